"""Whether Mbar and h can belong together, whatever the model is; no reference is needed.

Mbar must be symmetric and positive definite; h at rest must be the gradient of an energy; h - h(q, 0) must be quadratic in the
speeds, and its power must be qd' Mdot qd / 2. Derivatives are central differences of fourth order; their error is estimated
with a step twice as long. Noise in the values (single precision, interpolated tables) is measured first, by differences of sixth
order over short steps, and added to every tolerance.
"""

from collections.abc import Callable, Sequence
from math import comb
from typing import NamedTuple

import numpy as np

from ..judge.check import closest
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR
from ..report.text import say
from ..robots.coordinates import Coordinates
from .cause import TEMPLATE

STEP = 2e-3  # rad or m, or s along a motion of about one rad/s
SAFETY = 8.0  # times the error or the noise that is estimated
CLOSE_BY = 1e-4  # rad or m, between the points at which noise is measured
ORDER = 6


class Condition(NamedTuple):
    """One condition at the state that comes closest to breaking it."""

    name: str
    value: float
    tolerance: float
    unit: str
    finding: Finding  # what is wrong where it is not met
    rule: str = "at most"  # or "at least"

    @property
    def text(self) -> str:
        return say(self.finding)

    @property
    def is_met(self) -> bool:
        return bool(self.value <= self.tolerance if self.rule == "at most" else self.value >= self.tolerance)


def conditions(
    mass_matrix: Callable, bias: Callable, coordinates: Coordinates, q: np.ndarray, qd: np.ndarray
) -> list[Condition]:
    """The conditions on mass_matrix(q) (states, nv, nv) and bias(q, qd) (states, nv), at states q (states, nq), qd (states, nv).

    The power is evaluated only for a symmetric M, and without the part of h that is linear in the speeds.
    """
    M, still = np.asarray(mass_matrix(q)), np.zeros_like(qd)
    floors = FACTOR * EPS * np.abs(M).max(axis=(1, 2)) + SAFETY * noise(mass_matrix, coordinates, q)
    of_h = SAFETY * noise(lambda q: bias(q, qd), coordinates, q)
    names = coordinates.speeds
    tested = [symmetric(M, floors, names), definite(M, floors)]
    tested.append(gradient_at_rest(lambda q: bias(q, np.zeros((len(q), qd.shape[1]))), coordinates, q, of_h))
    weight, ahead, behind = (np.asarray(bias(q, rates)) for rates in (still, qd, -qd))
    doubled = (np.asarray(bias(q, 2.0 * qd)) + np.asarray(bias(q, -2.0 * qd))) / 2.0
    size = np.max([np.abs(part) for part in (weight, ahead, behind, doubled)], axis=(0, 2))
    size = FACTOR * EPS * size + of_h
    tested.append(even(ahead, behind, size, names))
    of_rates = (ahead + behind) / 2.0 - weight
    tested.append(quadratic(of_rates, doubled - weight, size, names))
    if tested[0].is_met:
        tested.append(power_balance(mass_matrix, coordinates, q, qd, of_rates, floors, size))
    return [condition for condition in tested if condition is not None]


def noise(function: Callable, coordinates: Coordinates, q: np.ndarray) -> float:
    """The noise in function(q) (states, ...), the largest of all states and entries, as a standard deviation.

    Differences of sixth order of values close by; a smooth function leaves nothing of size there.
    """
    direction = np.random.default_rng(0).uniform(0.5, 1.0, coordinates.nv)
    points = [np.asarray(function(coordinates.move(q, k * CLOSE_BY * direction))) for k in range(ORDER + 1)]
    difference = sum((-1) ** k * comb(ORDER, k) * values for k, values in enumerate(points))
    return float(np.abs(difference).max()) / np.sqrt(comb(2 * ORDER, ORDER))


def symmetric(M: np.ndarray, allowed: np.ndarray, names: Sequence[str]) -> Condition:
    skew = np.abs(M - np.swapaxes(M, 1, 2))
    (s,) = closest(skew.max(axis=(1, 2)), allowed)
    i, j = np.unravel_index(np.argmax(skew[s]), skew[s].shape)
    wrong = Finding(TEMPLATE, "symmetric", {"names": (names[i], names[j]), "values": (M[s, i, j], M[s, j, i])})
    return Condition("M is symmetric", float(skew[s].max()), float(allowed[s]), "kg m2", wrong)


def definite(M: np.ndarray, allowed: np.ndarray) -> Condition:
    """In units of its diagonal, where entries may be kg and kg m2."""
    M = (M + np.swapaxes(M, 1, 2)) / 2.0
    diagonal = np.einsum("sii->si", M)
    root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    least = np.linalg.eigvalsh(M / (root[:, :, None] * root[:, None, :]))[:, 0]
    s = int(np.argmin(least))
    floor = allowed[s] / diagonal[s].max() if diagonal[s].max() > 0.0 else 0.0
    wrong = Finding(TEMPLATE, "definite", {"least": least[s]})
    return Condition("M is positive definite", float(least[s]), float(floor), "", wrong, "at least")


