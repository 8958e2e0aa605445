"""A file, or MJCF text, read once: what it states, and what MuJoCo compiles of it.

Textures and visual meshes are nearly all of a robot's memory (252 MB of one quadruped, 22 kB without), and
every copy copies them: what is only drawn is left out. No bodies are fused (fusestatic gives wrong inertias
up to MuJoCo 3.10) and nothing is printed as XML (which has seven digits). A URDF's meshes are found by their
packages, and its floating base hangs on the world.
"""

import os
import re
import warnings
from collections.abc import Collection
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from ...process.files import is_pipe, named_by, needed_by
from . import locked
from .locked import Positions, compiled, gives_inertia, is_from_geoms, without_visuals
from .names import moving

# by MuJoCo, of a mesh that is not there or in another format
UNREAD = ("Error opening file", "no decoder found")
DECODED = ".stl", ".obj", ".msh"
PACKAGES = "is looked for in a folder NAME beside the file or above it, else beside the file"
ADVICE = {  # by what MuJoCo says of a file that it cannot compile
    "package:/": f"package://NAME/... {PACKAGES}",
    "must have positive eigenvalues": "the order of fullinertia is xx, yy, zz, xy, xz, yz",
    "mass and inertia of moving bodies": "boundmass and boundinertia of <compiler> give some, or both joints in one body",
}
LOST = (
    'with fusestatic and inertiafromgeom="true" MuJoCo leaves out the <inertial> of bodies without joints; '
    'expected fusestatic="false" or inertiafromgeom="auto"'
)
ROOT_ELEMENT = re.compile(r"(?:\ufeff|\s|<[?!][^>]*>)*<([A-Za-z][\w.:-]*)")


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self) -> str:
        return " ".join(super().__str__().split())


