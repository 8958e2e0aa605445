"""A compiled model in other surroundings: in the air, without dry friction, with other actuators."""

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from .names import bit, control_of, element_name, kind_of, number_of_actuators, output_of


def varied(model: mujoco.MjModel, **numbers: ArrayLike) -> mujoco.MjModel:
    """A copy of a model with other numbers, by the fields of the model or of its options."""
    variant = mujoco.MjModel.__copy__(model)
    for name, values in numbers.items():
        if hasattr(variant.opt, name):
            setattr(variant.opt, name, values)
        else:
            getattr(variant, name)[:] = values
    return variant


def has_free_base(model: mujoco.MjModel) -> bool:
    """Whether a base would fall."""
    return bool(falling_joints(model).any())


def stands(model: mujoco.MjModel) -> bool:
    """Whether the base of a robot would fall, beside which loose objects do not count."""
    return bool((falling_joints(model) & ~loose_objects(model)[model.jnt_dofadr]).any())


def loose_objects(model: mujoco.MjModel) -> np.ndarray:
    """Which speeds are those of free bodies that carry no joint, (nv,); none, if nothing else moves."""
    trees = np.array(model.dof_treeid)
    is_free = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_FREE
    loose = is_free & (np.bincount(trees)[trees] == 6)
    return np.asarray(loose & (not loose.all()))


def falling_joints(model: mujoco.MjModel) -> np.ndarray:
    """Which joints are free, or a slide of a base along gravity that nothing drives or stops, (njnt,)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    along = np.abs(data.xaxis @ model.opt.gravity) > 0.1 * np.linalg.norm(model.opt.gravity)
    of_world = model.body_parentid[model.jnt_bodyid] == 0
    slides = (model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE) & along & of_world
    slides &= (model.jnt_stiffness == 0.0) & (model.jnt_limited == 0)
    slides[model.actuator_trnid[model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT, 0]] = False
    return np.asarray(slides | (model.jnt_type == mujoco.mjtJoint.mjJNT_FREE))


def of_base(model: mujoco.MjModel) -> np.ndarray:
    """Which speeds are those of the free joint that carries most mass, (nv,): the robot's base."""
    free = [joint for joint in range(model.njnt) if kind_of(model, joint) == "free"]
    carried = [float(model.body_subtreemass[model.jnt_bodyid[joint]]) for joint in free]
    base = free[int(np.argmax(carried))] if free else -1
    return np.array(model.dof_jntid == base)


def in_the_air(model: mujoco.MjModel) -> mujoco.MjModel:
    """Without contacts; with a free joint also without gravity, as it would fall."""
    gravity = np.zeros(3) if has_free_base(model) else model.opt.gravity
    return varied(model, disableflags=model.opt.disableflags | bit("CONTACT"), gravity=gravity)


def without_dry_friction(model: mujoco.MjModel) -> mujoco.MjModel | None:
    """Without the dry friction of joints and tendons; None: there is none."""
    has_friction = model.dof_frictionloss.any() or model.tendon_frictionloss.any()
    if model.opt.disableflags & bit("FRICTIONLOSS") or not has_friction:
        return None
    return varied(model, dof_frictionloss=0.0, tendon_frictionloss=0.0)


def add_armature(model: mujoco.MjModel, more: np.ndarray) -> None:
    """More armature at the speeds of a compiled model, (nv,) kg m2 or kg.

    Of bodies whose inertia never changes the compiler keeps it ready: there dof_armature alone does nothing.
    """
    model.dof_armature += more
    model.dof_M0 += more


@dataclass(frozen=True)
class Actuator:
    """An actuator at a joint, a tendon or another transmission of MuJoCo.

    moment: dl/dq, (nv,), if it is the same at every posture (a hinge, a slide, a fixed tendon), else None:
    then MuJoCo computes it. Forces are N or N m, times the gear.
    """

    name: str
    joint: str  # the first joint on which it acts; "": none
    moment: tuple[float, ...] | None
    gain: tuple[float, ...] = (0.0, 0.0, 0.0)  # g0, g1, g2
    bias: tuple[float, ...] = (0.0, 0.0, 0.0)  # b0, b1, b2
    dynamics: str = "none"  # or integrator, filter, filterexact: then u is the activation
    control_range: tuple[float, float] | None = None
    activation_range: tuple[float, float] | None = None
    off: str = ""  # why it exerts no force; "": it does
    refused: str = ""  # why its law is not supported; "": it is

    @property
    def feeds_back(self) -> bool:
        """Whether its force depends on length or speed."""
        return any(self.gain[1:]) or any(self.bias[1:])

    def balancing(self, length: float) -> float:
        """The u for which a servo has force 0 at this length; other actuators: 0."""
        gain = self.gain[0] + self.gain[1] * length
        return -(self.bias[0] + self.bias[1] * length) / gain if self.bias[1] and gain else 0.0

    def target(self, length: float) -> float:
        """The same, within its range."""
        return self.clamped(self.balancing(length))

    def clamped(self, u: float) -> float:
        """u within the ranges of the control and of the activation."""
        for limits in (self.control_range, self.activation_range if self.dynamics != "none" else None):
            if limits is not None:
                u = min(max(u, limits[0]), limits[1])
        return float(u)

    def force(self, u: float, length: float, speed: float = 0.0) -> float:
        gain = self.gain[0] + self.gain[1] * length + self.gain[2] * speed
        return gain * u + self.bias[0] + self.bias[1] * length + self.bias[2] * speed

    def stiffness(self, u: float) -> float:
        """-d force/dl."""
        return -(self.gain[1] * u + self.bias[1])

    def damping(self, u: float) -> float:
        """-d force/dldot."""
        return -(self.gain[2] * u + self.bias[2])


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


