"""Comparison of your equations with MuJoCo, entry by entry, for use in your tests.

The tolerance of an entry is (64 eps + rtol) x its scale. The scale is the sum of the absolute values of its terms, see
judge/entries.py, not the entry itself: that may be a small difference of large terms, and a rounded constant changes it by
as much as the terms.
"""

from __future__ import annotations  # so that help() shows the short names of types

from collections.abc import Callable, Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .given import Given, State
from .message import message
from .why import Why, cause_of

__all__ = ["Difference", "State", "assert_agrees", "differences"]

Model = str | PathLike | object  # a path, MJCF text or an MjModel
Quantity = Callable | ArrayLike | tuple | None  # a function, values, or a SymPy matrix and its symbols
Values = ArrayLike | None
Names = Sequence[str] | None


class Difference(NamedTuple):
    """One entry at one state, in your joints.

    quantity: "mass_matrix", "bias", "gravity" or "acceleration".
    entry: such as "M[hip][knee]" or "h[hip]".
    state: number, q, qd and tau, in the joints of your equations.
    yours, mujoco: both values: kg m2 (M), N m (h, gravity), rad/s2 (acceleration), of slides kg, N and m/s2.
    difference: yours - mujoco.
    tolerance: (64 eps + rtol) times the scale of the entry.
    ratio: of the difference to its tolerance, at most 1 if they agree; inf where yours is not a finite number.
    cause: the probable cause of all differences, in a sentence; "" where the entry agrees.
    """

    quantity: str
    entry: str
    state: State
    yours: float
    mujoco: float
    difference: float
    tolerance: float
    ratio: float
    cause: str


def assert_agrees(
    mjcf: Model,
    *,
    mass_matrix: Quantity = None,
    bias: Quantity = None,
    gravity: Quantity = None,
    acceleration: Quantity = None,
    q: Values = None,
    qd: Values = None,
    tau: Values = None,
    joints: Names = None,
    rtol: float = 0.0,
    states: int = 100,
    seed: int = 0,
) -> None:
    """Compare equations of your own with MuJoCo; raise AssertionError with the worst entry and the probable cause if they differ.

    mjcf: a path, MJCF text or an MjModel; contacts, limits, actuators and equalities are switched off.
    mass_matrix(q), bias(q, qd), gravity(q), acceleration(q, qd, tau): a function of one state or a batch, or the array of its
    values at the given q (N, nq), qd, tau (N, nv), or a pair of a SymPy matrix and the list of its symbols.
    Mbar qdd + h = tau - D qd - k (q - rest); damping D and springs k of the joints are in acceleration alone. Units: rad and N m,
    for slides m and N.
    q, qd, tau: the states, in your joints; None: `states` random states from `seed`, within the joints' ranges. A UserWarning
    is issued if the number of states is not `states`: because q is given, or because the functions take too long.
    joints: the joints as your equations take them, such as ["knee", "-hip", "ankle+90deg"]; None: those of the model.
    rtol: added to the tolerance, relative to the scale of each entry, for equations with rounded constants.
    Raises ValueError for a model or shape that cannot be compared, or a function that raises at the first state.
    """
    __tracebackhide__ = True  # pytest shows the line of the test
    given = Given(mjcf, mass_matrix, bias, gravity, acceleration, q, qd, tau, joints, rtol, states, seed)
    if given.fails or given.problems:
        raise AssertionError(message(given, cause_of(given) if given.fails else Why()))


def differences(
    mjcf: Model,
    *,
    mass_matrix: Quantity = None,
    bias: Quantity = None,
    gravity: Quantity = None,
    acceleration: Quantity = None,
    q: Values = None,
    qd: Values = None,
    tau: Values = None,
    joints: Names = None,
    rtol: float = 0.0,
    states: int = 100,
    seed: int = 0,
) -> list[Difference]:
    """Every entry of every quantity at every state, the largest ratio first; they agree if all ratios are at most 1.

    The same arguments and errors as `assert_agrees`.
    """
    given = Given(mjcf, mass_matrix, bias, gravity, acceleration, q, qd, tau, joints, rtol, states, seed)
    cause = cause_of(given).text if given.fails else ""
    rows = []
    for name, comparison in given.compared.items():
        entries = given.entries(name)
        places = list(np.ndindex(comparison.own.shape))
        values = zip(
            *(
                part.reshape(-1).tolist()
                for part in (comparison.own, comparison.right, comparison.tolerance, comparison.ratio)
            )
        )
        for (at, *entry), (own, right, tolerance, ratio) in zip(places, values):
            why = cause if ratio > 1.0 else ""
            state = given.states[at]
            rows.append(Difference(name, entries[tuple(entry)], state, own, right, own - right, tolerance, ratio, why))
    return sorted(rows, key=lambda comparison: -comparison.ratio)
