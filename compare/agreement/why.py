"""The probable cause of a difference, in a sentence: what the diagnosis finds in Mbar and h, and what can only be in qdd."""

from typing import NamedTuple

import numpy as np

from tmt import literal

from ..diagnosis import STATES_ASKED
from ..diagnosis.consistency import conditions, symmetric
from ..diagnosis.finding import LEAST_STATES
from ..diagnosis.forces import causes_of_forces
from ..diagnosis.stated import diagnose_stated
from ..diagnosis.words import joints_stated
from ..engines.own import QUICK
from ..judge.check import over
from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from .given import Given

SECONDS_OF_CAUSE = 10.0  # of a search
SHARPER = 4.0  # times the tolerance: of Mbar and h that are found from accelerations
SHOWN_CAUSES = 4


class Values(NamedTuple):
    """Mbar and h of one's own with their tolerances, at states in the model's joints: what a diagnosis is given."""

    q: np.ndarray
    qd: np.ndarray
    mass_matrix: np.ndarray | None
    bias: np.ndarray | None
    tolerances: tuple[np.ndarray, np.ndarray]  # of Mbar and h


def cause_of(given: Given) -> tuple[str, bool]:
    """The sentence, "" where there are no values of which it could be sought; and whether rounded constants may have done it."""
    if len(some_states(given)) < min(LEAST_STATES, len(given.q)):
        return "", False  # too few of them are numbers
    failing = [name for name, one in given.compared.items() if (one.ratio > 1.0).any()]
    if failing == ["acceleration"]:
        which = some_states(given)
        if acting := of_forces(given, which):
            return acting, True
        if {"mass_matrix", "bias"} <= given.compared.keys():
            return "mass_matrix and bias agree: it is in how they are solved, or in damping, springs or friction.", True
        values = of_accelerations(given, which)
    else:
        values = of_equations(given, [name for name in failing if name != "acceleration"])
    if values is None:
        return "It cannot be found in values of accelerations alone: give mass_matrix and bias too.", True
    return diagnosed_sentence(given, values)


def diagnosed_sentence(given: Given, values: Values) -> tuple[str, bool]:
    """What a diagnosis says of values, and whether rounded constants may have done it."""
    own, M = given.own, values.mass_matrix
    if M is not None and np.isfinite(M).all():
        mirrored = symmetric(M, values.tolerances[0].max(axis=(1, 2)), given.coordinates.speeds)
        if not mirrored.is_met:
            return mirrored.text, False

    def bias(qd: np.ndarray) -> np.ndarray:
        return own.bias(values.q, qd)

    can_be_asked = own is not None and own.has("bias") and own.seconds <= QUICK and "bias" in given.compared
    found = diagnose_stated(
        given.tree,
        given.joints,
        values.q,
        values.qd,
        (M, values.bias),
        values.tolerances,
        SECONDS_OF_CAUSE,
        bias if can_be_asked else None,
    )
    if not found.differs:
        return "", True
    sentence = found.sentence
    if given.are_stated and any(cause.joints and not cause.joints.is_same for cause in found.causes):
        sentence += f" That is to take the place of joints={joints_stated(given.joints)}."
    if not found.causes and (broken := first_broken(given, values)):
        return f"{broken} {sentence}", found.is_small
    is_of_numbers = not found.causes or any("number" in cause.kind for cause in found.causes)
    return sentence, found.is_small and is_of_numbers


def first_broken(given: Given, values: Values) -> str:
    """What is wrong with Mbar and h of one's own whatever the model is; "" if that is nothing, or takes long to find out."""
    own = given.own
    if own is None or not (own.has("mass_matrix") and own.has("bias")) or own.seconds > QUICK:
        return ""
    if not all(np.isfinite(part).all() for part in (values.mass_matrix, values.bias) if part is not None):
        return ""
    known = conditions(own.mass_matrix, own.bias, given.coordinates, values.q, given.qd[: len(values.q)])
    return next((condition.text for condition in known if not condition.is_met), "")


