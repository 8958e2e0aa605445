"""Positions, angular velocities, Jacobians and convective terms."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ..engines import LABELS
from ..engines.mujoco.accelerations import convective_accelerations
from ..engines.tmt import Compiled
from ..judge.check import Result, agreement_headline
from ..judge.entries import has_own_scales, scales, unit
from ..judge.scale import EPS, FACTOR, reaches
from ..judge.words import ROWS_COMPILED, listed
from ..robots import Robot
from ..robots.states import Sample
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=30, asks_of_own=("com_positions", "jacobians"), options=("--joints",))
headline = agreement_headline
RATED, RATE_STEP = 20, 1e-6  # states at most, and step in s, of central differences of a Jacobian along the motion
CLEARLY = 1e3  # of two ways, one is wrong if it is off by so many times more


OF_COMPILED = ("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv")
OF_TMT = ("com_positions", "angular_velocities", "jacobians", "convective_terms")


def brought(robot: Robot) -> tuple[str, ...]:
    """What the equations that MuJoCo is compared with give of it."""
    return tuple(name for name in OF_TMT if not robot.own or name in robot.own)


def skipped(robot: Robot) -> str | None:
    """Why it cannot serve a robot, or None."""
    return None if brought(robot) else "your equations have neither com_positions nor jacobians"


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    if robot.own:
        named = {"com_positions": "x_b (xipos)", "jacobians": "T_b and B_b (mj_jacBodyCom, its rotation in body axes)"}
        which = listed([named[name] for name in brought(robot)])
        return f"Of what lies between positions and equations of motion yours agree with MuJoCo in {which}."
    positions = "hinge angles" if set(robot.tree.kind) == {"hinge"} else "joints' positions"
    return (
        f"Every quantity between the {positions} and the equations of motion has a counterpart in MuJoCo, so that a wrong "
        "one can be named: x_b and omega_b (xipos, cvel), T_b and B_b (mj_jacBodyCom, its rotation turned into body axes), "
        "and both convective terms (mj_jacDot times the rates)."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    if has_own_scales(robot.tree, robot.is_read):
        return (
            "64 eps x scale, each entry its own. With L the largest distance from the origin that a centre of mass can have at "
            "that state, S the sum of |rates| of the hinges and balls that move a body, V that of its slides: lengths L; T_b: L "
            "of a hinge or ball, 1 of a slide; B_b: 1; angular velocity S; convective terms 2 S (L S + V) and S^2; "
            "all times the number of hinges and balls that turn the body."
        )
    reach = reaches(robot.tree).max()
    return (
        f"64 eps x scale. Lengths and T_b: the largest distance from the {origin_in_words(robot)}, {reach:.2f} m. B_b: 1. "
        f"Angular velocity: the sum S of |rates|. Convective terms: {reach:.2f} m x S^2 and S^2."
    )


def origin_in_words(robot: Robot) -> str:
    """What is at the origin, in words: the landmark that is there."""
    landmarks = robot.landmarks(robot.posture()) if robot.landmarks else {}
    return next((name for name, point in landmarks.items() if not np.any(point)), "origin")


def rows(setup: Setup) -> Result:
    """Six quantities, or those that a user's own equations give, at the named postures and at random states."""
    result, tree = Result("kinematics", label=LABELS[setup.robot.compared[0]]), setup.robot.tree
    brings = brought(setup.robot)
    engines = tuple(setup.compared().values())
    per_speed = unit(tree, "m/rad", "m/m")
    for sample in (setup.named, setup.random):
        q, qd = sample.q, sample.qd
        scale = scales(tree, setup.robot.is_read, q, qd)
        found, faster = {}, {}
        if "com_positions" in brings:
            found["x_b"] = [dynamics.com_positions(q) for dynamics in engines]
        if "angular_velocities" in brings:
            found["omega_b"] = [dynamics.angular_velocities(q, qd) for dynamics in engines]
        if "jacobians" in brings:
            found["T_b"], found["B_b"] = zip(*(dynamics.jacobians(q) for dynamics in engines))
        if "convective_terms" in brings:
            convective = [dynamics.convective_terms(q, qd) for dynamics in engines]
            wrong = wrong_rates(setup, sample, convective[1][0], scale.v_conv) if tree.coordinates.balls else ""
            if wrong:
                convective[1] = convective_accelerations(engines[1], q, qd)
                result.notes.append(wrong)
            found["v_conv"], found["w_conv"] = zip(*convective)
        if sample is setup.random and not setup.robot.own:
            compiled = Compiled(tree)
            values = compiled.com_positions(q), compiled.angular_velocities(q, qd), *compiled.jacobians(q)
            faster = dict(zip(OF_COMPILED, (*values, *compiled.convective_terms(q, qd))))
        of_quantities = {
            "x_b": ("m", scale.positions, "com_positions"),
            "omega_b": ("rad/s", scale.angular_velocities, "angular_velocities"),
            "T_b": (per_speed, scale.T, "T"),
            "B_b": ("", scale.B, "B"),
            "v_conv": ("m/s2", scale.v_conv, "v_conv"),
            "w_conv": ("rad/s2", scale.w_conv, "w_conv"),
        }
        for quantity, (ours, theirs) in found.items():
            of, size, truth = of_quantities[quantity]
            result.agree(sample, quantity, of, ours, theirs, size, truth=truth)
            if quantity in faster:
                result.agree(sample, f"{quantity}, compiled", of, faster[quantity], theirs, size)
        result.notes += sample.notes
    result.notes += [ROWS_COMPILED] * (not setup.robot.own)
    return result


def wrong_rates(setup: Setup, sample: Sample, found: np.ndarray, scale: np.ndarray) -> str:
    """A sentence if mj_jacDot is not the rate of MuJoCo's own Jacobian, and accelerations at qacc = 0 are; else "".

    found: v_conv by mj_jacDot, (states, m, 3). Decided at the first states, by central differences of mj_jacBodyCom along the
    motion: MuJoCo's mj_jacDot of 4.0 leaves out what a ball does to a slide that comes after it in the same body.
    """
    few, dynamics = sample.first(RATED), setup.compared()["mujoco"]
    q, qd, found, scale = few.q, few.qd, found[: len(few.q)], scale[: len(few.q)]
    other, _ = convective_accelerations(dynamics, q, qd)
    if (np.abs(found - other) <= FACTOR * EPS * scale).all():
        return ""
    move = setup.robot.coordinates.move
    later, sooner = (dynamics.jacobians(move(q, dt * qd))[0] for dt in (RATE_STEP, -RATE_STEP))
    rate = np.einsum("sbci,si->sbc", later - sooner, qd) / (2.0 * RATE_STEP)
    by_rates, by_accelerations = (float(np.abs(values - rate).max()) for values in (found, other))
    if by_accelerations > by_rates / CLEARLY:
        return ""
    return (
        f"{sample.name}: MuJoCo's mj_jacDot is wrong here: times the rates it is up to {by_rates:.2g} m/s2 off the central "
        f"difference of MuJoCo's own mj_jacBodyCom, and its accelerations of the bodies at qacc = 0 (mj_objectAcceleration) are "
        f"{by_accelerations:.1g} m/s2 off. MuJoCo's convective terms are taken from these accelerations."
    )


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
