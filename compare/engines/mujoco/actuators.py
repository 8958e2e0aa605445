"""The actuators of a compiled model."""

from collections.abc import Mapping

import mujoco
import numpy as np

from ...robots.actuators import Actuator, Drive
from .names import OF_A_JOINT, control_of, element_name, kind_of, number_of_actuators, on, output_of
from .source import Source

WITH_LENGTH = "JOINT", "JOINTINPARENT", "SLIDERCRANK", "TENDON", "SITE"  # transmissions
GAINS = {"FIXED": 1, "AFFINE": 3}  # how many numbers of its law each kind has
BIASES = {"NONE": 0, "AFFINE": 3}
DYNAMICS = {"NONE": "none", "INTEGRATOR": "integrator", "FILTER": "filter", "FILTEREXACT": "filterexact"}
NAMED_LAWS = {"DCMOTOR": "a DC motor", "USER": "a user-defined law"}
BEYOND_LAW = {"delay": "a delay", "damping": "damping of its own", "dampingpoly": "damping of its own"}
GROUPS = 31  # that can be switched off


def drive_of(source: Source, keys: Mapping[int, str]) -> Drive:
    """What drives a compiled model. keys: names of keyframes."""
    model = source.model
    return Drive(
        actuators=tuple(actuator(model, i) for i in range(number_of_actuators(model))),
        controls={keys[k]: u for k, u in stated_controls(source).items() if k in keys},
    )


def actuator(m: mujoco.MjModel, i: int) -> Actuator:
    """One actuator; its law is that of the compiled model."""
    kinds, (place, inputs), (joint, moment) = kinds_of(m, i), control_of(m, i), moment_of(m, i)
    clamped = inputs and on(m, "CLAMPCTRL") and m.actuator_ctrllimited[place]
    return Actuator(
        name=element_name(m, "actuator", i),
        joint=joint,
        moment=moment,
        gain=law(m.actuator_gainprm[i], GAINS.get(kinds["gain"], 0)),
        bias=law(m.actuator_biasprm[i], BIASES.get(kinds["bias"], 0)),
        dynamics=DYNAMICS.get(kinds["dyn"], "none"),
        control_range=tuple(m.actuator_ctrlrange[place].tolist()) if clamped else None,
        activation_range=tuple(m.actuator_actrange[i].tolist()) if m.actuator_actlimited[i] else None,
        off=off(m, i),
        refused=refused(m, i),
    )


def kinds_of(m: mujoco.MjModel, i: int) -> dict[str, str]:
    """The words of MuJoCo's for the transmission, dynamics, gain and bias of an actuator."""
    words = {}
    for part in ("trn", "dyn", "gain", "bias"):
        member = getattr(mujoco, f"mjt{part.title()}")(int(getattr(m, f"actuator_{part}type")[i]))
        words[part] = member.name.partition("_")[2]
    return words


def is_affine(m: mujoco.MjModel, i: int) -> bool:
    """Whether the law of an actuator is one that is known here."""
    return kinds_of(m, i)["gain"] in GAINS and kinds_of(m, i)["bias"] in BIASES


def refused(m: mujoco.MjModel, i: int) -> str:
    """Why the law of an actuator cannot be evaluated here; "" if it can."""
    if m.actuator_plugin[i] >= 0:
        return "a plugin"
    kinds, inputs = kinds_of(m, i), control_of(m, i)[1]
    for part, known in (("dyn", DYNAMICS), ("gain", GAINS), ("bias", BIASES)):
        if kinds[part] not in known:
            return NAMED_LAWS.get(kinds[part], f"a law of type {kinds[part].lower()}")
    if inputs != 1:
        return f"{inputs} controls"
    if kinds["trn"] not in WITH_LENGTH:
        return f"a transmission of type {kinds['trn'].lower()}"
    for field, why in BEYOND_LAW.items():
        if np.any(getattr(m, f"actuator_{field}", np.zeros(i + 1))[i]):
            return why
    return ""


def off(m: mujoco.MjModel, i: int) -> str:
    """Why an actuator exerts nothing, or ""."""
    if not on(m, "ACTUATION"):
        return "the file disables actuation"
    group = int(m.actuator_group[i])
    if 0 <= group < GROUPS and m.opt.disableactuator & (1 << group):
        return f"the file disables group {group}"
    return ""


def moment_of(m: mujoco.MjModel, i: int) -> tuple[str, tuple[float, ...] | None]:
    """The first joint on which an actuator acts, or ""; dl/dq where it is the same everywhere, else None."""
    transmission, target = mujoco.mjtTrn(m.actuator_trntype[i]), int(m.actuator_trnid[i, 0])
    gear, moment = m.actuator_gear[output_of(m, i), 0], np.zeros(m.nv)
    if transmission in OF_A_JOINT:
        moment[m.jnt_dofadr[target]] = 1.0
        is_constant = kind_of(m, target) in ("hinge", "slide")
        return element_name(m, "joint", target), tuple((gear * moment).tolist()) if is_constant else None
    if transmission != mujoco.mjtTrn.mjTRN_TENDON:
        return "", None
    for k in range(m.tendon_adr[target], m.tendon_adr[target] + m.tendon_num[target]):
        if m.wrap_type[k] != mujoco.mjtWrap.mjWRAP_JOINT:  # a spatial tendon
            return "", None
        moment[m.jnt_dofadr[m.wrap_objid[k]]] += m.wrap_prm[k]
    moved = m.dof_jntid[np.flatnonzero(moment)]
    return element_name(m, "joint", moved[0]) if len(moved) else "", tuple((gear * moment).tolist())


def stated_controls(source: Source) -> dict[int, tuple[float | None, ...]]:
    """By the number of a keyframe u of each actuator, None where it states none.

    u of an integrator is its activation, of a filter the control, at which it settles. The compiled model has
    zeros where a file states none: the file tells. Of a model compiled elsewhere all zeros are none.
    """
    m, spec = source.model, source.spec
    keys = spec.keys if spec is not None and len(spec.keys) == m.nkey else None
    controls = {}
    for k in range(m.nkey):
        has_controls = len(keys[k].ctrl) > 0 if keys else m.key_ctrl[k].any()
        has_activations = len(keys[k].act) > 0 if keys else m.key_act[k].any()
        stated: list[float | None] = []
        for i in range(number_of_actuators(m)):
            place, inputs = control_of(m, i)
            if kinds_of(m, i)["dyn"] == "INTEGRATOR":
                stated.append(float(m.key_act[k, m.actuator_actadr[i]]) if has_activations else None)
            else:
                stated.append(float(m.key_ctrl[k, place]) if inputs and has_controls else None)
        if stated and (has_controls or has_activations):
            controls[k] = tuple(stated)
    return controls


def law(values: np.ndarray, count: int) -> tuple[float, ...]:
    """The first numbers of a law, filled up with zeros to three."""
    return (*map(float, values[:count]), *[0.0] * (3 - count))
