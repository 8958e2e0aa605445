"""The probable cause of a difference: in Mbar and h, or in the accelerations alone."""

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt import literal

from ..core.finding import Finding
from ..core.text import say
from ..diagnosis import STATES_ASKED, Stated, Values, diagnose
from ..diagnosis.cause import LEAST_STATES
from ..diagnosis.consistency import conditions, symmetric
from ..diagnosis.forces import LeftOver
from ..engines.own import QUICK
from .comparison import Comparison

SECONDS_OF_CAUSE = 4.5  # of a search


class Why(NamedTuple):
    """What explains a difference, or what else is known of it."""

    text: str = ""
    is_found: bool = True  # whether that is a cause


def cause_of(comparison: Comparison) -> Why:
    """The probable cause of what differs."""
    which = some_states(comparison)
    if len(which) < min(LEAST_STATES, len(comparison.q)):
        return Why("", False)  # too few of them are numbers
    q, qd, tau = comparison.q[which], comparison.qd[which], comparison.tau[which]
    yours = {name: values[which] for name, values in comparison.values.items()}
    tree, M, h, rounding = comparison.tree, yours.get("mass_matrix"), yours.get("bias"), comparison.rounding
    failing = [name for name, compared in comparison.compared.items() if compared.fails]
    values = Values.of(tree, q, qd, M, h, rounding)
    if failing == ["acceleration"]:
        return of_accelerations(comparison, values, tau, yours["acceleration"])
    of_h = values
    if "gravity" in yours and ("bias" not in yours or ("gravity" in failing and "bias" not in failing)):
        of_h = Values.of(tree, q, np.zeros_like(qd), M, yours["gravity"], rounding)
    why = of_equations(comparison, of_h)
    if "acceleration" not in failing or not why.is_found or M is None or h is None:
        return why
    return why._replace(text=f"{why.text} {beside(comparison, values, tau, yours['acceleration'])}".rstrip())


def some_states(comparison: Comparison) -> ndarray:
    """As many states as a diagnosis takes: of those with finite values the first, and the worst."""
    ratios = [compared.ratio for compared in comparison.compared.values()]
    worst = np.max([ratio.reshape(len(ratio), -1).max(axis=1) for ratio in ratios], axis=0)
    finite = np.flatnonzero(np.isfinite(worst))
    return np.unique([*finite[np.argsort(-worst[finite])[:1]], *finite[: STATES_ASKED - 1]]).astype(int)


def of_equations(comparison: Comparison, values: Values) -> Why:
    """What a diagnosis finds in values of Mbar and h."""
    equations, coordinates, M = comparison.equations, comparison.coordinates, values.mass_matrix
    mirrored = symmetric(M, values.tolerances[0].max(axis=(1, 2)), coordinates.speeds)
    if np.isfinite(M).all() and not mirrored.is_met:
        return Why(mirrored.text)
    if equations is not None and (equations.seconds > QUICK or not equations.has("bias")):
        equations = None  # they cannot be called some hundred times more
    bias = partial(equations.bias, values.q) if equations is not None else None
    diagnosis = diagnose(comparison.tree, values, SECONDS_OF_CAUSE, bias, Stated(comparison.joints))
    if not diagnosis.differs:
        return Why("", False)
    broken = []
    if equations is not None and equations.has("mass_matrix") and values.are_finite and not diagnosis.causes:
        tested = conditions(equations.mass_matrix, equations.bias, coordinates, values.q, values.qd)
        broken = [condition.text for condition in tested if not condition.is_met]
    return Why(" ".join([*broken[:1], diagnosis.sentence()]), bool(diagnosis.causes))


def beside(comparison: Comparison, values: Values, tau: ndarray, qdd: ndarray) -> str:
    """What else is wrong with accelerations than the user's Mbar and h; "" where they follow from these."""
    left_over = LeftOver(comparison.tree, values, tau, qdd, comparison.rounding)
    if left_over.ratio <= 1.0:
        return ""
    return left_over.sentence() or say(Finding("agreement", "another"))


def of_accelerations(comparison: Comparison, values: Values, tau: ndarray, qdd: ndarray) -> Why:
    """What explains accelerations alone: a force, how they are solved for, or the bias if Mbar is right.

    values: the user's Mbar and h, as far as they are given; these are right.
    """
    tree, q, qd, rounding = comparison.tree, values.q, values.qd, comparison.rounding
    right = Values.of(tree, q, qd, literal.mass_matrix(q, tree), literal.bias(q, qd, tree), rounding)
    left_over = LeftOver(tree, right, tau, qdd, rounding)
    if left_over.causes:
        return Why(left_over.sentence())
    if values.are_finite:
        return Why(say(Finding("agreement", "solved")), False)
    alone = Values.of(tree, q, qd, None, right.bias + left_over.force, rounding)
    alone = alone._replace(tolerances=(alone.tolerances[0], left_over.tolerance))
    diagnosis = diagnose(tree, alone, SECONDS_OF_CAUSE, stated=Stated(comparison.joints))
    text = diagnosis.sentence() if diagnosis.causes else say(Finding("agreement", "accelerations_alone"))
    return Why(text, bool(diagnosis.causes))