def some_states(given: Given) -> np.ndarray:
    """The numbers of as many states as a diagnosis takes: of those with finite values the first, and the worst."""
    worst = np.max([one.ratio.reshape(len(given.q), -1).max(axis=1) for one in given.compared.values()], axis=0)
    finite = np.flatnonzero(np.isfinite(worst))
    if not len(finite):
        return finite
    return np.unique([finite[np.argmax(worst[finite])], *finite[: STATES_ASKED - 1]])


def of_equations(given: Given, failing: list[str]) -> Values:
    """Mbar and h at some of the states, gravity in the place of h where that alone is given or off."""
    which = some_states(given)
    q, qd = given.q[which], given.qd[which]
    own = {name: values[which] for name, values in given.values.items()}
    M, h = own.get("mass_matrix"), own.get("bias")
    if "gravity" in own and (h is None or failing == ["gravity"]):
        h, qd = own["gravity"], np.zeros_like(qd)
    scale, rounding = Entries(given.tree, q, qd), FACTOR * EPS + given.rtol
    sizes = np.broadcast_to(scale.mass_matrix, (len(q), *np.shape(scale.mass_matrix)[-2:])), scale.bias
    return Values(q, qd, M, h, tuple(above_zero(rounding * size) for size in sizes))


def above_zero(allowed: np.ndarray) -> np.ndarray:
    """A tolerance that can be divided by."""
    return np.maximum(allowed, np.finfo(float).tiny / EPS)


def of_forces(given: Given, which: np.ndarray) -> str:
    """What explains accelerations that do not follow from the right Mbar and h: damping, springs and the like; "": nothing."""
    tree, q, qd, tau = given.tree, given.q[which], given.qd[which], given.tau[which]
    qdd = given.values["acceleration"][which]
    M, h = literal.mass_matrix(q, tree), literal.bias(q, qd, tree)
    pull = literal.spring_torque(q, tree) if tree.has_springs else 0.0
    acting = tau - np.array(tree.damping) * qd - pull - h - np.einsum("sij,sj->si", M, qdd)
    scale = Entries(tree, q, qd)
    allowed = SHARPER * (FACTOR * EPS + given.rtol) * scale.residual(scale.force(tau), qdd)
    if not np.isfinite(acting).all() or not (over(np.abs(acting), allowed) > 1.0).any():
        return ""
    causes = causes_of_forces(tree, q, qd, tau, h, acting, above_zero(allowed))
    return "; or ".join(cause.text for cause in causes[:SHOWN_CAUSES]) + "." * bool(causes)


def of_accelerations(given: Given, which: np.ndarray) -> Values | None:
    """Mbar and h from a function of accelerations: these are linear in the torque, and Mbar^-1 is their slope. None: neither."""
    own = given.own
    if own is None or not own.has("acceleration"):
        return None
    q, qd, tau = given.q[which], given.qd[which], given.tau[which]
    base, size = own.acceleration(q, qd, tau), np.abs(tau).max() + 1.0
    slopes = [(own.acceleration(q, qd, tau + size * e) - base) / size for e in np.eye(given.coordinates.nv)]
    inverse = np.stack(slopes, axis=-1)
    if not np.isfinite(inverse).all() or np.linalg.cond(inverse).max() > 1.0 / np.sqrt(EPS):
        return None
    M = np.linalg.inv(inverse)
    h = tau - own.passive(q, qd) - np.einsum("sij,sj->si", M, base)
    # each acceleration is off by eps of all of its terms, and so is what they are solved for
    scale = Entries(given.tree, q, qd)
    spread = np.abs(scale.M) @ scale.inverse
    off = np.einsum("sij,sj->si", spread, scale.residual(scale.force(np.abs(tau) + size), base))
    of_M = off[:, :, None] * np.abs(M).max() / size
    of_M = of_M + spread @ scale.mass_matrix @ spread.transpose(0, 2, 1)
    of_h = off + np.einsum("sij,sj->si", of_M, np.abs(base))
    rounding = SHARPER * (FACTOR * EPS + given.rtol)
    return Values(q, qd, M, h, (above_zero(rounding * of_M), above_zero(rounding * of_h)))
