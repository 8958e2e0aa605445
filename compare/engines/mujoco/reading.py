"""A file read as a Tree, as MuJoCo compiled it; what the Tree does not have is listed and switched off."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import tmt

from ...robots.file import RobotFile
from ...robots.placement import places_of
from .actuators import drive_of
from .engine import Mujoco
from .inventory import features, refuse, refuse_numbers, take_away, usable_keys
from .names import MEMBERS, Place, element_name, joint_name, joint_places, kind_of, moving, rotors, tensor
from .source import ModelError, Source


@dataclass(frozen=True)
class Reading(RobotFile):
    """A file, read once: what it is made of, and its numbers as those of a Tree."""

    bodies: tuple[int, ...]  # the numbers of the Tree's bodies in the model
    source: Source = field(repr=False, compare=False)

    @property
    def model(self) -> mujoco.MjModel:
        """Without what is only drawn."""
        return self.source.model

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of MuJoCo's compiler, one line each."""
        return self.source.warnings


def origin_of(mjcf: Any) -> Any:
    """What a user gives as a model: a path as a Path, MJCF text and models as they are. ModelError for another text."""
    if not isinstance(mjcf, str | PathLike) or str(mjcf).lstrip().startswith("<"):
        return mjcf
    if isinstance(mjcf, str) and not Path(mjcf).suffix and not os.path.exists(mjcf):
        raise ModelError(f"{mjcf[:60]!r} is neither the path of a file nor MJCF text")
    return Path(mjcf)


def read(origin: Source | Path | str | mujoco.MjModel) -> Reading:
    """The reading of an MJCF file (a Path), of MJCF text or of a compiled model, of which a copy is taken.

    ModelError, in one line, where it cannot be compared.
    """
    source = origin if isinstance(origin, Source) else Source(origin)
    model = source.model
    try:
        refuse(model)
        joints = joint_places(model)
        massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
        bodies = np.flatnonzero(massive & moving(model)).tolist()
        tree = tree_of(model, joints, bodies)
    except ValueError as error:
        raise ModelError(f"cannot compare {source}: {error}") from None
    name = bytes(model.names).partition(b"\0")[0].decode("utf-8", "replace").strip()
    keys = {k: element_name(model, "key", k) for k in np.flatnonzero(usable_keys(model)).tolist()}
    limited = zip(model.jnt_range.tolist(), model.jnt_limited)
    ranges = [tuple(limits) if is_limited else None for limits, is_limited in limited]
    integrator = mujoco.mjtIntegrator(model.opt.integrator)
    names_of_members = {member: name for name, member in MEMBERS.items()}
    return Reading(
        name=name if name.isprintable() and name != "MuJoCo Model" else "",  # MuJoCo's own for none
        path=source.origin if isinstance(source.origin, Path) else None,
        tree=tree,
        features=features(model),
        keyframes={name: model.key_qpos[k].copy() for k, name in keys.items()},
        qpos0=model.qpos0.copy(),
        ranges=tuple(ranges[place.joint] for place in joints.values()),
        integrator=names_of_members.get(integrator, integrator.name.removeprefix("mjINT_")),
        dt=float(model.opt.timestep),
        drive=drive_of(source, keys),
        bodies=tuple(bodies),
        source=source,
    )


def tree_of(compiled: mujoco.MjModel, joints: Mapping[str, Place], bodies: Sequence[int]) -> tmt.Tree:
    """The Tree of a compiled model.

    Frames are read where mj_kinematics puts them at the reference position: that honours `sameframe`. There
    all of the Tree's frames are parallel to the world's, so that everything is in world axes.
    """
    model, places = mujoco.MjModel.__copy__(compiled), list(joints.values())
    take_away(model)  # what a flag of the file disables is zero
    data, carrier = at_reference(model), carriers(model, places)
    free = {place.joint for place in places if kind_of(model, place.joint) == "free"}
    parents, anchors, axes, reference = [], [], [], []
    for i, place in enumerate(places):
        body, first = model.jnt_bodyid[place.joint], model.jnt_dofadr[place.joint]
        is_free = place.joint in free
        is_first = model.body_dofadr[body] == place.dofs.start
        parents.append(carrier[model.body_parentid[body]] if is_first else i - 1)
        anchors.append(np.zeros(3) if is_free else data.xanchor[place.joint])
        own_axes = np.eye(3) if is_free else data.xmat[body].reshape(3, 3).T  # of the body
        if place.kind == "ball":
            axes += [*own_axes]
        else:
            axes.append(own_axes[place.dofs.start - first] if is_free else data.xaxis[place.joint])
        has_reference = place.kind != "ball" and not is_free
        reference.append(model.qpos0[place.qpos.start] if has_reference else 0.0)
    joint_of_body = [carrier[body] for body in bodies]
    inertia = [tensor(data.ximat[body].reshape(3, 3), model.body_inertia[body]) for body in bodies]
    origins = [anchors[before] if before >= 0 else np.zeros(3) for before in parents]
    speeds = [i for place in places for i in place.dofs]
    numbers: dict[str, Any] = {
        "joint_names": list(joints),
        "parent": parents,
        "offset": [anchor - origin for anchor, origin in zip(anchors, origins)],
        "axis": axes,
        "damping": model.dof_damping[speeds],
        "body_names": [element_name(model, "body", body) for body in bodies],
        "body_joint": joint_of_body,
        "mass": model.body_mass[bodies],
        "com": [data.xipos[body] - anchors[joint] for body, joint in zip(bodies, joint_of_body)],
        "inertia": [(moments + moments.T) / 2.0 for moments in inertia],
        "gravity": model.opt.gravity,
        "kind": [place.kind for place in places],
        "armature": (model.dof_armature + rotors(model))[speeds],
        "stiffness": [model.jnt_stiffness[place.joint] for place in places],
        "rest": [model.qpos_spring[i] for place in places for i in place.qpos],
        "reference": reference,
    }
    return tmt.Tree(**numbers)


