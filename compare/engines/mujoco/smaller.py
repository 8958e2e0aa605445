"""Smaller models of a file: without what a motion does not use, and with joints locked."""

import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import mujoco
import numpy as np
from scipy.sparse.csgraph import connected_components

from .changes import state_as_compiled
from .locked import (
    Positions,
    compiled,
    compiled_without,
    delete_geoms,
    delete_named,
    delete_textures,
    is_from_geoms,
)
from .motion import Roll, Use, joints
from .names import bit, element_name, kind_of, parts_of
from .source import Source
from .stepper import Stepper

NAMED = {  # the elements that are known by their names, and their kinds in a compiled model
    "geoms": "geom", "joints": "joint", "actuators": "actuator", "tendons": "tendon",
    "equalities": "equality", "sites": "site", "bodies": "body",
}  # fmt: skip
OFF = int(mujoco.mjtLimited.mjLIMITED_FALSE)
DRAWN = "skins", "lights", "cameras"
REPORTED = int(mujoco.mjtEnableBit.mjENBL_ENERGY) | int(mujoco.mjtEnableBit.mjENBL_FWDINV)


def spec_with_points(source: Source, points: Iterable[str]) -> mujoco.MjSpec:
    """A copy of the file's spec with sites at bodies of these names; ValueError for a name of neither."""
    assert source.spec is not None
    spec = source.spec.copy()
    sites, bodies = ({element.name for element in elements} for elements in (spec.sites, spec.bodies))
    for name in points:
        if name not in sites | bodies:
            raise ValueError(f"the file has no body and no site {name!r}")
        if name not in sites:
            spec.body(name).add_site(name=name)
    return spec


