"""The torque that holds a robot against gravity."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import tmt
from tmt import literal

from ..engines import LABELS, WHOSE
from ..judge.check import Result
from ..judge.entries import Entries, has_own_scales, per_speed, scales, unit
from ..judge.scale import gravity_scale, spring_scale
from ..robots import Robot
from ..robots.case import Coordinates
from . import Experiment
from .quantities import Comparison, add_notes
from .setup import Setup

EXPERIMENT = Experiment(order=50, asks_of_own=("gravity", "bias", "energy"), options=("--joints",), diagnosed=True)
MOST_ENERGIES = 150_000  # of one engine, at random states


def claim_values(robot: Robot) -> dict:
    return {
        "has_potential": has_potential(robot),
        "own_scales": has_own_scales(robot.tree, robot.is_read),
        "weight": gravity_scale(robot.tree),
    }


def has_potential(robot: Robot) -> bool:
    """Whether the equations that are compared with MuJoCo have an energy: a user's own need not."""
    return not robot.own or "energy" in robot.own


def has_exact_gradient(tree: tmt.Tree) -> np.ndarray:
    """For which speeds the rules of `gradient` are exact, (nv,): not for a ball with a spring."""
    kinds, stiffness = np.array(per_speed(tree, tree.kind)), np.array(per_speed(tree, tree.stiffness))
    return (kinds != "ball") | (stiffness == 0.0)


def gradient(potential_energy: Callable, q: np.ndarray, tree: tmt.Tree) -> np.ndarray:
    """dV/dq, N m or N, (states, nv), exact where `has_exact_gradient`.

    potential_energy: V, J, of positions (..., nq). q: (states, nq). In an angle V is a + b cos + c sin plus a spring's k x^2 / 2:
    the difference of V one turn forward and one turn back is 4 pi k x. In a slide's length V is quadratic.
    """
    coordinates = Coordinates(tree.hinge_names, tree.kind)
    kinds, stiffness = np.array(per_speed(tree, tree.kind)), np.array(per_speed(tree, tree.stiffness))

    def difference(steps):
        """V one step forward minus V one step back, along each speed."""
        forward, back = (coordinates.move(q[:, None], sign * np.diag(steps)) for sign in (1.0, -1.0))
        return potential_energy(forward) - potential_energy(back)

    slopes = difference(np.where(kinds == "slide", 1.0, np.pi / 2)) / 2
    sprung = (kinds == "hinge") & (stiffness > 0.0)
    if sprung.any():
        springs = difference(np.where(sprung, 2 * np.pi, 0.0)) / (4 * np.pi)
        slopes = slopes + (1.0 - np.pi / 2) * springs * sprung
    return slopes


def rows(setup: Setup) -> Result:
    """Torques at each named posture and at random ones, their gradients, and the one engine's torque applied to MuJoCo."""
    tree, is_read, (name, _) = setup.robot.tree, setup.robot.is_read, setup.robot.compared
    result, (ours, theirs) = Result("gravity", label=LABELS[name]), setup.compared().values()
    units, rates = unit(tree, "N m", "N"), unit(tree, "rad/s2", "m/s2")
    few = max(1, MOST_ENERGIES // (2 * tree.coordinates.nv))  # states: each takes two energies for each speed
    exact = has_exact_gradient(tree)
    for sample in (*setup.named.each(), setup.random):
        comparison = Comparison(setup, sample)
        comparison.agree(result, "holding torque")
        q, scale, (held, engine_held, *_) = sample.q, comparison.scale, comparison.values("holding torque")
        if "gravity" in setup.robot.own:
            still = ours.bias(q, np.zeros(tree.coordinates.nv))
            result.agree(sample, "yours: gravity - bias at rest", units, held, still, scale.weight)
        if tree.has_springs:
            held, engine_held = held + literal.spring_torque(q, tree), theirs.inverse(q, 0.0, 0.0)
            result.agree(sample, "holding torque, springs too", units, held, engine_held, scale.holding)
        if sample is not setup.random:
            result.curves.setdefault("postures", {})[sample.name] = {name: held[0], "mujoco": engine_held[0]}
        if not exact.any():
            continue
        part = sample.first(few)
        size = gradient_scale(tree, part.q)[:, exact] if has_own_scales(tree, is_read) else scale.potential_energy
        held, engine_held = held[:few, exact], engine_held[:few, exact]
        if has_potential(setup.robot):
            slope = gradient(ours.potential_energy, part.q, tree)[:, exact]
            result.agree(part, f"{result.label}: torque - dV/dq", units, held, slope, size)
        engine_slope = gradient(theirs.potential_energy, part.q, tree)[:, exact]
        result.agree(part, "MuJoCo: torque - dV/dq", units, engine_slope, engine_held, size)

    for sample in (setup.named, setup.random):
        q, scale = sample.q, scales(tree, is_read, sample.q)
        # the other way round, MuJoCo's torque would leave the same number with the other sign
        at_rest = np.zeros((len(q), tree.coordinates.nv))
        torque = ours.gravity_balance(q) + (literal.spring_torque(q, tree) if tree.has_springs else 0.0)
        left = theirs.acceleration(q, at_rest, torque)
        allowed = scale.acceleration(scale.holding, 0.0)
        result.agree(sample, f"qdd of MuJoCo under {WHOSE[name]} torque", rates, at_rest, left, allowed)
    if not has_potential(setup.robot):
        result.find("no_potential")
    if not exact.all():
        result.find("no_exact_gradient")
    add_notes(result, setup)
    return result


def gradient_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """Scale of the differences of V that `gradient` takes, (states, nv) J."""
    stiffness = np.array(per_speed(tree, tree.stiffness))
    slides = np.array(per_speed(tree, tree.kind)) == "slide"
    stretch = np.divide(spring_scale(tree, q), stiffness, out=np.zeros((len(q), len(slides))), where=stiffness > 0.0)
    stretched = stiffness * (stretch + np.where(slides, 1.0, 2 * np.pi)) ** 2 / 2
    lifted = slides * float(np.linalg.norm(tree.gravity)) * sum(tree.mass)
    return Entries(tree, q).potential_energy[:, None] + stretched + lifted


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances, draw_holding_torques  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states", ["holding torque"])
    yield partial(draw_holding_torques, result, robot)
