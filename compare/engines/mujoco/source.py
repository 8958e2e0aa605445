"""A file, or MJCF text, read once: what it states, and what MuJoCo compiles of it, with all of its joints or without some.

Textures and visual meshes are nearly all of a robot's memory (252 MB of one quadruped, 22 kB without), and every copy copies
them: what is only drawn is left out. No bodies are fused (fusestatic gives wrong inertias up to MuJoCo 3.10) and nothing is
printed as XML (which has seven digits). A URDF's meshes are found by their packages, and its floating base hangs on the world.
"""

import os
import re
import warnings
from collections.abc import Collection, Mapping
from copy import copy
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from ...process.parts import is_pipe, named_by
from .inventory import contact_pairs
from .names import aligns, element_name, joint_name, joint_places, kind_of, parts_of, rotors
from .welded import compiled, join, welded_bodies

FROM_GEOMS = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
PARTS_OF_FREE = [mujoco.mjtJoint.mjJNT_SLIDE] * 3 + [mujoco.mjtJoint.mjJNT_BALL]
UNREAD = (
    "Error opening file",
    "no decoder found",
)  # by MuJoCo, of a mesh that is not there or in another format
ADVICE = {  # by what MuJoCo says of a file that it cannot compile
    "which cannot be read": "package://NAME/... is looked for in a folder NAME beside the file or above it, else beside the file",
    "must have positive eigenvalues": "the order of fullinertia is xx, yy, zz, xy, xz, yz",
    "mass and inertia of moving bodies": "boundmass and boundinertia of <compiler> give some, or both joints in one body",
}
ROOT_ELEMENT = re.compile(r"(?:\ufeff|\s|<[?!][^>]*>)*<([A-Za-z][\w.:-]*)")
Positions = Mapping[str, float | tuple[float, ...]]  # of joints by name: rad, m or a quaternion


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self) -> str:
        return " ".join(super().__str__().split())


