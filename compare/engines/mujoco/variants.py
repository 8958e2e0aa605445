"""A compiled model in other surroundings: in the air, without dry friction, with other actuators."""

from typing import NamedTuple

import mujoco
import numpy as np

from .names import bit, control_of, kind_of, number_of_actuators, output_of

KNOWN_GAINS = {mujoco.mjtGain.mjGAIN_FIXED: 1, mujoco.mjtGain.mjGAIN_AFFINE: 3}  # how many numbers a law has
KNOWN_BIASES = {mujoco.mjtBias.mjBIAS_NONE: 0, mujoco.mjtBias.mjBIAS_AFFINE: 3}


def copied(model: mujoco.MjModel) -> mujoco.MjModel:
    return mujoco.MjModel.__copy__(model)


def has_free_base(model: mujoco.MjModel) -> bool:
    return any(kind_of(model, joint) == "free" for joint in range(model.njnt))


def of_free_joints(model: mujoco.MjModel) -> np.ndarray:
    """Which speeds are those of free joints, (nv,)."""
    return np.array(model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_FREE)


def of_base(model: mujoco.MjModel) -> np.ndarray:
    """Which speeds are those of the free joint that carries most mass, (nv,): the robot's base, and not what it holds."""
    free = [joint for joint in range(model.njnt) if kind_of(model, joint) == "free"]
    carried = [float(model.body_subtreemass[model.jnt_bodyid[joint]]) for joint in free]
    base = free[int(np.argmax(carried))] if free else -1
    return np.array(model.dof_jntid == base)


def in_the_air(model: mujoco.MjModel) -> mujoco.MjModel:
    """Without contacts; with a free joint also without gravity, as it would fall."""
    air = copied(model)
    air.opt.disableflags |= bit("CONTACT")
    if has_free_base(model):
        air.opt.gravity[:] = 0.0
    return air


def without_dry_friction(model: mujoco.MjModel) -> mujoco.MjModel | None:
    """Without the dry friction of joints and tendons; None: there is none."""
    if model.opt.disableflags & bit("FRICTIONLOSS") or not (
        model.dof_frictionloss.any() or model.tendon_frictionloss.any()
    ):
        return None
    smooth = copied(model)
    smooth.dof_frictionloss[:] = 0.0
    smooth.tendon_frictionloss[:] = 0.0
    return smooth


def add_armature(model: mujoco.MjModel, more: np.ndarray) -> None:
    """More armature at the speeds of a compiled model, (nv,) kg m2 or kg.

    Of bodies whose inertia never changes the compiler keeps it ready: there dof_armature alone does nothing.
    """
    model.dof_armature += more
    model.dof_M0 += more


class Servo(NamedTuple):
    """What a program computes for an actuator: force = (g0 + g1 l + g2 ldot) u + b0 + b1 l + b2 ldot, within its range.

    control: the number of its control; output: of its length. u: what it is told; low, high: N or N m over the gear.
    """

    control: int
    output: int
    gain: np.ndarray  # (3,)
    bias: np.ndarray  # (3,)
    u: float
    low: float
    high: float

    def force(self, length: float, speed: float) -> float:
        seen = np.array([1.0, length, speed])
        return float(np.clip(self.gain @ seen * self.u + self.bias @ seen, self.low, self.high))