class Source:
    """A file (a Path), MJCF text, or a model that was compiled elsewhere, of which a copy is taken.

    origin: the Path or the text; None: compiled elsewhere. floating: whether the base of a URDF gets a free
    joint. text: what it says. model: without what is only drawn. missing: the files of meshes and height
    fields that cannot be read: geoms of them are left out. warnings: of MuJoCo's compiler, one line each.
    bodies: their numbers in the model, in the order of the spec. ModelError, in one line, where
    MuJoCo makes no model of it.
    """

    def __init__(self, origin: Path | str | mujoco.MjModel, floating: bool = False) -> None:
        self.origin: Path | str | None = None
        self.text, self.floating = "", floating
        self.warnings: tuple[str, ...] = ()
        self.missing: tuple[str, ...] = ()
        self.welded: dict[int, int] = {}
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
        before, cache = mujoco.get_mju_user_warning(), mujoco.mj_getCache()
        mujoco.set_mju_user_warning(lines.append)
        capacity = mujoco.mj_getCacheCapacity(cache)
        mujoco.mj_setCacheCapacity(cache, 0)  # it would hold all meshes, in twice the memory of the model
        try:
            with warnings.catch_warnings(record=True, action="always") as caught:
                self.spec = stated = parsed(origin, self.text, self.floating)
                spec = self.compiled_spec(stated)
            bytes(self.model.names).decode()
        except UnicodeDecodeError:
            raise ModelError(f"{self} has names that are not UTF-8; save it as UTF-8") from None
        except ValueError as error:
            raise ModelError(self.problem(str(error))) from None
        finally:
            mujoco.set_mju_user_warning(before)
            mujoco.mj_setCacheCapacity(cache, capacity)
        lines += [str(warning.message) for warning in caught]
        self.warnings = tuple(dict.fromkeys(" ".join(line.split()) for line in lines))
        if stated.compiler.fusestatic and is_from_geoms(spec):
            fused = spec.copy()
            fused.compiler.fusestatic = True
            if not np.isclose(moving_mass(compiled(fused)), moving_mass(self.model)):
                raise ModelError(f"cannot compare {self}: {LOST}")
        # elements have their numbers in the model only once compiled
        self.bodies = [body.id for body in spec.bodies]

    def problem(self, error: str) -> str:
        """Why MuJoCo makes no model of it, and what to do."""
        is_model, root = "<mujoco" in self.text or "<robot" in self.text, ROOT_ELEMENT.match(self.text)
        if root and not is_model:
            return f"{self} is not MJCF or URDF: its root element is <{root[1]}>"
        problem = f"MuJoCo cannot compile {self}" if is_model else f"{self} is not MJCF"
        return "; ".join([f"{problem}: {error}", *(text for part, text in ADVICE.items() if part in error)])

    def compiled_spec(self, stated: mujoco.MjSpec) -> mujoco.MjSpec:
        """The spec of the model, without what is only drawn, and without meshes that cannot be read."""
        spec = without_visuals(stated)
        try:
            self.model = compiled(spec)
        except ValueError as error:
            if not any(words in str(error) for words in UNREAD):
                raise
            files = [asset for asset in (*stated.meshes, *stated.hfields) if not is_read(stated, asset)]
            self.missing = tuple(asset.file for asset in files)
            leave_out(stated, self.missing)
            spec = without_visuals(stated)
            self.model = compiled(spec)
        return spec

    def __str__(self) -> str:
        """Its name in a message."""
        if isinstance(self.origin, Path):
            return str(self.origin)
        return "the model" if self.origin is None else "the text"

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("spec", "bare")}

    @property
    def mesh_geoms(self) -> list[tuple[str, list[bool]]]:
        """The name of each body but the world, and whether its geoms are meshes; of a URDF nothing."""
        bodies, mesh = list(self.spec.bodies)[1:] if self.spec else [], mujoco.mjtGeom.mjGEOM_MESH
        return [(body.name, [geom.type == mesh for geom in body.geoms]) for body in bodies]

    @cached_property
    def spec(self) -> mujoco.MjSpec | None:
        """What is stated: only copies of it are compiled. None: the model was compiled elsewhere."""
        if self.origin is None:
            return None
        with warnings.catch_warnings(action="ignore"):  # in another process: the first reading has them
            spec = parsed(self.origin, self.text, self.floating)
            leave_out(spec, self.missing)
        return spec

    @cached_property
    def bare(self) -> mujoco.MjSpec:
        """What is stated, without what is only drawn and meshes without mass: copies are changed."""
        assert self.spec is not None
        bare = without_visuals(self.spec)
        if not self.spec.compiler.settotalmass > 0.0:  # of which bodies that never move have a part
            locked.delete_meshes(bare)
        return bare

    @property
    def files(self) -> list[Path]:
        """The existing files of the model: itself, and those that it includes, attaches and loads."""
        if not isinstance(self.origin, Path) or self.spec is None:
            return []
        meshes = (Path(self.origin.parent, mesh.file) for mesh in self.spec.meshes)  # package:// too
        return [*needed_by(self.origin), *filter(Path.is_file, meshes)]

    def joined(self) -> "Source":
        """The same, with the mass of bodies that are welded to a moving one in that one."""
        other = copy(self)
        other.spec = self.spec  # which is not pickled, nor copied
        other.model, other.welded = mujoco.MjModel.__copy__(self.model), locked.welded_bodies(self.model)
        locked.join(other.model, other.welded)
        return other

    def without_meshes(self) -> mujoco.MjModel:
        """The compiled model for what touches nothing: meshes are nearly all of its memory."""
        if not (self.model.nmesh or self.model.nhfield) or self.spec is None:
            return self.model
        model = compiled(self.bare.copy())
        locked.join(model, self.welded)
        return model

    def without(self, positions: Positions, bare: bool = False) -> mujoco.MjModel:
        """The compiled model without the joints named in `positions`, see names.joint_places.

        Every body keeps its number. Keyframes and sensors are deleted, and the actuators and equalities of a
        locked joint; bare: all tendons, equalities and meshes, and all actuators except those with armature.
        ModelError if anything else refers to a locked joint, or nothing is stated.
        """
        names = ", ".join(positions)
        if self.spec is None:
            raise ModelError(f"cannot lock {names}: the model was changed after it was read")
        try:
            with warnings.catch_warnings(action="ignore"):  # the compiler's, of the file as it is
                spec = self.bare.copy() if bare else without_visuals(self.spec)
                model = locked.compiled_without(spec, positions, bare)
        except ValueError as error:
            raise ModelError(f"MuJoCo cannot compile {self} with locked joints {names}: {error}") from None
        locked.join(model, self.welded)
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
    return root is not None and root[1] == "robot"