def gradient_at_rest(weight: Callable, coordinates: Coordinates, q: np.ndarray, floor: float) -> Condition | None:
    """dh_i/dq_j at rest is symmetric, in hinges and slides; None where there is one of them at most."""
    straight = [
        by.start for kind, by in zip(coordinates.all_kinds, (p.qd for p in coordinates.places.joints)) if kind != "ball"
    ]
    if len(straight) < 2:
        return None
    nv, rows, sizes, errors = coordinates.nv, [], [], []
    for j in straight:
        slope, error, size = derivative(lambda t, j=j: weight(coordinates.move(q, t * np.eye(nv)[j]))[:, straight])
        rows.append(slope)
        errors.append(error)
        sizes.append(size)
    slopes, errors = np.stack(rows, axis=2), np.stack(errors, axis=2)  # (states, i, j)
    curl = np.abs(slopes - np.swapaxes(slopes, 1, 2))
    rounding = (FACTOR * EPS * np.max(sizes, axis=(0, 2)) + floor) / STEP
    allowed = SAFETY * (errors + np.swapaxes(errors, 1, 2)) + rounding[:, None, None]
    s, a, b = closest(curl, allowed)
    one, other = coordinates.speeds[straight[a]], coordinates.speeds[straight[b]]
    wrong = Finding(TEMPLATE, "gradient", {"names": (one, other), "values": (slopes[s, a, b], slopes[s, b, a])})
    return Condition("h at rest is a gradient", float(curl[s, a, b]), float(allowed[s, a, b]), "N m/rad", wrong)


def even(ahead: np.ndarray, behind: np.ndarray, allowed: np.ndarray, names: Sequence[str]) -> Condition:
    """h(q, qd) = h(q, -qd)."""
    odd = np.abs(ahead - behind) / 2.0
    (s,) = closest(odd.max(axis=1), allowed)
    i = int(np.argmax(odd[s]))
    wrong = Finding(TEMPLATE, "even", {"name": names[i], "value": odd[s, i]})
    return Condition("h is even in the rates", float(odd[s, i]), float(allowed[s]), "N m", wrong)


def quadratic(of_rates: np.ndarray, doubled: np.ndarray, floor: np.ndarray, names: Sequence[str]) -> Condition:
    """At twice the speed the velocity terms are four times as large."""
    off = np.abs(doubled - 4.0 * of_rates)
    allowed = 4.0 * floor
    (s,) = closest(off.max(axis=1), allowed)
    i = int(np.argmax(off[s]))
    factor = doubled[s, i] / of_rates[s, i] if of_rates[s, i] else np.inf
    wrong = Finding(TEMPLATE, "quadratic", {"name": names[i], "factor": factor})
    return Condition("h is quadratic in the rates", float(off[s, i]), float(allowed[s]), "N m", wrong)


def power_balance(
    mass_matrix: Callable,
    coordinates: Coordinates,
    q: np.ndarray,
    qd: np.ndarray,
    of_rates: np.ndarray,
    floor_M: np.ndarray,
    floor_h: np.ndarray,
) -> Condition:
    """qd' (h - h at rest) = qd' Mdot qd / 2, Mdot along the motion. floor_M, floor_h: rounding and noise of both, (states,)."""
    largest = np.abs(qd).max(axis=1, keepdims=True)
    rates = qd / np.where(largest > 0.0, largest, 1.0)  # of about 1, so that the step is one of positions
    sizes = np.abs(rates)

    def kinetic(t):
        M = np.asarray(mass_matrix(coordinates.move(q, t * rates)))
        return np.einsum("si,sij,sj->s", rates, M, rates) / 2.0

    slope, error, _ = derivative(kinetic)
    squared = largest[:, 0].clip(min=1e-300) ** 2
    given = np.einsum("si,si->s", rates, of_rates) / squared
    off = np.abs(given - slope)
    total = sizes.sum(axis=1)
    allowed = SAFETY * error + total**2 * floor_M / STEP + 2.0 * total * floor_h / squared
    (s,) = closest(off, allowed)
    watts = largest[s, 0] ** 3
    wrong = Finding(TEMPLATE, "power", {"yours": given[s] * watts, "right": slope[s] * watts})
    name = "h belongs to M: qd'(h - h at rest) = qd' Mdot qd / 2"
    return Condition(name, float(off[s] * watts), float(allowed[s] * watts), "W", wrong)


def derivative(function: Callable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """df/dt at 0 to fourth order, its error estimated from two step sizes, and the size of f, all of the shape of f(t)."""
    values = {k: np.asarray(function(k * STEP)) for k in (-4, -2, -1, 1, 2, 4)}
    slope = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * STEP)
    coarse = (8.0 * (values[2] - values[-2]) - (values[4] - values[-4])) / (24.0 * STEP)
    # a sixteenth of the difference would do where it is smooth; with noise it is as large as the difference
    return slope, np.abs(slope - coarse), np.max([np.abs(value) for value in values.values()], axis=0)
