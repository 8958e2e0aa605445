"""Whether Mbar and h can belong together, whatever the model is; no reference is needed.

Mbar must be symmetric and positive definite, h - h(q, 0) quadratic in the speeds. Noise in the values (single
precision, interpolated tables) is measured first, by differences of sixth order over short steps, and added
to every tolerance.
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

STEP = 2e-3  # rad or m
SAFETY = 8.0  # times the error or the noise that is estimated
CLOSE_BY, ORDER = 1e-4, 6  # rad or m, between the points at which noise is measured, and of their difference

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
    h = {factor: np.asarray(bias(q, factor * qd)) for factor in (0.0, 1.0, -1.0, 2.0, -2.0)}
    velocity, doubled = ((h[speed] + h[-speed]) / 2.0 - h[0.0] for speed in (1.0, 2.0))
    of_h = SAFETY * noise(lambda q: bias(q, qd), coordinates, q)
    allowed = (of_h + ROUNDED * np.abs(list(h.values())).max(axis=(0, 2)))[:, None]
    odd, off = np.abs(h[1.0] - h[-1.0]) / 2.0, np.abs(doubled - 4.0 * velocity)
    units = np.broadcast_to(np.where(np.array(coordinates.units) == "m", "N", "N m"), odd.shape)
    factors = np.divide(doubled, velocity, out=np.full(odd.shape, np.inf), where=velocity != 0.0)
    return [
        symmetric(M, of_M, names), definite(M, of_M),
        nearest("even", "h is even in the rates", "N m", odd, allowed, names, value=odd, unit=units),
        nearest("quadratic", "h is quadratic in the rates", "N m", off, 4.0 * allowed, names, factor=factors),
    ]  # fmt: skip


def nearest(
    kind: str,
    name: str,
    measure: str,
    off: ndarray,
    allowed: ndarray,
    names: Sequence[str],
    **values: ndarray,
) -> Condition:
    """A condition on differences, off (states, ...), where it is nearest to being broken.

    kind: the macro that says it, which takes the values there and the names of the entry.
    """
    at, allowed = closest(off, allowed), np.broadcast_to(allowed, off.shape)
    there = {"names": [names[i] for i in at[1:]], **{key: array[at] for key, array in values.items()}}
    return Condition(name, float(off[at]), float(allowed[at]), measure, Finding(TEMPLATE, kind, there))


def noise(function: OfPositions, coordinates: Coordinates, q: ndarray) -> float:
    """The noise in function(q) (states, ...), the largest of all states and entries, as a standard deviation.

    Differences of sixth order of values close by; a smooth function leaves nothing of size there.
    """
    direction = np.random.default_rng(0).uniform(0.5, 1.0, coordinates.nv)
    points = [np.asarray(function(coordinates.move(q, k * CLOSE_BY * direction))) for k in range(ORDER + 1)]
    return float(np.abs(np.diff(points, ORDER, axis=0)).max()) / np.sqrt(comb(2 * ORDER, ORDER))


def symmetric(M: ndarray, allowed: ndarray, names: Sequence[str]) -> Condition:
    """allowed: (states,)."""
    mirrored, allowed = np.swapaxes(M, 1, 2), allowed[:, None, None]
    about = "symmetric", "M is symmetric", "kg m2"
    return nearest(*about, np.abs(M - mirrored), allowed, names, value=M, mirrored=mirrored)


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


def follows_from(mass_matrix: OfPositions, q: ndarray, qd: ndarray, velocity_terms: ndarray) -> bool:
    """Whether velocity terms (states, nv) are Mdot qd - d(qd' Mbar qd / 2)/dq, of hinges and slides.

    Derivatives are central differences of fourth order; their error is that from a step twice as long.
    """
    right, allowed, rates = np.zeros_like(qd), np.zeros(len(qd)), np.abs(qd).sum(axis=1)
    for k, unit in enumerate(np.eye(qd.shape[1])):
        values = {step: np.asarray(mass_matrix(q + step * STEP * unit)) for step in (-4, -2, -1, 1, 2, 4)}
        slope = (8.0 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12.0 * STEP)
        coarse = (8.0 * (values[2] - values[-2]) - (values[4] - values[-4])) / (24.0 * STEP)
        size = np.max([np.abs(value) for value in values.values()], axis=0)
        right += qd[:, k : k + 1] * np.einsum("sij,sj->si", slope, qd)
        right[:, k] -= np.einsum("si,sij,sj->s", qd, slope, qd) / 2.0
        # a sixteenth of the difference would do where it is smooth; with noise it is as large as the
        # difference
        error = SAFETY * np.abs(slope - coarse) + ROUNDED * size / STEP
        allowed += error.max(axis=(1, 2)) * rates**2
    return bool((np.abs(velocity_terms - right) <= allowed[:, None]).all())