class Source:
    """A file (a Path), MJCF text, or a model that was compiled elsewhere, of which a copy is taken.

    origin: the Path or the text; None: compiled elsewhere. floating: whether the base of a URDF gets a free joint. text: what it
    says. model: without what is only drawn. missing: the files of meshes and height fields that cannot be read: geoms of them
    are left out. warnings: of MuJoCo's compiler, one line each. bodies, joints: their numbers in the model, in the order of the
    spec. ModelError, in one line, where MuJoCo makes no model of it.
    """

    def __init__(self, origin: Path | str | mujoco.MjModel, floating: bool = False) -> None:
        self.origin: Path | str | None = None
        self.text = ""
        self.warnings: tuple[str, ...] = ()
        self.missing: tuple[str, ...] = ()
        self.floating = floating
        self.welded: dict[int, int] = {}
        self._spec: mujoco.MjSpec | None = None
        if isinstance(origin, mujoco.MjModel):
            self.model = mujoco.MjModel.__copy__(origin)
        elif isinstance(origin, Path | str):
            self.origin, self.text = origin, text_of(origin) if isinstance(origin, Path) else origin
            self.compile(origin)
        else:
            kind = type(origin).__name__
            raise ModelError(f"cannot read a {kind}; expected a path, MJCF text or an MjModel")

    def compile(self, origin: Path | str) -> None:
        if not self.text.strip():
            raise ModelError(f"{self} is empty; expected MJCF or URDF")
        lines: list[str] = []
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lines.append)
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                self._spec = parsed(origin, self.text, self.floating)
                spec = self.compiled_spec(self._spec)
            bytes(self.model.names).decode()
        except UnicodeDecodeError:
            raise ModelError(f"{self} has names that are not UTF-8; save it as UTF-8") from None
        except ValueError as error:
            is_model, root = "<mujoco" in self.text or "<robot" in self.text, ROOT_ELEMENT.match(self.text)
            if root and not is_model:
                raise ModelError(f"{self} is not MJCF or URDF: its root element is <{root[1]}>") from None
            problem = f"MuJoCo cannot compile {self}" if is_model else f"{self} is not MJCF"
            advice = "".join(f"; {text}" for part, text in ADVICE.items() if part in str(error))
            raise ModelError(f"{problem}: {error}{advice}") from None
        finally:
            mujoco.set_mju_user_warning(before)
        lines += [str(warning.message) for warning in caught]
        self.warnings = tuple(dict.fromkeys(" ".join(line.split()) for line in lines))
        # elements have their numbers in the model only once compiled
        self.bodies, self.joints = [body.id for body in spec.bodies], [joint.id for joint in spec.joints]

    def compiled_spec(self, stated: mujoco.MjSpec) -> mujoco.MjSpec:
        """The spec of the model, without what is only drawn, and without meshes that cannot be read."""
        spec = without_visuals(stated.copy())
        try:
            self.model = compiled(spec)
        except ValueError as error:
            if not is_unread(error):
                raise
            files = [asset for asset in (*stated.meshes, *stated.hfields) if not is_read(stated, asset)]
            self.missing = tuple(asset.file for asset in files)
            leave_out(stated, self.missing)
            spec = without_visuals(stated.copy())
            self.model = compiled(spec)
        return spec

    def __str__(self) -> str:
        """Its name in a message."""
        if self.origin is None:
            return "the model"
        return str(self.origin) if isinstance(self.origin, Path) else "the text"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_spec": None}

    @property
    def spec(self) -> mujoco.MjSpec | None:
        """What is stated: only copies of it are compiled. None: the model was compiled elsewhere."""
        if self._spec is None and self.origin is not None:  # in another process
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the first reading has them
                self._spec = parsed(self.origin, self.text, self.floating)
                leave_out(self._spec, self.missing)
        return self._spec

    def joined(self) -> "Source":
        """The same, with the mass of bodies that are welded to a moving one in that one."""
        other = copy(self)
        other._spec = self._spec  # which is not pickled, nor copied
        other.model, other.welded = mujoco.MjModel.__copy__(self.model), welded_bodies(self.model)
        join(other.model, other.welded)
        return other

    def without_meshes(self) -> mujoco.MjModel:
        """The compiled model for what touches nothing: meshes are nearly all of its memory, and every copy copies them."""
        if not (self.model.nmesh or self.model.nhfield) or self.spec is None:
            return self.model
        if self.spec.compiler.settotalmass > 0.0:  # of which bodies that never move have a part
            return self.model
        spec = without_visuals(self.spec.copy())
        delete_meshes(spec)
        model = compiled(spec)
        join(model, self.welded)
        return model

    def without(self, positions: Positions, bare: bool = False) -> mujoco.MjModel:
        """The compiled model without the joints named in `positions`, see names.joint_places.

        Every body keeps its number. Keyframes and sensors are deleted, and the actuators and equalities of a locked joint; bare:
        all tendons, equalities and meshes, and all actuators except those with armature. ModelError if anything
        else refers to a locked joint, or nothing is stated.
        """
        names = ", ".join(positions)
        if self.spec is None:
            raise ModelError(f"cannot lock {names}: the model was changed after it was read")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the compiler's, of the file as it is
                model = compiled_without(without_visuals(self.spec.copy()), positions, bare)
        except ValueError as error:
            raise ModelError(f"MuJoCo cannot compile {self} with locked joints {names}: {error}") from None
        join(model, self.welded)
        return model


def text_of(path: Path) -> str:
    for part in filter(is_pipe, named_by(path)):  # MuJoCo would wait for it
        raise ModelError(f"{part} is a pipe or a device; expected a regular file")
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror}; expected an MJCF or URDF file") from None


def is_urdf(text: str) -> bool:
    root = re.search(r"<(robot|mujoco)\b", text)
    return bool(root) and root[1] == "robot"  # type: ignore[index]


def parsed(origin: Path | str, text: str, floating: bool = False) -> mujoco.MjSpec:
    """The MjSpec of a file (a Path) with this text, or of the text alone; floating: the base of a URDF has a free joint."""
    spec = parsed_as_it_is(origin, text)
    if floating and not is_urdf(text):
        raise ValueError("only the base of a URDF is made floating; MJCF states its free joints")
    for body in list(spec.worldbody.bodies) if floating else ():
        if not body.joints:
            body.add_freejoint()
    return spec


