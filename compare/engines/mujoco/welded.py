"""Bodies of a compiled model that are welded to one another, or have no mass, as one body."""

from collections.abc import Mapping

import mujoco
import numpy as np

from ...robots.coordinates import point_inertia
from .names import element_name, tensor

# kg and kg m2: more than the least mass that MuJoCo compiles, less than the rounding of any other
LEAST = 1e-14
LIGHT = 1e-6  # share of a mass, and of M at the position zero, that stands for none
NO_MASS = "mass and inertia of moving bodies"  # in MuJoCo's message


def compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The model of a spec, also where a link without mass carries others, which MuJoCo refuses."""
    try:
        return spec.compile()
    except ValueError as error:
        if NO_MASS not in str(error) or spec.compiler.settotalmass > 0.0:
            raise
    stated = spec.compiler.boundmass, spec.compiler.boundinertia
    spec.compiler.boundmass = spec.compiler.boundinertia = LEAST
    model = spec.compile()
    spec.compiler.boundmass, spec.compiler.boundinertia = stated
    model.body_mass[model.body_mass == LEAST] = 0.0
    model.body_inertia[model.body_inertia == LEAST] = 0.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    if empty := [int(body) for body in model.jnt_bodyid if not model.body_subtreemass[body]]:
        raise ValueError(
            f"{element_name(model, 'body', empty[0])} moves, and neither it nor what it carries has mass"
        )
    return model


def welded_bodies(model: mujoco.MjModel) -> dict[int, int]:
    """The bodies with mass and without a joint, and the body to which each is fixed, 0: the world.

    Those of negligible mass are among them, fixed to the world.
    """
    massive = (model.body_mass > 0.0) | (model.body_inertia > 0.0).any(axis=1)
    bodies = np.flatnonzero(massive & (model.body_weldid != np.arange(model.nbody)))
    welded = {int(body): int(model.body_weldid[body]) for body in bodies}
    return welded | dict.fromkeys(negligible(model, np.flatnonzero(massive)), 0)


def negligible(model: mujoco.MjModel, bodies: np.ndarray) -> list[int]:
    """Those of some bodies that move with others, and whose mass and inertia stand for none."""
    most = LIGHT * model.body_subtreemass[model.body_weldid[bodies]]
    found = []
    for body in bodies[(model.body_mass[bodies] <= most) & (model.body_weldid[bodies] > 0)]:
        without = mujoco.MjModel.__copy__(model)
        without.body_mass[body] = without.body_inertia[body] = 0.0
        mujoco.mj_setConst(without, mujoco.MjData(without))
        if np.allclose(without.dof_M0, model.dof_M0, rtol=LIGHT, atol=0.0):
            found.append(int(body))
    return found


def join(model: mujoco.MjModel, welded: Mapping[int, int]) -> None:
    """Give each body the mass, centre of mass and inertia of those welded to it, which lose theirs."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    fixed = [body for body, base in welded.items() if not base]
    model.body_mass[fixed], model.body_inertia[fixed] = 0.0, 0.0
    for base in set(welded.values()) - {0}:
        group = [base, *(body for body, onto in welded.items() if onto == base)]
        masses, centres = model.body_mass[group], data.xipos[group]
        com, total = masses @ centres / masses.sum(), np.zeros((3, 3))
        for body, mass, centre in zip(group, masses, centres - com):
            total += tensor(data.ximat[body].reshape(3, 3), model.body_inertia[body])
            total += point_inertia(centre, mass)
        turn = data.xmat[base].reshape(3, 3)
        moments, axes = np.linalg.eigh(turn.T @ total @ turn)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        model.body_mass[group], model.body_inertia[group] = 0.0, 0.0
        model.body_mass[base], model.body_inertia[base] = masses.sum(), moments
        model.body_ipos[base] = turn.T @ (com - data.xpos[base])
        mujoco.mju_mat2Quat(model.body_iquat[base], axes.ravel())
        model.body_sameframe[base] = model.body_simple[base] = 0
        model.dof_simplenum[:] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))
