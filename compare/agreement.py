"""Two engines compared: checks and their rules, the states of a run, scales of tolerances.

A difference is judged against 64 x eps x scale. The scale of a quantity is the sum of the absolute
values of the terms that are added up in it, times the condition number of Mbar where a linear system is
solved; it is taken per state and is never the quantity itself (which may be zero).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

import tmt
from tmt.reference import distance, exact

from .engine import Engine
from .scenes import POSTURES, posture

EPS = float(np.finfo(float).eps)
FACTOR = 64
SEED = 10  # of every random number in a report
SHOWN = ["scene", "quantity", "unit", "states", "largest_difference", "worst_difference", "bar", "difference_over_bar",
         "tmt_from_exact_eps", "mujoco_from_exact_eps"]  # fmt: skip


RULES = {  # of a verdict: the words between a value and its tolerance, and what passes
    "at most": lambda value, tolerance: value <= tolerance,
    "at least": lambda value, tolerance: value >= tolerance,
    "equal": lambda value, tolerance: value == tolerance,
}


# checks that fail where the program could not go on: they say nothing of an agreement
ENDS, DRAWN, LOCKABLE = "runs to its end", "figure", "models whose hinges can be locked"


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

    def __post_init__(self):
        if self.rule not in RULES or not np.isfinite(self.tolerance):
            raise ValueError(f"{self.quantity!r}: {self.rule!r} {self.tolerance} is no rule with a finite tolerance")

    @property
    def passed(self) -> bool:
        return self.value is not None and bool(RULES[self.rule](self.value, self.tolerance))

    @property
    def over_bar(self) -> float | None:
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
    notes: list = field(default_factory=list)  # sentences for the report
    shown: list | None = None  # columns of the table in the report, if not all; none: only in its file
    tables: dict = field(default_factory=dict)  # further tables by name: lists of rows

    def check(self, scene, quantity, value, tolerance, unit, note="", rounding=False, rule="at most") -> Check:
        """Add a check; a value that is None or not finite stands for a run that gave no number, and fails."""
        value = None if value is None or not np.isfinite(value) else float(value)
        self.checks.append(Check(self.experiment, scene, quantity, value, float(tolerance), unit, note, rounding, rule))
        return self.checks[-1]

    def agree(self, sample, quantity, unit, tmt_values, mujoco_values, scale, truth=None) -> None:
        """A row and a check: the worst difference of both engines over the states, the closest to its tolerance.

        tmt_values, mujoco_values: (states, ...); scale: a number or (states,); truth: the name of a field of
        tmt.reference.Truth, for one more check of each engine: its distance from the exact value, 64 eps x scale too.
        """
        states = len(sample.q)
        scale = np.broadcast_to(scale, states)
        bar = FACTOR * EPS * scale
        apart = {"TMT to MuJoCo": largest(np.subtract(tmt_values, mujoco_values))}
        if truth:
            known = sample.truth(truth)
            for party, values in (("TMT", tmt_values), ("MuJoCo", mujoco_values)):
                apart[f"{party} to exact"] = largest(distance(values[: len(known)], known))
        in_eps = {name: d / (EPS * scale[: len(d)]) for name, d in apart.items()}
        difference = apart["TMT to MuJoCo"]

        def closest(quantity, difference):
            """A check of the state that comes closest to its bar, and which one that is."""
            share = np.where(np.isfinite(difference), difference / bar[: len(difference)], np.inf)
            k = int(np.argmax(share))
            return self.check(sample.name, quantity, difference[k], bar[k], unit, sample.describe(k), True), k

        check, worst = closest(quantity, difference)
        for name in list(apart)[1:]:
            closest(f"{quantity}, {name}", apart[name])
        self.rows.append(
            {
                "scene": sample.name,
                "quantity": quantity,
                "unit": unit,
                "states": states,
                "largest_difference": float(difference.max()) if np.isfinite(difference).all() else None,
                "worst_difference": check.value,
                "bar": check.tolerance,
                "difference_over_bar": check.over_bar,
                "scale": scale[worst],
                "difference_eps": in_eps["TMT to MuJoCo"].max(),
                "tmt_from_exact_eps": in_eps["TMT to exact"].max() if truth else None,
                "mujoco_from_exact_eps": in_eps["MuJoCo to exact"].max() if truth else None,
                "exact_states": len(known) if truth else None,
                "worst_state": check.note,
                "worst_q": numbers(sample.q[worst]),
                "worst_qd": numbers(sample.qd[worst]),
                "worst_tau": numbers(sample.tau[worst]),
                "passed": check.passed,
            }
        )
        curves = {name: np.sort(values) for name, values in in_eps.items()}
        self.curves.setdefault(sample.name, {})[quantity] = curves
        self.shown = SHOWN


def numbers(values) -> str:
    """Numbers with all their digits, for whoever wants to see a state again."""
    return " ".join(repr(float(v)) for v in values)


def largest(values) -> np.ndarray:
    """The largest absolute value of each state, (states, ...) -> (states,)."""
    values = np.abs(np.asarray(values, dtype=float))
    return values.reshape(len(values), -1).max(axis=1)


class Sample:
    """States at which the parties are compared, with the exact values of the first `exact_states`."""

    def __init__(self, name, q, qd, tau, exact_states, states=()):
        self.name, self.q, self.qd, self.tau = name, q, qd, tau
        self.exact_states, self.states = exact_states, states

    @cached_property
    def truths(self) -> list:
        known = slice(self.exact_states)
        return [exact(tmt.ARM, *state) for state in zip(self.q[known], self.qd[known], self.tau[known])]

    def truth(self, quantity) -> np.ndarray:
        return np.array([getattr(truth, quantity) for truth in self.truths])

    def describe(self, i) -> str:
        """Where state i is, for a reader who wants to see it again."""
        if self.states:
            return self.states[i]
        return f"state {i}: q = ({', '.join(f'{a:.4f}' for a in self.q[i])}) rad"

    def each(self) -> list["Sample"]:
        """One sample for each state, by its own name."""
        singles = []
        for i, name in enumerate(self.states):
            single = Sample(name, *(a[i : i + 1] for a in (self.q, self.qd, self.tau)), 1, (name,))
            single.truths = self.truths[i : i + 1]
            singles.append(single)
        return singles


@dataclass(frozen=True)
class Setup:
    """What an experiment needs: the engine under judgement, the states, how many of them."""

    engine: Engine
    states: int = 10_000  # random states
    exact_states: int = 200  # of these, how many are held against the exact values too
    map: Callable = map  # where the scenes of an experiment may run side by side
    quiet: Callable = lambda: None  # waits until nothing runs beside: for timings
    tell: Callable = lambda text: None  # says how far long work has come
    background: dict = field(default_factory=dict)  # work under way, by its name
    steps: tuple = (64, 1024, 8192)  # of a trajectory: the assignment's dt = 5/64 s, and finer
    size: str = "full"  # or "quick": some paths, for a first answer in seconds; "small": all paths, as little as may be

    @property
    def is_quick(self) -> bool:
        return self.size == "quick"

    def of(self, full, quick, small):
        """What a run of this size takes."""
        return {"full": full, "quick": quick, "small": small}[self.size]

    @classmethod
    def quick(cls, engine, **more) -> "Setup":
        """Fewer of everything, for a first answer in seconds."""
        return cls(engine, states=1000, exact_states=20, steps=(64,), size="quick", **more)

    @classmethod
    def small(cls, engine, **more) -> "Setup":
        """Every path of a full run with few states and steps: for tests."""
        return cls(engine, states=50, exact_states=2, steps=(64, 128), size="small", **more)

    @cached_property
    def named(self) -> Sample:
        """The named postures, with random rates and torques where those are asked for."""
        rng = np.random.default_rng([SEED, 1])
        rates, torques = rng.uniform(-10.0, 10.0, (2, len(POSTURES), 3))
        q = np.array([posture(name) for name in POSTURES])
        return Sample("named postures", q, rates, torques, len(q), tuple(POSTURES))

    @cached_property
    def random(self) -> Sample:
        """Random states: q in [-pi, pi] rad, qd in [-10, 10] rad/s, tau in [-10, 10] N m."""
        rng = np.random.default_rng(SEED)
        q = rng.uniform(-np.pi, np.pi, (self.states, 3))
        rates, torques = rng.uniform(-10.0, 10.0, (2, self.states, 3))
        return Sample("random states", q, rates, torques, self.exact_states)


# scales: from the stated numbers and TMT's own terms, per state


def reaches(model=tmt.ARM) -> np.ndarray:
    """Largest distance of each centre of mass from the origin, m: lengths added along the tree, shape (m,)."""
    to_hinge = []
    for parent, offset in zip(model.parent, model.offset):
        to_hinge.append((to_hinge[parent] if parent >= 0 else 0.0) + np.linalg.norm(offset))
    to_hinge.append(0.0)  # of the world, hinge -1
    return np.array([to_hinge[hinge] + np.linalg.norm(com) for hinge, com in zip(model.body_hinge, model.com)])


def gravity_scale(model=tmt.ARM) -> float:
    """Sum of m g reach, N m or J."""
    return float(np.linalg.norm(model.gravity) * np.dot(model.mass, reaches(model)))


def bias_scale(q, qd, model=tmt.ARM) -> np.ndarray:
    """Convective + Euler + gravity terms of the bias, each by its absolute value, N m, (states,)."""
    T, B = tmt.jacobians(q, model)
    v_conv, w_conv = tmt.convective_terms(q, qd, model)
    omega = tmt.angular_velocities(q, qd, model)
    inertia = np.array(model.inertia)
    moments = np.abs(np.einsum("bij,sbj->sbi", inertia, w_conv))
    moments += np.abs(np.cross(omega, np.einsum("bij,sbj->sbi", inertia, omega)))
    newton = np.einsum("sbci,b,sbc->si", np.abs(T), model.mass, np.abs(v_conv))
    euler = np.einsum("sbci,sbc->si", np.abs(B), moments)
    return (newton + euler).max(axis=1) + gravity_scale(model)


def mass_scale(q) -> np.ndarray:
    """Largest entry of Mbar, kg m2, (states,)."""
    return np.abs(tmt.mass_matrix(q)).max(axis=(1, 2))


def condition(q) -> np.ndarray:
    """Condition number of Mbar in the 2-norm, (states,)."""
    return np.linalg.cond(tmt.mass_matrix(q))


def acceleration_scale(q, force, size=None) -> np.ndarray:
    """|Mbar^-1| (|Mbar| |qdd| + force), rad/s2, (states,): what errors of eps in Mbar and in the force do to qdd.

    force: scale of the forces, N m, (states,). size: |qdd| where it is known; without it, its bound |Mbar^-1| force,
    so that the scale is (cond(Mbar) + 1) |Mbar^-1| force. Norms of Mbar are its eigenvalues.
    """
    eigenvalues = np.linalg.eigvalsh(tmt.mass_matrix(q))
    size = force / eigenvalues[:, 0] if size is None else size
    return (eigenvalues[:, -1] * size + force) / eigenvalues[:, 0]