def parsed_as_it_is(origin: Path | str, text: str) -> mujoco.MjSpec:
    if not isinstance(origin, Path):
        return mujoco.MjSpec.from_string(text)
    spec = mujoco.MjSpec.from_file(os.fsencode(origin))
    free = [joint.parent.parent for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    bases = [body.name for body in free if body.parent == spec.worldbody]
    if bases:  # of a URDF: its link with a free joint hangs on another one
        spec = mujoco.MjSpec.from_string(on_the_world(text, bases[0]))
        spec.modelfiledir = str(origin.parent)
    for mesh in spec.meshes:
        if "://" in mesh.file:
            mesh.file = str(place_of(mesh.file, origin.absolute()) or mesh.file)
    return spec


def on_the_world(text: str, base: str) -> str:
    """A URDF text in which a link is the world."""
    robot = ElementTree.fromstring(text)
    named = [(link, "name") for link in robot.iter("link")]
    for element, key in named + [(end, "link") for end in robot.iter("parent")]:
        if element.get(key) == base:
            element.set(key, "world")
    return ElementTree.tostring(robot, encoding="unicode")


def place_of(address: str, path: Path) -> Path | None:
    """The file of package://NAME/... in a folder NAME beside a URDF or above it, else beside the URDF; None: it is not there."""
    _, _, relative = address.partition("://")
    places = [*(above / relative for above in path.parents), path.parent / Path(relative).name]
    return next((place for place in places if place.is_file()), None)


def is_unread(error: ValueError) -> bool:
    return any(words in str(error) for words in UNREAD)


def is_read(spec: mujoco.MjSpec, asset: mujoco.MjsMesh | mujoco.MjsHField) -> bool:
    """Whether MuJoCo can read the file of an asset, which is tried alone."""
    alone = mujoco.MjSpec()
    alone.modelfiledir, alone.meshdir = spec.modelfiledir, spec.meshdir
    if isinstance(asset, mujoco.MjsMesh):
        alone.add_mesh(name="asset", file=asset.file)
        alone.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="asset")
    else:
        alone.add_hfield(name="asset", file=asset.file, size=asset.size)
    try:
        alone.compile()
    except ValueError as error:
        return not is_unread(error)
    return True


def leave_out(spec: mujoco.MjSpec, missing: Collection[str]) -> None:
    """Delete meshes and height fields by their files, and geoms of them. ValueError where one has the inertia of its body."""
    assets = [asset for asset in (*spec.meshes, *spec.hfields) if asset.file in missing and asset.file]
    names = {asset.name: asset.file for asset in assets}
    geoms = [geom for geom in spec.geoms if {geom.meshname, geom.hfieldname} & names.keys()]
    for geom in geoms:
        if gives_inertia(geom):
            body, file = geom.parent, names.get(geom.meshname or geom.hfieldname, "")
            why = f"is that of its mesh {file}, which cannot be read"
            raise ValueError(f"the inertia of body {body.name!r} {why}")
    deleted = {geom.name for geom in geoms} - {""}
    pairs = [pair for pair in spec.pairs if {pair.geomname1, pair.geomname2} & deleted]
    for element in (*pairs, *geoms, *assets):
        spec.delete(element)


def gives_inertia(geom: mujoco.MjsGeom) -> bool:
    """Whether the compiler takes mass of a body that moves from this geom."""
    body = geom.parent
    is_stated = body.explicitinertial and body.compiler.inertiafromgeom != FROM_GEOMS
    low, high = body.compiler.inertiagrouprange
    has_mass = geom.mass != 0.0 and geom.density != 0.0 and low <= geom.group <= high
    return has_mass and not is_stated and moves(body)


def moves(body: mujoco.MjsBody) -> bool:
    while body.name != "world":  # whose parent is no body, and in MuJoCo 3.10 not even none
        if body.joints:
            return True
        body = body.parent
    return False


