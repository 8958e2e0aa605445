"""Whether Mbar and h can belong together, whatever the model is: found without any reference.

Mbar must be symmetric and positive definite; h at rest the gradient of an energy; h less h at rest quadratic in the rates, and
its power qd' (h - h(q, 0)) half of qd' Mdot qd along the motion. Derivatives are central differences of fourth order, whose error
is taken from a step twice as long. Noise in the values (single precision, constants of a table that are interpolated) is
measured first, by differences of sixth order over steps too short for anything else, and belongs to every tolerance.
"""

from collections.abc import Callable, Sequence
from math import comb
from typing import NamedTuple

import numpy as np

from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates

STEP = 2e-3  # rad or m, or s along a motion of about one rad/s
SAFETY = 8.0  # times the error or the noise that is estimated
CLOSE_BY = 1e-4  # rad or m, between the points at which noise is measured
ORDER = 6


class Condition(NamedTuple):
    """One condition at the state that comes closest to breaking it."""

    name: str  # what holds when it is met
    value: float
    tolerance: float
    unit: str
    state: int
    text: str  # what is wrong where it is not met
    rule: str = "at most"  # or "at least"

    @property
    def is_met(self) -> bool:
        return bool(self.value <= self.tolerance if self.rule == "at most" else self.value >= self.tolerance)


def conditions(
    mass_matrix: Callable, bias: Callable, coordinates: Coordinates, q: np.ndarray, qd: np.ndarray
) -> list[Condition]:
    """The conditions on mass_matrix(q) (states, nv, nv) and bias(q, qd) (states, nv), at states q (states, nq), qd (states, nv).

    A later one is asked only where those before it that it needs are met: of a bias with a part that is linear in the rates, the
    power is that of the rest.
    """
    M, still = np.asarray(mass_matrix(q)), np.zeros_like(qd)
    floors = FACTOR * EPS * np.abs(M).max(axis=(1, 2)) + SAFETY * noise(mass_matrix, coordinates, q)
    of_h = SAFETY * noise(lambda q: bias(q, qd), coordinates, q)
    names = coordinates.speeds
    found = [symmetric(M, floors, names), definite(M, floors)]
    found.append(gradient_at_rest(lambda q: bias(q, np.zeros((len(q), qd.shape[1]))), coordinates, q, of_h))
    weight, ahead, behind = (np.asarray(bias(q, rates)) for rates in (still, qd, -qd))
    doubled = (np.asarray(bias(q, 2.0 * qd)) + np.asarray(bias(q, -2.0 * qd))) / 2.0
    size = np.max([np.abs(part) for part in (weight, ahead, behind, doubled)], axis=(0, 2))
    size = FACTOR * EPS * size + of_h
    found.append(even(ahead, behind, size, names))
    of_rates = (ahead + behind) / 2.0 - weight
    found.append(quadratic(of_rates, doubled - weight, size, names))
    if found[0].is_met:
        found.append(power_balance(mass_matrix, coordinates, q, qd, of_rates, floors, size))
    return [condition for condition in found if condition is not None]


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
    s = int(np.argmax(ratios(skew.max(axis=(1, 2)), allowed)))
    i, j = np.unravel_index(np.argmax(skew[s]), skew[s].shape)
    a, b = names[i], names[j]
    text = f"Your M is not symmetric: M[{a}][{b}] is {M[s, i, j]:.6g}, M[{b}][{a}] is {M[s, j, i]:.6g}."
    return Condition("M is symmetric", float(skew[s].max()), float(allowed[s]), "kg m2", s, text)


def definite(M: np.ndarray, allowed: np.ndarray) -> Condition:
    """In units of its diagonal, where entries may be kg and kg m2."""
    M = (M + np.swapaxes(M, 1, 2)) / 2.0
    diagonal = np.einsum("sii->si", M)
    root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    least = np.linalg.eigvalsh(M / (root[:, :, None] * root[:, None, :]))[:, 0]
    s = int(np.argmin(least))
    floor = allowed[s] / diagonal[s].max() if diagonal[s].max() > 0.0 else 0.0
    text = f"Your M is not positive definite: its least eigenvalue, in units of its diagonal, is {least[s]:.3g}."
    return Condition("M is positive definite", float(least[s]), float(floor), "", s, text, "at least")


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
    s, a, b = map(int, np.unravel_index(np.argmax(ratios(curl, allowed)), curl.shape))
    one, other = coordinates.speeds[straight[a]], coordinates.speeds[straight[b]]
    text = (
        f"Your h at rest is not the gradient of an energy: dh[{one}]/d {other} is {slopes[s, a, b]:.6g} and dh[{other}]/d "
        f"{one} is {slopes[s, b, a]:.6g}."
    )
    return Condition("h at rest is a gradient", float(curl[s, a, b]), float(allowed[s, a, b]), "N m/rad", s, text)


def even(ahead: np.ndarray, behind: np.ndarray, allowed: np.ndarray, names: Sequence[str]) -> Condition:
    """h(q, qd) = h(q, -qd)."""
    odd = np.abs(ahead - behind) / 2.0
    s = int(np.argmax(ratios(odd.max(axis=1), allowed)))
    i = int(np.argmax(odd[s]))
    text = f"Your bias is linear in qd: is damping in it? Of h[{names[i]}] {odd[s, i]:.3g} N m changes its sign with the rates."
    return Condition("h is even in the rates", float(odd[s, i]), float(allowed[s]), "N m", s, text)


def quadratic(of_rates: np.ndarray, doubled: np.ndarray, floor: np.ndarray, names: Sequence[str]) -> Condition:
    """Twice the rates, four times what they add to h."""
    off = np.abs(doubled - 4.0 * of_rates)
    allowed = 4.0 * floor
    s = int(np.argmax(ratios(off.max(axis=1), allowed)))
    i = int(np.argmax(off[s]))
    factor = doubled[s, i] / of_rates[s, i] if of_rates[s, i] else np.inf
    text = (
        f"Your h is not quadratic in the rates: at twice the rates their part of h[{names[i]}] is {factor:.4g} times as large, "
        "not 4."
    )
    return Condition("h is quadratic in the rates", float(off[s, i]), float(allowed[s]), "N m", s, text)


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
    s = int(np.argmax(ratios(off, allowed)))
    watts = largest[s, 0] ** 3
    text = (
        f"Your h does not belong to your M: qd'(h - h at rest) is {given[s] * watts:.6g} W, and half of qd' Mdot qd is "
        f"{slope[s] * watts:.6g} W."
    )
    return Condition(
        "h belongs to M: qd'(h - h at rest) = qd' Mdot qd / 2",
        float(off[s] * watts),
        float(allowed[s] * watts),
        "W",
        s,
        text,
    )


def derivative(function: Callable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """df/dt at 0 to fourth order, its error as two steps tell it, and the size of f, all of the shape of f(t)."""
    values = {k: np.asarray(function(k * STEP)) for k in (-4, -2, -1, 1, 2, 4)}
    slope = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * STEP)
    coarse = (8.0 * (values[2] - values[-2]) - (values[4] - values[-4])) / (24.0 * STEP)
    # a sixteenth of the difference would do where it is smooth; with noise it is as large as the difference
    return slope, np.abs(slope - coarse), np.max([np.abs(value) for value in values.values()], axis=0)


def ratios(value: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """What is used of a tolerance; nothing of none is 0, and what is no number comes first."""
    used = np.divide(value, allowed, out=np.where(value == 0.0, 0.0, np.inf), where=allowed > 0.0)
    return np.where(np.isfinite(value), used, np.inf)
