"""What can be said of one run: how far it went, when it left its start, when it diverged."""

from functools import lru_cache

import numpy as np

import tmt
from tmt import literal
from tmt.equations.composite import mass_matrix_and_bias  # the sum over bodies takes long for tens of joints

from ..robots.case import Case, Coordinates, rates_at
from .check import About, Result
from .rounding import NARROW
from .scale import EPS, FACTOR, gravity_scale

LEFT = 0.1  # rad or m: a held model that is so far from its posture has left it
MOVES = 0.1  # rad or m: a run without a torque that holds shows nothing if it moves less
ORDER_MARGIN = 0.15  # of an order that is measured
COARSE_STEP, STABLE_SO_LONG = (
    0.01,
    0.3,
)  # s: with such a step, or a coarser one, only RK4 is sure to be stable any longer


def step_in_words(case: Case, steps: int) -> str:
    """The step of a run of a case in words."""
    return f"dt = {case.duration:g}/{steps} s"


def required_time(case: Case, scheme: str, dt: float) -> float:
    """For how long a run of a case by a scheme must be judged, s."""
    judged = case.duration if case.scene.judged is None else case.scene.judged
    return judged if scheme == "rk4" or dt < COARSE_STEP else min(judged, STABLE_SO_LONG)


def movement_unit(coordinates: Coordinates) -> str:
    """The unit of the movements of all joints: rad, m, or rad or m."""
    return " or ".join(sorted(set(coordinates.units), reverse=True))


def check_movement(result: Result, where: str, moved: float, unit: str = "rad") -> None:
    """A run without a torque that holds moves, rad or m: one that stays shows nothing."""
    result.check(where, "movement", moved, MOVES, unit, rule="at least", about=About.PREDICTION)


def moved_from(q: np.ndarray, start: np.ndarray, coordinates: Coordinates | None = None) -> np.ndarray:
    """How far positions are from a start, as movements without signs; without coordinates no joint is a ball."""
    return np.abs(q - start if coordinates is None else coordinates.difference(q, start))


def deviation(q: np.ndarray, start: np.ndarray, coordinates: Coordinates | None = None) -> float:
    """The largest deviation of any joint of a run from where it started, rad or m; inf if the run diverged."""
    away = moved_from(q, start, coordinates).max()
    return float(away) if np.isfinite(away) else np.inf


def deviation_alive(q: np.ndarray, start: np.ndarray, coordinates: Coordinates | None = None) -> float:
    """The same, rad or m, of a run as long as it has not diverged."""
    return float(np.nanmax(moved_from(q, start, coordinates)))


def departure(t: np.ndarray, q: np.ndarray, coordinates: Coordinates | None = None) -> float | None:
    """The time at which a joint is first 0.1 rad, or m, from where it started; None: never."""
    away = ~(moved_from(q, q[0], coordinates).max(axis=1) <= LEFT)  # a run that is no number has left too
    return float(t[away][0]) if away.any() else None


def diverged_at(case: Case, t: np.ndarray, q: np.ndarray, qd: np.ndarray) -> float | None:
    """The first time at which a run of a case has stopped, is not finite, or is beyond its physical energy; None: never.

    Energy less the work of the constant torque cannot grow, on the stated robot. The bound is a gain of all energy that its
    motion can exchange: see `exchanged`.
    """
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    good = (
        np.where(finite[:, None], q, case.q if case.coordinates.has_balls else 0.0),
        np.where(finite[:, None], qd, 0.0),
    )
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that is about to end
        done = work(case, good[0])
        energy = literal.energy(*good, case.tree) - done
        bad = ~finite | ~(energy - energy[0] <= exchanged(case, good[0], done))
    return float(t[bad][0]) if bad.any() else None


def work(case: Case, q: np.ndarray) -> np.ndarray:
    """The work of the constant torque along a run, and of what a controller takes off by the positions, J, (times,).

    At hinges and slides it is that of the way from the start. A ball's torque is constant in axes that turn with it, and its work
    no function of the position: it is added up over the movements from state to state.
    """
    if case.tree.position_gain:
        mean = case.tau - (fed_back_at(case.tree, q) + fed_back_at(case.tree, q[0])) / 2.0  # as it is linear
        return np.sum(case.coordinates.difference(q, q[0]) * mean, axis=1)
    if not case.coordinates.has_balls:
        return (q - q[0]) @ case.tau
    if not case.tau.any():
        return np.zeros(len(q))
    return np.append(0.0, np.cumsum(case.coordinates.difference(q[1:], q[:-1]) @ case.tau))


