"""The features of a file: modelled by the equations, switched off, or a reason to refuse the file."""

from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from ...robots import Feature
from .names import OF_A_JOINT, bit, control_of, element_name, kind_of, names_where, number_of_actuators, on

KINDS = ("hinge", "slide", "ball", "free")
MODELLED, OFF, OPEN, LEFT_OUT = "modelled", "switched_off", "open_tree", "left_out"
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
    "unusable keyframe": (LEFT_OUT, "not every number is finite"),
    "other": (OFF, "it changes the motion; the equations do not have it"),
}
# enable flags that cannot change a motion without contacts
QUIET = ("OVERRIDE", "ENERGY", "FWDINV", "DIAGEXACT")
# fields of forces that are not linear, and the disable flag of each
NONLINEAR = {"dof_dampingpoly": "DAMPER", "jnt_stiffnesspoly": "SPRING", "jnt_springyield": "SPRING"}


def features(m: mujoco.MjModel) -> tuple[Feature, ...]:
    """The features of a compiled model, in the order of REASONS."""

    def named(kind: str, numbers: Iterable[int]) -> list[str]:
        return [element_name(m, kind, number) for number in numbers]

    def having(*fields: str, unless: str = "") -> list[str]:
        """The elements of which a field that this MuJoCo has is not zero; none where a flag is off."""
        holds = {field: np.asarray(getattr(m, field, ())) != 0 for field in fields}
        names = [name for field in fields for name in names_where(m, field, holds[field])]
        return [] if unless and not on(m, unless) else names

    actuators, limited = range(number_of_actuators(m)), m.actuator_ctrllimited
    inputs = [limited[place : place + count].any() for place, count in (control_of(m, i) for i in actuators)]
    clamped = [i for i in actuators if inputs[i] or m.actuator_forcelimited[i] or m.actuator_actlimited[i]]
    flags = {name.removeprefix("mjENBL_"): int(bit) for name, bit in mujoco.mjtEnableBit.__members__.items()}
    flags = {name: bit for name, bit in flags.items() if name not in QUIET and not name.startswith("mj")}
    others = [f"flag {name.lower()}" for name, bit in flags.items() if m.opt.enableflags & bit]
    others += ["flag eulerdamp"] * (not on(m, "EULERDAMP"))
    for field, flag in NONLINEAR.items():
        others += [f"{field} of {name}" for name in having(field, unless=flag)]
    names = {kind: named("joint", [j for j in range(m.njnt) if kind_of(m, j) == kind]) for kind in KINDS}
    names |= {
        "armature": having("dof_armature", "actuator_armature"),
        "damping": having("dof_damping", unless="DAMPER"),
        "spring": having("jnt_stiffness", unless="SPRING"),
        "contact": named("geom", np.unique(contact_pairs(m))) if on(m, "CONTACT") else [],
        "limit": having("jnt_limited", "tendon_limited", unless="LIMIT"),
        "frictionloss": having("dof_frictionloss", "tendon_frictionloss", unless="FRICTIONLOSS"),
        "equality": named("equality", np.flatnonzero(m.eq_active0)) if on(m, "EQUALITY") else [],
    }
    if not on(m, "CONSTRAINT"):
        names |= {name: [] for name in ("contact", "limit", "frictionloss", "equality")}
    names |= {
        "clamp": named("actuator", clamped) + having("jnt_actfrclimited", "tendon_actfrclimited"),
        "fluid": [name for name in ("density", "viscosity") if getattr(m.opt, name)],
        "gravcomp": having("body_gravcomp"),
        "actuator": named("actuator", actuators),
        "tendon": named("tendon", range(m.ntendon)),
        "keyframe": named("key", np.flatnonzero(usable_keys(m))),
        "unusable keyframe": named("key", np.flatnonzero(~usable_keys(m))),
        "other": others,
    }
    return tuple(Feature(name, tuple(names[name]), *REASONS[name]) for name in REASONS if names[name])


def usable_keys(m: mujoco.MjModel) -> np.ndarray:
    """Of each keyframe whether its numbers are finite and of at most MOST, (nkey,)."""
    return (np.abs(np.hstack([m.key_qpos, m.key_act, m.key_ctrl])) <= MOST).all(axis=1)


def switch_off(m: mujoco.MjModel) -> None:
    """Switch off in a compiled model all that a Tree does not have."""
    take_away(m)
    for flag in ("CONSTRAINT", "CONTACT", "EQUALITY", "LIMIT", "FRICTIONLOSS", "ACTUATION", "SENSOR"):
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
    set_fields(m, NOT_HAD_FIELDS, 0)
    # a spring with a plastic state yields, at whatever force
    set_fields(m, ("jnt_plasticadr", "tendon_plasticadr"), -1)


def set_fields(m: mujoco.MjModel, names: Iterable[str], value: int) -> None:
    """Set all numbers of some fields; those that the installed MuJoCo does not have are left out."""
    for name in names:
        if hasattr(m, name):
            getattr(m, name)[:] = value


NOT_HAD_FIELDS = (
    "body_gravcomp", "dof_dampingpoly", "jnt_stiffnesspoly", "jnt_springyield", "actuator_damping",
    "actuator_dampingpoly", "tendon_stiffness", "tendon_stiffnesspoly", "tendon_springyield", "tendon_damping",
    "tendon_dampingpoly", "dof_frictionloss", "tendon_frictionloss",
)  # fmt: skip


