"""A smaller file: what a motion does not use is taken out of an MjSpec, joints are locked, and it is written as MJCF."""

import ctypes
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path as File
from typing import Any

import mujoco
import numpy as np

from .calls import library
from .changed import state_as_compiled
from .locked import Positions, compiled_without
from .motion import Motion, Use, joints
from .names import INTEGRATORS, bit, element_name, kind_of, parts_of
from .source import Source
from .variants import of_base
from .welded import compiled

NAMED = {  # the elements that are known by their names, and their kinds in a compiled model
    "geoms": "geom", "joints": "joint", "actuators": "actuator", "tendons": "tendon",
    "equalities": "equality", "sites": "site", "bodies": "body",
}  # fmt: skip
MATCHED = "joint", "actuator"  # of the smaller file with the whole one, by name
OFF, ALL_DIGITS, USUAL_DIGITS = int(mujoco.mjtLimited.mjLIMITED_FALSE), 17, 6
DRAWN = "skins", "lights", "cameras", "textures"
REPORTED = int(mujoco.mjtEnableBit.mjENBL_ENERGY) | int(mujoco.mjtEnableBit.mjENBL_FWDINV)


class Smaller:
    """A spec and its compiled model. All elements have names: those that the file does not state are `invented`."""

    def __init__(self, spec: mujoco.MjSpec, invented: frozenset[tuple[str, str]] = frozenset()) -> None:
        self.spec, self.invented = spec, invented
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the first reading has them
            self.model = compiled(spec)

    @classmethod
    def whole(cls, source: Source, points: tuple[str, ...] = ()) -> "Smaller":
        """The whole file. points: of bodies with such a name, sites are added. ValueError for a name that is neither."""
        assert source.spec is not None
        spec, invented = source.spec.copy(), set()
        sites, bodies = ({element.name for element in elements} for elements in (spec.sites, spec.bodies))
        for name in points:
            if name not in sites | bodies:
                raise ValueError(f"the file has no body and no site {name!r}")
            if name not in sites:
                spec.body(name).add_site(name=name)
        first = cls(spec)
        for elements, kind in NAMED.items():
            for element in getattr(spec, elements):
                if not element.name:
                    element.name = element_name(first.model, kind, element.id)
                    if kind not in MATCHED:
                        invented.add((elements, element.name))
        return cls(spec, frozenset(invented))

    def edited(self, edit: "Edit", use: Use) -> tuple["Smaller", int]:
        """A copy from which an edit has taken something out, and how many elements."""
        copy = Smaller(self.spec.copy(), self.invented)
        count = edit(copy, use)
        return Smaller(copy.spec, self.invented), count

    def delete(self, elements: str, is_needless: Callable[[Any], bool]) -> int:
        needless = [element for element in getattr(self.spec, elements) if is_needless(element)]
        for element in needless:
            self.spec.delete(element)
        return len(needless)

    def text(self, comment: str = "") -> str:
        """The file with every digit, if the installed MuJoCo can print them; its meshes are those of the whole file."""
        spec = self.spec.copy()
        for elements, name in self.invented:
            for element in [element for element in getattr(spec, elements) if element.name == name]:
                element.name = ""
        spec.comment = comment.replace("--", "- -")
        folder = File(spec.modelfiledir or ".").absolute()
        spec.meshdir, spec.texturedir = str(folder / spec.meshdir), str(folder / spec.texturedir)
        with warnings.catch_warnings(), every_digit():
            warnings.simplefilter("ignore")
            compiled(spec)
            return str(spec.to_xml())


@contextmanager
def every_digit() -> Iterator[None]:
    """MuJoCo prints MJCF with all digits, if it has the function that its own tests use for it; else with six."""
    choose = getattr(ctypes.CDLL(library() or None), "_mjPRIVATE__set_xml_precision", lambda digits: None)
    choose(ALL_DIGITS)
    try:
        yield
    finally:
        choose(USUAL_DIGITS)


def drawing(small: Smaller, use: Use) -> int:
    """What is only drawn: lights, cameras, textures, skins, geoms that collide with nothing, and their meshes."""
    for material in small.spec.materials:
        material.textures = [""] * len(material.textures)
    return touchless(small, lambda geom: not (geom.contype or geom.conaffinity)) + sum(
        small.delete(elements, lambda _: True) for elements in DRAWN
    )


def touchless(small: Smaller, is_needless: Callable[[mujoco.MjsGeom], bool]) -> int:
    """Delete geoms, and meshes and height fields that no geom has then. The inertias stay as they were compiled."""
    spec = small.spec
    named = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    needless = [geom for geom in spec.geoms if is_needless(geom) and geom.name not in named]
    if needless:
        state_as_compiled(spec, small.model, [body.id for body in spec.bodies])
    for geom in needless:
        spec.delete(geom)
    meshes = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for elements in ("meshes", "hfields"):
        small.delete(elements, lambda asset: asset.name not in meshes)
    return len(needless)


def geoms(small: Smaller, use: Use) -> int:
    """Geoms, pairs and exclusions of what never touches."""
    pairs = small.delete("pairs", lambda pair: not {pair.geomname1, pair.geomname2} <= use.geoms)
    return pairs + touchless(small, lambda geom: geom.name not in use.geoms)


def sensors(small: Smaller, use: Use) -> int:
    return small.delete("sensors", lambda _: True)


def equalities(small: Smaller, use: Use) -> int:
    return small.delete("equalities", lambda tie: tie.name not in use.acted["equality"])


