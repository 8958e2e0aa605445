"""The inventory of a file: its features, and which of them the equations model or the comparison switches off."""

from typing import NamedTuple

import mujoco
import numpy as np

from .names import bit, joint_name, kind_of, number_of_actuators, on, own_name

MODELLED, OFF, OPEN = "modelled", "switched_off", "open_tree"


class Feature(NamedTuple):
    """A feature of a file: a row of the inventory."""

    feature: str
    count: int
    names: tuple[str, ...]
    treatment: str  # modelled, switched_off, open_tree
    reason: str
    numbers: tuple[float, ...] = ()  # of a feature that is not modelled: those other than 0, sorted


REASONS = {
    "hinge": (MODELLED, "a joint of the equations: an angle"),
    "slide": (MODELLED, "a joint of the equations: a length"),
    "ball": (MODELLED, "a joint of the equations: a quaternion"),
    "free": (MODELLED, "three slides along the world's axes and a ball"),
    "armature": (MODELLED, "on the diagonal of the mass matrix"),
    "damping": (MODELLED, "a force against each speed, linear in it"),
    "spring": (MODELLED, "a force towards the rest position, linear in the distance"),
    "contact": (OFF, "the equations have no contacts"),
    "limit": (OFF, "the equations have no limits"),
    "frictionloss": (OFF, "the equations have no dry friction"),
    "clamp": (OFF, "it limits forces of actuators, which are off"),
    "fluid": (OFF, "the equations have no fluid around the bodies"),
    "gravcomp": (OFF, "the equations have the whole weight"),
    "actuator": (OFF, "the comparison applies given torques to all engines"),
    "equality": (OPEN, "the equations are those of the open tree"),
    "tendon": (OFF, "the equations have no forces along tendons"),
    "keyframe": (MODELLED, "postures of the comparison"),
    "other": (OFF, "it changes the motion; the equations do not have it"),
}


def features(model: mujoco.MjModel) -> tuple[Feature, ...]:
    """The features of a compiled model, always in the same order."""
    names = names_of_features(model)
    return tuple(
        Feature(
            feature, len(names[feature]), tuple(names[feature]), *REASONS[feature], numbers_of_feature(model, feature)
        )
        for feature in REASONS
        if names[feature]
    )


def numbers_of_feature(m: mujoco.MjModel, feature: str) -> tuple[float, ...]:
    """The numbers of a feature that do not depend on how frames of bodies are placed."""
    fields = [np.ravel(getattr(m, name)) for name in FIELDS_OF_FEATURES.get(feature, ()) if hasattr(m, name)]
    if feature == "fluid":
        fields = [np.array([m.opt.density, m.opt.viscosity, *m.opt.wind])]
    if feature == "equality":
        fields = [m.eq_data[np.isin(m.eq_type, OF_COORDINATES), :5].ravel()]
    return tuple(sorted(float(x) for field in fields for x in field if x))


FIELDS_OF_FEATURES = {
    "gravcomp": ("body_gravcomp",),
    "frictionloss": ("dof_frictionloss", "tendon_frictionloss"),
    "tendon": ("tendon_stiffness", "tendon_damping", "tendon_lengthspring", "wrap_prm"),
    "other": ("dof_dampingpoly", "jnt_stiffnesspoly", "jnt_springyield"),
}
OF_COORDINATES = int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)


def names_of_features(m: mujoco.MjModel) -> dict[str, list[str]]:
    """The elements with each feature, by name."""
    actuators, tendons = number_of_actuators(m), range(m.ntendon)

    def joints(chosen) -> list[str]:
        return [joint_name(m, j) for j in range(m.njnt) if chosen(j)]

    def speeds(values) -> list[str]:
        return joints(lambda j: np.any(values[m.dof_jntid == j]))

    def named(what: str, numbers) -> list[str]:
        return [own_name(getattr(m, what)(int(i)).name, what, int(i)) for i in numbers]

    clamped = m.actuator_ctrllimited.astype(bool)  # of each input, of which an actuator may have several
    if hasattr(m, "actuator_ctrlnum"):
        clamped = np.array([clamped[a : a + n].any() for a, n in zip(m.actuator_ctrladr, m.actuator_ctrlnum)], bool)
    clamped = (
        clamped | per_actuator(m.actuator_forcelimited, actuators) | per_actuator(m.actuator_actlimited, actuators)
    )
    constrained = on(m, "CONSTRAINT")
    rotor = np.flatnonzero(getattr(m, "actuator_armature", np.zeros(0)))
    limited = constrained and on(m, "LIMIT")
    rubbed = constrained and on(m, "FRICTIONLOSS")
    return {
        **{kind: joints(lambda j, kind=kind: kind_of(m, j) == kind) for kind in ("hinge", "slide", "ball", "free")},
        "armature": speeds(m.dof_armature) + named("actuator", rotor),
        "damping": speeds(m.dof_damping) if on(m, "DAMPER") else [],
        "spring": joints(lambda j: m.jnt_stiffness[j]) if on(m, "SPRING") else [],
        "contact": named("geom", touching(m)) if constrained and on(m, "CONTACT") else [],
        "limit": (joints(lambda j: m.jnt_limited[j]) + named("tendon", np.flatnonzero(m.tendon_limited))) * limited,
        "frictionloss": (speeds(m.dof_frictionloss) + named("tendon", np.flatnonzero(m.tendon_frictionloss))) * rubbed,
        "clamp": named("actuator", np.flatnonzero(clamped))
        + joints(lambda j: m.jnt_actfrclimited[j])
        + named("tendon", np.flatnonzero(m.tendon_actfrclimited)),
        "fluid": [name for name in ("density", "viscosity") if getattr(m.opt, name)],
        "gravcomp": named("body", np.flatnonzero(m.body_gravcomp)),
        "actuator": named("actuator", range(actuators)),
        "equality": list(open_equalities(m)),
        "tendon": named("tendon", tendons),
        "keyframe": named("key", range(m.nkey)),
        "other": others(m, joints, speeds),
    }


