"""What changes a model: functions that give a changed copy of one, or None if nothing would change; inertias of a spec."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from .names import control_of, number_of_actuators, on, output_of

NO_BIAS, AFFINE_BIAS = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)
FIXED_GAIN, AFFINE_GAIN = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE)
OVERRIDE = mujoco.mjtEnableBit.mjENBL_OVERRIDE  # the options' contact parameters replace those of geoms


def changed(model: mujoco.MjModel, **numbers: ArrayLike) -> mujoco.MjModel:
    """A copy with other numbers, by the names of fields of the model or of its options."""
    copy = mujoco.MjModel.__copy__(model)
    for name, values in numbers.items():
        if not hasattr(copy.opt, name):
            getattr(copy, name)[:] = values
        elif np.ndim(getattr(copy.opt, name)):
            getattr(copy.opt, name)[:] = values
        else:
            setattr(copy.opt, name, values)
    return copy


def with_armature(model: mujoco.MjModel, more: float) -> mujoco.MjModel | None:
    """With more armature, kg m2 or kg, at each joint that is not free; None: all are free.

    Of bodies whose inertia never changes the compiler keeps it ready in dof_M0, which therefore changes too.
    """
    added = np.where(model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_FREE, 0.0, more)
    if not added.any():
        return None
    return changed(model, dof_armature=model.dof_armature + added, dof_M0=model.dof_M0 + added)


def with_kv(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the speed gain of every servo and damper times a factor, and the targets that they have.

    A velocity servo, kv (u - speed), has kv in its gain as well; a damper, -kv u speed, there alone.
    """
    gain, bias = model.actuator_gainprm.copy(), model.actuator_biasprm.copy()
    is_affine = model.actuator_biastype == AFFINE_BIAS
    of_gain = model.actuator_gaintype == AFFINE_GAIN
    is_velocity_servo = is_affine & (bias[:, 1] == 0.0) & (bias[:, 2] != 0.0) & (gain[:, 0] == -bias[:, 2])
    gain[is_velocity_servo, 0] *= factor
    bias[is_affine, 2] *= factor
    gain[of_gain, 2] *= factor
    if np.array_equal(gain, model.actuator_gainprm) and np.array_equal(bias, model.actuator_biasprm):
        return None
    return changed(model, actuator_gainprm=gain, actuator_biasprm=bias)


def with_slower_contacts(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the time constants of all contacts times a factor: of geoms, of pairs, or those of the options.

    None: all of them are stated by stiffness and damping, as numbers that are not positive.
    """
    fields = ("o_solref",) if model.opt.enableflags & OVERRIDE else ("geom_solref", "pair_solref")
    numbers = {}
    for field in fields:
        solref = np.array(getattr(model.opt if field == "o_solref" else model, field))
        times = solref[..., 0]
        solref[..., 0] = np.where(times > 0.0, factor * times, times)
        if (times > 0.0).any():
            numbers[field] = solref
    return changed(model, **numbers) if numbers else None


def with_iterations(model: mujoco.MjModel, count: int) -> mujoco.MjModel | None:
    """With at least `count` iterations of the solver, and of each line search; None: it has as many."""
    numbers = {name: max(count, getattr(model.opt, name)) for name in ("iterations", "ls_iterations")}
    is_same = all(getattr(model.opt, name) == number for name, number in numbers.items())
    return None if is_same else changed(model, **numbers)


def with_impratio(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    """With a factor times the ratio of frictional to normal impedance of contacts."""
    return changed(model, impratio=factor * model.opt.impratio)


def state_as_compiled(spec: mujoco.MjSpec, model: mujoco.MjModel, numbers: Sequence[int]) -> None:
    """State the inertias of all bodies, whose numbers in the model are given, as they were compiled."""
    for body, number in zip(spec.bodies[1:], numbers[1:]):
        state_inertial(body, model.body_mass[number], model.body_ipos[number])
        body.iquat, body.inertia = model.body_iquat[number], model.body_inertia[number]
        body.fullinertia = np.full(6, np.nan)
    spec.compiler.inertiafromgeom = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE)
    spec.compiler.settotalmass = -1.0


def state_inertial(body: mujoco.MjsBody, mass: float, com: np.ndarray) -> None:
    body.mass, body.ipos, body.explicitinertial = mass, com, True
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT


class Program(NamedTuple):
    """A controller outside of MuJoCo: the model that it drives, and the law by which it computes controls.

    places: of its controls; outputs: of the lengths l and speeds that it reads; each control is u - kp l - kv
    ldot; all (n,).
    """

    model: mujoco.MjModel
    places: np.ndarray
    outputs: np.ndarray
    u: np.ndarray
    kp: np.ndarray
    kv: np.ndarray

    def controls(self, data: mujoco.MjData) -> np.ndarray:
        """The controls, (n,), for the lengths and speeds of the data, which must be computed."""
        lengths, speeds = data.actuator_length[self.outputs], data.actuator_velocity[self.outputs]
        return np.asarray(self.u - self.kp * lengths - self.kv * speeds)


def program(
    model: mujoco.MjModel, controls: np.ndarray, lengths: np.ndarray, kp: float | None = None,
    kv: float | None = None,
) -> Program | None:  # fmt: skip
    """The servos of a model, or its motors, in a program; None: it has none of them.

    Without gains it is the servos: motors of gain 1 take their places, whose force the program computes by
    the servos' own law at their controls, (nu,). With kp or kv (of which the other one is 0) it is the
    motors, whose law stays as it is: their control is kp (target - length) - kv speed. lengths: the targets,
    of each output.
    """
    copy, given, rows = mujoco.MjModel.__copy__(model), kp is not None or kv is not None, []
    for i in range(number_of_actuators(model)):
        (place, inputs), output = control_of(model, i), output_of(model, i)
        of_gain, of_bias = model.actuator_gaintype[i], model.actuator_biastype[i]
        gain = model.actuator_gainprm[i, :3] * [1.0, *2 * [of_gain == AFFINE_GAIN]]
        bias = model.actuator_biasprm[i, :3] * (of_bias == AFFINE_BIAS)
        is_known = of_gain in (FIXED_GAIN, AFFINE_GAIN) and of_bias in (NO_BIAS, AFFINE_BIAS) and inputs == 1
        is_servo = bool(gain[1:].any() or bias[1:].any())
        if not is_known or model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE or is_servo == given:
            continue
        u = float(controls[place])
        if model.actuator_ctrllimited[place] and on(model, "CLAMPCTRL"):
            u = float(np.clip(u, *model.actuator_ctrlrange[place]))
        law = (gain * u + bias) * [1.0, -1.0, -1.0]
        if given:
            law = np.array([(kp or 0.0) * lengths[output], kp or 0.0, kv or 0.0])
        else:
            copy.actuator_gaintype[i], copy.actuator_biastype[i] = FIXED_GAIN, NO_BIAS
            copy.actuator_gainprm[i], copy.actuator_biasprm[i] = np.eye(len(copy.actuator_gainprm[i]))[0], 0.0
            copy.actuator_ctrllimited[place] = 0
        rows.append((place, output, *law))
    columns = np.array(rows).T
    return Program(copy, *columns[:2].astype(int), *columns[2:]) if rows else None
