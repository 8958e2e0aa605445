"""Bias in motion, forward and inverse dynamics, energy and power."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

import tmt
from tmt import literal
from tmt.equations import method
from tmt.equations.dual import seeded

from ..engines import LABELS, WHOSE
from ..judge.check import Result
from ..judge.entries import has_own_scales, scales, unit
from ..judge.scale import gravity_scale
from ..robots import Robot
from ..truth.conserved import conserved
from . import Experiment
from .quantities import Comparison, add_notes
from .setup import Setup

EXPERIMENT = Experiment(order=60, options=("--joints",), diagnosed=True, overview="agreement")


def claim_values(robot: Robot) -> dict:
    own_scales = has_own_scales(robot.tree, robot.is_read)
    return {
        "own_scales": own_scales,
        "has_energy": not robot.own or "energy" in robot.own,
        "damped": any(robot.tree.damping),
        "momenta": [momentum.kind for momentum in conserved(robot.tree)] if own_scales else ["first hinge"],
        "weight": gravity_scale(robot.tree),
    }


def rows(setup: Setup) -> Result:
    """Each quantity at the named postures and at random states."""
    robot, tree, is_read = setup.robot, setup.robot.tree, setup.robot.is_read
    (name, _), (ours, theirs) = robot.compared, setup.compared().values()
    result, whose = Result("acceleration", label=LABELS[name]), WHOSE[name]
    still = robot.case("no gravity", gravity=False)
    weightless, momenta = ({}, ()) if robot.own else (setup.compared(still), conserved(tree))
    damping = np.array(tree.damping)
    work, lost = ("tau.qd", "") if not damping.any() else ("(tau - D qd).qd", " + D qd")
    torques = unit(tree, "N m", "N")
    for sample in (setup.named, setup.random):
        q, qd, tau, drag = sample.q, sample.qd, sample.tau, damping * sample.qd
        comparison = Comparison(setup, sample)
        comparison.agree(result, "bias", "qdd", *([] if robot.own else ["energy", "potential energy"]))
        scale, size, (qdd, engine_qdd, *_) = comparison.scale, comparison.acceleration_size(), comparison.values("qdd")
        force = scale.force(tau)
        closing, springs = scale.closing(force, size), literal.spring_torque(q, tree) if tree.has_springs else 0.0
        inertia = np.einsum("sij,sj->si", ours.mass_matrix(q), engine_qdd)
        back = inertia + comparison.values("bias")[0] + drag + springs
        result.agree(sample, f"tau from MuJoCo's qdd by {result.label}", torques, back, tau, closing)
        result.agree(sample, f"tau from {whose} qdd by mj_inverse", torques, tau, theirs.inverse(q, qd, qdd), closing)
        if "energy" in robot.own:  # which may be zero at any position
            zero, rest = np.array(tree.zero)[None], np.zeros((1, tree.coordinates.nv))
            above = (engine.energy(q, qd) - engine.energy(zero, rest) for engine in (ours, theirs))
            result.agree(sample, "energy above the zero position's", "J", *above, scale.energy)

        power = np.einsum("si,si->s", tau - drag, qd)
        for engine, accelerations in ((whose, qdd), (WHOSE["mujoco"], engine_qdd)):
            gained = rate(partial(total_energy, tree), tree, q, qd, accelerations)
            result.agree(sample, f"dE/dt - {work} at {engine} qdd", "W", gained, power, scale.power(force, size))

        scale = scales(still.tree, is_read, q, qd)
        for engine, dynamics in weightless.items():
            accelerations = dynamics.acceleration(q, qd, np.zeros_like(qd))
            size = scale.change(accelerations)
            for momentum in momenta:
                change = np.stack(rate(momentum.momentum, tree, q, qd, accelerations), axis=-1)
                quantity = f"d{momentum.name}/dt{lost} at {LABELS[engine]}'s qdd, no gravity"
                loss = momentum.effect(q, -drag - springs)
                result.agree(sample, quantity, momentum.unit, change, loss, momentum.size(q, size))
    if robot.own:
        result.find("only_of_own", has_energy="energy" in robot.own)
    elif len(momenta) == 0 or momenta[-1].kind == "linear":
        result.find("no_angular_momentum", joint=robot.joints[0])
    add_notes(result, setup)
    return result


def rate(quantity: Callable, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray | list:
    """Time derivative of quantity(q, qd) along the motion, exact by dual numbers: (states,), or a list of them."""
    rates = tree.coordinates.component_rates(q.T, qd.T)
    state = seeded([*q.T, *qd.T], [*rates, *qdd.T])
    value = quantity(state[: q.shape[1]], state[q.shape[1] :])
    return [part.slope for part in value] if isinstance(value, list) else value.slope


def total_energy(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
    """Potential and kinetic energy over any scalars, J."""
    parts = method.bodies(tree, q, qd)
    own = method.potential(parts, tree.gravity) + method.spring_energy(tree, q)
    return own + method.kinetic(parts, qd, tree.armature)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    quantities = ["bias", "qdd", "energy", "potential energy"]
    compared = [quantity for quantity in quantities if quantity in result.curves["random states"]]
    yield partial(draw_distances, result, "random states", compared)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import pictures_of_agreement  # matplotlib is for the process that draws

    yield from pictures_of_agreement(results)
