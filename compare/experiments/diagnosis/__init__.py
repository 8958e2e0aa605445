"""What explains a difference: in Mbar, h and accelerations of a file beside its reference, or of one's own equations."""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from ...diagnosis import STATES_ASKED, Diagnosis, diagnose, packed
from ...diagnosis.consistency import Condition
from ...diagnosis.forces import causes_of_forces
from ...diagnosis.stated import diagnose_stated
from ...diagnosis.words import Cause
from ...engines.own import QUICK
from ...judge.check import Result, over
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from .. import Experiment
from ..setup import Setup
from .own_equations import asked_conditions, for_command_line

EXPERIMENT = Experiment(order=80, options=("--joints",))
SECONDS = 8.0  # of a search
CAUSE_COLUMNS = ["rank", "kind", "place", "stated", "explains", "unit", "left_over", "tied"]
NO_NUMBERS = "not all values are numbers"
WHOSE_VALUES = {"own": "Your", "mujoco": "MuJoCo's"}


class Found(NamedTuple):
    """What explains the values of an engine that differ from those of a robot's Tree."""

    engine: str
    states: int
    conditions: list[Condition]  # on Mbar and h of a user's own; [] of MuJoCo's
    diagnosis: Diagnosis  # of Mbar and h
    ratio: float  # of a difference of Mbar or h to its tolerance, the largest
    of_forces: list[Cause]  # what else acts in the accelerations
    force_ratio: float  # of a force left over to its tolerance, the largest
    unasked: str = ""  # why the conditions were not asked

    @property
    def causes(self) -> list[Cause]:
        """Of one rank each, those of Mbar and h first."""
        return [*self.diagnosis.causes, *self.of_forces]

    @property
    def sentence_of_forces(self) -> str:
        """What the accelerations have besides Mbar and h."""
        if self.of_forces:
            return "; or ".join(cause.text for cause in self.of_forces[:4]) + "."
        return "No torque, damping, spring or friction explains what acts besides Mbar and h, nor do two of them."