class Smaller:
    """A spec, all of whose elements have names, and its compiled model."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        self.spec = spec
        with warnings.catch_warnings(action="ignore"):  # the first reading has them
            self.model = compiled(spec)

    @classmethod
    def whole(cls, source: Source, points: tuple[str, ...] = ()) -> "Smaller":
        """The whole file. points: see spec_with_points."""
        spec = spec_with_points(source, points)
        spec.compiler.fusestatic = False  # as in the model that is read: states have the forces on each body
        first = cls(spec)
        for elements, kind in NAMED.items():
            for element in getattr(spec, elements):
                element.name = element.name or element_name(first.model, kind, element.id)
        return cls(spec)

    def delete(self, elements: str, is_needless: Callable[[Any], bool]) -> int:
        needless = [element for element in getattr(self.spec, elements) if is_needless(element)]
        for element in needless:
            self.spec.delete(element)
        return len(needless)


def drawing(small: Smaller, use: Use) -> int:
    """What is only drawn: lights, cameras, textures, skins, geoms that collide with nothing, meshes."""
    count = delete_textures(small.spec) + sum(small.delete(elements, lambda _: True) for elements in DRAWN)
    return count + touchless(small, lambda geom: not (geom.contype or geom.conaffinity))


def touchless(small: Smaller, is_needless: Callable[[mujoco.MjsGeom], bool]) -> int:
    """Delete geoms, and meshes that no geom has then. The inertias stay as they were compiled."""
    spec = small.spec
    named = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    needless = [geom for geom in spec.geoms if is_needless(geom) and geom.name not in named]
    if needless:
        state_as_compiled(spec, small.model, [body.id for body in spec.bodies])
    delete_geoms(spec, needless)
    return len(needless)


def geoms(small: Smaller, use: Use) -> int:
    """Geoms, pairs and exclusions of what never touches."""
    pairs = small.delete("pairs", lambda pair: not {pair.geomname1, pair.geomname2} <= use.geoms)
    return pairs + touchless(small, lambda geom: geom.name not in use.geoms)


def tendons(small: Smaller, use: Use) -> int:
    """Tendons to which nothing refers, and that have no force."""
    needed = {actuator.target for actuator in small.spec.actuators} | use.acted["tendon"]
    for tie in small.spec.equalities:
        needed |= {tie.name1, tie.name2}
    return small.delete("tendons", lambda tendon: tendon.name not in needed)


def limits(small: Smaller, use: Use) -> int:
    """Limits of joints and tendons that never act; their ranges stay, as a servo may have the same.

    MuJoCo turns the range of a joint into rad only where it is a limit.
    """
    model, acted = small.model, use.acted
    ends = [x for x in small.spec.joints if model.jnt_limited[x.id] and x.name not in acted["joint"]]
    for joint in ends:
        joint.range = model.jnt_range[joint.id]
    ends += [x for x in small.spec.tendons if model.tendon_limited[x.id] and x.name not in acted["tendon"]]
    for element in ends:
        element.limited = OFF
    return len(ends)


def stages(small: Smaller, use: Use) -> int:
    """Whole stages: numbers that are only reported; contacts, or all constraints, where none occurred."""
    option = small.spec.option
    before = option.disableflags, option.enableflags
    option.enableflags &= ~REPORTED
    if not use.pairs:
        option.disableflags |= bit("CONTACT")
    if not use.has_constraints:
        option.disableflags |= bit("CONSTRAINT")
    return bin(before[0] ^ option.disableflags).count("1") + bin(before[1] ^ option.enableflags).count("1")


def without(elements: str, is_needless: Callable[[Any, Use], bool]) -> "Edit":
    return lambda small, use: small.delete(elements, lambda element: is_needless(element, use))


def is_forceless(actuator: mujoco.MjsActuator, use: Use) -> bool:
    return actuator.name not in use.acted["actuator"] and not actuator.armature


Edit = Callable[[Smaller, Use], int]  # takes out what a motion does not use: how many elements
FREE: dict[str, Edit] = {
    "drawing": drawing,
    "sensors": without("sensors", lambda sensor, use: True),
    "geoms that never touch": geoms,
    "equalities without force": without("equalities", lambda tie, use: tie.name not in use.acted["equality"]),
    "actuators without force": without("actuators", is_forceless),
    "tendons without force": tendons,
    "limits that never act": limits,
    "stages without work": stages,
}


def tied_joints(model: mujoco.MjModel) -> list[list[str]]:
    """The joints that can be locked, those tied by a tendon or an equality together; not the free
    joint that carries most mass."""
    names = list(joints(model))
    free = [joint for joint in range(model.njnt) if kind_of(model, joint) == "free"]
    base = max(free, key=lambda joint: model.body_subtreemass[model.jnt_bodyid[joint]], default=-1)
    together = [joints_of(model, tendon) for tendon in range(model.ntendon)]
    for tie in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
        ends = (model.eq_obj1id[tie], model.eq_obj2id[tie])
        together.append([int(end) for end in ends if end >= 0])
    ties = np.eye(model.njnt)
    for numbers in together:
        ties[np.ix_(numbers, numbers)] = 1.0
    count, labels = connected_components(ties, directed=False)
    groups = [np.flatnonzero(labels == label).tolist() for label in range(count)]
    return [[names[number] for number in group] for group in groups if base not in group]


def joints_of(model: mujoco.MjModel, tendon: int) -> list[int]:
    """The numbers of the joints of a fixed tendon."""
    first = model.tendon_adr[tendon]
    wraps = slice(first, first + model.tendon_num[tendon])
    is_joint = model.wrap_type[wraps] == mujoco.mjtWrap.mjWRAP_JOINT
    return [int(number) for number in model.wrap_objid[wraps][is_joint]]


def locked(small: Smaller, positions: Mapping[str, np.ndarray]) -> Smaller:
    """With joints locked at positions, and bodies fused that move as one. ValueError where that cannot be."""
    if not positions:
        return small
    model, spec = small.model, small.spec.copy()
    numbers = {number for number, name in enumerate(joints(model)) if name in positions}
    tied = [tendon for tendon in range(model.ntendon) if numbers.intersection(joints_of(model, tendon))]
    gone = {element_name(model, "tendon", tendon) for tendon in tied}
    delete_named(spec, "tendon", [tendon for tendon in spec.tendons if tendon.name in gone])
    with warnings.catch_warnings(action="ignore"):
        fixed = compiled_without(spec, of_parts(model, positions), bare=False)
    for tie in list(spec.equalities):
        bodies = [mujoco.mj_name2id(fixed, mujoco.mjtObj.mjOBJ_BODY, name) for name in (tie.name1, tie.name2)]
        if min(bodies) >= 0 and len(set(fixed.body_weldid[bodies].tolist())) == 1:
            spec.delete(tie)
    spec.compiler.fusestatic = not is_from_geoms(spec)  # else inertials would be lost
    return Smaller(spec)


def of_parts(model: mujoco.MjModel, positions: Mapping[str, np.ndarray]) -> Positions:
    """The positions of joints by the names of those of a Tree."""
    at: dict[str, float | tuple[float, ...]] = {}
    for name, q in positions.items():
        if kind_of(model, list(joints(model)).index(name)) == "free":
            at |= dict(zip(parts_of(name), [*q[:3].tolist(), tuple(q[3:].tolist())]))
        else:
            at[name] = float(q[0]) if len(q) == 1 else tuple(q.tolist())
    return at


def finished(small: Smaller, motions: Iterable[tuple[Stepper, Roll]]) -> Smaller:
    """With the starts of its motions as its only keyframes, by their names."""
    spec = small.spec.copy()
    for key in list(spec.keys):
        spec.delete(key)
    for stepper, roll in motions:
        data = stepper.put(roll.state)
        places = {"mpos": data.mocap_pos.ravel(), "mquat": data.mocap_quat.ravel()}
        state = {"qpos": data.qpos, "qvel": data.qvel, "act": data.act, "ctrl": data.ctrl}
        spec.add_key(name=roll.name, time=data.time, **state, **places)
    return Smaller(spec)
