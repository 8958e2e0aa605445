"""A file read as a Tree: the model as MuJoCo compiled it, with what the Tree has not listed and switched off."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

import tmt

from .dynamics import NAMES
from .engine import Mujoco
from .file import compiled
from .inventory import Feature, features, open_equalities, refuse, refuse_callbacks
from .joints import kind_of, moved, own_name, places, reference
from .lock import ModelError, editable, name_of
from .rotors import rotors


@dataclass(frozen=True)
class Reading:
    """What a file is to be compared as."""

    source: Path | str
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
    model: mujoco.MjModel = field(repr=False, compare=False)


def read(source: Path | str) -> Reading:
    """The reading of an MJCF file (a Path) or of MJCF text; ModelError, in one line, where it cannot be compared."""
    try:
        refuse_callbacks()
        model, warnings = compiled(source, lambda: without_fusing(editable(source)))
        refuse(model)
        if not model.njnt:
            raise ValueError("it has no joint; at least one is expected")
        joints = places(model)
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
        model=model,
    )


def engine(reading: Reading) -> Mujoco:
    """MuJoCo with all of it switched off that the Tree has not."""
    return Mujoco(reading.model, reading.tree.hinge_names, reading.bodies, reading.source, bare=True)


def without_fusing(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled model with every body of the file: fusing changes nothing that moves, and renumbers bodies."""
    spec.compiler.fusestatic = False
    return spec.compile()


def moving_bodies(model: mujoco.MjModel) -> list[int]:
    """The numbers of the bodies that move and have mass or inertia."""
    massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
    return [int(body) for body in np.flatnonzero(massive & moved(model))]


def tree_of(model: mujoco.MjModel, joints: Mapping, bodies: list[int]) -> tmt.Tree:
    """The Tree of a compiled model.

    Frames are read where mj_kinematics puts them at the reference position: that honours `sameframe`. There all of the
    Tree's frames are parallel to the world's, so that everything is in world axes.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = reference(model)
    mujoco.mj_kinematics(model, data)
    carrier = carriers(model, joints)  # of each body the last joint of the Tree that moves it, -1: none
    listed = list(joints.values())
    parent, anchor = [], np.array([data.xanchor[place.joint] for place in listed])
    axis, springs = [], []
    for i, place in enumerate(listed):
        body = int(model.jnt_bodyid[place.joint])
        first = place.joint == model.body_jntadr[body] and place.dofs.start == model.jnt_dofadr[place.joint]
        parent.append(carrier[model.body_parentid[body]] if first else i - 1)
        free = kind_of(model, place.joint) == "free"
        if free:
            anchor[i] = 0.0
        if place.kind == "ball":
            axis += list(np.eye(3) if free else data.xmat[body].reshape(3, 3).T)
        else:
            axis.append(
                np.eye(3)[place.dofs.start - model.jnt_dofadr[place.joint]] if free else data.xaxis[place.joint]
            )
        springs.append(model.jnt_stiffness[place.joint])
    flags = model.opt.disableflags
    inertia = [R @ np.diag(i) @ R.T for R, i in zip(data.ximat.reshape(-1, 3, 3)[bodies], model.body_inertia[bodies])]
    hangs = [carrier[body] for body in bodies]
    at = [i for place in listed for i in place.qpos]
    by = [i for place in listed for i in place.dofs]
    return tmt.Tree(
        hinge_names=list(joints),
        parent=parent,
        offset=[a - (anchor[p] if p >= 0 else 0.0) for a, p in zip(anchor, parent)],
        axis=axis,
        damping=np.where(flags & int(mujoco.mjtDisableBit.mjDSBL_DAMPER), 0.0, model.dof_damping[by]),
        body_names=[own_name(model.body(body).name, "body", body) for body in bodies],
        body_hinge=hangs,
        mass=model.body_mass[bodies],
        com=[data.xipos[body] - anchor[i] for body, i in zip(bodies, hangs)],
        inertia=[(tensor + tensor.T) / 2.0 for tensor in inertia],
        gravity=model.opt.gravity * (not flags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)),
        kind=[place.kind for place in listed],
        armature=(model.dof_armature + rotors(model))[by],
        stiffness=np.where(flags & int(mujoco.mjtDisableBit.mjDSBL_SPRING), 0.0, springs),
        rest=model.qpos_spring[at],
        reference=[
            model.qpos0[place.qpos.start] if kind_of(model, place.joint) in ("hinge", "slide") else 0.0
            for place in listed
        ],
    )


def carriers(model: mujoco.MjModel, joints: Mapping) -> list[int]:
    """Of each body the last joint of the Tree that moves it, -1: none."""
    last = {int(model.jnt_bodyid[place.joint]): i for i, place in enumerate(joints.values())}
    found = [-1]
    for body in range(1, model.nbody):
        found.append(last.get(body, found[model.body_parentid[body]]))
    return found


def keyframes(model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """The positions of the keyframes by their names, or `key 0`; quaternions of length 1."""
    found = {}
    for number in range(model.nkey):
        qpos = model.key_qpos[number].copy()
        mujoco.mj_normalizeQuat(model, qpos)
        found[own_name(model.key(number).name, "key", number)] = qpos
    return found


def own_model_name(model: mujoco.MjModel) -> str:
    """What the file calls its model; "" where it does not, or in no line of text."""
    name = bytes(model.names).partition(b"\0")[0].decode("utf-8", "replace").strip()
    return name if name.isprintable() and name != "MuJoCo Model" else ""  # MuJoCo's own for none


def limits(model: mujoco.MjModel, place) -> tuple[float, float] | None:
    """The range of a joint, if the file gives it one."""
    low, high = map(float, model.jnt_range[place.joint])
    return (low, high) if model.jnt_limited[place.joint] else None


def integrator_name(model: mujoco.MjModel) -> str:
    """MuJoCo's name of the integrator that the file asks for."""
    member = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
    return next((name for name, known in NAMES.items() if known == member), member)