def at_reference(model: mujoco.MjModel) -> mujoco.MjData:
    """The model at the reference position, free bodies at the origin and not turned."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    for start in model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]:
        data.qpos[start : start + 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    mujoco.mj_kinematics(model, data)
    return data


def tree_with_sites(reading: Reading) -> tmt.Tree:
    """The Tree, with the frames of all bodies and sites of the file as its sites.

    A body's frame has its name; a site's `NAME site`, where a body has the name.
    """
    model = reading.model
    data, carrier = at_reference(model), carriers(model, list(joint_places(model).values()))
    origins = [*places_of(reading.tree)[0], np.zeros(3)]
    bodies = {element_name(model, "body", body): body for body in range(1, model.nbody)}
    names, joints = list(bodies), [carrier[body] for body in bodies.values()]
    positions, turns = list(data.xpos[1:]), list(data.xmat[1:])
    for site in range(model.nsite):
        name = element_name(model, "site", site)
        names.append(f"{name} site" if name in bodies else name)
        joints.append(carrier[model.site_bodyid[site]])
        positions.append(data.site_xpos[site])
        turns.append(data.site_xmat[site])
    sites: dict[str, Any] = {
        "site_names": names,
        "site_joint": joints,
        "site_offset": [position - origins[joint] for position, joint in zip(positions, joints)],
        "site_rotation": [turn.reshape(3, 3) for turn in turns],
    }
    return replace(reading.tree, **sites)


def carriers(model: mujoco.MjModel, places: Sequence[Place]) -> list[int]:
    """The last joint of the Tree that moves each body, -1: none."""
    last = {int(model.jnt_bodyid[place.joint]): i for i, place in enumerate(places)}
    return [last.get(body, -1) for body in model.body_weldid.tolist()]


def engine(reading: Reading, solution: Reading | None = None) -> Mujoco:
    """MuJoCo with all that the Tree does not have switched off.

    solution: the Tree and the order of the bodies are its; its joints have the names of the file's.
    ModelError if a joint does not move as many bodies there.
    """
    tree = (solution or reading).tree
    bodies = bodies_as_in(solution, reading) if solution else reading.bodies
    return Mujoco(reading.source, bodies, tree)


def bodies_as_in(solution: Reading, reading: Reading) -> list[int]:
    """The bodies of a file in the order of a solution's: on the same joint, by name or by order.

    Where joints follow each other in another order, bodies are on other joints, and are known by their names.
    """
    numbers: dict[int, int] = {}
    for joint in solution.tree.joint_names:
        bodies, stated = moved_by(reading, joint), moved_by(solution, joint)
        if len(bodies) != len(stated):
            named = dict(zip(reading.tree.body_names, reading.bodies))
            if named.keys() == {*solution.tree.body_names}:
                return [named[name] for name in solution.tree.body_names]
            counts = f"bodies with mass on joint {joint}: {len(bodies)}, in the solution {len(stated)}"
            raise ModelError(f"cannot compare the bodies of {reading.source}: {counts}")
        order = stated if stated.keys() == bodies.keys() else bodies
        numbers |= zip(stated.values(), [bodies[name] for name in order])
    return [numbers[body] for body in solution.bodies]


def moved_by(reading: Reading, joint: str) -> dict[str, int]:
    """The bodies that a joint of the Tree carries: their numbers by name."""
    tree = reading.tree
    bodies = zip(tree.body_names, reading.bodies, tree.body_joint)
    return {name: body for name, body, carrier in bodies if tree.joint_names[carrier] == joint}


def has_hinges(source: Source, names: Sequence[str]) -> bool:
    """Whether a file has exactly the hinges of these names, in any order."""
    joints = {joint_name(source.model, j): kind_of(source.model, j) for j in range(source.model.njnt)}
    return joints == dict.fromkeys(names, "hinge")


def parse(origin: Source | Path | str, tree: tmt.Tree) -> Mujoco:
    """The engine for a file (a Path) or MJCF text; ModelError if it has not exactly the hinges of the Tree.

    The body that a hinge moves is known by the hinge; one of several on a hinge, or fixed to the world, by
    its name.
    """
    source = origin if isinstance(origin, Source) else Source(origin)
    model, hinges, bodies = source.model, tree.joint_names, []
    try:
        refuse_numbers(model)
    except ValueError as error:
        raise ModelError(f"cannot compare {source}: {error}") from None
    names = {joint_name(model, j): j for j in range(model.njnt)}
    if not has_hinges(source, hinges):
        joints = ", ".join(f"{name} ({kind_of(model, j)})" for name, j in names.items()) or "none"
        expected = f"expected exactly the hinges {', '.join(hinges)}"
        raise ModelError(f"{source} has the joints {joints}; {expected}")
    for name, hinge in zip(tree.body_names, tree.body_joint):
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if hinge >= 0 and tree.body_joint.count(hinge) == 1:
            number = int(model.jnt_bodyid[names[hinges[hinge]]])
        if number < 0:
            raise ModelError(f"{source} has no body {name!r}, and no hinge identifies it")
        bodies.append(number)
    of_hinges = sorted(set(model.jnt_bodyid.tolist()))
    if len(set(bodies)) < len(bodies) == len(of_hinges):  # hinges of two bodies have exchanged their names
        bodies = of_hinges
    return Mujoco(source, bodies)
