"""Checks and their rules, and the result of an experiment: rows, checks and findings."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from .cause import Cause
from .finding import Finding

RULES = {"at most": operator.le, "at least": operator.ge, "equal": operator.eq}  # which values pass
ENDS = "runs to its end"  # names of checks
AT_OWN_STEP, AT_REQUESTED_STEP = "stable at its own step", "stable at the requested step"
# in results.json
RECORDED = "experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "judged", "passed", "note"


class About(Enum):
    """The subject of a check; only the first kind decides whether the two models agree."""

    MODELS = "difference between the two models, or between one and the exact or stated value"
    PREDICTION = "prediction for a run: stability limit, order, time of departure"
    STEP = "stability of the step at which the robot is used"
    ENGINE = "difference of another engine that reads the robot's file"
    PROGRAM = "errors of the program itself"


@dataclass(frozen=True)
class Check:
    """One verdict: the value is at most, at least or equal to the tolerance, or it was not judged.

    value: None where a run diverged or a value is not finite; that never passes.
    judged: False where the comparison could not have failed, or not be made; the note says why.
    """

    experiment: str
    scene: str
    quantity: str
    value: float | None
    tolerance: float
    unit: str
    note: str = ""
    rounding: bool = False  # whether the tolerance is a bound of rounding errors
    rule: str = "at most"
    about: About = About.MODELS
    judged: bool = True

    def __post_init__(self) -> None:
        if self.rule not in RULES:
            raise ValueError(f"{self.quantity!r}: unknown rule {self.rule!r}")
        if not np.isfinite(self.tolerance):
            raise ValueError(f"{self.quantity!r}: infinite tolerance {self.tolerance}")

    @property
    def passed(self) -> bool:
        return self.judged and self.value is not None and bool(RULES[self.rule](self.value, self.tolerance))

    @property
    def failed(self) -> bool:
        return self.judged and not self.passed

    @property
    def over_tolerance(self) -> float | None:
        """Value over tolerance, for a tolerance of rounding that is not zero; else None."""
        if not self.rounding or not self.tolerance or self.value is None:
            return None
        return self.value / self.tolerance

    def record(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in RECORDED}

    def __str__(self) -> str:
        where = f"{self.experiment}: {self.quantity}" + (f", {self.scene}" if self.scene else "")
        if not self.judged:
            return f"{where}: not judged, {self.note}"
        if self.rule == "equal" and self.value is None and self.note:  # only the reason matters
            return f"{where}: no, {self.note}"
        value = "no number" if self.value is None else f"{self.value:.3g} {self.unit}".rstrip()
        tolerance, note = f"{self.tolerance:.3g} {self.unit}".rstrip(), f" ({self.note})" if self.note else ""
        return f"{where}: {value}, must be {self.rule.replace('equal', 'equal to')} {tolerance}{note}"


@dataclass
class Result:
    """The result of an experiment; a subclass has what its figures need, too."""

    experiment: str
    rows: list[Any] = field(default_factory=list)  # each a Row
    checks: list[Check] = field(default_factory=list)
    causes: list[Cause] = field(default_factory=list)  # of failing checks
    notes: list[Finding] = field(default_factory=list)  # for the report
    shown: Sequence[str] | None = None  # columns of the table in the report; None: all; []: it is only a file
    tables: dict[str, Any] = field(default_factory=dict)  # further tables by name: lists of rows
    filed: Sequence[str] = ()  # names of further tables that are only files
    top: list[Finding] = field(default_factory=list)  # for the top of the report and for the terminal
    label: str = "TMT"  # of the engine that is compared with MuJoCo
    headline: Finding | None = None  # for the first screen; None: the number of checks that pass
    repeated: dict[str, Any] = field(default_factory=dict)  # what reproduce.py repeats, as JSON has it
    answer: Finding | None = None  # added to the answers to the assignment's questions that name it

    def finding(self, kind: str, of: str = "", **values: Any) -> Finding:
        """A finding of this experiment's template, or of the template `of`."""
        return Finding(of or self.experiment, kind, values)

    def find(self, kind: str, of: str = "", **values: Any) -> None:
        self.notes.append(self.finding(kind, of, **values))

    def check(
        self, scene: str, quantity: str, value: float | None, tolerance: float, unit: str, note: str = "",
        rounding: bool = False, rule: str = "at most", about: About = About.MODELS,
    ) -> Check:  # fmt: skip
        """Add a check; a value that is None or not finite fails."""
        number = None if value is None or not np.isfinite(value) else float(value)
        numbers = number, float(tolerance), unit
        self.checks.append(Check(self.experiment, scene, quantity, *numbers, note, rounding, rule, about))
        return self.checks[-1]

    def not_judged(
        self, scene: str, quantity: str, reason: str, unit: str = "", about: About = About.MODELS
    ) -> None:
        """Add a check that was not judged: it neither passes nor fails, and nothing is said to agree."""
        check = Check(self.experiment, scene, quantity, None, 0.0, unit, reason, about=about, judged=False)
        self.checks.append(check)


def largest_known(values: Sequence[float | None]) -> float | None:
    """The largest of the values that are not None; inf where one is not a number; None if there is none."""
    known = [float(value) for value in values if value is not None]
    return np.inf if np.isnan(known).any() else max(known, default=None)