def held_servos(
    model: mujoco.MjModel, controls: np.ndarray, kp: float | None, kv: float | None, targets: np.ndarray
) -> tuple[mujoco.MjModel, list[Servo]]:
    """The model with motors in place of its servos, and the laws by which a program commands them.

    Position and velocity servos keep their gains. With kp, kv the other actuators of constant gain follow
    kp (target - length) - kv speed in units of their force. controls: of the file, (nu,); targets: lengths, of each output.
    """
    motors, servos = copied(model), []
    for i in range(number_of_actuators(model)):
        place, inputs = control_of(model, i)
        law = mujoco.mjtGain(model.actuator_gaintype[i]), mujoco.mjtBias(model.actuator_biastype[i])
        if inputs != 1 or law[0] not in KNOWN_GAINS or law[1] not in KNOWN_BIASES:
            continue
        gain, bias, output = np.zeros(3), np.zeros(3), output_of(model, i)
        gain[: KNOWN_GAINS[law[0]]] = model.actuator_gainprm[i, : KNOWN_GAINS[law[0]]]
        bias[: KNOWN_BIASES[law[1]]] = model.actuator_biasprm[i, : KNOWN_BIASES[law[1]]]
        u = float(controls[place])
        if not (bias[1:].any() or gain[1:].any()):
            if kp is None:
                continue
            u, gain, bias = 1.0, np.zeros(3), np.array([kp * targets[output], -kp, -(kv or 0.0)])
        limits = (-np.inf, np.inf) if not model.actuator_forcelimited[i] else model.actuator_forcerange[i]
        servos.append(Servo(place, output, gain, bias, u, float(limits[0]), float(limits[1])))
        motors.actuator_gaintype[i], motors.actuator_biastype[i] = (
            mujoco.mjtGain.mjGAIN_FIXED,
            mujoco.mjtBias.mjBIAS_NONE,
        )
        motors.actuator_gainprm[i, :3], motors.actuator_dyntype[i] = (1.0, 0.0, 0.0), mujoco.mjtDyn.mjDYN_NONE
        motors.actuator_ctrllimited[place] = 0
    return motors, servos


def with_servos(model: mujoco.MjModel, kp: float, kv: float, targets: np.ndarray) -> mujoco.MjModel:
    """The model whose motors are servos of MuJoCo with these gains: where it rests, a program's servos rest."""
    servos = copied(model)
    for i in range(number_of_actuators(model)):
        if mujoco.mjtBias(model.actuator_biastype[i]) == mujoco.mjtBias.mjBIAS_NONE:
            servos.actuator_gaintype[i], servos.actuator_biastype[i] = (
                mujoco.mjtGain.mjGAIN_FIXED,
                mujoco.mjtBias.mjBIAS_AFFINE,
            )
            servos.actuator_gainprm[i, 0] = 0.0
            servos.actuator_biasprm[i, :3] = kp * targets[output_of(model, i)], -kp, -kv
    return servos


# changes that may make a step stable; None: there is nothing to change


def with_kv(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the speed gain kv of every servo, and its part of the gain, times a factor."""
    if not (model.actuator_biasprm[:, 2].any() or model.actuator_gainprm[:, 2].any()):
        return None
    changed = copied(model)
    affine = np.flatnonzero(model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE)
    changed.actuator_biasprm[affine, 2] *= factor
    return changed


def with_armature(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    """With armature of a factor times the least inertia of each joint at qpos0 more; none of a free joint."""
    data, changed = mujoco.MjData(model), copied(model)
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    own = 1.0 / np.maximum(model.dof_invweight0, mujoco.mjMINVAL)
    add_armature(changed, np.where(of_free_joints(model), 0.0, factor * own))
    return changed


def with_slower_contacts(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the time constant of every contact times a factor; None: they are stated by stiffness and damping."""
    if (model.geom_solref[:, 0] <= 0.0).all() and (model.pair_solref[:, 0] <= 0.0).all():
        return None
    changed = copied(model)
    for solref in (changed.geom_solref, changed.pair_solref):
        solref[:, 0] *= np.where(solref[:, 0] > 0.0, factor, 1.0)
    return changed


def with_impratio(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    changed = copied(model)
    changed.opt.impratio *= factor
    return changed


def with_other_cone(model: mujoco.MjModel, _: float) -> mujoco.MjModel:
    """With elliptic friction cones for pyramidal ones, or the other way."""
    changed = copied(model)
    changed.opt.cone = 1 - model.opt.cone
    return changed
