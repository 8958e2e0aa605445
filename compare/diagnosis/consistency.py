"""Whether Mbar and h can belong together, whatever the model is; no reference is needed.

Mbar must be symmetric and positive definite; h at rest must be the gradient of an energy; h - h(q, 0) must be
quadratic in the speeds. Derivatives are central differences of fourth
order; their error is estimated with a step twice as long. Noise in the values (single precision, interpolated
tables) is measured first, by differences of sixth order over short steps, and added to every tolerance.
"""

from collections.abc import Callable, Sequence
from math import comb
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..core.finding import Finding
from ..core.text import say
from ..judge.agree import closest
from ..robots.coordinates import Coordinates
from .cause import TEMPLATE
from .layout import ROUNDED

STEP = 2e-3  # rad or m, or s along a motion of about one rad/s
SAFETY = 8.0  # times the error or the noise that is estimated
CLOSE_BY = 1e-4  # rad or m, between the points at which noise is measured
ORDER = 6
CONDITIONS = {  # names and units, by the macros that say what is wrong
    "symmetric": ("M is symmetric", "kg m2"), "gradient": ("h at rest is a gradient", "N m/rad"),
    "even": ("h is even in the rates", "N m"), "quadratic": ("h is quadratic in the rates", "N m"),
}  # fmt: skip

OfPositions = Callable[[ndarray], ndarray]  # of q (states, nq) -> (states, ...)
OfStates = Callable[[ndarray, ndarray], ndarray]  # of q (states, nq), qd (states, nv) -> (states, nv)


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
    mass_matrix: OfPositions, bias: OfStates, coordinates: Coordinates, q: ndarray, qd: ndarray
) -> list[Condition]:
    """The conditions on mass_matrix(q) (states, nv, nv) and bias(q, qd) (states, nv)."""
    M, names = np.asarray(mass_matrix(q)), coordinates.speeds
    of_M = ROUNDED * np.abs(M).max(axis=(1, 2)) + SAFETY * noise(mass_matrix, coordinates, q)
    of_h = SAFETY * noise(lambda q: bias(q, qd), coordinates, q)
    h = {factor: np.asarray(bias(q, factor * qd)) for factor in (0.0, 1.0, -1.0, 2.0, -2.0)}
    velocity, doubled = ((h[speed] + h[-speed]) / 2.0 - h[0.0] for speed in (1.0, 2.0))
    rounding = of_h + ROUNDED * np.abs(list(h.values())).max(axis=(0, 2))
    odd, allowed = np.abs(h[1.0] - h[-1.0]) / 2.0, rounding[:, None]
    units = np.broadcast_to(np.where(np.array(coordinates.units) == "m", "N", "N m"), odd.shape)
    factors = np.divide(doubled, velocity, out=np.full(odd.shape, np.inf), where=velocity != 0.0)
    even = nearest("even", odd, allowed, names, value=odd, unit=units)
    quadratic = nearest("quadratic", np.abs(doubled - 4.0 * velocity), 4.0 * allowed, names, factor=factors)
    of_weight = gradient(lambda q: bias(q, 0.0 * qd), coordinates, q, of_h)
    tested = [symmetric(M, of_M, names), definite(M, of_M), *of_weight, even, quadratic]
    return tested


def nearest(kind: str, off: ndarray, allowed: ndarray, names: Sequence[str], **values: ndarray) -> Condition:
    """A condition on differences, off (states, ...), where it is nearest to being broken.

    kind: of CONDITIONS; its macro takes the values there and the names of the entry.
    """
    name, unit = CONDITIONS[kind]
    at, allowed = closest(off, allowed), np.broadcast_to(allowed, off.shape)
    there = {"names": [names[i] for i in at[1:]], **{key: array[at] for key, array in values.items()}}
    return Condition(name, float(off[at]), float(allowed[at]), unit, Finding(TEMPLATE, kind, there))


def noise(function: OfPositions, coordinates: Coordinates, q: ndarray) -> float:
    """The noise in function(q) (states, ...), the largest of all states and entries, as a standard deviation.

    Differences of sixth order of values close by; a smooth function leaves nothing of size there.
    """
    direction = np.random.default_rng(0).uniform(0.5, 1.0, coordinates.nv)
    points = [np.asarray(function(coordinates.move(q, k * CLOSE_BY * direction))) for k in range(ORDER + 1)]
    difference = sum((-1) ** k * comb(ORDER, k) * values for k, values in enumerate(points))
    return float(np.abs(difference).max()) / np.sqrt(comb(2 * ORDER, ORDER))


