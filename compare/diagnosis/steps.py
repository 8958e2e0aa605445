"""Which scheme, step and implicit terms explain single steps of an integrator, where Mbar, h and accelerations agree.

Each of many states is taken one dt further; as every step starts anew, nothing is carried along. Rank 1: another scheme of tmt;
rank 2: another dt, or a term that is left out or has the wrong sign in the linear system of an implicit Euler step.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import tmt
from tmt.equations import composite
from tmt.methods import SemiImplicitEuler, method_named, one_step

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from .words import Cause, nice

SEVERAL = 8.0  # sums of a step, each with its rounding
ROUNDS_OF_DT = 30
FEW_STAGES = 4  # of a scheme whose dt is fitted beside it
FEW_STEPS = 3  # states at which dt is fitted
ALMOST = 1e-6  # relative change of dt in a derivative by it


class Steps(NamedTuple):
    """One step of each of many states, as some integrator took them."""

    q: np.ndarray  # (states, nq)
    qd: np.ndarray  # (states, nv)
    tau: np.ndarray  # (states, nv)
    dt: float  # s, as it is said to be
    after_q: np.ndarray
    after_qd: np.ndarray


@dataclass(frozen=True)
class Altered(SemiImplicitEuler):
    """The implicit Euler step with factors of what its linear system has: dt D and dt dh/dqd; 1 is right."""

    of_damping: float = 1.0
    of_bias: float = 1.0

    def matrix(self, tree, q, qd, dt, terms=composite.mass_matrix_and_bias):
        right = SemiImplicitEuler.matrix(self, tree, q, qd, dt, terms)
        undamped = SemiImplicitEuler(implicit_bias=False).matrix(tree, q, qd, dt, terms)  # Mbar + dt D
        return [
            [
                undamped[i][j]
                + self.of_bias * (right[i][j] - undamped[i][j])
                + (self.of_damping - 1.0) * dt * (tree.damping[i] if i == j else 0.0)
                for j in range(len(qd))
            ]
            for i in range(len(qd))
        ]


def stepped_once(stepping, tree: tmt.Tree, steps: Steps, dt: float) -> np.ndarray:
    """Positions and speeds one dt later, (states, nq + nv)."""
    states = len(steps.q)
    with np.errstate(all="ignore"):
        q, qd = one_step(stepping, tree, *(list(part.T.copy()) for part in (steps.q, steps.qd, steps.tau)), dt)
    return np.stack([np.broadcast_to(x, states) for x in (*q, *qd)], axis=-1)


def diagnose_steps(tree: tmt.Tree, steps: Steps, scheme: str) -> tuple[float, tuple[Cause, ...]]:
    """The largest difference over its tolerance, and what explains it: all causes of the first rank in which something does.

    scheme: of tmt.METHODS, what the steps are said to be.
    """
    given = np.concatenate([steps.after_q, steps.after_qd], axis=1)
    right = stepped_once(method_named(scheme), tree, steps, steps.dt)
    allowed, size = tolerance_of_step(tree, steps), float(np.linalg.norm(given - right))

    def ratio(values: np.ndarray) -> float:
        return float(np.nan_to_num(np.abs(given - values) / allowed, nan=np.inf).max())

    off = ratio(right)
    if off <= 1.0:
        return off, ()

    def cause(rank, kind, place, stated, explains, unit, values, text) -> Cause:
        left = float(np.linalg.norm(given - values)) / size
        return Cause(rank, kind, place, stated, explains, unit, left, 0, text)

    causes = []
    others = differing(tree, steps, [name for name in fixed_schemes() if name != scheme])
    few = Steps(*(part[:FEW_STEPS] if np.ndim(part) else part for part in steps))

    def fitted(name: str) -> float:
        """The dt of a scheme that comes closest at a few states."""
        return fitted_dt(
            lambda dt: stepped_once(method_named(name), tree, few, dt), given[:FEW_STEPS], allowed[:FEW_STEPS], steps.dt
        )

    for name in others:
        values = stepped_once(method_named(name), tree, steps, steps.dt)
        if ratio(values) <= 1.0:
            causes.append(
                cause(1, "scheme", "scheme", scheme, name, "", values, f"scheme: {name} in place of {scheme}")
            )
    causes = [
        c for k, c in enumerate(causes) if c.explains in differing(tree, steps, [d.explains for d in causes[: k + 1]])
    ]
    if not causes:
        for place, explains, altered in terms_of(scheme, tree):
            values = stepped_once(altered, tree, steps, steps.dt)
            if ratio(values) <= 1.0:
                causes.append(cause(2, "term", place, "right", explains, "", values, f"{place}: {explains}"))
    if not causes:
        dt = fitted(scheme)
        values = stepped_once(method_named(scheme), tree, steps, dt)
        if ratio(values) <= 1.0:
            text = f"dt: {nice(dt)} s in place of {nice(steps.dt)}"
            causes.append(cause(2, "number", "dt", steps.dt, dt, "s", values, text))
    if not causes:
        for name in (name for name in others if method_named(name).stages <= FEW_STAGES):
            dt = fitted(name)
            values = stepped_once(method_named(name), tree, steps, dt)
            if ratio(values) <= 1.0:
                text = f"scheme: {name} in place of {scheme} and dt: {nice(dt)} s in place of {nice(steps.dt)}"
                pair = "scheme and dt", f"{scheme} and {nice(steps.dt)}", f"{name} and {nice(dt)}", "s"
                causes.append(cause(3, "scheme and number", *pair, values, text))
    return off, tuple(one._replace(tied=len(causes) - 1) for one in causes)


def fixed_schemes() -> list[str]:
    """The methods of tmt whose step is a formula: not those that choose their own or solve for their stages."""
    methods = {name: method_named(name) for name in tmt.METHODS}
    return [name for name, method in methods.items() if not (method.adaptive or method.solves_stages)]


def differing(tree: tmt.Tree, steps: Steps, names: list[str]) -> list[str]:
    """Of schemes that do the same for this tree the first."""
    kept = {}
    for name in names:
        kept.setdefault(stepped_once(method_named(name), tree, steps, steps.dt).tobytes(), name)
    return list(kept.values())


def terms_of(scheme: str, tree: tmt.Tree) -> Iterator[tuple[str, str, object]]:
    """Implicit terms done wrongly: place, what explains, and the method with it."""
    method = method_named(scheme)
    if not isinstance(method, SemiImplicitEuler):
        return
    fields = (method.implicit_bias, method.lone_bodies, method.implicit_springs)
    if method.implicit_bias:
        place = "derivative of the bias in the implicit step"
        for factor, word in ((-1.0, "enters with the wrong sign"), (0.0, "left out"), (0.5, "halved"), (2.0, "twice")):
            yield place, word, Altered(*fields, of_bias=factor)
    if any(tree.damping):
        place = "damping in the implicit step"
        for factor, word in ((0.0, "explicit"), (-1.0, "enters with the wrong sign"), (0.5, "halved"), (2.0, "twice")):
            yield place, word, Altered(*fields, of_damping=factor)
        if method.implicit_bias:
            yield "damping and bias in the implicit step", "explicit", Altered(*fields, of_damping=0.0, of_bias=0.0)


def fitted_dt(step: Callable[[float], np.ndarray], given: np.ndarray, allowed: np.ndarray, dt: float) -> float:
    """The dt whose step comes closest, by Gauss and Newton, from the best of a few starts."""

    def left(x: float) -> np.ndarray:
        return np.nan_to_num((given - step(x)) / allowed, nan=1e300, posinf=1e300, neginf=-1e300)

    starts = dt * np.array([0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0])
    x = min(starts, key=lambda x: np.linalg.norm(left(x)))
    for _ in range(ROUNDS_OF_DT):
        slope = (left(x * (1.0 + ALMOST)) - left(x * (1.0 - ALMOST))).ravel() / (2.0 * ALMOST * x)
        squared = slope @ slope
        if not np.isfinite(squared) or squared == 0.0:
            break
        move = -(slope @ left(x).ravel()) / squared
        x += float(np.clip(move, -0.5 * x, x))
        if abs(move) <= EPS * x:
            break
    return float(x)


def tolerance_of_step(tree: tmt.Tree, steps: Steps) -> np.ndarray:
    """Of positions and speeds after a step, (states, nq + nv): rounding of their sums and of the accelerations."""
    scale = Entries(tree, steps.q, steps.qd)
    force = scale.force(steps.tau)
    size = np.abs(steps.after_qd - steps.qd) / steps.dt
    of_speeds = np.abs(steps.qd) + np.abs(steps.after_qd) + steps.dt * scale.acceleration(force, size)
    each = np.abs(steps.q) + np.abs(steps.after_q)
    if tree.coordinates.nq == tree.coordinates.nv:
        of_positions = each + steps.dt * of_speeds
    else:  # what turns a quaternion is bounded by the fastest rate
        of_positions = each + 1.0 + steps.dt * of_speeds.max(axis=1, keepdims=True)
    return SEVERAL * FACTOR * EPS * np.concatenate([of_positions, of_speeds], axis=1)
