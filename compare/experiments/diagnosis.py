"""What explains a difference in Mbar, h and accelerations: of a file's robot and its reference, or of the user's equations."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from ..diagnosis import STATES_ASKED, Diagnosis, Values, diagnose_stated, packed
from ..diagnosis.cause import Cause
from ..diagnosis.consistency import Condition, conditions
from ..diagnosis.forces import causes_of_forces, force_left_over
from ..engines.own import QUICK, OwnDynamics
from ..judge.check import Result, over
from ..judge.entries import Entries
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR
from ..report.text import say
from ..robots import Robot
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=80, options=("--joints",))
SECONDS = 8.0  # of a search
SECONDS_OF_CONDITIONS = 3.0
CALLS_OF_CONDITIONS, CALLS_FOR_A_JOINT = 30, 16  # of Mbar and h at each state, that the conditions take, about
CAUSE_COLUMNS = ["rank", "kind", "place", "stated", "explains", "unit", "left_over", "tied"]
WHOSE_VALUES = {"own": "Your", "mujoco": "MuJoCo's"}


class Found(NamedTuple):
    """What explains the values of an engine that differ from those of a robot's Tree."""

    engine: str
    states: int
    conditions: list[Condition]  # on Mbar and h of a user's own; [] of MuJoCo's
    diagnosis: Diagnosis  # of Mbar and h
    ratio: float  # of a difference of Mbar or h to its tolerance, the largest
    of_forces: tuple[Cause, ...]  # what else acts in the accelerations
    force_ratio: float  # of a force left over to its tolerance, the largest
    too_slow: bool = False  # whether the conditions were skipped because the equations take too long

    @property
    def causes(self) -> list[Cause]:
        """Of one rank each, those of Mbar and h first."""
        return [*self.diagnosis.causes, *self.of_forces]

    @property
    def stated_by(self) -> str:
        return stated_by(self.engine == "own")


def stated_by(is_own: bool) -> str:
    """How joints are stated: see `Cause.text`."""
    return "option" if is_own else ""


def diagnosed(setup: Setup) -> Found:
    """What explains the difference of the engine that is compared with the robot's Tree; computed once."""
    if "diagnosis" not in setup.background:
        setup.background["diagnosis"] = search(setup)
    return setup.background["diagnosis"]


def search(setup: Setup) -> Found:
    tree, sample, name = setup.robot.tree, setup.random.first(STATES_ASKED), "own" if setup.robot.own else "mujoco"
    given, (q, qd, tau) = setup.engines[name].of(setup.robot.case()), (sample.q, sample.qd, sample.tau)
    M, h = np.asarray(given.mass_matrix(q)), np.asarray(given.bias(q, qd))
    scale, nv = Entries(tree, q, qd), tree.coordinates.nv
    sizes = np.broadcast_to(scale.mass_matrix, M.shape), np.broadcast_to(scale.bias, h.shape)
    values = Values(q, qd, M, h, tuple(FACTOR * EPS * size for size in sizes))

    def bias(qd: np.ndarray) -> np.ndarray:
        return np.asarray(given.bias(q, qd))

    if name == "own":
        met, too_slow = conditions_of(given, values)
        of_speeds = bias if given.equations.seconds <= QUICK else None
        diagnosis = diagnose_stated(tree, given.equations.joints, values, SECONDS, of_speeds)
    else:
        met, too_slow, diagnosis = [], False, values.diagnosis(tree, SECONDS, bias)
    right = packed(literal.mass_matrix(q, tree), literal.bias(q, qd, tree), nv, len(q))
    ratio = largest_ratio(over(np.abs(packed(M, h, nv, len(q)) - right), packed(*values.tolerances, nv, len(q))))
    qdd = np.asarray(given.acceleration(q, qd, tau))
    acting, allowed = force_left_over(tree, q, qd, tau, M, h, qdd), tolerance_of_force(tree, q, qd, tau, M, h, qdd)
    force_ratio = largest_ratio(over(np.abs(acting), allowed))
    of_forces = causes_of_forces(tree, q, qd, tau, h, acting, allowed) if 1.0 < force_ratio < np.inf else ()
    return Found(name, len(q), met, diagnosis, ratio, of_forces, force_ratio, too_slow)