def fed_back_at(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """What a controller takes off the torque at positions q (..., nq), N m or N, (..., nv)."""
    at = [at.start for at, by in tree.coordinates.places for _ in range(by.start, by.stop)]
    return q[..., at] @ np.array(tree.position_gain).T


def exchanged(case: Case, q: np.ndarray, done: np.ndarray) -> np.ndarray:
    """The energy that the motion of a case can have exchanged up to each state of a run, J, (times,).

    It starts with a kinetic energy and with that of its springs, and can gain the whole potential range of the stated robot,
    twice the sum of m g reach, and with servos what these have stored. No reach bounds what slides and a torque do: where that
    is more, it is the most work of the torque, `done`, and the weight times the way along the slides. Rounding may add 64 eps
    of 1 J for each inertia and stiffness of 1.
    """
    tree, coordinates = case.tree, case.coordinates
    # what slides have moved at the start belongs to the reach; what they move from there is the way that they have gone
    has = (
        2.0 * gravity_scale(case.robot.tree, case.posture)
        + literal.energy(q[0], case.v, tree)
        - literal.potential_energy(q[0], tree)
    )
    if tree.position_gain:
        # and its servos what they give back until they are without force; what they cannot is the work of a motor
        gain = np.array(tree.position_gain)
        pull, give = case.tau - fed_back_at(tree, q[0]), np.linalg.pinv(gain, hermitian=True)
        has = has + pull @ give @ pull / 2.0
        done = coordinates.difference(q, q[0]) @ (case.tau - gain @ give @ case.tau)
    if tree.has_springs:
        has = has + literal.spring_torque(q[0], tree) @ coordinates.difference(q[0], np.array(tree.rest)) / 2.0
    slides = [i for kind, _, by in coordinates.places.joints if kind == "slide" for i in range(by.start, by.stop)]
    weight = np.linalg.norm(tree.gravity) * np.sum(tree.mass)
    gone = weight * np.abs(coordinates.difference(q, q[0])[:, slides]).sum(axis=1)
    stiff = np.sum(tree.stiffness) + (np.trace(tree.position_gain) if tree.position_gain else 0.0)
    nothing = FACTOR * EPS * (sum_of_inertias(tree, tuple(q[0].tolist())) + stiff)
    return np.maximum(has, np.maximum.accumulate(np.abs(done) + gone)) + nothing


@lru_cache(maxsize=64)
def sum_of_inertias(tree: tmt.Tree, q: tuple[float, ...]) -> float:
    """The trace of Mbar at positions (nq,), kg m2 and kg: kept, for many runs start from the same ones."""
    inertia, _ = mass_matrix_and_bias(tree, list(q), [0.0] * tree.coordinates.nv)
    return float(np.trace(np.array(inertia, dtype=float)))


def number_or_none(number: float | None) -> float | None:
    """A number for a table: None if it is not finite."""
    return float(number) if number is not None and np.isfinite(number) else None


def number_or_nan(number: float | None) -> float:
    """A number from a table: NaN, which leaves a gap in a figure and fails a check, where there is none."""
    return np.nan if number is None else number


def leaves_no_digits(robot: object) -> str | None:
    """Why no run of a file's robot can be compared: rounding grows beyond what is judged in two steps; or None.

    A force that moves a joint at the rate r is rounded by 64 eps of itself, and a step multiplies what is off by (r dt)^2, where
    that is far more than 1: after two of them it is 64 eps (r dt)^4 of 1 rad or 1 m.
    """
    if not (robot.is_read and robot.cases_of_torque):
        return None
    case = min(robot.cases_of_torque, key=lambda case: case.scene.dt)
    rate, dt = max(rates_at(case.tree, case.q)), case.scene.dt
    if not FACTOR * EPS * (rate * dt) ** 4 > NARROW:
        return None
    return (
        f"the {robot.noun}'s fastest rate, {rate:.1e} per second, is {rate * dt:.1e} over a step of {dt:.1e} s, the finest of "
        "its scenes: rounding alone leaves no digits after two steps"
    )
