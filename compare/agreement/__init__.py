"""Comparison of your equations with MuJoCo, entry by entry, for use in your tests.

The tolerance of an entry is 64 eps x its scale + rtol x the largest value that it has at the states. The
scale is the sum of the absolute values of its terms, see judge/entries.py, not the entry itself, which may be
a small difference of large terms. A value near zero, such as that of gravity at a posture, is judged as the
others.
"""

from __future__ import annotations  # so that help() shows the short names of types

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.text import block, say
from .comparison import Comparison
from .tree import tree
from .values import State
from .why import Why, cause_of

__all__ = ["Difference", "State", "assert_agrees", "differences", "tree"]

Model = str | PathLike[str] | object  # a path, MJCF text or an MjModel
# a function, values, or a SymPy matrix and its symbols
Quantity = Callable[..., Any] | ArrayLike | tuple[Any, Any] | None
Values = ArrayLike | None
Names = Sequence[str] | None
ROUNDED = 1e-6  # of its largest value: an entry that differs by no more may have rounded constants


class Difference(NamedTuple):
    """One entry at one state, in your joints.

    Attributes
    ----------
    quantity : {"mass_matrix", "bias", "C qd", "C + C'", "gravity", "acceleration"}
    entry : str
        Such as "M[hip][knee]" or "h[hip]".
    state : State
        Its number, q, qd and tau, in the joints of your equations.
    yours, mujoco : float
        Both values: kg m2 (M), N m (h, gravity), rad/s2 (acceleration), of slides kg, N and m/s2.
    difference : float
        yours - mujoco.
    tolerance : float
        64 eps times the scale of the entry, and rtol times its largest value at the states.
    ratio : float
        Of the difference to its tolerance, at most 1 if they agree; inf where yours is not a finite number.
    cause : str
        The probable cause of all differences, in a sentence; "" where the entry agrees.
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
    coriolis_matrix: Quantity = None,
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
    """Compare equations of your own with MuJoCo; raise AssertionError if they differ.

    The error has the worst entry and the probable cause. The signs: Mbar qdd + h = tau - D qd - k (q - rest);
    damping D and springs k of the joints are in acceleration alone. Units: rad and N m, for slides m and N.

    Parameters
    ----------
    mjcf : path, MJCF text or MjModel
        Its contacts, limits, actuators and equalities are switched off.
    mass_matrix, bias, coriolis_matrix, gravity, acceleration : optional, at least one
        mass_matrix(q), bias(q, qd), coriolis_matrix(q, qd), gravity(q), acceleration(q, qd, tau): a function
        of one state, the array of its values at the given q, qd, tau, or a pair of a SymPy matrix and its
        list of symbols. Of a Coriolis matrix C, which M and h do not determine, C qd is compared with bias -
        gravity, and C + C' with dM/dt: dM/dt - 2 C is then skew.
    q, qd, tau : (N, nq), (N, nv), (N, nv), optional
        The states, in your joints; None: `states` random states from `seed`, within the joints' ranges.
    joints : sequence of str, optional
        The joints as your equations take them: ["knee", "-hip", "ankle+90deg"]; None: those of the model.
    rtol : float, default 0
        Added to the tolerance, relative to the largest value of each entry, for equations with rounded
        constants.
    states, seed : int, default 100 and 0
        Number and seed of the random states.

    Raises
    ------
    AssertionError
        If an entry differs by more than its tolerance.
    ValueError
        For a model or shape that cannot be compared, or a function that raises at the first state.

    Warns
    -----
    UserWarning
        If the number of states is not `states`: because q is given, or because the functions take too long.

    Examples
    --------
    >>> inertia = '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/>'
    >>> mjcf = f'<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/>{inertia}</body></worldbody></mujoco>'
    >>> compare.assert_agrees(mjcf, gravity=lambda q: 9.81 * np.sin(q))
    >>> compare.assert_agrees(mjcf, gravity=lambda q: 9.81 * np.cos(q))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    AssertionError: Not equal to MuJoCo to tolerance 64 eps x the scale of each entry...
    """
    __tracebackhide__ = True  # pytest shows the line of the test
    quantities = {
        "mass_matrix": mass_matrix, "bias": bias, "coriolis_matrix": coriolis_matrix, "gravity": gravity,
        "acceleration": acceleration,
    }  # fmt: skip
    comparison = Comparison(mjcf, quantities, q, qd, tau, joints, rtol, states, seed)
    if comparison.fails or comparison.problems:
        raise AssertionError(message(comparison))


def differences(
    mjcf: Model,
    *,
    mass_matrix: Quantity = None,
    bias: Quantity = None,
    coriolis_matrix: Quantity = None,
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
    """Every entry of every quantity at every state, the largest ratio first; at most 1 if they agree.

    Parameters
    ----------
    mjcf, mass_matrix, bias, coriolis_matrix, gravity, acceleration, q, qd, tau, joints, rtol, states, seed
        As of `assert_agrees`, which also says what is raised.

    Returns
    -------
    list of Difference

    Examples
    --------
    >>> inertia = '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/>'
    >>> mjcf = f'<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/>{inertia}</body></worldbody></mujoco>'
    >>> worst, *_ = compare.differences(mjcf, mass_matrix=[[[0.5]]], q=[[0.0]])  # it is 0.1 + 2 kg (0.5 m)^2
    >>> print(worst.entry, worst.yours, round(worst.mujoco, 9), worst.ratio > 1.0)
    M[hip][hip] 0.5 0.6 True
    """
    quantities = {
        "mass_matrix": mass_matrix, "bias": bias, "coriolis_matrix": coriolis_matrix, "gravity": gravity,
        "acceleration": acceleration,
    }  # fmt: skip
    comparison = Comparison(mjcf, quantities, q, qd, tau, joints, rtol, states, seed)
    return rows(comparison, cause_of(comparison).text if comparison.fails else "")


def rows(comparison: Comparison, cause: str) -> list[Difference]:
    """Every entry of every quantity at every state, the largest ratio first."""
    found = []
    for name, (yours, right, _, tolerance) in comparison.compared.items():
        entries, ratios = comparison.entries(name), comparison.compared[name].ratio
        columns = (part.ravel().tolist() for part in (yours, right, yours - right, tolerance, ratios))
        for at, own, theirs, off, allowed, ratio in zip(np.ndindex(yours.shape), *columns):
            where, why = (name, entries[at[1:]], comparison.states[at[0]]), cause if ratio > 1.0 else ""
            found.append(Difference(*where, own, theirs, off, allowed, ratio, why))
    return sorted(found, key=lambda row: -row.ratio)


def message(comparison: Comparison) -> str:
    """Which entries are off, the worst of each quantity, the probable cause, and what can be stated."""
    from ..engines.mujoco.parameters import remarks  # here, so that `import compare` need not wait for it

    why = cause_of(comparison) if comparison.fails else Why()
    failing: dict[str, list[Difference]] = {}
    for row in rows(comparison, why.text):
        if row.ratio > 1.0:
            failing.setdefault(row.quantity, []).append(row)
    joints = zip(comparison.tree.joint_names, comparison.tree.kind)
    advice = None if why.is_found or comparison.rtol else rounded(comparison)
    said = [say(remark) for remark in remarks(comparison.reading, has_scenes=False)]
    values = {"comparison": comparison, "failing": failing, "why": why, "rounded": advice, "remarks": said}
    hinge = next((name for name, kind in joints if kind == "hinge"), "")
    text = block("agreement", "message", **values, compensated=comparison.compensated, hinge=hinge)
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip())


def rounded(comparison: Comparison) -> float | None:
    """The rtol to state if the constants are rounded; None if an entry is off by more, or is not finite."""
    worst = np.max([compared.least_rtol for compared in comparison.compared.values()])
    if not worst <= ROUNDED:
        return None
    exponent = int(np.floor(np.log10(worst)))
    return float(f"{np.ceil(worst / 10.0**exponent):.0f}e{exponent}")