def parsed(origin: Path | str, text: str, floating: bool = False) -> mujoco.MjSpec:
    """The MjSpec of a file (a Path) with this text, or of the text; floating: the base of a URDF is free."""
    spec = parsed_file(origin, text) if isinstance(origin, Path) else mujoco.MjSpec.from_string(text)
    if floating and not is_urdf(text):
        raise ValueError("only the base of a URDF is made floating; MJCF states its free joints")
    for body in list(spec.worldbody.bodies) if floating else ():
        if not body.joints:
            body.add_freejoint()
    return spec


def parsed_file(path: Path, text: str) -> mujoco.MjSpec:
    if is_urdf(text) and path.suffix != ".urdf":  # MuJoCo chooses how to decode a file by its name
        spec = mujoco.MjSpec.from_string(text)
        spec.modelfiledir = str(path.parent)
    else:
        spec = mujoco.MjSpec.from_file(os.fsencode(path))
    free = [joint.parent.parent for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    bases = [body.name for body in free if body.parent == spec.worldbody]
    if bases:  # of a URDF: its link with a free joint hangs on another one, which is the world
        robot = ElementTree.fromstring(text)
        named = [(link, "name") for link in robot.iter("link")]
        for element, key in named + [(end, "link") for end in robot.iter("parent")]:
            if element.get(key) == bases[0]:
                element.set(key, "world")
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
        spec.modelfiledir = str(path.parent)
    for mesh in spec.meshes:
        if "://" in mesh.file:
            mesh.file = str(place_of(mesh.file, path.absolute()) or mesh.file)
    return spec


def place_of(address: str, path: Path) -> Path | None:
    """The file of package://NAME/... in a folder NAME beside a URDF or above it, else beside the URDF."""
    _, _, relative = address.partition("://")
    places = [*(above / relative for above in path.parents), path.parent / Path(relative).name]
    return next((place for place in places if place.is_file()), None)


def is_read(spec: mujoco.MjSpec, asset: mujoco.MjsMesh | mujoco.MjsHField) -> bool:
    """Whether the file of an asset is there, in a format that MuJoCo decodes."""
    file = Path(spec.modelfiledir, spec.meshdir, asset.file)
    return file.is_file() and (isinstance(asset, mujoco.MjsHField) or file.suffix.lower() in DECODED)


def leave_out(spec: mujoco.MjSpec, missing: Collection[str]) -> None:
    """Delete meshes and height fields by their files, and geoms. ValueError where one has an inertia."""
    assets = [asset for asset in (*spec.meshes, *spec.hfields) if asset.file in missing and asset.file]
    names = {asset.name: asset.file for asset in assets}
    geoms = [geom for geom in spec.geoms if {geom.meshname, geom.hfieldname} & names.keys()]
    for geom in filter(gives_inertia, geoms):
        body, file = list(spec.bodies).index(geom.parent), names[geom.meshname or geom.hfieldname]
        name = repr(geom.parent.name) if geom.parent.name else f"{body}, which has no name,"
        raise ValueError(f"the inertia of body {name} is that of its mesh {file}, which cannot be read")
    locked.delete_geoms(spec, geoms)


def moving_mass(model: mujoco.MjModel) -> float:
    return float(model.body_mass[moving(model)].sum())
