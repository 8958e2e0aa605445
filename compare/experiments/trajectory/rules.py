"""Checks of a run: the time that is judged, the engines' difference, divergence; and of the derivative of the bias."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from tmt import Tree
from tmt.equations import method
from tmt.equations.dual import seeded

from ...engines import Engine
from ...engines.mujoco.linear import implicit_derivative
from ...judge.check import About, Result, closest
from ...judge.rounding import NARROW
from ...judge.run import movement_unit
from ...judge.scale import EPS, FACTOR, mass_scale
from ...robots import Robot
from ...robots.case import Coordinates

ADDED_DAMPING = 0.5  # N m s/rad: its derivative is part of it
DERIVATIVE_STATES = 20  # random states


def ends_first(ends: Mapping[str, float | None]) -> float:
    """When the first of the runs has diverged, s; inf: none has."""
    return min((end for end in ends.values() if end is not None), default=np.inf)


def judged(times: np.ndarray, width: np.ndarray, ends: Mapping[str, float | None]) -> int:
    """The number of recorded states that are judged: those before the band is wide or a run has diverged, and the start."""
    alive = times < ends_first(ends)
    return max(1, int(np.argmin(np.append((width < NARROW) & alive, False))))


def check_divergence(
    result: Result, where: str, ends: Mapping[str, float | None], dt: float, steps: int, width: np.ndarray
) -> None:
    """Both diverge at the same step, if one does while the band (recorded,) is narrow.

    The band must be narrow at the first recorded state from the divergence on. ends: of MuJoCo's partner and of MuJoCo, s.
    """
    end = ends_first(ends)
    if end == np.inf:
        return
    every = steps // (len(width) - 1)
    if width[-(-round(end / dt) // every)] < NARROW:
        ours, theirs = (steps + 1 if at is None else round(at / dt) for at in ends.values())
        whose = "TMT's" if result.label == "TMT" else result.label
        note = f"{steps + 1}: never" if steps + 1 in (ours, theirs) else ""
        result.check(where, f"step of divergence, MuJoCo's, is {whose}", theirs, ours, "", note, rule="equal")


def check_same_bits(result: Result, where: str, integrator: str, first: list, other: list) -> None:
    """Integrators with the same scheme give the same bits: q and v of both."""
    differ = sum(not np.array_equal(a, b, equal_nan=True) for a, b in zip(first, other))
    quantity, unit = f"the same bits as {integrator}", "arrays that differ"
    result.check(where, quantity, differ, 0.0, unit, rule="equal", about=About.PREDICTION)


def check_level(
    result: Result,
    where: str,
    about: dict,
    coordinates: Coordinates,
    difference: np.ndarray,
    tolerance: ArrayLike,
    times: np.ndarray,
    ending: dict,
) -> None:
    """A row and a check: the component and recorded state that come closest to their tolerance.

    about, ending: the first and the last columns of the row; difference: (states, nv) rad/s2, or (states, 2 nv) rad and rad/s;
    tolerance: broadcast to it; times: of the states, s.
    """
    level, n = about["level"], coordinates.nv
    difference = np.abs(difference)
    tolerance = np.broadcast_to(tolerance, difference.shape)
    k, i = closest(difference, tolerance)
    per = "/s2" if level == "derivative" else ("", "/s")[i // n]
    unit = coordinates.units[i % n] + per
    units = movement_unit(coordinates).split(" or ")
    largest_unit = " or ".join(unit + (per if level == "derivative" else "") for unit in units)
    place = f"{coordinates.speeds[i % n]} at t = {times[k]:.3f} s"
    check = result.check(
        where, f"{level}, {result.label} to MuJoCo", difference[k, i], tolerance[k, i], unit, place, True
    )
    result.rows.append(
        about
        | {
            "largest_difference": None if check.value is None else difference[:, :n].max(),
            "unit": largest_unit,
            "worst_difference": check.value,
            "band": check.tolerance,
            "worst_unit": unit,
            "difference_over_band": check.over_tolerance,
            "worst_place": place,
        }
        | ending
    )


def compare_derivatives(result: Result, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """TMT's dual numbers compared with MuJoCo's qDeriv, which the integrator implicit uses, with joint damping added."""
    case = robot.case("damped", damping=ADDED_DAMPING)
    moved, v = (
        np.random.default_rng(0).uniform(-3.0, 3.0, (DERIVATIVE_STATES, 2, case.coordinates.nv)).transpose(1, 0, 2)
    )
    q = case.coordinates.move(np.array(case.tree.zero), moved)
    mujoco, damping = engines["mujoco"].of(case), np.diag(case.tree.damping)
    ours = [bias_rates(case.tree, *state) + damping for state in zip(q, v)]
    theirs = [-implicit_derivative(mujoco, *state) for state in zip(q, v)]
    damping_units = {"rad": "N m s/rad", "m": "N s/m"}
    units = " or ".join(damping_units[unit] for unit in movement_unit(case.coordinates).split(" or "))
    check_derivative(result, case.tree, q, v, np.array(ours), np.array(theirs), units)


def bias_rates(tree: Tree, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """dh/dqd at a state, (nv, nv) N m s/rad, by tmt.equations.method in all directions at once."""
    h = method.bias(method.bodies(tree, list(q), seeded(list(v), np.eye(len(v)))), tree.gravity)
    return np.array([np.broadcast_to(getattr(row, "slope", 0.0), len(v)) for row in h])


def check_derivative(
    result: Result,
    tree: Tree,
    q: np.ndarray,
    v: np.ndarray,
    ours: np.ndarray,
    theirs: np.ndarray,
    unit: str = "N m s/rad",
) -> None:
    """The state closest to its tolerance, 64 eps x (the largest entry of Mbar x the sum of |rates| + the largest damping).

    q, v: (states, nq), (states, nv); ours, theirs: (states, nv, nv) of this unit.
    """
    tolerance = FACTOR * EPS * (mass_scale(tree, q) * np.abs(v).sum(axis=1) + max(tree.damping))
    off = np.abs(ours - theirs).max(axis=(1, 2))
    (k,) = closest(off, tolerance)
    where = f"{len(q)} random states"
    result.check(where, "dh/dqd + D, TMT to MuJoCo's -qDeriv", off[k], tolerance[k], unit, rounding=True)