def symmetric(M: ndarray, allowed: ndarray, names: Sequence[str]) -> Condition:
    """allowed: (states,)."""
    mirrored = np.swapaxes(M, 1, 2)
    off, allowed = np.abs(M - mirrored), allowed[:, None, None]
    return nearest("symmetric", off, allowed, names, value=M, mirrored=mirrored)


def definite(M: ndarray, allowed: ndarray) -> Condition:
    """In units of its diagonal, where entries may be kg and kg m2."""
    M = (M + np.swapaxes(M, 1, 2)) / 2.0
    diagonal = np.einsum("sii->si", M)
    root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    least = np.linalg.eigvalsh(M / (root[:, :, None] * root[:, None, :]))[:, 0]
    s = int(np.argmin(least))
    floor = allowed[s] / diagonal[s].max() if diagonal[s].max() > 0.0 else 0.0
    wrong = Finding(TEMPLATE, "definite", {"least": least[s]})
    return Condition("M is positive definite", float(least[s]), float(floor), "", wrong, "at least")


def gradient(weight: OfPositions, coordinates: Coordinates, q: ndarray, floor: float) -> list[Condition]:
    """dh_i/dq_j at rest is symmetric, in hinges and slides; [] where there is one of them at most."""
    straight = [joint.qd.start for joint in coordinates.places.joints if joint.kind != "ball"]
    if len(straight) < 2:
        return []

    def along(direction: ndarray) -> tuple[ndarray, ...]:
        return derivative(lambda t: weight(coordinates.move(q, t * direction))[:, straight])

    derivatives = map(along, np.eye(coordinates.nv)[straight])
    slopes, errors, sizes = (np.stack(part, axis=2) for part in zip(*derivatives))  # (states, i, j)
    rounding = (ROUNDED * sizes.max(axis=(1, 2)) + floor) / STEP
    allowed = SAFETY * (errors + np.swapaxes(errors, 1, 2)) + rounding[:, None, None]
    names, mirrored = [coordinates.speeds[k] for k in straight], np.swapaxes(slopes, 1, 2)
    return [nearest("gradient", np.abs(slopes - mirrored), allowed, names, value=slopes, mirrored=mirrored)]


def follows_from(mass_matrix: OfPositions, q: ndarray, qd: ndarray, velocity_terms: ndarray) -> bool:
    """Whether velocity terms (states, nv) are Mdot qd - d(qd' Mbar qd / 2)/dq, of hinges and slides."""
    right, allowed, rates = np.zeros_like(qd), np.zeros(len(qd)), np.abs(qd).sum(axis=1)

    def along(unit: ndarray) -> tuple[ndarray, ...]:
        return derivative(lambda t: np.asarray(mass_matrix(q + t * unit)))

    for k, (slope, error, size) in enumerate(map(along, np.eye(qd.shape[1]))):
        right += qd[:, k : k + 1] * np.einsum("sij,sj->si", slope, qd)
        right[:, k] -= np.einsum("si,sij,sj->s", qd, slope, qd) / 2.0
        allowed += (SAFETY * error + ROUNDED * size / STEP).max(axis=(1, 2)) * rates**2
    return bool((np.abs(velocity_terms - right) <= allowed[:, None]).all())


def derivative(function: Callable[[float], ndarray]) -> tuple[ndarray, ndarray, ndarray]:
    """df/dt at 0 to fourth order, its error from two step sizes, and the size of f, of the shape of f."""
    values = {k: np.asarray(function(k * STEP)) for k in (-4, -2, -1, 1, 2, 4)}
    slope = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * STEP)
    coarse = (8.0 * (values[2] - values[-2]) - (values[4] - values[-4])) / (24.0 * STEP)
    # a sixteenth of the difference would do where it is smooth; with noise it is as large as the difference
    return slope, np.abs(slope - coarse), np.max([np.abs(value) for value in values.values()], axis=0)
