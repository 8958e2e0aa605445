"""Which engine: two verdicts of each, and the cheapest of its methods for three errors."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from ...engines import LABELS
from ...engines.outside.model import FROM_COMPILED, FROM_URDF
from ...judge.run import movement_unit
from ...robots.case import Case
from ..followed import REGULAR
from .tables import AnswerRow, EnginesResult, MethodRow

TARGETS = {"1e_3": 1e-3, "1e_6": 1e-6, "1e_9": 1e-9}  # rad or m, the largest error of a motion
FALLS = 1.8  # ratio of the errors of two runs of a method of order 1; a smaller one is that of a floor
SAME, OTHER, NOT_SET = "same", "differs", "not set"  # verdicts on the equations


def add_answer(result: EnginesResult, case: Case | None) -> None:
    """The rows of all engines, the headline and the sentences of the first screen."""
    runs: dict[str, list[MethodRow]] = {}
    for run in result.tables["engines_methods"]:
        runs.setdefault(run.engine, []).append(run)
    precisions = {row.engine: row.precision for row in result.rows}
    known = [label for label in (LABELS["mujoco"], LABELS["tmt"]) if label in runs]
    rows = [
        AnswerRow(
            engine=label, precision=precisions.get(label, "float64"), as_read=as_read(result, label),
            as_set=as_set(result, label), **cheapest_of(runs.get(label, []), case.duration if case else 1.0),
        )
        for label in (*known, *precisions)
    ]  # fmt: skip
    result.tables["engines_answer"] += rows
    ways = {"by_urdf": result.labels(FROM_URDF), "by_compiled": result.labels(FROM_COMPILED)}
    values: dict[str, Any] = {"rows": rows[len(known) :], "not_asked": result.not_asked, **ways}
    result.headline = result.finding("headline", **values)
    result.top.append(result.finding("answer", **values))
    if case and runs:
        cheapest = {name: cheapest_engine(rows, name) for name in TARGETS}
        unit = movement_unit(case.coordinates)
        about: dict[str, Any] = {"scene": case.name, "duration": case.duration, "unit": unit}
        result.top.append(result.finding("cheapest", cheapest=cheapest, targets=TARGETS, **about))
        result.top += [
            result.finding("engine", row=row, targets=TARGETS) for row in rows if row.floor is not None
        ]


def as_read(result: EnginesResult, label: str) -> str:
    """What a user gets who loads the file: same, or what differs."""
    if label in result.readers and result.readers[label].differing:
        return ", ".join(result.readers[label].differing)
    return SAME if all(row.as_read_over_bar <= 1.0 for row in result.rows if row.engine == label) else OTHER


def as_set(result: EnginesResult, label: str) -> str:
    """Whether the equations are the same with the numbers that this program could set."""
    if all(row.passed for row in result.rows if row.engine == label):
        return SAME
    read = [row for row in result.tables["engines_read"] if row.engine == label]
    return NOT_SET if any(not row.set_by_this_program for row in read) else OTHER


def cheapest_of(runs: Sequence[MethodRow], duration: float) -> Mapping[str, Any]:
    """The fields of an AnswerRow of methods: the cheapest for each target, and the smallest error."""
    ended = [row for row in runs if row.worst_error is not None]
    fields: dict[str, Any] = {}
    for name, target in TARGETS.items():
        reached = [row for row in ended if row.worst_error is not None and row.worst_error <= target]
        best = min(reached, key=lambda row: row.own_seconds, default=None)
        fields[f"within_{name}"] = best and best.method
        fields[f"within_{name}_cost"] = best and 1e3 * best.own_seconds / duration
    least = min(ended, key=lambda row: row.worst_error or 0.0, default=None)
    fields |= {"floor": least and least.worst_error, "floor_method": least and least.method}
    errors = [row.worst_error or 0.0 for row in ended if least and row.method == least.method]
    pairs = [pair for pair in pairwise(errors) if pair[0] < REGULAR]
    is_reached = any(after * FALLS > before for before, after in pairs)
    is_left_out = any(row.finer_left_out for row in runs) and not is_reached
    return fields | {"floor_reached": is_reached, "finer_left_out": is_left_out}


def cheapest_engine(rows: Sequence[AnswerRow], name: str) -> tuple[AnswerRow, str, float] | None:
    """The cheapest engine for a target, its method and its cost; None: none reaches it."""
    field = f"within_{name}"
    reached = [row for row in rows if getattr(row, field)]
    best = min(reached, key=lambda row: float(getattr(row, f"{field}_cost")), default=None)
    return None if best is None else (best, getattr(best, field), getattr(best, f"{field}_cost"))
