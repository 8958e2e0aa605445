"""What explains a difference in Mbar, h and accelerations, of a file's robot or of a user's equations."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

import tmt

from ..agreement.why import Given, Why, why
from ..core.cause import Cause
from ..core.check import Result
from ..core.finding import Finding
from ..core.rows import Row, column
from ..core.text import block
from ..diagnosis import STATES_ASKED, Stated, Values
from ..diagnosis.consistency import Condition, conditions
from ..diagnosis.layout import packed
from ..diagnosis.model import Equations
from ..engines.mujoco.reading import tree_with_sites
from ..engines.own import OwnDynamics
from ..judge.agree import share_of
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from . import Drawing
from .setup import Setup

MOST_SAID = 3  # of causes that do the same
POINTS = 61  # of a curve
SECONDS_OF_CONDITIONS, CALLS_OF_CONDITIONS = 3.0, 20  # calls of Mbar and h at each state
WHOSE_VALUES = {"own": "Your", "mujoco": "MuJoCo's"}


@dataclass(kw_only=True)
class CauseRow(Row):
    rank: int
    kind: str
    place: str
    stated: float | str = column(digits=7)
    explains: float | str
    unit: str
    left_over: float
    tied: int


class Curve(NamedTuple):
    """An entry of Mbar or h along the coordinate that changes its difference most, from one of the states."""

    entry: str
    coordinate: str
    unit: str
    moved: np.ndarray  # rad or m, as the others (points,)
    yours: np.ndarray
    right: np.ndarray


@dataclass
class DiagnosisResult(Result):
    curve: Curve | None = None  # of a difference that nothing explains


class Found(NamedTuple):
    """What explains the values of an engine that differ from those of a robot's Tree."""

    engine: str
    states: int
    why: Why
    ratio: float | None = None  # of a difference of Mbar or h to its tolerance; None: they are not given
    conditions: Sequence[Condition] | None = ()  # on a user's own Mbar and h; None: they take too long
    curve: Curve | None = None  # of a user's own Mbar and h, where nothing explains their difference

    @property
    def causes(self) -> list[Cause]:
        """The likeliest of Mbar and h, then those of accelerations."""
        return [*self.why.diagnosis.causes[:MOST_SAID], *self.why.forces[:MOST_SAID]]

    @property
    def said(self) -> list[Cause]:
        """One of Mbar and h, one of accelerations: the likeliest, and in its text others that explain the same."""
        several = [causes for causes in (self.why.diagnosis.causes, self.why.forces) if causes]
        return [
            replace(found[0], text=block("causes", "causes", list=found, most=MOST_SAID)) for found in several
        ]

    @property
    def share(self) -> float:
        """Of the largest difference of Mbar or h in the scale of its entry."""
        return (self.ratio or 0.0) * FACTOR * EPS


@lru_cache(maxsize=2)
def diagnosed(setup: Setup) -> Found:
    """What explains the difference of the engine that is compared with the robot's Tree; computed once."""
    tree, sample, engine = setup.robot.tree, setup.random.first(STATES_ASKED), setup.robot.compared[0]
    engine = "own" if engine == "own" else "mujoco"
    if setup.reading is not None and tree == setup.reading.tree:
        tree = tree_with_sites(setup.reading)  # its numbers are said in the frames of the file
    dynamics, (q, qd, tau) = setup.engines[engine].of(setup.robot.case()), (sample.q, sample.qd, sample.tau)
    own = dynamics if isinstance(dynamics, OwnDynamics) else None
    has_matrix = own is None or own.has("mass_matrix")
    of_engine = (dynamics.mass_matrix(q), dynamics.bias(q, qd)) if has_matrix else (None, None)
    values, qdd = Values.of(tree, q, qd, *of_engine), dynamics.acceleration(q, qd, tau)
    if own is None:
        bias = partial(dynamics.bias, q)
        given = Given(tree, values, tau, qdd, bias=bias, mass_matrix=dynamics.mass_matrix)
    else:
        stated = Stated(own.equations.joints, "option")
        given = Given(tree, values, tau, qdd, stated, own.equations).with_functions()
    found = Found(engine, len(q), why(given))
    if not has_matrix:
        return found
    shares = share_of(np.abs(values.packed - given.right.packed), values.packed_tolerance)
    found = found._replace(ratio=float(shares.max()))
    if own is None:
        return found
    found = found._replace(conditions=conditions_of(own, values))
    is_explained = not found.why.diagnosis.differs or bool(found.why.diagnosis.causes)
    if given.mass_matrix is None or is_explained:
        return found
    return found._replace(curve=telling_curve(own, tree, values, shares))