def conditions_of(given: OwnDynamics, values: Values) -> tuple[list[Condition], bool]:
    """The conditions at as many of the states as there is time for, and whether that is none."""
    q, qd = values.q, values.qd
    if not (np.isfinite(values.mass_matrix).all() and np.isfinite(values.bias).all()):
        return [], False
    calls = CALLS_OF_CONDITIONS + CALLS_FOR_A_JOINT * given.coordinates.nv
    count = given.equations.affordable(calls * len(q), SECONDS_OF_CONDITIONS) // calls
    if count == 0:
        return [], True
    found = conditions(given.mass_matrix, given.bias, given.coordinates, q[:count], qd[:count])
    return [condition for condition in found if np.isfinite(condition.tolerance)], False


def largest_ratio(ratios: np.ndarray) -> float:
    """The largest of them; inf if one is not a number."""
    return float(np.where(np.isfinite(ratios), ratios, np.inf).max())


def tolerance_of_force(tree: tmt.Tree, q, qd, tau, M, h, qdd) -> np.ndarray:
    """Of the force left over, (states, nv)."""
    scale = Entries(tree, q, qd)
    sizes = scale.mass_matrix + np.abs(M)
    terms = np.einsum("sij,sj->si", sizes, np.abs(qdd)) + scale.force(tau) + np.abs(h)
    worst = np.linalg.cond(M).max() if np.isfinite(M).all() else 1.0  # of a solver that is not backward stable
    return FACTOR * EPS * terms * max(1.0, np.sqrt(worst))


def rows(setup: Setup) -> Result:
    """One row for each explanation; a check of each condition, of Mbar and h, and of accelerations, whose note is the cause."""
    result, found = Result("diagnosis", shown=CAUSE_COLUMNS), diagnosed(setup)
    scene, whose, diagnosis = f"{found.states} random states", WHOSE_VALUES[found.engine], found.diagnosis
    for condition in found.conditions:
        if not condition.is_met:
            result.notes.append(condition.finding)
        note, quantity = "" if condition.is_met else condition.text, f"{whose} {condition.name}"
        result.check(scene, quantity, condition.value, condition.tolerance, condition.unit, note, rule=condition.rule)
    finding = result.finding("of_equations", found=found)
    note = say(finding) if found.ratio > 1.0 or diagnosis.differs else ""
    result.check(scene, f"{whose} M and h, largest difference over its tolerance", found.ratio, 1.0, "", note)
    forces = result.finding("of_forces", found=found)
    quantity = f"{whose} accelerations follow from M and h: force left over, over its tolerance"
    result.check(scene, quantity, found.force_ratio, 1.0, "", say(forces) if found.force_ratio > 1.0 else "")
    result.rows = [{name: getattr(cause, name) for name in CAUSE_COLUMNS} for cause in found.causes]
    if diagnosis.differs:
        result.notes.append(finding)
    if not np.isfinite([found.ratio, found.force_ratio]).all():
        result.find("no_numbers")
    elif found.force_ratio > 1.0:
        result.notes.append(forces)
    if found.too_slow:
        result.find("too_slow")
    if not result.notes:
        result.find("nothing")
    result.curves["nearest"] = diagnosis.nearest
    result.curves["causes"] = [record(cause, bool(setup.robot.own)) for cause in found.causes]
    return result


def record(cause: Cause, is_own: bool = False) -> dict:
    """A cause as a report has it."""
    return {
        "rank": cause.rank,
        "place": cause.place,
        "stated": cause.stated,
        "found": cause.explains,
        "text": cause.text(stated_by(is_own)),
    }


def headline(result: Result) -> Finding | None:
    """The first explanation, and how many more there are."""
    return result.finding("headline", place=result.rows[0]["place"], more=len(result.rows) - 1) if result.rows else None


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    if result.curves["nearest"]:
        from .figures import draw_nearest  # matplotlib is for the process that draws

        yield partial(draw_nearest, result)
