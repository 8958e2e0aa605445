"""Bias in motion, forward and inverse dynamics, energy and power."""

import numpy as np

import tmt
from tmt import literal
from tmt.derivation import method
from tmt.derivation.dual import seeded

from ..core.check import Result
from ..engines import WHOSE
from ..judge.entries import unit
from . import Experiment
from .quantities import check_wide, compared, headline, overview
from .setup import Setup

__all__ = ["EXPERIMENT", "headline", "overview", "rows"]
EXPERIMENT = Experiment(order=60, overview="agreement")


def rows(setup: Setup) -> Result:
    robot, tree, damping = setup.robot, setup.robot.tree, np.array(setup.robot.tree.damping)
    whose, torques = WHOSE[robot.compared[0]], unit(tree, "N m", "N")
    work = "(tau - D qd).qd" if damping.any() else "tau.qd"
    energies = () if robot.own else ("energy", "potential energy")
    if robot.own and "mass_matrix" not in robot.own:
        return compared(setup, "acceleration", "qdd")[0]
    result, comparisons = compared(setup, "acceleration", "bias", "qdd", *energies)
    check_wide(result, comparisons)
    for comparison in comparisons:
        engine, mujoco, *_ = comparison.engines
        sample, scale, (qdd, mujoco_qdd, *_) = comparison.sample, comparison.scale, comparison.values("qdd")
        q, qd, tau, drag = sample.q, sample.qd, sample.tau, damping * sample.qd
        closing = scale.closing(scale.force(tau), comparison.acceleration_size())
        inertia = np.einsum("sij,sj->si", engine.mass_matrix(q), mujoco_qdd)
        springs = literal.spring_torque(tree, q) if tree.has_springs else 0.0
        back = inertia + comparison.values("bias")[0] + drag + springs
        comparison.agree(f"tau from MuJoCo's qdd by {result.label}", torques, back, tau, closing)
        back = mujoco.inverse(q, qd, qdd)
        comparison.agree(f"tau from {whose} qdd by mj_inverse", torques, tau, back, closing)
        if not robot.own and sample is setup.named:
            C, Y = literal.coriolis_matrix(tree, q, qd), literal.regressor(tree, q, qd, qdd)
            moving = np.einsum("sij,sj->si", C, qd) + literal.gravity_balance(tree, q)
            size = np.einsum("sij,sj->si", scale.coriolis_matrix, np.abs(qd)) + scale.weight
            comparison.agree("bias from C qd", torques, moving, mujoco.bias(q, qd), size)
            of_bodies = Y @ tree.inertial_parameters + np.array(tree.armature) * qdd + drag + springs
            comparison.agree("tau from Y theta", torques, of_bodies, back, closing)
        if "energy" in robot.own:  # which may be zero at any position
            zero = np.array(tree.zero)[None], np.zeros((1, tree.coordinates.nv))
            above, mujoco_above = (side.energy(q, qd) - side.energy(*zero) for side in (engine, mujoco))
            comparison.agree("energy above the zero position's", "J", above, mujoco_above, scale.energy)

        power, size = np.einsum("si,si->s", tau - drag, qd), np.einsum("si,si->s", closing, np.abs(qd))
        for name, accelerations in ((whose, qdd), (WHOSE["mujoco"], mujoco_qdd)):
            gained = energy_rate(tree, q, qd, accelerations)
            comparison.agree(f"dE/dt - {work} at {name} qdd", "W", gained, power, size)
    return result


def energy_rate(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Time derivative of the energy along the motion, W, (states,), exact by dual numbers."""
    state = seeded([*q.T, *qd.T], [*tree.coordinates.component_rates(q.T, qd.T), *qdd.T])
    positions, speeds = state[: q.shape[1]], state[q.shape[1] :]
    bodies = method.bodies(tree, positions, speeds)
    potential = method.potential(bodies, tree.gravity) + method.spring_energy(tree, positions)
    return (potential + method.kinetic(bodies, speeds, tree.armature)).slope
