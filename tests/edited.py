"""The arm with an edited file: what experiments are given to see whether they notice."""

from compare.engines.mujoco import Mujoco, parse
from compare.experiment import Setup, engines
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")
MOON = XML.replace("0 0 -9.81", "0 0 -1.62")
MODELS = {  # what is replaced in the file by what
    "the arm": ("", ""),
    "on the moon": ("0 0 -9.81", "0 0 -1.62"),
    "gravity off by its flag": ("<flag ", '<flag gravity="disable" '),
    "ten times the gravity": ("-9.81", "-98.1"),
    "damped by 5": ('axis="1 0 0"/>', 'axis="1 0 0" damping="5"/>'),
    "with a spring": ('axis="1 0 0"/>', 'axis="1 0 0" stiffness="30"/>'),
    "a muscle's activation": ("</mujoco>", '<actuator><position joint="beta" kp="3" timeconst="0.1"/></actuator></mujoco>'),
    "a feather": (
        'pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"', 'pos="1e-5 0 0" mass="1.5" diaginertia="1e-9 1e-9 1e-9"',
    ),
}  # fmt: skip


def setup_of(model: str | Mujoco = XML, make=Setup.small, **fields) -> Setup:
    """What an experiment needs of the arm, MuJoCo with this MJCF text or engine."""
    return make(ARM, engines(parse(model, ARM.tree) if isinstance(model, str) else model), **fields)
