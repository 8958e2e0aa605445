"""What the installed MuJoCo has in a model and this reader has never heard of."""

from functools import cache

import mujoco
import numpy as np

from .joints import KINDS
from .known import KNOWN_COUNTS, KNOWN_DISABLING, KNOWN_ENABLING, KNOWN_FIELDS, KNOWN_OPTIONS

PLAIN = """<mujoco><worldbody><body><freejoint/><geom size="0.1"/>
<body><joint/><geom size="0.1"/><body><joint type="ball"/><geom size="0.1"/></body></body>
</body></worldbody></mujoco>"""
PREFIXES = ("body_", "dof_", "jnt_", "tendon_", "eq_", "actuator_")  # of fields that may change a motion


def unknown(model: mujoco.MjModel) -> str:
    """The first count, flag, option, kind of joint or field that is not known and in use; "" if there is none.

    A field that the compiler fills in for any model is not in use: one that is zero in a plain model and not in this one is.
    """
    plain = plain_model()
    for flags, known, enum, prefix in (
        (model.opt.enableflags, KNOWN_ENABLING, mujoco.mjtEnableBit, "mjENBL_"),
        (model.opt.disableflags, KNOWN_DISABLING, mujoco.mjtDisableBit, "mjDSBL_"),
    ):
        for name, bit in members(enum, prefix):
            if name not in known and flags & bit:
                return f"the flag {name.lower()}"
    for number in range(model.njnt):
        if mujoco.mjtJoint(model.jnt_type[number]) not in KINDS:
            return f"a joint of the type {mujoco.mjtJoint(model.jnt_type[number]).name}"
    for name in numbers_of(model):
        if name not in KNOWN_COUNTS and getattr(model, name) and not getattr(plain, name):
            return name
    for name in attributes(model.opt):
        if name not in KNOWN_OPTIONS and not np.array_equal(getattr(model.opt, name), getattr(plain.opt, name)):
            return f"the option {name}"
    for name in attributes(model):
        if name.startswith(PREFIXES) and name not in KNOWN_FIELDS and in_use(model, name) and not in_use(plain, name):
            return name
    return ""


def in_use(model: mujoco.MjModel, name: str) -> bool:
    """Whether a field of floats is not zero throughout, or one of whole numbers has one above zero; -1 stands for none."""
    values = np.asarray(getattr(model, name))
    return bool(np.any(values) if values.dtype.kind == "f" else np.any(values > 0))


def numbers_of(model: mujoco.MjModel) -> list[str]:
    return [name for name in attributes(model) if name.startswith("n") and isinstance(getattr(model, name), int)]


def attributes(what) -> list[str]:
    return [name for name in dir(what) if not name.startswith("_") and not callable(getattr(what, name))]


def members(enum, prefix: str) -> list[tuple[str, int]]:
    """The flags of an enumeration by their names without the prefix."""
    return [
        (name.removeprefix(prefix), int(value)) for name, value in enum.__members__.items() if name.startswith(prefix)
    ]


@cache
def plain_model() -> mujoco.MjModel:
    """A model with a joint of every kind and nothing else."""
    return mujoco.MjModel.from_xml_string(PLAIN)
