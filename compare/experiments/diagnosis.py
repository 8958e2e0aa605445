"""What explains a difference in Mbar, h and accelerations: of a file's robot and its reference, or of the user's equations."""

from collections.abc import Iterator
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from ..core.cause import Cause
from ..core.check import Result
from ..core.finding import Finding
from ..core.text import say
from ..diagnosis import STATES_ASKED, Diagnosis, Stated, Values, diagnose
from ..diagnosis.consistency import Condition, conditions
from ..diagnosis.forces import LeftOver
from ..engines.own import QUICK, OwnDynamics
from ..judge.agree import over
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from ..robots.states import Sample
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=80, needs_file=True, options=("--joints",))
SECONDS = 8.0  # of a search
SECONDS_OF_CONDITIONS = 3.0
CALLS_OF_CONDITIONS, CALLS_FOR_A_JOINT = (
    30,
    16,
)  # of Mbar and h at each state, that the conditions take, about
CAUSE_COLUMNS = ["rank", "kind", "place", "stated", "explains", "unit", "left_over", "tied"]
OF_ACCELERATIONS = "accelerations follow from M and h: force left over, over its tolerance"
WHOSE_VALUES = {"own": "Your", "mujoco": "MuJoCo's"}


class Found(NamedTuple):
    """What explains the values of an engine that differ from those of a robot's Tree."""

    engine: str
    states: int
    conditions: list[Condition]  # on Mbar and h of a user's own; [] of MuJoCo's
    too_slow: bool  # whether the conditions were skipped because the equations take too long
    diagnosis: Diagnosis  # of Mbar and h
    ratio: float  # of a difference of Mbar or h to its tolerance, the largest
    of_forces: tuple[Cause, ...]  # what else acts in the accelerations
    force_ratio: float  # of a force left over to its tolerance, the largest

    @property
    def causes(self) -> list[Cause]:
        """Of one rank each, those of Mbar and h first."""
        return [*self.diagnosis.causes, *self.of_forces]

    @property
    def share(self) -> float:
        """Of the largest difference of Mbar or h in the scale of its entry."""
        return self.ratio * FACTOR * EPS


@lru_cache(maxsize=2)
def diagnosed(setup: Setup) -> Found:
    """What explains the difference of the engine that is compared with the robot's Tree; computed once."""
    tree, sample, is_own = setup.robot.tree, setup.random.first(STATES_ASKED), bool(setup.robot.own)
    name = "own" if is_own else "mujoco"
    given, (q, qd, tau) = setup.engines[name].of(setup.robot.case()), (sample.q, sample.qd, sample.tau)
    M, h, qdd = (
        np.asarray(part) for part in (given.mass_matrix(q), given.bias(q, qd), given.acceleration(q, qd, tau))
    )
    values = Values.of(tree, q, qd, M, h)

    def bias(qd: np.ndarray) -> np.ndarray:
        return np.asarray(given.bias(q, qd))

    met, too_slow = conditions_of(given, values) if is_own else ([], False)
    of_speeds = None if is_own and given.equations.seconds > QUICK else bias
    stated = Stated(given.equations.joints, "option") if is_own else None
    diagnosis = diagnose(tree, values, SECONDS, of_speeds, stated)
    right = values._replace(mass_matrix=literal.mass_matrix(q, tree), bias=literal.bias(q, qd, tree))
    ratio = largest_ratio(values.packed - right.packed, values.packed_tolerance)
    left_over = LeftOver(tree, values, tau, qdd)
    return Found(name, len(q), met, too_slow, diagnosis, ratio, left_over.causes, left_over.ratio)


def conditions_of(given: OwnDynamics, values: Values) -> tuple[list[Condition], bool]:
    """The conditions at as many of the states as there is time for, and whether that is none."""
    if not values.are_finite:
        return [], False
    q, qd = values.q, values.qd
    calls = CALLS_OF_CONDITIONS + CALLS_FOR_A_JOINT * given.coordinates.nv
    count = given.equations.affordable(calls * len(q), SECONDS_OF_CONDITIONS) // calls
    if count == 0:
        return [], True
    found = conditions(given.mass_matrix, given.bias, given.coordinates, q[:count], qd[:count])
    return [condition for condition in found if np.isfinite(condition.tolerance)], False


def is_solved(given: OwnDynamics, tree: tmt.Tree, sample: Sample) -> bool:
    """Whether a user's accelerations are those of the own Mbar and h at all states of a sample."""
    q, qd, tau = sample.q, sample.qd, sample.tau
    values = Values.of(tree, q, qd, given.mass_matrix(q), given.bias(q, qd))
    return LeftOver(tree, values, tau, given.acceleration(q, qd, tau)).ratio <= 1.0


def largest_ratio(off: np.ndarray, tolerance: np.ndarray) -> float:
    """Of a difference to its tolerance; inf if one is not a number."""
    return float(over(np.where(np.isfinite(off), np.abs(off), np.inf), tolerance).max())


def rows(setup: Setup) -> Result:
    """One row for each explanation; a check of each condition, of Mbar and h, and of accelerations, whose note is the cause."""
    result, found = Result("diagnosis", shown=CAUSE_COLUMNS), diagnosed(setup)
    scene, whose, diagnosis = f"{found.states} random states", WHOSE_VALUES[found.engine], found.diagnosis

    def check(name, value, tolerance, fails: bool, finding: Finding, **more) -> None:
        result.check(scene, f"{whose} {name}", value, tolerance, note=say(finding) if fails else "", **more)
        if fails:
            result.notes.append(finding)

    for of in found.conditions:
        check(of.name, of.value, of.tolerance, not of.is_met, of.finding, unit=of.unit, rule=of.rule)
    is_finite = diagnosis.differs or np.isfinite(found.ratio)
    for name, ratio, kind, is_known in (
        ("M and h, largest difference over its tolerance", found.ratio, "of_equations", is_finite),
        (OF_ACCELERATIONS, found.force_ratio, "of_forces", np.isfinite(found.force_ratio)),
    ):
        values = {"found": found} if is_known else {}
        check(
            name,
            ratio,
            1.0,
            ratio > 1.0,
            result.finding(kind if is_known else "no_numbers", **values),
            unit="",
        )
    result.rows = [{name: getattr(cause, name) for name in CAUSE_COLUMNS} for cause in found.causes]
    if found.too_slow:
        result.find("too_slow")
    if not result.notes:
        result.find("nothing")
    result.curves["nearest"] = diagnosis.nearest
    result.curves["causes"] = [cause.record() for cause in found.causes]
    return result


def headline(result: Result) -> Finding | None:
    return (
        result.finding("headline", place=result.rows[0]["place"], more=len(result.rows) - 1)
        if result.rows
        else None
    )


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    if result.curves["nearest"]:
        from .figures import draw_nearest  # matplotlib is for the process that draws

        yield partial(draw_nearest, result)
