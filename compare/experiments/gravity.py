"""The torque that holds a robot against gravity."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import tmt
from tmt import literal

from ..engines import LABELS, WHOSE
from ..engines.tmt import Compiled
from ..judge.check import Result, agreement_headline
from ..judge.entries import Entries, has_own_scales, per_speed, scales, unit
from ..judge.scale import gravity_scale, spring_scale
from ..judge.words import ROWS_COMPILED, capital
from ..robots import Robot
from ..robots.case import Coordinates
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=50, asks_of_own=("gravity", "bias", "energy"), options=("--joints",), diagnosed=True)
headline = agreement_headline
MOST_ENERGIES = 150_000  # of one engine, at random states


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    springs = "; with the springs mj_inverse's at rest" if robot.tree.has_springs else ""
    whose = WHOSE[robot.compared[0]]
    of = "in both" if has_potential(robot) else "in MuJoCo"
    return (
        f"{capital(whose)} holding torque is MuJoCo's qfrc_bias at rest{springs}; {of} it is the gradient of the engine's own "
        f"potential energy; and {whose} torque, given to MuJoCo, leaves the {robot.noun} at rest."
    )


def has_potential(robot: Robot) -> bool:
    """Whether the equations that MuJoCo is compared with have an energy: a user's own need not."""
    return not robot.own or "energy" in robot.own


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    if has_own_scales(robot.tree, robot.is_read):
        return own_tolerance(robot.tree)
    scale = gravity_scale(robot.tree)
    return (
        f"Torques: 64 eps x {scale:.2f} N m, the sum of m g reach. Accelerations left: 64 eps x (cond(Mbar) + 1) x "
        f"|Mbar^-1| x {scale:.2f} N m. "
        "The gradient is exact, not a small difference: V is a + b cos q_i + c sin q_i in each hinge angle, so that "
        "dV/dq_i = (V(q_i + 90 deg) - V(q_i - 90 deg)) / 2. (Rounding the sum q_i + 90 deg costs about 2 eps of the scale.)"
    )


def own_tolerance(tree: tmt.Tree) -> str:
    """The same where each entry has its own scale."""
    of_springs = " + k (|q| + |rest|)" if tree.has_springs else ""
    rules = ["D_i = (V(q_i + 90 deg) - V(q_i - 90 deg)) / 2 of a hinge or a ball's turn about an axis of its own"]
    if tree.has_springs:
        rules[0] += ", and with a spring of a hinge D_i + (1 - pi / 2) (V(q_i + 360 deg) - V(q_i - 360 deg)) / (4 pi)"
    rules += ["(V(q_i + 1 m) - V(q_i - 1 m)) / 2 m of a slide"] * ("slide" in tree.kind)
    return (
        f"Torques: 64 eps x F_i, each joint's own: k m g L{of_springs}, of a slide k m g{of_springs}, summed over the bodies "
        "that it moves, each turned by k hinges and balls; L is the largest distance from the origin that a centre of mass can "
        "have at that state. Accelerations left: "
        "64 eps x |Mbar^-1| F, entry by entry. The gradient is exact, not a small difference: "
        f"dV/dq_i = {'; '.join(rules)}. Its scale is the potential energy's, the largest of those that it is made of."
    )


def has_exact_gradient(tree: tmt.Tree) -> np.ndarray:
    """For which of the speeds the rules above are exact, (nv,): not for a ball with a spring."""
    kinds, stiffness = np.array(per_speed(tree, tree.kind)), np.array(per_speed(tree, tree.stiffness))
    return (kinds != "ball") | (stiffness == 0.0)


def gradient(potential_energy: Callable, q: np.ndarray, tree: tmt.Tree) -> np.ndarray:
    """dV/dq by the rules above, N m or N, (states, nv), right where they are exact.

    potential_energy: V, J, of positions (..., nq). q: (states, nq). In an angle V is a + b cos + c sin, and a spring's k x^2 / 2:
    a turn ahead less a turn back leaves 4 pi k x alone. In a slide's length V is quadratic.
    """
    coordinates = Coordinates(tree.hinge_names, tree.kind)
    kinds, stiffness = np.array(per_speed(tree, tree.kind)), np.array(per_speed(tree, tree.stiffness))

    def difference(steps):
        """V at one step forward less V at one back, along each speed."""
        ahead, behind = (coordinates.move(q[:, None], sign * np.diag(steps)) for sign in (1.0, -1.0))
        return potential_energy(ahead) - potential_energy(behind)

    slopes = difference(np.where(kinds == "slide", 1.0, np.pi / 2)) / 2
    sprung = (kinds == "hinge") & (stiffness > 0.0)
    if sprung.any():
        springs = difference(np.where(sprung, 2 * np.pi, 0.0)) / (4 * np.pi)
        slopes = slopes + (1.0 - np.pi / 2) * springs * sprung
    return slopes


def rows(setup: Setup) -> Result:
    """Torques at each named posture and at random ones, their gradients, and the one engine's torque given to MuJoCo."""
    tree, is_read, (name, _) = setup.robot.tree, setup.robot.is_read, setup.robot.compared
    result, (ours, theirs) = Result("gravity", label=LABELS[name]), setup.compared().values()
    units, rates = unit(tree, "N m", "N"), unit(tree, "rad/s2", "m/s2")
    few = max(1, MOST_ENERGIES // (2 * tree.coordinates.nv))  # states: each takes two energies for each speed
    exact = has_exact_gradient(tree)
    for sample in (*setup.named.each(), setup.random):
        q, scale = sample.q, scales(tree, is_read, sample.q)
        held, engine_held = ours.gravity_balance(q), theirs.gravity_balance(q)
        result.agree(sample, "holding torque", units, held, engine_held, scale.weight, truth="gravity_balance")
        if sample is setup.random and not setup.robot.own:
            compiled = Compiled(tree).gravity_balance(q)
            result.agree(sample, "holding torque, compiled", units, compiled, engine_held, scale.weight)
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
    result.notes += [note for sample in (setup.named, setup.random) for note in sample.notes]
    if not has_potential(setup.robot):
        result.notes.append("The gradient of your potential energy is left out: your equations have no energy.")
    if not exact.all():
        result.notes.append("The gradient of V is left out for balls with a spring: there is no exact rule for it.")

    for sample in (setup.named, setup.random):
        q, scale = sample.q, scales(tree, is_read, sample.q)
        # the other way round, MuJoCo's torque would leave the same number with the other sign
        at_rest = np.zeros((len(q), tree.coordinates.nv))
        torque = ours.gravity_balance(q) + (literal.spring_torque(q, tree) if tree.has_springs else 0.0)
        left = theirs.acceleration(q, at_rest, torque)
        allowed = scale.acceleration(scale.holding, 0.0)
        result.agree(sample, f"qdd of MuJoCo under {WHOSE[name]} torque", rates, at_rest, left, allowed)
    result.notes += [ROWS_COMPILED] * (not setup.robot.own)
    return result


def gradient_scale(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """Of differences of V, each by one step along one speed, (states, nv) J."""
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