def claim(robot: Robot) -> str:
    """What is claimed."""
    if robot.own:
        return (
            "There is nothing to explain: your M is symmetric and positive definite, your h belongs to it, both are those of "
            "the model, and your accelerations follow from them. Where not, the least that explains everything is sought: an "
            "option or a joint's convention (rank 1), one number, term or coefficient (2), or two of them (3)."
        )
    return (
        "There is nothing to explain: MuJoCo's M and h are those of the reference, and nothing else acts in its accelerations. "
        "Where not, the least that explains everything is sought: an option or a joint's convention (rank 1), one number, term "
        "or coefficient (2), or two of them (3)."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged."""
    return (
        "64 eps x scale of each entry, the sum of the absolute values of the terms that are added up in it. A cause explains "
        "the difference if it leaves no more than that at any of the states; all causes of the same rank that do are ties, and "
        "where joints may be otherwise numbers and terms too. Derivatives that the conditions on M and h need are differences of "
        "fourth order; their error is estimated by a step twice as long."
    )


def diagnosed(setup: Setup) -> Found:
    """What explains the difference of the engine that is compared with the robot's Tree; computed once."""
    if "diagnosis" not in setup.background:
        setup.background["diagnosis"] = search(setup)
    return setup.background["diagnosis"]


def search(setup: Setup) -> Found:
    """The same, computed."""
    tree, sample, name = setup.robot.tree, setup.random.first(STATES_ASKED), "own" if setup.robot.own else "mujoco"
    given = setup.engines[name].of(setup.robot.case())
    q, qd, tau = sample.q, sample.qd, sample.tau
    M, h = np.asarray(given.mass_matrix(q)), np.asarray(given.bias(q, qd))
    allowed = packed_tolerances(tree, q, qd)
    values = packed(M, h, tree.coordinates.nv, len(q))

    def bias(qd: np.ndarray) -> np.ndarray:
        return np.asarray(given.bias(q, qd))

    names, (asked, unasked) = setup.robot.joints, ([], "")
    if name == "own":
        asked, unasked = asked_conditions(given, q, qd, M, h)
        joints, sizes = given.equations.joints, sizes_of(tree, q, qd)
        of_speeds = bias if given.equations.seconds <= QUICK else None
        diagnosis = diagnose_stated(tree, joints, q, qd, (M, h), sizes, SECONDS, of_speeds)
    else:
        diagnosis = diagnose(tree, names, q, qd, values, allowed, SECONDS, bias)
    right = packed(literal.mass_matrix(q, tree), literal.bias(q, qd, tree), tree.coordinates.nv, len(q))
    off = over(np.abs(values - right), allowed)
    acting, size = left_over(tree, q, qd, tau, M, h, np.asarray(given.acceleration(q, qd, tau)))
    force_ratio = largest_ratio(over(np.abs(acting), size))
    of_forces = causes_of_forces(tree, q, qd, tau, h, acting, size) if 1.0 < force_ratio < np.inf else []
    ratio = largest_ratio(off)
    return Found(name, len(q), asked, diagnosis, ratio, of_forces, force_ratio, unasked)


def largest_ratio(ratios: np.ndarray) -> float:
    """The largest of them; inf where one is no number."""
    return float(np.where(np.isfinite(ratios), ratios, np.inf).max())


def packed_tolerances(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """64 eps of the scale of each entry of Mbar and h, (states, entries) as `packed` has them."""
    return packed(*sizes_of(tree, q, qd), tree.coordinates.nv, len(q))


def sizes_of(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of Mbar, (states, nv, nv), and of h, (states, nv)."""
    scale, nv = Entries(tree, q, qd), tree.coordinates.nv
    M, h = np.broadcast_to(scale.mass_matrix, (len(q), nv, nv)), np.broadcast_to(scale.bias, (len(q), nv))
    return FACTOR * EPS * M, FACTOR * EPS * h


def left_over(tree: tmt.Tree, q, qd, tau, M, h, qdd) -> tuple[np.ndarray, np.ndarray]:
    """tau - D qd - k (q - rest) - h - M qdd, (states, nv), with all of one source, and its tolerance."""
    pull = literal.spring_torque(q, tree) if tree.has_springs else 0.0
    acting = tau - np.array(tree.damping) * qd - pull - h - np.einsum("sij,sj->si", M, qdd)
    scale = Entries(tree, q, qd)
    sizes = scale.mass_matrix + np.abs(M)
    terms = np.einsum("sij,sj->si", sizes, np.abs(qdd)) + scale.force(tau) + np.abs(h)
    worst = np.linalg.cond(M).max() if np.isfinite(M).all() else 1.0  # of a solver that is not backward stable
    return acting, FACTOR * EPS * terms * max(1.0, np.sqrt(worst))


def rows(setup: Setup) -> Result:
    """One row for each explanation; one check of what is asked, whose note is the cause."""
    result, found = Result("diagnosis", shown=CAUSE_COLUMNS), diagnosed(setup)
    of, whose = f"{found.states} random states", WHOSE_VALUES[found.engine]
    for condition in found.conditions:
        note = "" if condition.is_met else condition.text
        value, bound, unit = condition.value, condition.tolerance, condition.unit
        result.check(of, f"{whose} {condition.name}", value, bound, unit, note, rule=condition.rule)
    diagnosis = found.diagnosis
    note = for_command_line(diagnosis.sentence, bool(setup.robot.own)) if diagnosis.differs else "nothing to explain"
    note = note if np.isfinite(found.ratio) else NO_NUMBERS
    result.check(of, f"{whose} M and h, largest difference over its tolerance", found.ratio, 1.0, "", note)
    acting = found.sentence_of_forces if np.isfinite(found.force_ratio) else NO_NUMBERS
    note = "" if found.force_ratio <= 1.0 else acting
    what = f"{whose} accelerations follow from M and h: force left over, over its tolerance"
    result.check(of, what, found.force_ratio, 1.0, "", note)
    result.rows = [{name: getattr(cause, name) for name in CAUSE_COLUMNS} for cause in found.causes]
    result.notes += sentences(found)
    result.curves["nearest"] = diagnosis.nearest
    result.curves["causes"] = [record(cause, bool(setup.robot.own)) for cause in found.causes]
    return result


def sentences(found: Found) -> list[str]:
    """The finding in words."""
    said = [condition.text for condition in found.conditions if not condition.is_met]
    if found.diagnosis.differs:
        said += [found.diagnosis.sentence, found.diagnosis.where]
        if len(found.diagnosis.causes) > 1:
            said.append(
                "Explanations that are listed together cannot be told apart by M and h, at any state that was tried."
            )
    if not np.isfinite([found.ratio, found.force_ratio]).all():
        said.append(f"{NO_NUMBERS[0].upper()}{NO_NUMBERS[1:]}: what is said here is of the others.")
    elif found.force_ratio > 1.0:
        said.append(found.sentence_of_forces)
    said = [for_command_line(text, found.engine == "own") for text in dict.fromkeys(said)]
    return said + [found.unasked] * bool(found.unasked) or [
        "There is nothing to explain: Mbar, h and accelerations agree."
    ]


def record(cause: Cause, is_own: bool = False) -> dict:
    """A cause as a report has it."""
    return {
        "rank": cause.rank,
        "place": cause.place,
        "stated": cause.stated,
        "found": cause.explains,
        "text": for_command_line(cause.text, is_own),
    }


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from . import figures_found  # matplotlib is for the process that draws

    if result.curves.get("nearest"):
        yield partial(figures_found.draw_nearest, result)
