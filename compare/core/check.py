"""Checks and their rules, and the result of an experiment: rows, checks, curves and findings."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from .finding import Finding

RULES = {  # which values pass
    "at most": lambda value, tolerance: value <= tolerance,
    "at least": lambda value, tolerance: value >= tolerance,
    "equal": lambda value, tolerance: value == tolerance,
}
ENDS = "runs to its end"  # names of checks
AT_OWN_STEP, AT_REQUESTED_STEP = "stable at its own step", "stable at the requested step"


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

    value: None where a run diverged or a value is not finite; that never passes. judged: False where the comparison could
    not have failed, or could not be made; the note says why. It is neither passed nor failed.
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

    def __post_init__(self):
        if self.rule not in RULES or not np.isfinite(self.tolerance):
            raise ValueError(
                f"{self.quantity!r}: unknown rule {self.rule!r} or infinite tolerance {self.tolerance}"
            )

    @property
    def passed(self) -> bool:
        return self.judged and self.value is not None and bool(RULES[self.rule](self.value, self.tolerance))

    @property
    def failed(self) -> bool:
        return self.judged and not self.passed

    @property
    def over_tolerance(self) -> float | None:
        """Value over tolerance, for a tolerance of rounding that is not zero; else None."""
        return (
            self.value / self.tolerance
            if self.rounding and self.tolerance and self.value is not None
            else None
        )

    def record(self) -> dict:
        names = (
            "experiment",
            "scene",
            "quantity",
            "rule",
            "value",
            "tolerance",
            "unit",
            "judged",
            "passed",
            "note",
        )
        return {name: getattr(self, name) for name in names}

    def __str__(self):
        where = f"{self.experiment}: {self.quantity}" + (f", {self.scene}" if self.scene else "")
        if not self.judged:
            return f"{where}: not judged, {self.note}"
        if self.rule == "equal" and self.value is None and self.note:  # only the reason matters
            return f"{where}: no, {self.note}"
        value = "no number" if self.value is None else f"{self.value:.3g} {self.unit}".rstrip()
        rule, note = self.rule.replace("equal", "equal to"), f" ({self.note})" if self.note else ""
        return f"{where}: {value}, must be {rule} {f'{self.tolerance:.3g} {self.unit}'.rstrip()}{note}"


@dataclass
class Result:
    """The result of an experiment: rows of its table, checks, findings, and the data of its figures."""

    experiment: str
    rows: list = field(default_factory=list)
    checks: list = field(default_factory=list)
    curves: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)  # Findings for the report
    shown: list | None = None  # columns of the table in the report; None: all; []: the table is only a file
    tables: dict = field(default_factory=dict)  # further tables by name: lists of rows
    filed: tuple = ()  # names of further tables that are only files
    top: list = field(default_factory=list)  # Findings for the top of the report and for the terminal
    label: str = "TMT"  # of the engine that is compared with MuJoCo
    headline: Finding | None = None  # for the first screen; None: the number of checks that pass

    def finding(self, kind: str, of: str = "", **values) -> Finding:
        """A finding of this experiment's template, or of the template `of`."""
        return Finding(of or self.experiment, kind, values)

    def find(self, kind: str, of: str = "", **values) -> None:
        self.notes.append(self.finding(kind, of, **values))

    def check(
        self,
        scene,
        quantity,
        value,
        tolerance,
        unit,
        note="",
        rounding=False,
        rule="at most",
        about=About.MODELS,
    ) -> Check:
        """Add a check; a value that is None or not finite fails."""
        value = None if value is None or not np.isfinite(value) else float(value)
        check = Check(
            self.experiment, scene, quantity, value, float(tolerance), unit, note, rounding, rule, about
        )
        self.checks.append(check)
        return check

    def not_judged(self, scene, quantity, reason: str, unit="", about=About.MODELS) -> Check:
        """Add a check that was not judged: it neither passes nor fails, and no verdict says that the models agree."""
        check = Check(self.experiment, scene, quantity, None, 0.0, unit, reason, about=about, judged=False)
        self.checks.append(check)
        return check


def largest_known(values: Sequence[float | None]) -> float | None:
    """The largest of the values that are not None; inf where one is not a number; None if there is none."""
    known = [float(value) for value in values if value is not None]
    return None if not known else np.inf if np.isnan(known).any() else max(known)
