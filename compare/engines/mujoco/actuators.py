"""Actuators, measured: their forces at states near a posture give the law that they have there.

MuJoCo's own forces are taken at four states: at the posture, at moved positions, at other speeds, and at
both, where a law that is affine in length and speed must give the same. It is the law of the file without
limits of controls, activations and forces.
"""

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

from ...robots.actuators import Controller, Posture
from .inventory import set_fields
from .names import SETTLING, bit, control_of, element_name, number_of_actuators, on, output_of, set_control
from .source import Source

UNLIMITED = (
    "actuator_ctrllimited", "actuator_forcelimited", "actuator_actlimited", "jnt_actfrclimited",
    "tendon_actfrclimited",
)  # fmt: skip
BESIDE = "actuator_delay", "actuator_damping", "actuator_dampingpoly"  # what a law of controls does not have
AFFINE, CONSTANT = 1e-9, 1e-12  # relative to the largest force, and to the largest moment
SOLVED, MOST_ITERATIONS = 1e-15, 100  # of the solver
ACTING, IDLE = 0, 1  # groups of actuators
WITHIN = (-0.7, 0.4)  # of the tangent and of the speeds, at the fourth state


class Law(NamedTuple):
    """Forces of n actuators near a posture: force - stiffness (l - length) - damping ldot, N or N m, gears apart.

    moment: dl/dq at the posture, (n, nv); all else is (n,). is_affine: whether this gives the fourth force.
    is_constant: whether the moment is the same at every posture.
    """

    force: np.ndarray
    length: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    moment: np.ndarray
    is_affine: np.ndarray
    is_constant: np.ndarray


def law_at(model: mujoco.MjModel, q: np.ndarray, u: np.ndarray) -> Law:
    """The law of each actuator of a model at positions (nq,) and constant controls or activations u, (n,)."""
    m, count = mujoco.MjModel.__copy__(model), number_of_actuators(model)
    set_fields(m, (*UNLIMITED, "actuator_delay"), 0)
    data, outputs = mujoco.MjData(m), [output_of(m, i) for i in range(count)]
    for i in range(count):
        set_control(m, i, float(u[i]), data.ctrl, data.act)

    def forces(tangent: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, ...]:
        """Force, length, speed, (n,) each, and moment, (n, nv), at a moved posture."""
        data.qpos[:], moment = q, np.zeros((len(data.actuator_length), m.nv))
        mujoco.mj_integratePos(m, data.qpos, tangent, 1.0)
        for part in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_tendon, mujoco.mj_transmission):
            part(m, data)
        if data.actuator_moment.ndim == 2:
            moment[:] = data.actuator_moment
        else:
            rows = data.moment_rownnz, data.moment_rowadr, data.moment_colind
            mujoco.mju_sparse2dense(moment, data.actuator_moment, *rows)
        data.actuator_velocity[:] = moment @ speeds
        mujoco.mj_fwdActuation(m, data)
        values = data.actuator_force, data.actuator_length, data.actuator_velocity, moment
        return tuple(value[outputs].copy() for value in values)

    still, rng = np.zeros(m.nv), np.random.default_rng(0)
    tangent, speeds = rng.uniform(0.5, 1.5, (2, m.nv))
    force, length, _, moment = forces(still, still)
    moved, other_length, _, other_moment = forces(tangent, still)
    driven, _, speed, _ = forces(still, speeds)
    with np.errstate(all="ignore"):
        stiffness = np.nan_to_num((force - moved) / (other_length - length), posinf=0.0, neginf=0.0)
        damping = np.nan_to_num((force - driven) / speed, posinf=0.0, neginf=0.0)
    last, last_length, last_speed, last_moment = forces(WITHIN[0] * tangent, WITHIN[1] * speeds)
    by_law = force - stiffness * (last_length - length) - damping * last_speed
    largest = np.abs([force, moved, driven, last]).max(axis=0, initial=0.0)
    is_affine = np.abs(last - by_law) <= AFFINE * largest
    least = CONSTANT * np.abs(moment).max(axis=1, initial=0.0)
    others = np.abs([other_moment - moment, last_moment - moment])
    is_constant = others.max(axis=(0, 2), initial=0.0) <= least
    return Law(force, length, stiffness, damping, moment, is_affine, is_constant)