def others(m: mujoco.MjModel, joints, speeds) -> list[str]:
    """Other settings that would change the motion and are switched off."""
    settings = [
        f"flag {flag.lower()}"
        for flag in ENABLED
        if m.opt.enableflags & int(getattr(mujoco.mjtEnableBit, f"mjENBL_{flag}", 0))
    ]
    if not on(m, "EULERDAMP"):
        settings.append("flag eulerdamp")
    if on(m, "DAMPER"):
        settings += [f"polynomial damping of {name}" for name in speeds(field(m, "dof_dampingpoly", m.nv))]
    if on(m, "SPRING"):
        settings += [
            f"polynomial stiffness of {name}"
            for name in joints(lambda j: np.any(field(m, "jnt_stiffnesspoly", m.njnt)[j]))
        ]
        settings += [
            f"spring yield of {name}" for name in joints(lambda j: np.any(field(m, "jnt_springyield", m.njnt)[j]))
        ]
    return settings


ENABLED = ("SLEEP", "INVDISCRETE", "IPC", "SPECULATIVE")  # enable flags that can change a motion


def open_equalities(m: mujoco.MjModel) -> tuple[str, ...]:
    """The names of the equalities that the file has in force; the comparison switches them off."""
    if not (on(m, "CONSTRAINT") and on(m, "EQUALITY")):
        return ()
    return tuple(own_name(m.equality(int(i)).name, "equality", int(i)) for i in np.flatnonzero(m.eq_active0))


def switch_off(m: mujoco.MjModel) -> None:
    """Switch off in a compiled model all that a Tree does not have."""
    take_away(m)
    for flag in ("CONSTRAINT", "CONTACT", "EQUALITY", "LIMIT", "FRICTIONLOSS", "ACTUATION"):
        m.opt.disableflags |= bit(flag)
    m.opt.enableflags = 0


def take_away(m: mujoco.MjModel) -> None:
    """Set to zero what a Tree does not have and no flag switches off, and what a flag of the file disables.

    Armature of actuators stays: MuJoCo has it in the mass matrix whether they act or not.
    """
    m.opt.gravity[:] *= on(m, "GRAVITY")
    m.dof_damping[:] *= on(m, "DAMPER")
    m.jnt_stiffness[:] *= on(m, "SPRING")
    for flag in ("GRAVITY", "DAMPER", "SPRING", "EULERDAMP"):
        m.opt.disableflags &= ~bit(flag)
    m.opt.density = m.opt.viscosity = 0.0
    for name in NOT_HAD_FIELDS:
        if hasattr(m, name):
            getattr(m, name)[:] = 0
    for name in ("jnt_plasticadr", "tendon_plasticadr"):  # a spring with a plastic state yields, at whatever force
        if hasattr(m, name):
            getattr(m, name)[:] = -1


NOT_HAD_FIELDS = (
    "body_gravcomp",
    "dof_dampingpoly",
    "jnt_stiffnesspoly",
    "jnt_springyield",
    "actuator_damping",
    "actuator_dampingpoly",
    "tendon_stiffness",
    "tendon_stiffnesspoly",
    "tendon_springyield",
    "tendon_damping",
    "tendon_dampingpoly",
    "dof_frictionloss",
    "tendon_frictionloss",
)


def field(m: mujoco.MjModel, name: str, rows: int) -> np.ndarray:
    """A field of the model; zeros where the installed MuJoCo does not have it."""
    return getattr(m, name, np.zeros(rows))


def per_actuator(values, actuators: int) -> np.ndarray:
    return np.asarray(values, bool).reshape(-1)[:actuators]


def contact_pairs(m: mujoco.MjModel) -> int:
    """The number of pairs of geoms that may touch: those that MuJoCo chooses, and those that the file names."""
    return m.npair + len(chosen_pairs(m))


def touching(m: mujoco.MjModel) -> list[int]:
    """The geoms of these pairs, each once."""
    named = np.column_stack([m.pair_geom1, m.pair_geom2]) if m.npair else np.zeros((0, 2), int)
    return np.unique(np.concatenate([chosen_pairs(m), named])).astype(int).tolist()


def chosen_pairs(m: mujoco.MjModel) -> np.ndarray:
    """The pairs of geoms that MuJoCo chooses, (pairs, 2): of two bodies that move against each other."""
    i, j = np.triu_indices(m.ngeom, 1)
    one, other = np.sort([m.geom_bodyid[i], m.geom_bodyid[j]], axis=0)
    a, b = m.body_weldid[one], m.body_weldid[other]
    over_a, over_b = (m.body_weldid[m.body_parentid[weld]] for weld in (a, b))
    related = (a > 0) & (b > 0) & ((a == over_b) | (b == over_a)) & on(m, "FILTERPARENT")
    wanted = (m.geom_contype[i] & m.geom_conaffinity[j]) | (m.geom_contype[j] & m.geom_conaffinity[i])
    excluded = np.isin((one.astype(np.int64) << 16) + other, m.exclude_signature)
    return np.column_stack([i, j])[(a != b) & (wanted != 0) & ~related & ~excluded]