def telling_curve(dynamics: OwnDynamics, tree: tmt.Tree, values: Values, shares: np.ndarray) -> Curve:
    """The entry that differs most, and the coordinate along which its difference changes most."""
    shares = np.nan_to_num(shares, posinf=0.0)
    state, k = np.unravel_index(int(np.argmax(shares)), shares.shape)
    equations, qd = Equations(tree, values.q, values.qd), np.tile(values.qd[state], (POINTS, 1))
    coordinates, entry, curves = equations.coordinates, equations.entries[k].named(equations.speeds), []
    for name, unit, direction in zip(coordinates.speeds, coordinates.units, np.eye(equations.nv)):
        moved = np.linspace(-1.0, 1.0, POINTS) * (1.0 if unit == "m" else np.pi)
        q = coordinates.move(np.tile(values.q[state], (POINTS, 1)), moved[:, None] * direction)
        yours = packed(dynamics.mass_matrix(q), dynamics.bias(q, qd))[:, k]
        curves.append(Curve(entry, name, unit, moved, yours, Equations(tree, q, qd).right[:, k]))
    return max(curves, key=lambda curve: np.nan_to_num(np.ptp(curve.yours - curve.right)))


def conditions_of(dynamics: OwnDynamics, values: Values) -> list[Condition] | None:
    """The conditions on a user's own Mbar and h at as many states as there is time for; None: at none."""
    if not values.are_finite:
        return []
    calls = CALLS_OF_CONDITIONS * len(values.q)
    count = dynamics.equations.affordable(calls, SECONDS_OF_CONDITIONS) // CALLS_OF_CONDITIONS
    if count == 0:
        return None
    functions = dynamics.mass_matrix, dynamics.bias, dynamics.coordinates
    every = conditions(*functions, values.q[:count], values.qd[:count])
    return [condition for condition in every if np.isfinite(condition.tolerance)]


def rows(setup: Setup) -> DiagnosisResult:
    """A row for each explanation; a check of each condition, of Mbar and h, and of accelerations."""
    found = diagnosed(setup)
    result = DiagnosisResult("diagnosis", curve=found.curve)
    for condition in found.conditions or ():
        check(result, found, condition)
    if found.ratio is not None:
        is_known = found.why.diagnosis.differs or np.isfinite(found.ratio)
        finding = result.finding("of_equations" if is_known else "no_numbers", found=found)
        name = "M and h, largest difference over its tolerance"
        check(result, found, Condition(name, found.ratio, 1.0, "", finding))
    finding = result.finding("of_forces" if np.isfinite(found.why.force_ratio) else "no_numbers", found=found)
    name = f"accelerations{' follow from M and h' * (found.ratio is not None)}: force left over, over its tolerance"
    check(result, found, Condition(name, found.why.force_ratio, 1.0, "", finding))
    names = [field.name for field in fields(CauseRow)]
    result.rows = [CauseRow(**{name: getattr(cause, name) for name in names}) for cause in found.causes]
    if found.conditions is None:
        result.find("too_slow")
    if not result.notes:
        result.find("nothing")
    result.causes = found.causes
    return result


def check(result: Result, found: Found, condition: Condition) -> None:
    """A check that a condition is met; if not, its note, and a note of the result, is what is wrong."""
    name, note = f"{WHOSE_VALUES[found.engine]} {condition.name}", ""
    if not condition.is_met:
        result.notes.append(condition.finding)
        note = condition.text
    scene, value, least_or_most = f"{found.states} random states", condition.value, condition.tolerance
    result.check(scene, name, value, least_or_most, condition.unit, note, rule=condition.rule)


def headline(result: DiagnosisResult) -> Finding | None:
    more = len(result.rows) - 1
    return result.finding("headline", place=result.rows[0].place, more=more) if result.rows else None


def figures(result: DiagnosisResult, robot: Robot) -> Iterator[Drawing]:
    from .figures import draw_curve  # matplotlib is for the process that draws

    if result.curve is not None:
        yield partial(draw_curve, *result.curve)
