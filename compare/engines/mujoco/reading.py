"""A file read as a Tree: the model as MuJoCo compiled it; all that the Tree does not have is listed and switched off."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

import tmt

from ...robots.actuators import Drive
from .actuators import drive_of
from .engine import Mujoco, methods_for
from .inventory import Feature, features, open_equalities, take_away
from .names import NAMES, Place, joint_name, joint_places, kind_of, moving, own_name, rotors, unique_name
from .refused import refuse
from .source import ModelError, compiled, editable, moves_the_same, name_of, without_geoms, without_visuals


@dataclass(frozen=True)
class Reading:
    """A file as it is compared."""

    source: Path | str | None  # a Path or MJCF text; None: a model that was compiled elsewhere
    name: str  # of the model, "": it has none that can be printed in a line
    tree: tmt.Tree
    features: tuple[Feature, ...]  # of the file, in a fixed order
    open_tree: tuple[str, ...]  # names of equalities that are off: the open tree is compared
    keyframes: Mapping[str, np.ndarray]  # positions of the Tree, (nq,), by the key's name or `key 0`
    qpos0: np.ndarray  # (nq,)
    # of each joint, rad or m, a ball's of the angle of its turn; None: unlimited
    ranges: tuple[tuple[float, float] | None, ...]
    warnings: tuple[str, ...]  # of MuJoCo's compiler, one line each
    integrator: str  # of the file, by MuJoCo's name
    dt: float  # s, of the file
    bodies: tuple[int, ...]  # the numbers of the Tree's bodies in the model
    drive: Drive  # actuators, tendons, gravity compensation; controls by the names of `keyframes`
    model: mujoco.MjModel = field(repr=False, compare=False)  # without what only contacts and pictures need

    @cached_property
    def full_model(self) -> mujoco.MjModel:
        """The model with its contacts, compiled at the first use."""
        return self.model if self.source is None else compiled_whole(self.source)[0]

    def __getstate__(self):
        return {name: value for name, value in self.__dict__.items() if name != "full_model"}


def read(source: Path | str | mujoco.MjModel) -> Reading:
    """The reading of an MJCF file (a Path), of MJCF text or of a compiled model, of which a copy is taken.

    ModelError, in one line, where it cannot be compared.
    """
    try:
        if isinstance(source, mujoco.MjModel):
            model, warnings, source = mujoco.MjModel.__copy__(source), (), None
        elif isinstance(source, Path | str):
            model, warnings = compiled_whole(source)
        else:
            raise ModelError(f"cannot read a {type(source).__name__}; expected a path, MJCF text or an MjModel")
        refuse(model)
        joints = joint_places(model)
        bodies = moving_bodies(model)
        tree = tree_of(model, joints, bodies)
    except ModelError:
        raise
    except ValueError as error:
        raise ModelError(f"cannot compare {name_of(source)}: {error}") from None
    return Reading(
        source=source,
        name=own_model_name(model),
        tree=tree,
        features=features(model),
        open_tree=open_equalities(model),
        keyframes=keyframes(model),
        qpos0=model.qpos0.copy(),
        ranges=tuple(limits(model, place) for place in joints.values()),
        warnings=warnings,
        integrator=integrator_name(model),
        dt=float(model.opt.timestep),
        bodies=tuple(bodies),
        drive=drive_of(model, source, bodies, list(keyframes(model))),
        model=light_model(source, model),
    )


def compiled_whole(source: Path | str) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The model without what is only drawn, and the compiler's warnings."""
    return compiled(source, lambda: without_visuals(editable(source)).compile())


def light_model(source: Path | str | None, whole: mujoco.MjModel) -> mujoco.MjModel:
    """The model without geoms if it moves the same, else the whole one (and of a compiled model)."""
    if source is None:
        return whole
    try:
        model, _ = compiled(source, lambda: without_geoms(editable(source)).compile())
    except ModelError:
        return whole
    return model if moves_the_same(whole, model) else whole


def engine(reading: Reading, solution: Reading | None = None) -> Mujoco:
    """MuJoCo with all that the Tree does not have switched off.

    solution: the Tree and the order of the bodies are its; its joints have the names of the file's. ModelError if a joint does
    not move as many bodies there.
    """
    tree = (solution or reading).tree
    return Mujoco(
        reading.model,
        tree.hinge_names,
        bodies_as_in(solution, reading) if solution else reading.bodies,
        reading.source,
        bare=True,
        warnings=reading.warnings,
        methods=methods_for(tree),
    )