def actuators(small: Smaller, use: Use) -> int:
    """Actuators that never exert a force."""
    return small.delete(
        "actuators", lambda actuator: actuator.name not in use.acted["actuator"] and not actuator.armature
    )


def tendons(small: Smaller, use: Use) -> int:
    """Tendons to which nothing refers, and that have no force."""
    referred = {actuator.target for actuator in small.spec.actuators}
    referred |= {name for tie in small.spec.equalities for name in (tie.name1, tie.name2)} | use.acted[
        "tendon"
    ]
    return small.delete("tendons", lambda tendon: tendon.name not in referred)


def limits(small: Smaller, use: Use) -> int:
    """Limits of joints and tendons that never act; the range of a servo may be that of its joint, and stays."""
    count = 0
    for elements, kind in (("joints", "joint"), ("tendons", "tendon")):
        limited = getattr(small.model, "jnt_limited" if kind == "joint" else "tendon_limited")
        for element in getattr(small.spec, elements):
            if limited[element.id] and element.name not in use.acted[kind]:
                element.limited, count = OFF, count + 1
    return count


def stages(small: Smaller, use: Use) -> int:
    """Whole stages: energy and other numbers that are only reported; contacts, or all constraints, where none occurred."""
    option = small.spec.option
    before = option.disableflags, option.enableflags
    option.enableflags &= ~REPORTED
    if not use.pairs:
        option.disableflags |= bit("CONTACT")
    if not use.has_constraints:
        option.disableflags |= bit("CONSTRAINT")
    return bin(before[0] ^ option.disableflags).count("1") + bin(before[1] ^ option.enableflags).count("1")


Edit = Callable[[Smaller, Use], int]
FREE: dict[str, Edit] = {
    "drawing": drawing, "sensors": sensors, "geoms that never touch": geoms, "equalities without force": equalities,
    "actuators without force": actuators, "tendons without force": tendons, "limits that never act": limits,
    "stages without work": stages,
}  # fmt: skip


def tied_joints(model: mujoco.MjModel) -> list[frozenset[str]]:
    """The joints that can be locked, those together that a tendon or an equality of joints ties; not the base of a free robot."""
    names, base = list(joints(model)), set(model.dof_jntid[of_base(model)].tolist())
    groups = [frozenset([name]) for number, name in enumerate(names) if number not in base]
    for tie in range(model.neq):
        if model.eq_type[tie] == mujoco.mjtEq.mjEQ_JOINT:
            ends = (model.eq_obj1id[tie], model.eq_obj2id[tie])
            groups = merged(groups, frozenset(names[end] for end in ends if end >= 0))
    for tendon in range(model.ntendon):
        groups = merged(groups, frozenset(joints_of(model, tendon)))
    return groups


def merged(groups: list[frozenset[str]], tied: frozenset[str]) -> list[frozenset[str]]:
    together = [group for group in groups if group & tied]
    others = [group for group in groups if not group & tied]
    return [*others, frozenset().union(*together)] if together else groups


def joints_of(model: mujoco.MjModel, tendon: int) -> list[str]:
    """The joints of a fixed tendon."""
    first = model.tendon_adr[tendon]
    wraps = range(first, first + model.tendon_num[tendon])
    numbers = [
        model.wrap_objid[wrap] for wrap in wraps if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT
    ]
    return [element_name(model, "joint", number) for number in numbers]


def locked(small: Smaller, positions: Mapping[str, np.ndarray]) -> Smaller:
    """With joints locked at positions, and bodies that do not move in one another fused. ValueError where that cannot be."""
    if not positions:
        return small
    model, spec = small.model, small.spec.copy()
    gone = {
        element_name(model, "tendon", i)
        for i in range(model.ntendon)
        if {*joints_of(model, i)} & positions.keys()
    }
    for elements in (spec.equalities, spec.actuators, spec.sensors):
        for element in list(elements):
            names = {getattr(element, field, "") for field in ("name1", "name2", "target", "objname")}
            if names & gone:
                spec.delete(element)
    for tendon in [tendon for tendon in spec.tendons if tendon.name in gone]:
        spec.delete(tendon)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fixed = compiled_without(spec, of_parts(model, positions), bare=False)
    for tie in list(spec.equalities):
        bodies = [mujoco.mj_name2id(fixed, mujoco.mjtObj.mjOBJ_BODY, name) for name in (tie.name1, tie.name2)]
        if min(bodies) >= 0 and len(set(fixed.body_weldid[bodies].tolist())) == 1:
            spec.delete(tie)
    spec.compiler.fusestatic = True
    return Smaller(spec, small.invented)


def of_parts(model: mujoco.MjModel, positions: Mapping[str, np.ndarray]) -> Positions:
    """The positions of joints by the names of those of a Tree."""
    at: dict[str, float | tuple[float, ...]] = {}
    for name, q in positions.items():
        if kind_of(model, list(joints(model)).index(name)) == "free":
            at |= dict(zip(parts_of(name), [*q[:3].tolist(), tuple(q[3:].tolist())]))
        else:
            at[name] = float(q[0]) if len(q) == 1 else tuple(q.tolist())
    return at


def finished(small: Smaller, motion: Motion, dt: float, integrator: str) -> Smaller:
    """With a step and an integrator, and the start of the motion as its only keyframe."""
    spec, data = small.spec.copy(), motion.placed(small.model)
    spec.option.timestep, spec.option.integrator = dt, INTEGRATORS[integrator]
    for key in list(spec.keys):
        spec.delete(key)
    spec.add_key(name=motion.name, qpos=data.qpos, qvel=data.qvel, act=data.act, ctrl=data.ctrl)
    return Smaller(spec, small.invented)
