"""Properties of one run: how far it moved, when it left its start, when it diverged."""

from functools import lru_cache

import numpy as np

import tmt

from ..core.check import About, Result
from ..core.finding import Finding
from ..robots import Robot
from ..robots.case import Case
from ..robots.coordinates import Coordinates, rates_at
from .entries import Entries
from .rounding import NARROW
from .scale import EPS, FACTOR, gravity_scale

LEFT = 0.1  # rad or m: the distance at which a held model has left its posture
MOVES = 0.1  # rad or m: the least movement of a run without a holding torque that tests anything
LEAST_JUDGED = 0.1  # the share of its time for which a run must be judged, if its scene states no minimum
RESTS = 1e-9  # rad or m, and per s: what moves less only rounds
STILL = 1e-3  # of the largest movement of its unit: a joint that moves less is not what a run tests
COARSE_STEP = 0.01  # s: from this step on, methods other than RK4 may be unstable after STABLE_TIME
STABLE_TIME = 0.3  # s


def step_in_words(case: Case, steps: int) -> str:
    """The step of a run, for a label."""
    return f"dt = {case.duration:g}/{steps} s"


def required_time(case: Case, scheme: str, dt: float) -> float:
    """The shortest time, s, for which a run by a scheme must be judged; 0: the scene states none."""
    judged = case.duration if case.scene.judged is None else case.scene.judged
    return judged if scheme == "rk4" or dt < COARSE_STEP else min(judged, STABLE_TIME)


