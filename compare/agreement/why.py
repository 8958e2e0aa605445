"""The probable cause of a difference: what the diagnosis finds in Mbar and h, and what can only be in the accelerations."""

from functools import partial
from typing import NamedTuple

import numpy as np

from tmt import literal

from ..core.finding import Finding
from ..core.text import say
from ..diagnosis import STATES_ASKED, Stated, Values, diagnose
from ..diagnosis.cause import LEAST_STATES
from ..diagnosis.consistency import conditions, symmetric
from ..diagnosis.forces import LeftOver
from ..engines.own import QUICK
from .comparison import Comparison

SECONDS_OF_CAUSE = 10.0  # of a search


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
    own = {name: values[which] for name, values in comparison.values.items()}
    failing = [name for name, compared in comparison.compared.items() if compared.fails]
    unknown_M, unknown_h = np.full((*qd.shape, qd.shape[1]), np.nan), np.full(qd.shape, np.nan)
    if failing == ["acceleration"]:
        return of_accelerations(comparison, q, qd, tau, own)
    if "gravity" in own and ("bias" not in own or ("gravity" in failing and "bias" not in failing)):
        h, speeds = own["gravity"], np.zeros_like(qd)
    else:
        h, speeds = own.get("bias", unknown_h), qd
    values = Values.of(comparison.tree, q, speeds, own.get("mass_matrix", unknown_M), h, comparison.rounding)
    why = of_equations(comparison, values)
    if "acceleration" not in failing or not why.is_found or not {"mass_matrix", "bias"} <= own.keys():
        return why
    values = Values.of(comparison.tree, q, qd, own["mass_matrix"], own["bias"], comparison.rounding)
    return why._replace(text=f"{why.text} {beside(comparison, values, tau, own['acceleration'])}".rstrip())


def some_states(comparison: Comparison) -> np.ndarray:
    """The numbers of as many states as a diagnosis takes: of those with finite values the first, and the worst."""
    ratios = [
        compared.ratio.reshape(len(comparison.q), -1).max(axis=1) for compared in comparison.compared.values()
    ]
    worst = np.max(ratios, axis=0)
    finite = np.flatnonzero(np.isfinite(worst))
    return np.unique([*finite[np.argsort(-worst[finite])[:1]], *finite[: STATES_ASKED - 1]]).astype(int)


def of_equations(comparison: Comparison, values: Values) -> Why:
    """What a diagnosis finds in values of Mbar and h."""
    own, M = comparison.equations, values.mass_matrix
    mirrored = symmetric(M, values.tolerances[0].max(axis=(1, 2)), comparison.coordinates.speeds)
    if np.isfinite(M).all() and not mirrored.is_met:
        return Why(mirrored.text)
    is_quick = own is not None and own.seconds <= QUICK and own.has("bias")
    of_speeds = partial(own.bias, values.q) if own is not None and is_quick else None
    diagnosis = diagnose(comparison.tree, values, SECONDS_OF_CAUSE, of_speeds, Stated(comparison.joints))
    if not diagnosis.differs:
        return Why("", False)
    text = diagnosis.sentence()
    if not diagnosis.causes and own is not None and is_quick and own.has("mass_matrix") and values.are_finite:
        every = conditions(own.mass_matrix, own.bias, comparison.coordinates, values.q, values.qd)
        text = " ".join([*[one.text for one in every if not one.is_met][:1], text])
    return Why(text, bool(diagnosis.causes))


def beside(comparison: Comparison, values: Values, tau: np.ndarray, qdd: np.ndarray) -> str:
    """What else is wrong with accelerations than the user's Mbar and h; "" where they follow from these."""
    left_over = LeftOver(comparison.tree, values, tau, qdd, comparison.rounding)
    if left_over.ratio <= 1.0:
        return ""
    if left_over.causes:
        return say(Finding("agreement", "forces", {"causes": left_over.causes}))
    return say(Finding("agreement", "another"))


def of_accelerations(
    comparison: Comparison, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, own: dict[str, np.ndarray]
) -> Why:
    """What explains accelerations alone: a force, how they are solved for, or the bias if Mbar is right."""
    tree = comparison.tree
    right = Values.of(
        tree, q, qd, literal.mass_matrix(q, tree), literal.bias(q, qd, tree), comparison.rounding
    )
    left_over = LeftOver(tree, right, tau, own["acceleration"], comparison.rounding)
    if left_over.causes:
        return Why(say(Finding("agreement", "forces", {"causes": left_over.causes})))
    if {"mass_matrix", "bias"} <= own.keys():
        return Why(say(Finding("agreement", "solved")), False)
    unknown = np.full((*qd.shape, qd.shape[1]), np.nan)
    values = Values(q, qd, unknown, right.bias + left_over.force, (unknown, left_over.tolerance))
    diagnosis = diagnose(tree, values, SECONDS_OF_CAUSE, stated=Stated(comparison.joints))
    text = diagnosis.sentence() if diagnosis.causes else say(Finding("agreement", "accelerations_alone"))
    return Why(text, bool(diagnosis.causes))