def without_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec without what is only drawn; when compiled it has every body of the file.

    A medium pushes geoms that touch nothing, and they may have the mass: there they stay.
    """
    has_mass = any(body.compiler.inertiafromgeom == FROM_GEOMS for body in spec.bodies)
    spec.compiler.fusestatic = False  # fused bodies would only be renumbered
    spec.compiler.discardvisual = not (spec.option.density or spec.option.viscosity or has_mass)
    return spec


def compiled_without(spec: mujoco.MjSpec, positions: Positions, bare: bool) -> mujoco.MjModel:
    """The model whose bodies and other joints are placed as mj_kinematics places them with the joints locked."""
    model = compiled(spec)
    data, places = mujoco.MjData(model), joint_places(model)
    data.qpos[:] = model.qpos0
    for name, place in places.items():
        if name in positions or kind_of(model, place.joint) == "free":
            data.qpos[place.qpos] = positions.get(name, (1.0, 0.0, 0.0, 0.0) if place.kind == "ball" else 0.0)
    mujoco.mj_kinematics(model, data)
    for joint in spec.joints:
        joint.name = joint_name(model, joint.id)
    numbers = {joint.name: joint.id for joint in spec.joints}  # a change of the spec takes them away
    # a free joint goes as a whole, and the parts that stay are added
    removed = {joint_name(model, places[name].joint) for name in positions}
    moved = [body for body in spec.bodies if removed.intersection(joint.name for joint in body.joints)]
    for body, number in [(body, body.id) for body in moved]:
        axes = data.xmat[number].reshape(3, 3)
        parent, quat = model.body_parentid[number], np.zeros(4)
        mujoco.mju_mulQuat(quat, data.xquat[parent] * [1.0, -1.0, -1.0, -1.0], data.xquat[number])
        body.set_frame(body.parent.add_frame())
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.pos = (data.xpos[number] - data.xpos[parent]) @ data.xmat[parent].reshape(3, 3)
        body.quat = quat
        for joint in list(body.joints):
            i = numbers[joint.name]
            if joint.name not in removed:
                joint.set_frame(body.add_frame())
                joint.pos, joint.axis = (data.xanchor[i] - data.xpos[number]) @ axes, data.xaxis[i] @ axes
            elif kind_of(model, i) == "free":
                armature = model.dof_armature + rotors(model)  # of actuators too, which are deleted
                add_parts(body, joint, float(armature[model.jnt_dofadr[i]]), positions, axes)
    clear(spec, removed, bare)
    smaller = compiled(spec)
    if not bare and (touching := pairs_of_bodies(smaller) - pairs_of_bodies(model)):
        for body in spec.bodies:
            body.name = element_name(smaller, "body", body.id)
        for (
            one,
            other,
        ) in touching:  # they are neighbours, whose contacts MuJoCo leaves out unless one of them is fixed
            names = (element_name(smaller, "body", number) for number in (one, other))
            spec.add_exclude(**dict(zip(("bodyname1", "bodyname2"), names)))
        smaller = compiled(spec)
    # of springdamper the compiler chooses both by the inertia
    for name, place in joint_places(smaller).items():
        before = places[name]
        smaller.qpos_spring[place.qpos] = model.qpos_spring[before.qpos]
        smaller.dof_damping[place.dofs] = model.dof_damping[before.dofs]
        smaller.jnt_stiffness[place.joint] = model.jnt_stiffness[before.joint]
    return smaller


def pairs_of_bodies(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """The bodies whose geoms may touch, by number, the smaller one first."""
    pairs = np.sort(model.geom_bodyid[contact_pairs(model)], axis=1)
    return set(map(tuple, pairs.tolist()))


def add_parts(
    body: mujoco.MjsBody, free: mujoco.MjsJoint, armature: float, locked: Positions, axes: np.ndarray
) -> None:
    """Add the parts of a free joint that are not locked. axes: of the body, as columns."""
    if aligns(free):
        why = "is aligned with the inertia of its body: none of its parts can be locked"
        raise ValueError(f"free joint {free.name!r} {why}")
    no_defaults = {"ref": 0.0, "springdamper": np.zeros(2), "limited": mujoco.mjtLimited.mjLIMITED_FALSE}
    for name, kind, axis in zip(parts_of(free.name), PARTS_OF_FREE, [*axes, axes[2]]):
        if name not in locked:
            body.add_joint(name=name, type=kind, axis=axis, pos=np.zeros(3), armature=armature, **no_defaults)


def clear(spec: mujoco.MjSpec, removed: set[str], bare: bool) -> None:
    """Delete what refers to joints of these names, then the joints: the other way round MuJoCo crashes."""
    if bare:
        delete_meshes(spec)
    elements = [*spec.keys, *spec.sensors]
    elements += [tie for tie in spec.equalities if bare or {tie.name1, tie.name2} & removed]
    for actuator in spec.actuators:
        if actuator.target in removed or (bare and not actuator.armature):
            elements.append(actuator)
    elements += spec.tendons if bare else []
    for element in (*elements, *[joint for joint in spec.joints if joint.name in removed]):
        spec.delete(element)


def delete_meshes(spec: mujoco.MjSpec) -> None:
    """Delete meshes and height fields that give no inertia, their geoms, and what may refer to these."""
    elements = [*spec.sensors, *spec.tuples, *spec.pairs]
    meshes = [geom for geom in spec.geoms if geom.meshname or geom.hfieldname]
    elements += [geom for geom in meshes if not gives_inertia(geom)]
    for element in elements:
        spec.delete(element)
    used = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for asset in [asset for asset in (*spec.meshes, *spec.hfields) if asset.name not in used]:
        spec.delete(asset)
