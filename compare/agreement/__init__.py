"""Equations of one's own compared with MuJoCo, entry by entry: for tests of one's own.

The tolerance of an entry is (64 eps + rtol) x its scale. The scale is the sum of the absolute values of the terms that are
added up in it, see judge/entries.py, and not the entry itself: that may be the small rest of large terms, and what a rounded
constant leaves in it is as large as in the terms.
"""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .given import Given, State
from .message import message
from .why import cause_of

__all__ = ["Difference", "State", "assert_agrees", "differences"]

Quantity = Callable | ArrayLike | tuple  # a function, values, or a SymPy matrix and its symbols


class Difference(NamedTuple):
    """One entry at one state, in joints of one's own."""

    quantity: str  # "mass_matrix", "bias", "gravity", "acceleration"
    entry: str  # such as M[hip][knee], h[hip]
    state: State
    yours: float
    mujoco: float
    difference: float  # yours - mujoco
    tolerance: float
    ratio: float  # of the difference to its tolerance; inf where yours is not a finite number
    cause: str  # the probable cause, in a sentence; "" where the entry agrees


def assert_agrees(
    mjcf: str | PathLike | object,
    *,
    mass_matrix: Quantity | None = None,
    bias: Quantity | None = None,
    gravity: Quantity | None = None,
    acceleration: Quantity | None = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    tau: ArrayLike | None = None,
    joints: Sequence[str] | None = None,
    rtol: float = 0.0,
    states: int = 100,
    seed: int = 0,
) -> None:
    """AssertionError unless equations of one's own agree with MuJoCo: it names the worst place and the probable cause.

    mjcf: a path, MJCF text or an MjModel; contacts, limits, actuators and equalities are switched off.
    mass_matrix(q), bias(q, qd), gravity(q), acceleration(q, qd, tau): each a function of one state or a batch, or the array of
    its values at the given q (N, nq), qd, tau (N, nv), or a pair of a SymPy matrix and the list of its symbols.
    Mbar qdd + h = tau - D qd - k (q - rest), with D and k of the joints in acceleration alone; rad, N m, and m, N of slides.
    q, qd, tau: the states, in joints of one's own; None: `states` random ones by `seed`, within the joints' ranges.
    joints: the joints as one's own equations take them, such as ["knee", "-hip", "ankle+90deg"]; None: as the model has them.
    rtol: of each entry's scale, beside the tolerance of rounding: for equations whose constants are rounded.
    ValueError, in one line, for what cannot be compared: a model, a shape, a function that raises at the first state.
    """
    __tracebackhide__ = True  # pytest shows the line of the test
    given = Given(mjcf, mass_matrix, bias, gravity, acceleration, q, qd, tau, joints, rtol, states, seed)
    if given.fails or given.problems:
        raise AssertionError(message(given, *(cause_of(given) if given.fails else ("", False))))


def differences(
    mjcf: str | PathLike | object,
    *,
    mass_matrix: Quantity | None = None,
    bias: Quantity | None = None,
    gravity: Quantity | None = None,
    acceleration: Quantity | None = None,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    tau: ArrayLike | None = None,
    joints: Sequence[str] | None = None,
    rtol: float = 0.0,
    states: int = 100,
    seed: int = 0,
) -> list[Difference]:
    """Every entry of every quantity at every state beside MuJoCo's, the largest ratio first; they agree if all are at most 1.

    The same arguments and errors as `assert_agrees`.
    """
    given = Given(mjcf, mass_matrix, bias, gravity, acceleration, q, qd, tau, joints, rtol, states, seed)
    cause = cause_of(given)[0] if given.fails else ""
    found = []
    for name, one in given.compared.items():
        entries = given.entries(name)
        places = list(np.ndindex(one.own.shape))
        values = zip(*(part.reshape(-1).tolist() for part in (one.own, one.right, one.tolerance, one.ratio)))
        for (at, *entry), (own, right, tolerance, ratio) in zip(places, values):
            why = cause if ratio > 1.0 else ""
            state = given.states[at]
            found.append(Difference(name, entries[tuple(entry)], state, own, right, own - right, tolerance, ratio, why))
    return sorted(found, key=lambda one: -one.ratio)
