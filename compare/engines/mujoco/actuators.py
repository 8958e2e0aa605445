"""The actuators of a compiled model."""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import numpy as np

from ...robots.actuators import Actuator, Drive
from .names import OF_A_JOINT, control_of, element_name, number_of_actuators, on, output_of
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
    gain, bias = kind(mujoco.mjtGain, m.actuator_gaintype[i]), kind(mujoco.mjtBias, m.actuator_biastype[i])
    place, inputs = control_of(m, i)
    joint, moment = moment_of(m, i)
    clamped = inputs and on(m, "CLAMPCTRL") and m.actuator_ctrllimited[place]
    return Actuator(
        name=element_name(m, "actuator", i),
        joint=joint,
        moment=moment,
        gain=law(m.actuator_gainprm[i], GAINS.get(gain, 0)),
        bias=law(m.actuator_biasprm[i], BIASES.get(bias, 0)),
        dynamics=DYNAMICS.get(kind(mujoco.mjtDyn, m.actuator_dyntype[i]), "none"),
        control_range=tuple(m.actuator_ctrlrange[place].tolist()) if clamped else None,
        activation_range=tuple(m.actuator_actrange[i].tolist()) if m.actuator_actlimited[i] else None,
        off=off(m, i),
        refused=refused(m, i),
    )


def is_affine(m: mujoco.MjModel, i: int) -> bool:
    """Whether the law of an actuator is one that is known here."""
    gain, bias = kind(mujoco.mjtGain, m.actuator_gaintype[i]), kind(mujoco.mjtBias, m.actuator_biastype[i])
    return gain in GAINS and bias in BIASES


def refused(m: mujoco.MjModel, i: int) -> str:
    """Why the law of an actuator cannot be evaluated here; "" if it can."""
    if m.actuator_plugin[i] >= 0:
        return "a plugin"
    kinds = (
        (kind(mujoco.mjtDyn, m.actuator_dyntype[i]), DYNAMICS),
        (kind(mujoco.mjtGain, m.actuator_gaintype[i]), GAINS),
        (kind(mujoco.mjtBias, m.actuator_biastype[i]), BIASES),
    )
    for word, known in kinds:
        if word not in known:
            return NAMED_LAWS.get(word, f"a law of type {word.lower()}")
    if (inputs := control_of(m, i)[1]) != 1:
        return f"{inputs} controls"
    transmission = kind(mujoco.mjtTrn, m.actuator_trntype[i])
    if transmission not in WITH_LENGTH:
        return f"a transmission of type {transmission.lower()}"
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
    joint, moment = "", None
    if transmission in OF_A_JOINT:
        joint = element_name(m, "joint", target)
        if kind(mujoco.mjtJoint, m.jnt_type[target]) in ("HINGE", "SLIDE"):
            moment = np.eye(m.nv)[m.jnt_dofadr[target]]
    elif transmission == mujoco.mjtTrn.mjTRN_TENDON:
        moment = tendon_moment(m, target)
        if moment is not None and moment.any():
            joint = element_name(m, "joint", m.dof_jntid[np.flatnonzero(moment)[0]])
    gear = m.actuator_gear[output_of(m, i), 0]
    return joint, None if moment is None else tuple((gear * moment).tolist())


def tendon_moment(m: mujoco.MjModel, i: int) -> np.ndarray | None:
    """dl/dq (nv,) of a fixed tendon; None of a spatial one."""
    moment, start = np.zeros(m.nv), int(m.tendon_adr[i])
    for k in range(start, start + int(m.tendon_num[i])):
        if mujoco.mjtWrap(m.wrap_type[k]) != mujoco.mjtWrap.mjWRAP_JOINT:
            return None
        moment[m.jnt_dofadr[m.wrap_objid[k]]] += m.wrap_prm[k]
    return moment


def stated_controls(source: Source) -> dict[int, tuple[float | None, ...]]:
    """By the number of a keyframe u of each actuator, None where it states none.

    u of an integrator is its activation, of a filter the control, at which it settles. The compiled model has zeros
    where a file states none: the file tells. Of a model compiled elsewhere all zeros are none.
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
            if kind(mujoco.mjtDyn, m.actuator_dyntype[i]) == "INTEGRATOR":
                stated.append(float(m.key_act[k, m.actuator_actadr[i]]) if has_activations else None)
            else:
                stated.append(float(m.key_ctrl[k, place]) if inputs and has_controls else None)
        if stated and (has_controls or has_activations):
            controls[k] = tuple(stated)
    return controls


def kind(enum: Callable[[int], Any], value: int) -> str:
    """The name of a member of an enum of MuJoCo's, without its prefix."""
    return enum(int(value)).name.partition("_")[2]


def law(values: np.ndarray, count: int) -> tuple[float, ...]:
    """The first numbers of a law, filled up with zeros to three."""
    return (*map(float, values[:count]), *[0.0] * (3 - count))
