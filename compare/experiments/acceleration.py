"""Bias in motion, forward and inverse dynamics, energy and power."""

import numpy as np

import tmt
from tmt import literal
from tmt.derivation import method
from tmt.derivation.dual import seeded

from ..core.check import Result
from ..engines import WHOSE
from ..judge.agree import agree
from ..judge.entries import unit
from . import Experiment
from .quantities import check_wide, compared, figures, headline, overview
from .setup import Setup

__all__ = ["EXPERIMENT", "figures", "headline", "overview", "rows"]
EXPERIMENT = Experiment(order=60, options=("--joints",), diagnosed=True, overview="agreement")


def rows(setup: Setup) -> Result:
    robot, tree, (ours, theirs) = setup.robot, setup.robot.tree, setup.compared().values()
    whose, torques, damping = WHOSE[robot.compared[0]], unit(tree, "N m", "N"), np.array(tree.damping)
    work = "(tau - D qd).qd" if damping.any() else "tau.qd"
    energies = () if robot.own else ("energy", "potential energy")
    result, comparisons = compared(setup, "acceleration", "bias", "qdd", *energies)
    check_wide(result, comparisons)
    for comparison in comparisons:
        sample, scale, (qdd, engine_qdd, *_) = comparison.sample, comparison.scale, comparison.values("qdd")
        q, qd, tau, drag = sample.q, sample.qd, sample.tau, damping * sample.qd
        closing = scale.closing(scale.force(tau), comparison.acceleration_size())
        inertia = np.einsum("sij,sj->si", ours.mass_matrix(q), engine_qdd)
        springs = literal.spring_torque(q, tree) if tree.has_springs else 0.0
        back = inertia + comparison.values("bias")[0] + drag + springs
        agree(result, sample, f"tau from MuJoCo's qdd by {result.label}", torques, back, tau, closing)
        agree(
            result,
            sample,
            f"tau from {whose} qdd by mj_inverse",
            torques,
            tau,
            theirs.inverse(q, qd, qdd),
            closing,
        )
        if "energy" in robot.own:  # which may be zero at any position
            zero, rest = np.array(tree.zero)[None], np.zeros((1, tree.coordinates.nv))
            above = (engine.energy(q, qd) - engine.energy(zero, rest) for engine in (ours, theirs))
            agree(result, sample, "energy above the zero position's", "J", *above, scale.energy)

        power, size = np.einsum("si,si->s", tau - drag, qd), np.einsum("si,si->s", closing, np.abs(qd))
        for engine, accelerations in ((whose, qdd), (WHOSE["mujoco"], engine_qdd)):
            gained = energy_rate(tree, q, qd, accelerations)
            agree(result, sample, f"dE/dt - {work} at {engine} qdd", "W", gained, power, size)
    return result


def energy_rate(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Time derivative of the potential and kinetic energy along the motion, exact by dual numbers, W, (states,)."""
    state = seeded([*q.T, *qd.T], [*tree.coordinates.component_rates(q.T, qd.T), *qdd.T])
    q, qd = state[: q.shape[1]], state[q.shape[1] :]
    bodies = method.bodies(tree, q, qd)
    potential = method.potential(bodies, tree.gravity) + method.spring_energy(tree, q)
    return (potential + method.kinetic(bodies, qd, tree.armature)).slope
