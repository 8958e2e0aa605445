"""Checks and their rules, and what an experiment finds: rows, checks, curves and sentences."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from tmt.exact.values import distance

from .finding import Finding
from .scale import EPS, FACTOR

AGREEMENT = [
    "scene",
    "quantity",
    "unit",
    "states",
    "largest_difference",
    "worst_difference",
    "bar",
    "difference_over_bar",
]

RULES = {  # of a verdict: the words between a value and its tolerance, and what passes
    "at most": lambda value, tolerance: value <= tolerance,
    "at least": lambda value, tolerance: value >= tolerance,
    "equal": lambda value, tolerance: value == tolerance,
}


ENDS, AT_OWN_STEP = "runs to its end", "stable at its own step"  # names of checks


class About(Enum):
    """What a check is about; only those of the first kind say whether the two models agree."""

    MODELS = "numbers of the two models, or of one of them and the exact or stated value"
    PREDICTION = "what a run is predicted to do: its limit, its order, when it leaves"
    STEP = "whether the step at which the robot is used is stable"
    PROGRAM = "whether the program could go on"


@dataclass(frozen=True)
class Check:
    """One verdict, named by what holds when it passes: the value is at most, at least or equal to the tolerance.

    value None where a run diverged, or there is no number: that never passes.
    """

    experiment: str
    scene: str
    quantity: str
    value: float | None
    tolerance: float
    unit: str
    note: str = ""
    rounding: bool = False  # the tolerance is a bound of rounding, not a printed digit or a count
    rule: str = "at most"
    about: About = About.MODELS

    def __post_init__(self):
        if self.rule not in RULES or not np.isfinite(self.tolerance):
            raise ValueError(f"{self.quantity!r}: {self.rule!r} {self.tolerance} is no rule with a finite tolerance")

    @property
    def passed(self) -> bool:
        return self.value is not None and bool(RULES[self.rule](self.value, self.tolerance))

    @property
    def over_tolerance(self) -> float | None:
        """How much of a tolerance of rounding is used; None if it is no such tolerance, or zero, or there is no value."""
        return self.value / self.tolerance if self.rounding and self.tolerance and self.value is not None else None

    def record(self) -> dict:
        names = ("experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "passed", "note")
        return {name: getattr(self, name) for name in names}

    def __str__(self):
        found = "no number" if self.value is None else f"{self.value:.3g} {self.unit}".rstrip()
        wanted = f"{self.tolerance:.3g} {self.unit}".rstrip()
        where = f", {self.scene}" if self.scene else ""
        if self.rule == "equal" and self.value is None and self.note:  # there is nothing but the reason to tell
            return f"{self.experiment}: {self.quantity}{where}: no, {self.note}"
        note = f" ({self.note})" if self.note else ""
        rule = self.rule.replace("equal", "equal to")
        return f"{self.experiment}: {self.quantity}{where}: {found}, must be {rule} {wanted}{note}"


@dataclass
class Result:
    """What an experiment found: rows of its table, checks, and the numbers that its figures draw."""

    experiment: str
    rows: list = field(default_factory=list)
    checks: list = field(default_factory=list)
    curves: dict = field(default_factory=dict)
    notes: list = field(default_factory=list)  # Findings for the report
    shown: list | None = None  # columns of the table in the report, if not all; none: only in its file
    tables: dict = field(default_factory=dict)  # further tables by name: lists of rows
    filed: tuple = ()  # further tables, by name, that stand in their files alone
    top: list = field(default_factory=list)  # Findings for the top of the report and for the terminal
    label: str = "TMT"  # of the engine that MuJoCo is compared with
    headline: Finding | None = None  # its one number, on the first screen; None: how many checks pass

    def finding(self, kind: str, of: str = "", **values) -> Finding:
        """A sentence of this experiment's template, or of another one."""
        return Finding(of or self.experiment, kind, values)

    def find(self, kind: str, of: str = "", **values) -> None:
        """Add such a sentence to what was found."""
        self.notes.append(self.finding(kind, of, **values))

    def check(
        self, scene, quantity, value, tolerance, unit, note="", rounding=False, rule="at most", about=About.MODELS
    ) -> Check:
        """Add a check; a value that is None or not finite stands for a run that gave no number, and fails."""
        value = None if value is None or not np.isfinite(value) else float(value)
        one = Check(self.experiment, scene, quantity, value, float(tolerance), unit, note, rounding, rule, about)
        self.checks.append(one)
        return self.checks[-1]

    def agree(self, sample, quantity, unit, values, mujoco_values, scale, truth=None) -> None:
        """A row and a check: the worst difference of the two engines over the states, the closest to its tolerance.

        values, mujoco_values: (states, ...); scale: a number or (states,), or of as many dimensions as the values, a
        scale for each entry; truth: the name of a field of tmt.exact.values.Truth, for one more check of each engine that has an
        exact state: its distance from the exact value, 64 eps x scale too.
        """
        states = len(sample.q)
        between = f"{self.label} to MuJoCo"
        pairs = {between: np.abs(np.subtract(values, mujoco_values))}
        known = sample.truth(truth) if truth else ()
        if len(known):
            for engine, found in ((self.label, values), ("MuJoCo", mujoco_values)):
                with np.errstate(invalid="ignore"):  # one's own equations may give no numbers
                    pairs[f"{engine} to exact"] = distance(found[: len(known)], known)
        apart = {name: worst_of_each(differences, scale) for name, differences in pairs.items()}
        in_eps = {name: over(d, EPS * s) for name, (d, s) in apart.items()}
        difference, scale = apart[between]

        def check_closest(quantity, difference, scale):
            """A check of the state that comes closest to its tolerance, and which one that is."""
            tolerance = FACTOR * EPS * scale
            (k,) = closest(difference, tolerance)
            return self.check(sample.name, quantity, difference[k], tolerance[k], unit, sample.describe(k), True), k

        check, worst = check_closest(quantity, difference, scale)
        for name in list(apart)[1:]:
            check_closest(f"{quantity}, {name}", *apart[name])
        self.rows.append(
            {
                "scene": sample.name,
                "quantity": quantity,
                "unit": unit,
                "states": states,
                "largest_difference": float(difference.max()) if np.isfinite(difference).all() else None,
                "worst_difference": check.value,
                "bar": check.tolerance,
                "difference_over_bar": check.over_tolerance,
                "scale": scale[worst],
                "difference_eps": in_eps[between].max(),
                f"{self.label.lower()}_from_exact_eps": in_eps[f"{self.label} to exact"].max() if len(known) else None,
                "mujoco_from_exact_eps": in_eps["MuJoCo to exact"].max() if len(known) else None,
                "exact_states": len(known) if truth else None,
                "worst_state": check.note,
                "worst_q": all_digits(sample.q[worst]),
                "worst_qd": all_digits(sample.qd[worst]),
                "worst_tau": all_digits(sample.tau[worst]),
                "passed": check.passed,
            }
        )
        curves = {name: np.sort(values) for name, values in in_eps.items()}
        self.curves.setdefault(sample.name, {})[quantity] = curves
        self.shown = [*AGREEMENT, *(f"{engine.lower()}_from_exact_eps" for engine in (self.label, "MuJoCo"))]


