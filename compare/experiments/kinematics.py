"""Positions, angular velocities, Jacobians and convective terms."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ..engines import LABELS
from ..engines.mujoco.dynamics import convective_accelerations
from ..judge.check import Result
from ..judge.entries import has_own_scales
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR, reaches
from ..robots import Robot
from ..robots.states import Sample
from . import Experiment
from .quantities import QUANTITIES, Comparison, add_notes
from .setup import Setup

EXPERIMENT = Experiment(order=30, asks_of_own=("com_positions", "jacobians"), options=("--joints",))
COMPARED = ("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv")
DIFFERENCED, STEP = 20, 1e-6  # states at most, and step in s, of central differences of a Jacobian along the motion
CLEARLY = 1e3  # mj_jacDot is wrong if its error is larger by this factor


def compared(robot: Robot) -> list[str]:
    """The quantities that tmt's equations, or a user's own, give."""
    return [name for name in COMPARED if not robot.own or QUANTITIES[name].function in robot.own]


def skipped(robot: Robot) -> Finding | None:
    return None if compared(robot) else Finding("kinematics", "nothing_given")


def claim_values(robot: Robot) -> dict:
    landmarks = robot.landmarks(robot.posture()) if robot.landmarks else {}
    return {
        "quantities": compared(robot),
        "own_scales": has_own_scales(robot.tree, robot.is_read),
        "reach": reaches(robot.tree).max(),
        "origin": next((name for name, point in landmarks.items() if not np.any(point)), "origin"),
    }


def rows(setup: Setup) -> Result:
    result, names = Result("kinematics", label=LABELS[setup.robot.compared[0]]), compared(setup.robot)
    for sample in (setup.named, setup.random):
        comparison = Comparison(setup, sample)
        if setup.robot.tree.coordinates.balls and "v_conv" in names:
            by_rates = comparison.values("v_conv")[1]
            wrong = wrong_rates(setup, sample, by_rates, comparison.scale.v_conv)
            if wrong:
                replacement = convective_accelerations(comparison.engines[1], sample.q, sample.qd)
                comparison.returned["convective_terms"][1] = replacement
                result.find("wrong_rates", sample=sample.name, **wrong)
        comparison.agree(result, *names)
    add_notes(result, setup)
    return result


def wrong_rates(setup: Setup, sample: Sample, v_conv: np.ndarray, scale: np.ndarray) -> dict | None:
    """The errors of v_conv by mj_jacDot and by the accelerations at qacc = 0, m/s2, if only the first is wrong; else None.

    v_conv: by mj_jacDot, (states, m, 3). Decided at the first states, by central differences of mj_jacBodyCom along the
    motion: MuJoCo's mj_jacDot of 4.0 leaves out what a ball does to a slide that comes after it in the same body.
    """
    few, dynamics = sample.first(DIFFERENCED), setup.compared()["mujoco"]
    q, qd, v_conv, scale = few.q, few.qd, v_conv[: len(few.q)], scale[: len(few.q)]
    other, _ = convective_accelerations(dynamics, q, qd)
    if (np.abs(v_conv - other) <= FACTOR * EPS * scale).all():
        return None
    move = setup.robot.coordinates.move
    after, before = (dynamics.jacobians(move(q, dt * qd))[0] for dt in (STEP, -STEP))
    rate = np.einsum("sbci,si->sbc", after - before, qd) / (2.0 * STEP)
    by_rates, by_accelerations = (float(np.abs(values - rate).max()) for values in (v_conv, other))
    if by_accelerations > by_rates / CLEARLY:
        return None
    return {"by_rates": by_rates, "by_accelerations": by_accelerations}


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states")
