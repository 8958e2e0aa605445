"""A file read as a Tree: the model as MuJoCo compiled it; all that the Tree does not have is listed and switched off."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

import tmt

from ...robots.actuators import Drive
from .actuators import drive_of
from .engine import Mujoco, methods_for
from .inventory import Feature, features, refuse, refuse_numbers, take_away, usable_keys
from .names import NAMES, Place, element_name, joint_name, joint_places, kind_of, moving, rotors
from .source import ModelError, compiled, name_of


@dataclass(frozen=True)
class Reading:
    source: Path | str | None  # a Path or MJCF text; None: a model that was compiled elsewhere
    name: str  # of the model, "": it has none that can be printed in a line
    tree: tmt.Tree
    features: tuple[Feature, ...]  # of the file, in a fixed order
    keyframes: Mapping[str, np.ndarray]  # positions of the Tree, (nq,), by the key's name or `key 0`
    qpos0: np.ndarray  # (nq,)
    # of each joint, rad or m, a ball's of the angle of its turn; None: unlimited
    ranges: tuple[tuple[float, float] | None, ...]
    warnings: tuple[str, ...]  # of MuJoCo's compiler, one line each
    integrator: str  # of the file, by MuJoCo's name
    dt: float  # s, of the file
    bodies: tuple[int, ...]  # the numbers of the Tree's bodies in the model
    drive: Drive  # actuators, tendons, gravity compensation; controls by the names of `keyframes`
    model: mujoco.MjModel = field(repr=False, compare=False)  # without what is only drawn


def read(source: Path | str | mujoco.MjModel) -> Reading:
    """The reading of an MJCF file (a Path), of MJCF text or of a compiled model, of which a copy is taken.

    ModelError, in one line, where it cannot be compared.
    """
    if isinstance(source, mujoco.MjModel):
        model, warnings, source = mujoco.MjModel.__copy__(source), (), None
    elif isinstance(source, Path | str):
        model, warnings = compiled(source)
    else:
        raise ModelError(f"cannot read a {type(source).__name__}; expected a path, MJCF text or an MjModel")
    try:
        refuse(model)
        joints = joint_places(model)
        massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
        bodies = np.flatnonzero(massive & moving(model)).tolist()
        tree = tree_of(model, joints, bodies)
    except ValueError as error:
        raise ModelError(f"cannot compare {name_of(source)}: {error}") from None
    name = bytes(model.names).partition(b"\0")[0].decode("utf-8", "replace").strip()
    keys = {k: element_name(model, "key", k) for k in np.flatnonzero(usable_keys(model)).tolist()}
    ranges = [tuple(limits) for limits in model.jnt_range.tolist()]
    integrator = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    return Reading(
        source=source,
        name=name if name.isprintable() and name != "MuJoCo Model" else "",  # MuJoCo's own for none
        tree=tree,
        features=features(model),
        keyframes={name: model.key_qpos[k].copy() for k, name in keys.items()},
        qpos0=model.qpos0.copy(),
        ranges=tuple(
            ranges[place.joint] if model.jnt_limited[place.joint] else None for place in joints.values()
        ),
        warnings=warnings,
        integrator={member: name for name, member in NAMES.items()}.get(integrator, integrator),
        dt=float(model.opt.timestep),
        bodies=tuple(bodies),
        drive=drive_of(model, source, bodies, keys),
        model=model,
    )


def tree_of(whole: mujoco.MjModel, joints: Mapping[str, Place], bodies: list[int]) -> tmt.Tree:
    """The Tree of a compiled model.

    Frames are read where mj_kinematics puts them at the reference position: that honours `sameframe`. There all of the
    Tree's frames are parallel to the world's, so that everything is in world axes.
    """
    model = mujoco.MjModel.__copy__(whole)
    take_away(model)  # what a flag of the file disables is zero
    data, carrier = mujoco.MjData(model), carriers(model, joints)
    data.qpos[:] = model.qpos0
    free = {place.joint for place in joints.values() if kind_of(model, place.joint) == "free"}
    for start in model.jnt_qposadr[list(free)]:  # at the origin and not turned
        data.qpos[start : start + 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    mujoco.mj_kinematics(model, data)
    parents, anchors, axes, reference = [], [], [], []
    for i, place in enumerate(joints.values()):
        body, is_ball, is_free = model.jnt_bodyid[place.joint], place.kind == "ball", place.joint in free
        first = model.body_dofadr[body] == place.dofs.start
        parents.append(carrier[model.body_parentid[body]] if first else i - 1)
        anchors.append(np.zeros(3) if is_free else data.xanchor[place.joint])
        reference.append(0.0 if is_ball or is_free else model.qpos0[place.qpos.start])
        if is_free:
            axes += [*np.eye(3)] if is_ball else [np.eye(3)[place.dofs.start - model.jnt_dofadr[place.joint]]]
        else:  # a ball's are the axes of its body
            axes += [*data.xmat[body].reshape(3, 3).T] if is_ball else [data.xaxis[place.joint]]
    hangs = [carrier[body] for body in bodies]
    turns = data.ximat[bodies].reshape(-1, 3, 3)
    inertia = [R @ np.diag(moments) @ R.T for R, moments in zip(turns, model.body_inertia[bodies])]
    speeds = [i for place in joints.values() for i in place.dofs]
    return tmt.Tree(
        joint_names=list(joints),
        parent=parents,
        offset=[
            anchor - (anchors[before] if before >= 0 else 0.0) for anchor, before in zip(anchors, parents)
        ],
        axis=axes,
        damping=model.dof_damping[speeds],
        body_names=[element_name(model, "body", body) for body in bodies],
        body_joint=hangs,
        mass=model.body_mass[bodies],
        com=[data.xipos[body] - anchors[joint] for body, joint in zip(bodies, hangs)],
        inertia=[(tensor + tensor.T) / 2.0 for tensor in inertia],
        gravity=model.opt.gravity,
        kind=[place.kind for place in joints.values()],
        armature=(model.dof_armature + rotors(model))[speeds],
        stiffness=[model.jnt_stiffness[place.joint] for place in joints.values()],
        rest=[model.qpos_spring[i] for place in joints.values() for i in place.qpos],
        reference=reference,
    )


def carriers(model: mujoco.MjModel, joints: Mapping) -> list[int]:
    """The last joint of the Tree that moves each body, -1: none."""
    last = {int(model.jnt_bodyid[place.joint]): i for i, place in enumerate(joints.values())}
    joint_of_body = [-1]
    for body in range(1, model.nbody):
        joint_of_body.append(last.get(body, joint_of_body[model.body_parentid[body]]))
    return joint_of_body


def engine(reading: Reading, solution: Reading | None = None) -> Mujoco:
    """MuJoCo with all that the Tree does not have switched off.

    solution: the Tree and the order of the bodies are its; its joints have the names of the file's. ModelError if a joint does
    not move as many bodies there.
    """
    tree = (solution or reading).tree
    bodies = bodies_as_in(solution, reading) if solution else reading.bodies
    model, source, methods = reading.model, reading.source, methods_for(tree)
    return Mujoco(
        model, tree.joint_names, bodies, source, bare=True, warnings=reading.warnings, methods=methods
    )


def bodies_as_in(solution: Reading, reading: Reading) -> list[int]:
    """The numbers of the bodies of a file in the order of those of a solution: on the same joint, by name or by their order."""
    numbers = {}
    for joint in solution.tree.joint_names:
        bodies, stated = moved_by(reading, joint), moved_by(solution, joint)
        if len(bodies) != len(stated):
            counts = f"bodies with mass on joint {joint}: {len(bodies)}, in the solution {len(stated)}"
            raise ModelError(f"cannot compare the bodies of {name_of(reading.source)}: {counts}")
        order = stated if stated.keys() == bodies.keys() else bodies
        numbers |= zip(stated.values(), [bodies[name] for name in order])
    return [numbers[body] for body in solution.bodies]


def moved_by(reading: Reading, joint: str) -> dict[str, int]:
    """The bodies that a joint of the Tree carries: their numbers by name."""
    tree = reading.tree
    bodies = zip(tree.body_names, reading.bodies, tree.body_joint)
    return {name: body for name, body, hinge in bodies if tree.joint_names[hinge] == joint}


def has_hinges(path: str | Path, names: Sequence[str]) -> bool:
    """Whether a file has exactly the hinges of these names, in any order; ModelError if it cannot be read."""
    model, _ = compiled(Path(path))
    is_hinge = (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE).all()
    return bool(is_hinge) and sorted(joint_name(model, j) for j in range(model.njnt)) == sorted(names)


def load(path: str | Path, tree: tmt.Tree) -> Mujoco:
    return parse(Path(path), tree)


def parse(source: Path | str, tree: tmt.Tree) -> Mujoco:
    """The engine for a file (a Path) or MJCF text; ModelError if it does not have exactly the hinges of the Tree.

    The body that a hinge moves is known by the hinge; one of several on a hinge, or fixed to the world, by its name.
    """
    (model, warnings), hinges, bodies = compiled(source), tree.joint_names, []
    try:
        refuse_numbers(model)
    except ValueError as error:
        raise ModelError(f"cannot compare {name_of(source)}: {error}") from None
    names = {joint_name(model, j): j for j in range(model.njnt)}
    kinds = [kind_of(model, j) for j in names.values()]
    if sorted(names) != sorted(hinges) or set(kinds) != {"hinge"}:
        joints = ", ".join(f"{name} ({kind})" for name, kind in zip(names, kinds)) or "none"
        raise ModelError(
            f"{name_of(source)} has the joints {joints}; expected exactly the hinges {', '.join(hinges)}"
        )
    for name, hinge in zip(tree.body_names, tree.body_joint):
        if hinge >= 0 and tree.body_joint.count(hinge) == 1:
            bodies.append(int(model.jnt_bodyid[names[hinges[hinge]]]))
        elif (number := mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)) >= 0:
            bodies.append(number)
        else:
            raise ModelError(f"{name_of(source)} has no body {name!r}, and no hinge identifies it")
    of_hinges = sorted(set(model.jnt_bodyid.tolist()))
    if len(set(bodies)) < len(bodies) == len(of_hinges):  # hinges of two bodies have exchanged their names
        bodies = of_hinges
    return Mujoco(model, hinges, bodies, source, warnings=warnings)