def agreement_headline(result: Result) -> Finding | None:
    """The difference that comes closest to its tolerance, or is farthest beyond it."""
    missing = [row for row in result.rows if row["worst_difference"] is None]
    known = [row for row in result.rows if row["difference_over_bar"] is not None]
    top = missing[0] if missing else max(known, key=lambda row: row["difference_over_bar"], default=None)
    if top is None:
        return None
    values = {"difference": top["worst_difference"], "unit": top["unit"], "share": top["difference_over_bar"]}
    return Finding("shared", "agreement_headline", {"quantity": top["quantity"], **values})


def largest_known(values: Sequence[float | None]) -> float | None:
    """The largest of the values that are not None; inf where one is not a number; None if there is none."""
    known = [float(value) for value in values if value is not None]
    return None if not known else np.inf if np.isnan(known).any() else max(known)


def closest(difference: np.ndarray, tolerance: np.ndarray) -> tuple[int, ...]:
    """The place of the difference that comes closest to its tolerance, of a shape that stands for the same.

    One that is no number comes before all, and so does any where none is allowed.
    """
    difference, tolerance = np.broadcast_arrays(np.abs(difference), tolerance)
    share = np.where(np.isfinite(difference), over(difference, tolerance), np.inf)
    return tuple(map(int, np.unravel_index(np.argmax(share), share.shape)))


def over(difference: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """A difference over its scale, of the same shape; nothing over nothing is 0."""
    return np.divide(difference, scale, out=np.where(difference == 0.0, 0.0, np.inf), where=scale > 0.0)


def all_digits(values: Iterable[float]) -> str:
    """Numbers with all their digits, for whoever wants to see a state again."""
    return " ".join(repr(float(v)) for v in values)


def worst_of_each(differences: np.ndarray, scale: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Of each state the difference that is closest to its tolerance, and its scale, (states,) each.

    differences: (states, ...); scale: a number or (states,), or of as many dimensions as the differences, and of more states.
    """
    states = len(differences)
    if np.ndim(scale) < 2:
        return largest(differences), np.broadcast_to(scale, max(states, np.size(scale)))[:states]
    scale = scale[:states] if len(scale) > 1 else scale
    differences, scale = (a.reshape(states, -1) for a in np.broadcast_arrays(np.abs(differences), scale))
    share = np.where(np.isfinite(differences), over(differences, scale), np.inf)
    entry = np.arange(states), share.argmax(axis=1)
    return differences[entry], scale[entry]


def largest(values: ArrayLike) -> np.ndarray:
    """The largest absolute value of each state, (states, ...) -> (states,)."""
    values = np.abs(np.asarray(values, dtype=float))
    return values.reshape(len(values), -1).max(axis=1)