def widest_judged(case: Case, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The width from which on the band judges a movement or a speed no more, (2 nv,) rad or m, then per s.

    NARROW for movements; and never more than what itself moves in the run q (times, nq), v (times, nv). Where
    a robot is held, nothing has to move. A joint that hardly moves beside others of its unit has the widths
    of the joint that moves most.
    """
    nv, scene, units = case.coordinates.nv, case.scene, np.array(case.coordinates.units)
    if scene.torque in ("hold", "servos") and not np.any(scene.speed) and not np.any(scene.targets):
        return np.concatenate([np.full(nv, NARROW), np.full(nv, np.inf)])
    moved = moved_from(q, q[0], case.coordinates)
    return np.concatenate([widths(moved, units, NARROW), widths(np.abs(v), units, np.inf)])


def widths(sizes: np.ndarray, units: np.ndarray, most: float) -> np.ndarray:
    """The same of the movements or the speeds, `sizes` (times, nv), of joints with these units, (nv,)."""
    largest = np.nanmax(sizes, axis=0)
    of_unit = np.array([largest[units == unit].max() for unit in units])
    width = np.minimum(np.where(largest >= STILL * of_unit, largest, of_unit), most)
    if largest.max() > RESTS:
        width = np.where(of_unit > RESTS, width, most)  # where another unit is what moves
    return width


def movement_unit(coordinates: Coordinates) -> str:
    """The unit of the movements of all joints: rad, m, or rad or m."""
    return " or ".join(sorted(set(coordinates.units), reverse=True))


def check_movement(result: Result, where: str, moved: float, unit: str = "rad") -> None:
    """Checks that a run without a holding torque moves, rad or m: otherwise it tests nothing."""
    result.check(where, "movement", moved, MOVES, unit, rule="at least", about=About.PREDICTION)


def moved_from(q: np.ndarray, start: np.ndarray, coordinates: Coordinates | None = None) -> np.ndarray:
    """Absolute movements from a start to positions; coordinates: needed if a joint is a ball."""
    return np.abs(q - start if coordinates is None else coordinates.difference(q, start))


def deviation(q: np.ndarray, start: np.ndarray, coordinates: Coordinates | None = None) -> float:
    """The largest deviation of any joint of a run from its start, rad or m; inf if the run diverged."""
    away = moved_from(q, start, coordinates).max()
    return float(away) if np.isfinite(away) else np.inf


def departure(t: np.ndarray, q: np.ndarray, coordinates: Coordinates | None = None) -> float | None:
    """The first time at which a joint is 0.1 rad, or m, from its start; None: never."""
    away = ~(moved_from(q, q[0], coordinates).max(axis=1) <= LEFT)  # a run that is NaN has left too
    return float(t[away][0]) if away.any() else None


def diverged_at(case: Case, t: np.ndarray, q: np.ndarray, qd: np.ndarray) -> float | None:
    """The first time at which a run is not finite, or has more energy than is possible; None: never.

    Energy minus the work of the constant torque cannot grow. The bound on its gain is the energy that the
    motion can exchange.
    """
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    q, qd = np.where(finite[:, None], q, case.q), np.where(finite[:, None], qd, 0.0)
    with np.errstate(over="ignore", invalid="ignore"):  # in a run that is about to diverge
        done = work(case, q)
        energy = tmt.energy(case.tree, q, qd) - done
        bad = ~finite | ~(energy - energy[0] <= exchanged(case, q, done))
    return float(t[bad][0]) if bad.any() else None


def work(case: Case, q: np.ndarray) -> np.ndarray:
    """The work of the constant torque and of a controller's position gains along a run, J, (times,).

    It is added up from state to state, as a ball's torque is constant in axes that turn with it.
    """
    torque = case.tau - fed_back_at(case.tree, q)  # linear in q: between two states its mean acts
    mean, moved = (torque[1:] + torque[:-1]) / 2.0, case.coordinates.difference(q[1:], q[:-1])
    return np.append(0.0, np.cumsum(np.sum(moved * mean, axis=1)))


def fed_back_at(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """The torque of a controller's position gains at q (..., nq), N m or N, (..., nv), to be subtracted."""
    positions = q[..., tree.coordinates.first_positions]
    return positions @ np.array(tree.position_gain).T if tree.position_gain else np.zeros_like(positions)


def exchanged(case: Case, q: np.ndarray, done: np.ndarray) -> np.ndarray:
    """The largest energy that the motion of a case can have exchanged up to each state of a run, J, (times,).

    The initial kinetic energy, that of the springs, the whole potential range of the stated robot (twice the
    sum of m g reach), and what servos store. Slides have no such range: where it is larger, the largest work
    `done` of the torque plus the weight times the distance along the slides. Rounding may add 64 eps of 1 J
    for each inertia and stiffness of 1.
    """
    tree, coordinates = case.tree, case.coordinates
    exchange = 2.0 * gravity_scale(case.robot.tree, case.posture)  # the reach includes slides at the start
    kinetic, inertia = at_start(case)
    exchange = exchange + kinetic
    if tree.position_gain:  # servos return energy until they exert no force; other torque is a motor's
        gain = np.array(tree.position_gain)
        pull, give = case.tau - fed_back_at(tree, q[0]), np.linalg.pinv(gain, hermitian=True)
        exchange = exchange + pull @ give @ pull / 2.0
        done = coordinates.difference(q, q[0]) @ (case.tau - gain @ give @ case.tau)
    if tree.has_springs:
        stretch = coordinates.difference(q[0], np.array(tree.rest))
        exchange = exchange + tmt.spring_torque(tree, q[0]) @ stretch / 2.0
    slides = [joint.qd.start for joint in coordinates.places.joints if joint.kind == "slide"]
    weight = np.linalg.norm(tree.gravity) * np.sum(tree.mass)
    lifted = weight * np.abs(coordinates.difference(q, q[0])[:, slides]).sum(axis=1)
    stiff = np.sum(tree.stiffness) + (np.trace(tree.position_gain) if tree.position_gain else 0.0)
    rounding = FACTOR * EPS * (inertia + stiff)
    return np.maximum(exchange, np.maximum.accumulate(np.abs(done) + lifted)) + rounding


@lru_cache(maxsize=8)  # a case has many runs
def at_start(case: Case) -> tuple[float, float]:
    """The kinetic energy of a case, J, and the sum of the inertias on the diagonal of Mbar, their scales."""
    kinetic = tmt.energy(case.tree, case.q, case.v) - tmt.potential_energy(case.tree, case.q)
    return float(kinetic), float(np.trace(Entries(case.tree, case.q[None]).mass_matrix[0]))


def number_or_none(number: float | None) -> float | None:
    """The number, or None if it is not finite."""
    return float(number) if number is not None and np.isfinite(number) else None


def number_or_nan(number: float | None) -> float:
    """The number, or NaN for None: a gap in a figure, a failed check."""
    return np.nan if number is None else number


def leaves_no_digits(robot: Robot) -> Finding | None:
    """Why no run of a file's robot can be compared: rounding exceeds the judged error within two steps.

    A force that moves a joint at the rate r has a rounding error of 64 eps of itself. A step multiplies an
    error by (r dt)^2 where that is far above 1: two steps give 64 eps (r dt)^4 of 1 rad or 1 m.
    """
    if not (robot.is_read and robot.cases_of_torque):
        return None
    case = min(robot.cases_of_torque, key=lambda case: case.scene.dt)
    rate, dt = max(rates_at(case.tree, case.q)), case.scene.dt
    if not FACTOR * EPS * (rate * dt) ** 4 > NARROW:
        return None
    return Finding("shared", "leaves_no_digits", {"noun": robot.noun, "rate": rate, "dt": dt})