def has_one_input(m: mujoco.MjModel, i: int) -> bool:
    """Whether one constant control, or activation, says all of the force of an actuator at a state."""
    has_activation = getattr(m, "actuator_actnum", m.actuator_dyntype)[i] > 0
    settles = not has_activation or int(m.actuator_dyntype[i]) in SETTLING
    has_one = control_of(m, i)[1] == 1 and getattr(m, "actuator_outnum", np.ones(i + 1))[i] == 1
    has_more = any(np.any(getattr(m, field, np.zeros(i + 1))[i]) for field in BESIDE)
    return bool(settles and has_one and not has_more and m.actuator_plugin[i] < 0)


def held_at(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """u of each actuator without force at positions (nq,), within its ranges, (n,).

    Of what is no servo with one control, whose force is affine in its length, u is 0.
    """
    count = number_of_actuators(model)
    none, one = (law_at(model, q, np.full(count, u)) for u in (0.0, 1.0))
    gain, inputs = one.force - none.force, np.array([control_of(model, i)[1] for i in range(count)])
    is_servo = (none.stiffness != 0.0) & (gain != 0.0) & none.is_affine & one.is_affine & (inputs == 1)
    return clipped(model, np.where(is_servo, -none.force / np.where(is_servo, gain, 1.0), 0.0))


def clipped(m: mujoco.MjModel, u: np.ndarray) -> np.ndarray:
    """u of each actuator, (n,), within the ranges of its control and of its activation."""
    u = u.copy()
    for i in range(len(u)):
        place, inputs = control_of(m, i)
        is_integrator = m.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_INTEGRATOR
        is_limited = on(m, "CLAMPCTRL")
        if inputs and is_limited and m.actuator_ctrllimited[place] and not is_integrator:
            u[i] = np.clip(u[i], *m.actuator_ctrlrange[place])
        if m.actuator_actlimited[i] and int(m.actuator_dyntype[i]) in SETTLING:
            u[i] = np.clip(u[i], *m.actuator_actrange[i])
    return u


def ranges_of(m: mujoco.MjModel, inputs: str) -> np.ndarray:
    """The least and the largest activations and inputs, (2, na + nu) of ctrl, (2, na + nv) of qfrc_applied.

    Infinite where they have no range.
    """
    low = np.full(m.na + (m.nu if inputs == "ctrl" else m.nv), -np.inf)
    limits = np.array([low, -low])
    for i in range(number_of_actuators(m)):
        last = m.actuator_actadr[i] + m.actuator_actnum[i] - 1
        if m.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_MUSCLE:
            limits[:, last] = 0.0, 1.0
        elif m.actuator_actlimited[i]:
            limits[:, last] = m.actuator_actrange[i]
    if inputs == "ctrl" and on(m, "CLAMPCTRL"):
        is_limited = np.flatnonzero(m.actuator_ctrllimited)
        limits[:, m.na + is_limited] = m.actuator_ctrlrange[is_limited].T
    return limits


class Actuators:
    """The actuators of a compiled model, a Drive; positions q (nq,) and moments in the order of the file.

    stated: by posture, u of each actuator in its keyframe, or None.
    """

    def __init__(self, model: mujoco.MjModel, stated: Mapping[str, tuple[float | None, ...]]) -> None:
        self.model, self.stated = model, stated

    @property
    def names(self) -> tuple[str, ...]:
        m = self.model
        return tuple(element_name(m, "actuator", i) for i in range(number_of_actuators(m)))

    @property
    def laws(self) -> dict[str, tuple[str, tuple[float, ...]]]:
        m, laws = self.model, {}
        moments = law_at(m, m.qpos0, np.zeros(len(self.names))).moment
        for i, (name, moment) in enumerate(zip(self.names, moments)):
            acts_on, (place, inputs) = np.flatnonzero(moment), control_of(m, i)
            joint = element_name(m, "joint", m.dof_jntid[acts_on[0]]) if len(acts_on) else ""
            kinds = m.actuator_dyntype[i], m.actuator_gaintype[i], m.actuator_biastype[i]
            parts = m.actuator_gainprm[i], m.actuator_biasprm[i], m.actuator_dynprm[i]
            limits = m.actuator_ctrlrange[place] if inputs and m.actuator_ctrllimited[place] else ()
            last = m.actuator_gear[output_of(m, i)], limits, sorted(moment[acts_on].tolist())
            laws[name] = joint, tuple(np.concatenate([kinds, *parts, *last]).tolist())
        return laws

    @cached_property
    def feeds_back(self) -> bool:
        laws = [law_at(self.model, self.model.qpos0, np.full(len(self.names), u)) for u in (0.0, 1.0)]
        feeding = [law.is_affine & ((law.stiffness != 0.0) | (law.damping != 0.0)) for law in laws]
        return bool(np.any(feeding))

    def called(self, postures: Mapping[str, str]) -> "Actuators":
        return Actuators(self.model, {postures[name]: u for name, u in self.stated.items()})

    def controller(self, posture: Posture, q: np.ndarray, targets: np.ndarray | float = 0.0) -> Controller:
        """See Drive. Left out is what exerts nothing at any control, pushes away, or has no law that holds."""
        m, none = self.model, (None,) * len(self.names)
        stated = self.stated.get(posture, none) if isinstance(posture, str) else none
        pairs = zip(stated, held_at(m, q))
        u = clipped(m, np.array([held if given is None else given for given, held in pairs], dtype=float))
        law, more = law_at(m, q, u), law_at(m, q, u + 1.0)
        gain = more.force - law.force
        acts = law.is_affine & more.is_affine & law.is_constant & law.moment.any(axis=1)
        acts &= law.stiffness >= 0.0  # with negative stiffness MuJoCo's `discrete` uses another scheme
        acts &= np.array([has_one_input(m, i) for i in range(len(u))], dtype=bool)
        acts &= np.any([gain, *law[:1], *law[2:4], *more[2:4]], axis=0)
        kinds = m.jnt_type[m.dof_jntid]
        turns = (kinds == mujoco.mjtJoint.mjJNT_BALL) | (kinds == mujoco.mjtJoint.mjJNT_FREE)
        # the length of a turn is not linear
        acts &= ~law.moment[:, turns].any(axis=1) | (law.stiffness == 0.0)
        moved = np.abs(law.moment) @ np.broadcast_to(targets, m.nv)
        if (moving := acts & (moved != 0.0) & (law.stiffness > 0.0)).any():
            stiffness = np.where(moving, law.stiffness, 1.0)
            # the force at the moved target, over its change by u there
            beyond = law.force / stiffness + moved
            slope = gain - (more.stiffness - law.stiffness) * beyond
            u = np.where(moving, u + stiffness * moved / np.where(moving, slope, 1.0), u)
            law = law_at(m, q, u)
        places, J = np.arange(m.nv) + (m.jnt_qposadr - m.jnt_dofadr)[m.dof_jntid], law.moment[acts]
        at_zero = law.force[acts] + law.stiffness[acts] * (J @ q[places])
        controls = tuple(float(value) if is_acting else None for value, is_acting in zip(u, acts))
        left_out = tuple(name for name, is_acting in zip(self.names, acts) if not is_acting)
        gains = [(J.T * values[acts]) @ J for values in (law.stiffness, law.damping)]
        return Controller(controls, left_out, J.T @ at_zero, *gains)


def engage(m: mujoco.MjModel, controller: Controller) -> tuple[np.ndarray, np.ndarray]:
    """Switch on the actuators of a model that take part, without any range: their ctrl (nu,) and act (na,).

    `discrete` solves by iteration where a tendon couples branches: here to rounding and by Newton's method
    (with PGS it is Euler's scheme). Activations are constant, see set_control.
    """
    m.opt.disableflags &= ~bit("ACTUATION")
    set_fields(m, UNLIMITED, 0)
    m.opt.solver, m.opt.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, SOLVED
    m.opt.iterations = max(m.opt.iterations, MOST_ITERATIONS)
    ctrl, act = np.zeros(m.nu), np.zeros(m.na)
    for i, u in enumerate(controller.controls):
        m.actuator_group[i] = IDLE if u is None else ACTING
        if u is not None:
            set_control(m, i, u, ctrl, act)
    m.opt.disableactuator = 1 << IDLE
    return ctrl, act


def drive_of(source: Source, keys: Mapping[int, str]) -> Actuators:
    """What drives a compiled model. keys: names of keyframes."""
    stated = {keys[k]: u for k, u in stated_controls(source).items() if k in keys}
    return Actuators(source.model, stated)


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
            if m.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_INTEGRATOR:
                stated.append(float(m.key_act[k, m.actuator_actadr[i]]) if has_activations else None)
            else:
                stated.append(float(m.key_ctrl[k, place]) if inputs and has_controls else None)
        if stated and (has_controls or has_activations):
            controls[k] = tuple(stated)
    return controls
