"""The probable cause of a difference: what the diagnosis finds in Mbar and h, and what can only be in the accelerations."""

from typing import NamedTuple

import numpy as np

from tmt import literal

from ..diagnosis import STATES_ASKED, Diagnosis, Values, diagnose_stated
from ..diagnosis.cause import LEAST_STATES, Cause, joints_stated
from ..diagnosis.consistency import Condition, conditions, symmetric
from ..diagnosis.forces import causes_of_forces, force_left_over
from ..engines.own import QUICK
from ..judge.check import over
from ..judge.entries import Entries
from ..judge.finding import Finding
from ..judge.scale import EPS, FACTOR
from ..report.text import say
from .given import Given

SECONDS_OF_CAUSE = 10.0  # of a search
SHARPER = 4.0  # times the tolerance: of Mbar and h that are found from accelerations


class Why(NamedTuple):
    """What explains a difference."""

    kind: str = ""  # "condition", "forces", "solved", "accelerations_alone" or "diagnosis"; "": nothing was searched
    condition: Condition | None = None  # the first that Mbar and h do not meet
    diagnosis: Diagnosis | None = None
    forces: tuple[Cause, ...] = ()
    instead: list[str] | None = None  # joints that were stated, if others explain
    may_be_rounded: bool = False  # whether rounded constants may be the cause

    @property
    def text(self) -> str:
        """The cause in words; "": none."""
        return say(Finding("agreement", "why", {"why": self})) if self.kind else ""


def cause_of(given: Given) -> Why:
    """The probable cause of what differs."""
    which = some_states(given)
    if len(which) < min(LEAST_STATES, len(given.q)):
        return Why()  # too few of them are numbers
    failing = [name for name, comparison in given.compared.items() if (comparison.ratio > 1.0).any()]
    if failing == ["acceleration"]:
        if acting := of_forces(given, which):
            return Why("forces", forces=acting, may_be_rounded=True)
        if {"mass_matrix", "bias"} <= given.compared.keys():
            return Why("solved", may_be_rounded=True)
        values = of_accelerations(given, which)
    else:
        values = of_equations(given, which, [name for name in failing if name != "acceleration"])
    if values is None:
        return Why("accelerations_alone", may_be_rounded=True)
    return diagnosed(given, values)


def diagnosed(given: Given, values: Values) -> Why:
    """What a diagnosis finds in values of Mbar and h."""
    own, M = given.own, values.mass_matrix
    if M is not None and np.isfinite(M).all():
        mirrored = symmetric(M, values.tolerances[0].max(axis=(1, 2)), given.coordinates.speeds)
        if not mirrored.is_met:
            return Why("condition", mirrored)

    def bias(qd: np.ndarray) -> np.ndarray:
        return own.bias(values.q, qd)

    is_quick = own is not None and own.seconds <= QUICK
    of_speeds = bias if is_quick and own.has("bias") and "bias" in given.compared else None
    diagnosis = diagnose_stated(given.tree, given.joints, values, SECONDS_OF_CAUSE, of_speeds)
    if not diagnosis.differs:
        return Why(may_be_rounded=True)
    restated = given.are_stated and any(cause.joints and not cause.joints.is_same for cause in diagnosis.causes)
    condition, are_finite = None, all(np.isfinite(part).all() for part in (M, values.bias) if part is not None)
    if not diagnosis.causes and is_quick and are_finite and own.has("mass_matrix") and own.has("bias"):
        every = conditions(own.mass_matrix, own.bias, given.coordinates, values.q, given.qd[: len(values.q)])
        condition = next((one for one in every if not one.is_met), None)
    is_of_numbers = not diagnosis.causes or any("number" in cause.kind for cause in diagnosis.causes)
    instead = joints_stated(given.joints) if restated else None
    return Why("diagnosis", condition, diagnosis, instead=instead, may_be_rounded=diagnosis.is_small and is_of_numbers)


def some_states(given: Given) -> np.ndarray:
    """The numbers of as many states as a diagnosis takes: of those with finite values the first, and the worst."""
    worst = np.max(
        [comparison.ratio.reshape(len(given.q), -1).max(axis=1) for comparison in given.compared.values()], axis=0
    )
    finite = np.flatnonzero(np.isfinite(worst))
    if not len(finite):
        return finite
    return np.unique([finite[np.argmax(worst[finite])], *finite[: STATES_ASKED - 1]])


def of_equations(given: Given, which: np.ndarray, failing: list[str]) -> Values:
    """Mbar and h at some of the states, gravity in the place of h where that alone is given or off."""
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


def of_forces(given: Given, which: np.ndarray) -> tuple[Cause, ...]:
    """What explains accelerations that do not follow from the right Mbar and h: damping, springs and the like."""
    tree, q, qd, tau = given.tree, given.q[which], given.qd[which], given.tau[which]
    qdd, h = given.values["acceleration"][which], literal.bias(q, qd, tree)
    acting = force_left_over(tree, q, qd, tau, literal.mass_matrix(q, tree), h, qdd)
    scale = Entries(tree, q, qd)
    allowed = SHARPER * (FACTOR * EPS + given.rtol) * scale.residual(scale.force(tau), qdd)
    if not np.isfinite(acting).all() or not (over(np.abs(acting), allowed) > 1.0).any():
        return ()
    return causes_of_forces(tree, q, qd, tau, h, acting, above_zero(allowed))


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