def contact_pairs(m: mujoco.MjModel) -> np.ndarray:
    """The pairs of geoms that may touch, (pairs, 2): by the file, or of bodies that move relatively."""
    i, j = np.triu_indices(m.ngeom, 1)
    one, other = np.sort([m.geom_bodyid[i], m.geom_bodyid[j]], axis=0)
    a, b = m.body_weldid[one], m.body_weldid[other]
    over_a, over_b = (m.body_weldid[m.body_parentid[weld]] for weld in (a, b))
    related = (a > 0) & (b > 0) & ((a == over_b) | (b == over_a)) & on(m, "FILTERPARENT")
    wanted = (m.geom_contype[i] & m.geom_conaffinity[j]) | (m.geom_contype[j] & m.geom_conaffinity[i])
    excluded = np.isin((one.astype(np.int64) << 16) + other, m.exclude_signature)
    chosen = np.column_stack([i, j])[(a != b) & (wanted != 0) & ~related & ~excluded]
    return np.concatenate([chosen, np.column_stack([m.pair_geom1, m.pair_geom2])]).astype(int)


def light_joints(m: mujoco.MjModel) -> dict[str, tuple[float, float, float]]:
    """Joints that turn less inertia at qpos0 than a ball of the densest element with the mass that they carry.

    By name: the inertia, kg m2, the mass, kg, and the inertia of the ball. No body has so little: a
    placeholder.
    """
    found = {}
    for dof in np.flatnonzero([kind_of(m, joint) in ("hinge", "ball") for joint in m.dof_jntid]).tolist():
        mass = float(m.body_subtreemass[m.dof_bodyid[dof]])
        of_ball = 0.4 * mass * (0.75 * mass / (np.pi * DENSEST)) ** (2 / 3)
        if m.dof_M0[dof] < of_ball:
            found[element_name(m, "joint", m.dof_jntid[dof])] = float(m.dof_M0[dof]), mass, of_ball
    return found


DENSEST = 22_590.0  # kg/m3, of osmium
MOST = 1e30  # in size, of every number that is compared: products of several are still doubles
STEPS = 1e-6, 5.0  # s, of the file
MOST_SPEEDS = 1000  # of a model: Mbar of a state has the square of it
NUMBERS = (
    "body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos", "body_iquat", "jnt_pos", "jnt_axis",
    "jnt_stiffness", "dof_armature", "dof_damping", "actuator_gainprm", "actuator_biasprm", "actuator_gear",
    "tendon_stiffness", "tendon_damping",
)  # fmt: skip
UNITS = {"mass": " kg", "inertia": " kg m2", "armature": " kg m2", "gravity": " m/s2", "timestep": " s"}
NOT_NEGATIVE = ("jnt_stiffness", "dof_armature", "dof_damping")
ELASTIC = ("flex_stiffness", "flex_bending", "flex_edgestiffness", "flex_edgedamping")


def refuse(m: mujoco.MjModel) -> None:
    """ValueError, in one line, for a model that has forces, elements or numbers that cannot be compared."""
    if not m.njnt:
        raise ValueError("it has no joint")
    if m.nv > MOST_SPEEDS:
        raise ValueError(f"it has {m.nv:,} speeds; robots of at most {MOST_SPEEDS:,} are compared")
    for number in range(m.njnt):
        if (kind := kind_of(m, number)) not in KINDS:
            name = element_name(m, "joint", number)
            raise ValueError(f"joint {name!r} is of type {kind}; known are {', '.join(KINDS)}")
    if any(np.any(getattr(m, field)) for field in ELASTIC):
        name = mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_FLEX, int(np.argmin(m.flex_rigid)))
        raise ValueError(f"flex {name!r} is elastic; only rigid bodies are compared")
    for body in np.flatnonzero(m.body_plugin >= 0):
        raise ValueError(f"a plugin acts on body {element_name(m, 'body', body)!r}; its forces are unknown")
    only = "only that of joints is compared"
    for tendon in np.flatnonzero(m.tendon_armature):
        why = f"has armature, which couples joints; {only}"
        raise ValueError(f"tendon {element_name(m, 'tendon', tendon)!r} {why}")
    for i in np.flatnonzero(getattr(m, "actuator_armature", ())):
        if mujoco.mjtTrn(m.actuator_trntype[i]) not in OF_A_JOINT:
            why = f"has armature and acts on no joint; {only}"
            raise ValueError(f"actuator {element_name(m, 'actuator', i)!r} {why}")
    refuse_numbers(m)


def refuse_numbers(m: mujoco.MjModel) -> None:
    """ValueError, in one line, for a number that is not finite, or beyond the range that is judged."""
    for field in NUMBERS:
        least = 0.0 if field in NOT_NEGATIVE else -MOST
        values = getattr(m, field)
        for name in names_where(m, field, ~((values >= least) & (values <= MOST))):
            refuse_number(field.partition("_")[2], f" of {name!r}", values, least, MOST)
    for word, numbers in (("gravity", m.opt.gravity), ("qpos0", m.qpos0), ("qpos_spring", m.qpos_spring)):
        refuse_number(word, "", numbers, -MOST, MOST)
    refuse_number("timestep", "", m.opt.timestep, *STEPS)


def refuse_number(word: str, owner: str, values: ArrayLike, least: float, most: float) -> None:
    """ValueError, with the number, where one of some numbers is not in a range."""
    for number in np.ravel(values).tolist():
        if not least <= number <= most:
            unit = UNITS.get(word, "")
            raise ValueError(f"{word}{owner} is {number:g}{unit}; expected from {least:g} to {most:g}")
