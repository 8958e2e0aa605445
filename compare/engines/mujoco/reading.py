"""A file read as a Tree: the model as MuJoCo compiled it, with what the Tree has not listed and switched off."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

import tmt

from ...robots.actuators import Drive
from .actuators import drive_of
from .engine import Mujoco, methods_for
from .file import compiled
from .flags import NAMES
from .inventory import Feature, features, open_equalities, refuse, refuse_callbacks, take_away
from .joints import Place, joint_places, kind_of, moved, others_apart, own_name, reference_qpos
from .light import moves_the_same, without_geoms, without_visuals
from .lock import ModelError, editable, name_of
from .rotors import rotors
from .values import refuse_values


@dataclass(frozen=True)
class Reading:
    """What a file is to be compared as."""

    source: Path | str | None  # a Path or MJCF text; None: a model that was compiled elsewhere
    name: str  # of the model, "": it has none that can stand in a line
    tree: tmt.Tree
    features: tuple[Feature, ...]  # of the file, in a fixed order; those that it has
    open_tree: tuple[str, ...]  # names of equalities that are off: the open tree is compared
    keyframes: Mapping[str, np.ndarray]  # positions of the Tree, (nq,), by the key's name or `key 0`
    qpos0: np.ndarray  # (nq,)
    ranges: tuple[
        tuple[float, float] | None, ...
    ]  # of each joint, rad or m, a ball's of the angle of its turn; None: unlimited
    warnings: tuple[str, ...]  # of MuJoCo's compiler, one line each
    integrator: str  # of the file, by MuJoCo's name
    dt: float  # s, of the file
    bodies: tuple[int, ...]  # the numbers of the Tree's bodies in the model
    drive: Drive  # actuators, tendons, gravity compensation; controls by the names of `keyframes`
    model: mujoco.MjModel = field(repr=False, compare=False)  # without what only contacts and pictures need, see light

    @cached_property
    def full_model(self) -> mujoco.MjModel:
        """The model with its contacts, compiled when it is first asked for, and once."""
        return self.model if self.source is None else compiled_whole(self.source)[0]

    def __getstate__(self):
        return {name: value for name, value in self.__dict__.items() if name != "full_model"}


def read(source: Path | str | mujoco.MjModel) -> Reading:
    """The reading of an MJCF file (a Path), of MJCF text or of a compiled model, of which a copy is taken.

    ModelError, in one line, where it cannot be compared.
    """
    try:
        refuse_callbacks()
        if isinstance(source, mujoco.MjModel):
            model, warnings, source = mujoco.MjModel.__copy__(source), (), None
        elif isinstance(source, Path | str):
            model, warnings = compiled_whole(source)
        else:
            raise ModelError(f"a {type(source).__name__} cannot be read; a path, MJCF text or an MjModel is expected")
        if not model.njnt:
            raise ValueError("it has no joint; at least one is expected")
        refuse(model)
        refuse_values(model)
        joints = joint_places(model)
        bodies = moving_bodies(model)
        tree = tree_of(model, joints, bodies)
    except ModelError:
        raise
    except ValueError as error:
        raise ModelError(f"{name_of(source)} cannot be compared: {error}") from None
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
    """The model with everything but what is only drawn, and what the compiler warns of, see file.compiled."""
    return compiled(source, lambda: without_visuals(editable(source)).compile())


def light_model(source: Path | str | None, whole: mujoco.MjModel) -> mujoco.MjModel:
    """The model without geoms, where it moves the same; else the whole one. Of a compiled model nothing can be taken out."""
    if source is None:
        return whole
    try:
        model, _ = compiled(source, lambda: without_geoms(editable(source)).compile())
    except ModelError:
        return whole
    return model if moves_the_same(whole, model) else whole


def engine(reading: Reading, solution: Reading | None = None) -> Mujoco:
    """MuJoCo with all of it switched off that the Tree has not.

    solution: its Tree, whose joints are called as those of the file, counts, and the bodies are in its order; ModelError if a
    joint does not move as many bodies there.
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
    names, places, found = solution.tree.hinge_names, joint_places(reading.model), {}
    ours = moved_by(reading, [places[name] for name in names])
    theirs = moved_by(solution, joint_places(solution.model).values())
    for joint, bodies, stated in zip(names, ours, theirs, strict=True):
        if len(bodies) != len(stated):
            counts = f"joint {joint} moves {len(bodies)} bodies with mass, and {len(stated)} in the solution"
            raise ModelError(f"{name_of(reading.source)} cannot be compared body by body: {counts}")
        called = {reading.model.body(body).name: body for body in bodies}
        wanted = [solution.model.body(body).name for body in stated]
        found |= zip(stated, [called[name] for name in wanted] if set(wanted) == set(called) else bodies)
    return [found[body] for body in solution.bodies]


def moved_by(reading: Reading, places: Iterable[Place]) -> list[list[int]]:
    """Of each joint the bodies with mass that are fixed to the body that it moves, by number."""
    fixed_to = reading.model.body_weldid
    carriers = [reading.model.jnt_bodyid[place.joint] for place in places]
    return [[body for body in reading.bodies if fixed_to[body] == carrier] for carrier in carriers]


def moving_bodies(model: mujoco.MjModel) -> list[int]:
    """The numbers of the bodies that move and have mass or inertia."""
    massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
    return [int(body) for body in np.flatnonzero(massive & moved(model))]


def tree_of(whole: mujoco.MjModel, joints: Mapping[str, Place], bodies: list[int]) -> tmt.Tree:
    """The Tree of a compiled model.

    Frames are read where mj_kinematics puts them at the reference position: that honours `sameframe`. There all of the
    Tree's frames are parallel to the world's, so that everything is in world axes.
    """
    model = mujoco.MjModel.__copy__(whole)
    take_away(model)  # what a flag of the file disables is zero
    data = mujoco.MjData(model)
    data.qpos[:] = reference_qpos(model)
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
    """Of each body the last joint of the Tree that moves it, -1: none."""
    last = {int(model.jnt_bodyid[place.joint]): i for i, place in enumerate(joints.values())}
    found = [-1]
    for body in range(1, model.nbody):
        found.append(last.get(body, found[model.body_parentid[body]]))
    return found


def keyframes(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """The positions of the keyframes by their names, or `key 0`; the compiler has given quaternions length 1."""
    own = [model.key(number).name for number in range(model.nkey)]
    names = [others_apart(name, "key", number, own) for number, name in enumerate(own)]
    return {name: qpos.copy() for name, qpos in zip(names, model.key_qpos)}


def own_model_name(model: mujoco.MjModel) -> str:
    """What the file calls its model; "" where it does not, or in no line of text."""
    name = bytes(model.names).partition(b"\0")[0].decode("utf-8", "replace").strip()
    return name if name.isprintable() and name != "MuJoCo Model" else ""  # MuJoCo's own for none


def limits(model: mujoco.MjModel, place: Place) -> tuple[float, float] | None:
    """The range of a joint, if the file gives it one."""
    low, high = map(float, model.jnt_range[place.joint])
    return (low, high) if model.jnt_limited[place.joint] else None


def integrator_name(model: mujoco.MjModel) -> str:
    """MuJoCo's name of the integrator that the file asks for."""
    member = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    return next((name for name, known in NAMES.items() if known == member), member)