def bodies_as_in(solution: Reading, reading: Reading) -> list[int]:
    """The numbers of the bodies of a file in the order of those of a solution: on the same joint, by name or by their order."""
    names, places, numbers = solution.tree.hinge_names, joint_places(reading.model), {}
    ours = moved_by(reading, [places[name] for name in names])
    theirs = moved_by(solution, joint_places(solution.model).values())
    for joint, bodies, stated in zip(names, ours, theirs, strict=True):
        if len(bodies) != len(stated):
            counts = f"joint {joint} moves {len(bodies)} bodies with mass, in the solution {len(stated)}"
            raise ModelError(f"cannot compare the bodies of {name_of(reading.source)}: {counts}")
        called = {reading.model.body(body).name: body for body in bodies}
        wanted = [solution.model.body(body).name for body in stated]
        numbers |= zip(stated, [called[name] for name in wanted] if set(wanted) == set(called) else bodies)
    return [numbers[body] for body in solution.bodies]


def moved_by(reading: Reading, places: Iterable[Place]) -> list[list[int]]:
    """Of each joint the bodies with mass that are fixed to the body that it moves, by number."""
    fixed_to = reading.model.body_weldid
    carriers = [reading.model.jnt_bodyid[place.joint] for place in places]
    return [[body for body in reading.bodies if fixed_to[body] == carrier] for carrier in carriers]


def moving_bodies(model: mujoco.MjModel) -> list[int]:
    """The numbers of the bodies that move and have mass or inertia."""
    massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
    return [int(body) for body in np.flatnonzero(massive & moving(model))]