def law(values: np.ndarray, count: int) -> tuple[float, ...]:
    """The first numbers of a law, filled up with zeros to three."""
    return (*map(float, values[:count]), *[0.0] * (3 - count))


GAINS = {"FIXED": 1, "AFFINE": 3}  # how many numbers of its law each kind has
BIASES = {"NONE": 0, "AFFINE": 3}


def actuator(m: mujoco.MjModel, i: int) -> Actuator:
    """One actuator; its law is that of the compiled model."""
    kinds = kinds_of(m, i)
    gain = law(m.actuator_gainprm[i], GAINS.get(kinds["gain"], 0))
    bias = law(m.actuator_biasprm[i], BIASES.get(kinds["bias"], 0))
    return Actuator(element_name(m, "actuator", i), "", None, gain, bias)


class Servo(NamedTuple):
    """An actuator whose law a program computes within its range of force.

    control: the number of its control; output: of its length. u: what the program is told; low, high: N, N m.
    """

    law: Actuator
    control: int
    output: int
    u: float
    low: float
    high: float

    def force(self, length: float, speed: float) -> float:
        return float(np.clip(self.law.force(self.u, length, speed), self.low, self.high))


def held_servos(
    model: mujoco.MjModel, controls: np.ndarray, kp: float | None, kv: float | None, targets: np.ndarray
) -> tuple[mujoco.MjModel, list[Servo]]:
    """The model with motors in place of its servos, and the laws by which a program commands them.

    Position and velocity servos keep their gains. With kp, kv the other actuators of constant gain follow kp
    (target - length) - kv speed in units of their force. controls: of the file, (nu,); targets: of each
    output.
    """
    motors, servos = varied(model), []
    for i in range(number_of_actuators(model)):
        law, output = actuator(model, i), output_of(model, i)
        place, inputs = control_of(model, i)
        u = float(controls[place])
        if inputs != 1 or not is_affine(model, i):
            continue
        if not law.feeds_back:
            if kp is None:
                continue
            u, law = 1.0, Actuator(law.name, law.joint, law.moment, bias=servo_bias(kp, kv, targets[output]))
        limits = model.actuator_forcerange[i] if model.actuator_forcelimited[i] else (-np.inf, np.inf)
        servos.append(Servo(law, place, output, u, *map(float, limits)))
        set_law(motors, i, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        motors.actuator_dyntype[i], motors.actuator_ctrllimited[place] = mujoco.mjtDyn.mjDYN_NONE, 0
    return motors, servos


def with_servos(model: mujoco.MjModel, kp: float, kv: float, targets: np.ndarray) -> mujoco.MjModel:
    """The model whose motors are servos with these gains: where it rests, a program's servos rest."""
    servos = varied(model)
    for i in np.flatnonzero(model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE).tolist():
        set_law(servos, i, (0.0, 0.0, 0.0), servo_bias(kp, kv, targets[output_of(model, i)]))
    return servos


def servo_bias(kp: float, kv: float | None, target: float) -> tuple[float, float, float]:
    return kp * target, -kp, -(kv or 0.0)


def set_law(model: mujoco.MjModel, i: int, gain: tuple[float, ...], bias: tuple[float, ...]) -> None:
    """Give an actuator of a compiled model a law of constant gain, of three numbers each."""
    model.actuator_gaintype[i] = mujoco.mjtGain.mjGAIN_FIXED
    model.actuator_biastype[i] = mujoco.mjtBias.mjBIAS_AFFINE
    model.actuator_gainprm[i, :3], model.actuator_biasprm[i, :3] = gain, bias


# changes that may make a step stable; None: there is nothing to change


def with_kv(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the speed gain kv of every servo, and its part of the gain, times a factor."""
    if not (model.actuator_biasprm[:, 2].any() or model.actuator_gainprm[:, 2].any()):
        return None
    bias = model.actuator_biasprm.copy()
    bias[model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE, 2] *= factor
    return varied(model, actuator_biasprm=bias)


def with_armature(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    """With armature of a factor times the least inertia of each joint at qpos0 more; none of a free joint."""
    changed = varied(model)
    least = 1.0 / np.maximum(model.dof_invweight0, mujoco.mjMINVAL)
    is_free = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_FREE
    add_armature(changed, np.where(is_free, 0.0, factor * least))
    return changed


def with_slower_contacts(model: mujoco.MjModel, factor: float) -> mujoco.MjModel | None:
    """With the time constants of contacts times a factor; None: they are stated by stiffness and damping."""
    if (model.geom_solref[:, 0] <= 0.0).all() and (model.pair_solref[:, 0] <= 0.0).all():
        return None
    numbers = {"geom_solref": model.geom_solref.copy(), "pair_solref": model.pair_solref.copy()}
    for solref in numbers.values():
        solref[:, 0] *= np.where(solref[:, 0] > 0.0, factor, 1.0)
    return varied(model, **numbers)


def with_impratio(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    return varied(model, impratio=factor * model.opt.impratio)


def with_other_cone(model: mujoco.MjModel, _: float) -> mujoco.MjModel:
    """With elliptic friction cones for pyramidal ones, or the other way."""
    return varied(model, cone=1 - model.opt.cone)