def tree_of(whole: mujoco.MjModel, joints: Mapping[str, Place], bodies: list[int]) -> tmt.Tree:
    """The Tree of a compiled model.

    Frames are read where mj_kinematics puts them at the reference position: that honours `sameframe`. There all of the
    Tree's frames are parallel to the world's, so that everything is in world axes.
    """
    model = mujoco.MjModel.__copy__(whole)
    take_away(model)  # what a flag of the file disables is zero
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    for number in range(model.njnt):
        if kind_of(model, number) == "free":  # at the origin and not turned
            start = model.jnt_qposadr[number]
            data.qpos[start : start + 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    mujoco.mj_kinematics(model, data)
    places, carrier = list(joints.values()), carriers(model, joints)
    anchors = [np.zeros(3) if is_free(model, place) else data.xanchor[place.joint] for place in places]
    parents = [parent(model, i, place, carrier) for i, place in enumerate(places)]
    hangs = [carrier[body] for body in bodies]
    turns = data.ximat[bodies].reshape(-1, 3, 3)
    inertia = [R @ np.diag(moments) @ R.T for R, moments in zip(turns, model.body_inertia[bodies])]
    speeds = [i for place in places for i in place.dofs]
    single = [place.kind != "ball" and not is_free(model, place) for place in places]
    return tmt.Tree(
        hinge_names=list(joints),
        parent=parents,
        offset=[anchor - (anchors[before] if before >= 0 else 0.0) for anchor, before in zip(anchors, parents)],
        axis=[axis for place in places for axis in speed_axes(model, data, place)],
        damping=model.dof_damping[speeds],
        body_names=[own_name(model.body(body).name, "body", body) for body in bodies],
        body_hinge=hangs,
        mass=model.body_mass[bodies],
        com=[data.xipos[body] - anchors[joint] for body, joint in zip(bodies, hangs)],
        inertia=[(tensor + tensor.T) / 2.0 for tensor in inertia],
        gravity=model.opt.gravity,
        kind=[place.kind for place in places],
        armature=(model.dof_armature + rotors(model))[speeds],
        stiffness=[model.jnt_stiffness[place.joint] for place in places],
        rest=[model.qpos_spring[i] for place in places for i in place.qpos],
        reference=[model.qpos0[place.qpos.start] if one else 0.0 for place, one in zip(places, single)],
    )


def is_free(model: mujoco.MjModel, place: Place) -> bool:
    """Whether a joint of the Tree is part of a free joint."""
    return kind_of(model, place.joint) == "free"


def parent(model: mujoco.MjModel, number: int, place: Place, carrier: list[int]) -> int:
    """The joint of the Tree before one: in the same body, or the last that moves the body before."""
    body = int(model.jnt_bodyid[place.joint])
    first = model.body_dofadr[body] == place.dofs.start
    return carrier[model.body_parentid[body]] if first else number - 1


def speed_axes(model: mujoco.MjModel, data: mujoco.MjData, place: Place) -> np.ndarray:
    """The directions of a joint's speeds at the reference position: a ball's are the axes of its body."""
    if is_free(model, place):
        return np.eye(3) if place.kind == "ball" else np.eye(3)[[place.dofs.start - model.jnt_dofadr[place.joint]]]
    if place.kind == "ball":
        return data.xmat[model.jnt_bodyid[place.joint]].reshape(3, 3).T
    return data.xaxis[[place.joint]]


def carriers(model: mujoco.MjModel, joints: Mapping) -> list[int]:
    """The last joint of the Tree that moves each body, -1: none."""
    last = {int(model.jnt_bodyid[place.joint]): i for i, place in enumerate(joints.values())}
    joint_of_body = [-1]
    for body in range(1, model.nbody):
        joint_of_body.append(last.get(body, joint_of_body[model.body_parentid[body]]))
    return joint_of_body


def keyframes(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """The positions of the keyframes by their names, or `key 0`; the compiler has given quaternions length 1."""
    own = [model.key(number).name for number in range(model.nkey)]
    names = [unique_name(name, "key", number, own) for number, name in enumerate(own)]
    return {name: qpos.copy() for name, qpos in zip(names, model.key_qpos)}


def own_model_name(model: mujoco.MjModel) -> str:
    """The name of the model; "" if it has none that can be printed in a line."""
    name = bytes(model.names).partition(b"\0")[0].decode("utf-8", "replace").strip()
    return name if name.isprintable() and name != "MuJoCo Model" else ""  # MuJoCo's own for none


def limits(model: mujoco.MjModel, place: Place) -> tuple[float, float] | None:
    """The range of a joint, if the file gives it one."""
    low, high = map(float, model.jnt_range[place.joint])
    return (low, high) if model.jnt_limited[place.joint] else None


def integrator_name(model: mujoco.MjModel) -> str:
    """MuJoCo's name of the integrator of the file."""
    member = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    return next((name for name, known in NAMES.items() if known == member), member)


def load(path: str | Path, tree: tmt.Tree) -> Mujoco:
    """The engine for an MJCF file; ModelError if it cannot be read or does not have exactly the hinges of the Tree."""
    path = Path(path)
    model, warned = compiled(path, lambda: without_visuals(editable(path)).compile())
    return with_hinges(model, path, tree, warned)


def has_hinges(path: str | Path, names: Sequence[str]) -> bool:
    """Whether a file has exactly the hinges of these names, in any order; ModelError if it cannot be read."""
    path = Path(path)
    spec, _ = compiled(path, lambda: editable(path))
    hinges = [joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    return len(hinges) == len(spec.joints) and sorted(hinges) == sorted(names)


def parse(text: str, tree: tmt.Tree) -> Mujoco:
    """The engine for MJCF text."""
    return with_hinges(mujoco.MjModel.from_xml_string(text), text, tree)


def with_hinges(model: mujoco.MjModel, source: Path | str, tree: tmt.Tree, warned: tuple = ()) -> Mujoco:
    """The engine, if the model has exactly the hinges of the Tree; source: a Path or MJCF text."""
    hinges = tree.hinge_names
    names = [joint_name(model, j) for j in range(model.njnt)]
    kinds = [kind_of(model, j) for j in range(model.njnt)]
    if sorted(names) != sorted(hinges) or set(kinds) != {"hinge"}:
        joints = ", ".join(f"{name} ({kind})" for name, kind in zip(names, kinds)) or "none"
        raise ModelError(f"{name_of(source)} has the joints {joints}; expected exactly the hinges {', '.join(hinges)}")
    return Mujoco(model, hinges, bodies_of_hinges(model, source, tree), source, warnings=warned)


def bodies_of_hinges(model: mujoco.MjModel, source: Path | str, tree: tmt.Tree) -> list[int]:
    """The numbers of the Tree's bodies in the model: the body that a hinge moves, whatever its name.

    A body that is fixed to the world, or one of several on a hinge, is found by name; ModelError if there is none of that name.
    """
    numbers = []
    for name, hinge in zip(tree.body_names, tree.body_hinge):
        if hinge >= 0 and tree.body_hinge.count(hinge) == 1:
            numbers.append(int(model.jnt_bodyid[joint_places(model)[tree.hinge_names[hinge]].joint]))
            continue
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if number < 0:
            raise ModelError(f"{name_of(source)} has no body {name!r}, and no hinge identifies it")
        numbers.append(number)
    return numbers
