"""The probable cause of a difference: in Mbar and h, or in the accelerations alone."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree, literal

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import say
from ..diagnosis import STATES_ASKED, Stated, Values, diagnose
from ..diagnosis.cause import LEAST_STATES
from ..diagnosis.consistency import conditions, symmetric
from ..diagnosis.forces import LeftOver
from ..diagnosis.model import ROUNDED
from ..diagnosis.noise import through_noise
from ..engines.own import QUICK, OwnEquations
from ..judge.entries import Entries
from ..robots.coordinates import Coordinates
from .comparison import Comparison
from .tables import slips_of_tables

SECONDS_OF_CAUSE = 4.5  # of a search
SECONDS_OF_SLOPES = 1.5  # of accelerations at several torques
LARGER = 8.0  # times the scale: a slope is a difference of two accelerations
CONSTANT = 1e-8  # of a factor at all states


class Why(NamedTuple):
    """What explains a difference, or what else is known of it."""

    text: str = ""
    is_found: bool = True  # whether that is a cause
    causes: tuple[Cause, ...] = ()  # of accelerations


class Asked(NamedTuple):
    """The accelerations of a user that are explained, and the model that is right."""

    tree: Tree
    coordinates: Coordinates
    equations: OwnEquations | None  # None: values alone
    stated: Stated
    rounding: float = ROUNDED


class Affine(NamedTuple):
    """A user's function qdd = A tau + a, in the model's joints."""

    tree: Tree
    equations: OwnEquations

    def slopes(self, q: ndarray) -> ndarray:
        """A, (states, nv, nv): of accelerations at rest."""
        zero, size = np.zeros((len(q), self.equations.coordinates.nv)), 1.0 + Entries(self.tree, q).force()
        still = self.equations.acceleration(q, zero, zero)
        pushed = [self.equations.acceleration(q, zero, size * unit) for unit in np.eye(zero.shape[1])]
        return np.stack(pushed, axis=2) / size[:, None, :] - still[:, :, None] / size[:, None, :]

    def mass_matrix(self, q: ndarray) -> ndarray:
        return np.linalg.inv(self.slopes(q))

    def bias(self, q: ndarray, M: ndarray, qd: ndarray) -> ndarray:
        """h of Mbar qdd = tau - D qd - k (q - rest) - h, with the damping and springs of the model."""
        qdd = self.equations.acceleration(q, qd, 0.0 * qd)
        passive = np.array(self.tree.damping) * qd + literal.spring_torque(self.tree, q)
        return -np.einsum("sij,sj->si", M, qdd) - passive

    def inputs(self, q: ndarray) -> ndarray | None:
        """What each torque (column) does at each joint (row), (nv, nv), if the mass matrix is right; else None."""
        acting = literal.mass_matrix(self.tree, q) @ self.slopes(q)
        factors = acting.mean(axis=0)
        off = np.abs(acting - factors).max()
        return factors if off <= CONSTANT * (1.0 + np.abs(acting).max()) else None

    def values(self, q: ndarray, qd: ndarray, rounding: float) -> "tuple[Values, partial[ndarray]] | None":
        """The mass matrix and the bias, and the bias at other speeds; None where there is no such matrix."""
        slopes = self.slopes(q)
        if not np.isfinite(slopes).all() or (np.linalg.cond(slopes) > 1e8).any():
            return None
        M, scale = np.linalg.inv(slopes), Entries(self.tree, q, qd)
        size = 1.0 + scale.force()
        qdd = self.equations.acceleration(q, qd, 0.0 * qd)
        still = scale.acceleration(scale.force(), qdd)
        of_slopes = still[:, :, None] / size[:, None, :] + np.abs(slopes)
        allowed = LARGER * rounding * np.abs(M) @ of_slopes @ np.abs(M)
        forces = np.einsum("sij,sj->si", np.abs(M), still) + scale.force()
        of_h = np.einsum("sij,sj->si", allowed, np.abs(qdd)) + LARGER * rounding * forces
        values = Values(q, qd, M, self.bias(q, M, qd), (allowed, of_h))
        return values, partial(self.bias, q, M)


def cause_of(comparison: Comparison) -> Why:
    """The probable cause of what differs."""
    if slips := slips_of_tables(comparison):
        return Why(" ".join(map(say, slips)))
    which = some_states(comparison)
    if len(which) < min(LEAST_STATES, len(comparison.q)):
        return Why("", False)  # too few of them are numbers
    q, qd, tau = comparison.q[which], comparison.qd[which], comparison.tau[which]
    yours = {name: values[which] for name, values in comparison.values.items()}
    tree, M, h, rounding = comparison.tree, yours.get("mass_matrix"), yours.get("bias"), comparison.rounding
    failing = [name for name, compared in comparison.compared.items() if compared.fails]
    values = Values.of(tree, q, qd, M, h, rounding)
    if failing == ["acceleration"]:
        asked = Asked(tree, comparison.coordinates, comparison.equations, Stated(comparison.joints), rounding)
        why = of_accelerations(asked, values, tau, yours["acceleration"])
        return why if why.is_found else of_noise(comparison, "acceleration") or why
    of_h = values
    if "gravity" in yours and ("bias" not in yours or ("gravity" in failing and "bias" not in failing)):
        of_h = Values.of(tree, q, np.zeros_like(qd), M, yours["gravity"], rounding)
    why = of_equations(comparison, of_h)
    if not why.is_found and (noisy := of_noise(comparison, "bias" if of_h is values else "gravity")):
        return noisy
    if "acceleration" not in failing or not why.is_found or M is None or h is None:
        return why
    return why._replace(text=f"{why.text} {beside(comparison, values, tau, yours['acceleration'])}".rstrip())


def of_noise(comparison: Comparison, name: str) -> Why | None:
    """A number that is wrong in tables with noise, with its uncertainty, or noise alone; None: something else.

    name: of the table of h, of gravity or of accelerations.
    """
    tree, q, qd, given = comparison.tree, comparison.q, comparison.qd, comparison.values
    equations = comparison.equations
    if equations is not None and any(map(equations.has, given)):
        return None
    qdd, h, M = None, given.get(name), given.get("mass_matrix")
    if name == "acceleration":
        qdd, M = h, None
        h = comparison.tau - np.array(tree.damping) * qd - literal.spring_torque(tree, q)
    found = through_noise(tree, Values.of(tree, q, 0.0 * qd if name == "gravity" else qd, M, h), qdd)
    if found is None:
        return None
    text = say(Finding("agreement", "noisy" if found.place else "noise_alone", {"found": found}))
    return Why(text, found.place is not None)


def some_states(comparison: Comparison) -> ndarray:
    """As many states as a diagnosis takes: of those with finite values the first, and the worst."""
    ratios = [compared.ratio for compared in comparison.compared.values()]
    worst = np.max([ratio.reshape(len(ratio), -1).max(axis=1) for ratio in ratios], axis=0)
    finite = np.flatnonzero(np.isfinite(worst))
    return np.unique([*finite[np.argsort(-worst[finite])[:1]], *finite[: STATES_ASKED - 1]]).astype(int)


def of_equations(comparison: Comparison, values: Values) -> Why:
    """What a diagnosis finds in values of Mbar and h."""
    equations, coordinates, M = comparison.equations, comparison.coordinates, values.mass_matrix
    if equations is not None and (equations.seconds > QUICK or not equations.has("bias")):
        equations = None  # they cannot be called some hundred times more
    bias = partial(equations.bias, values.q) if equations is not None else None
    mass_matrix = equations.mass_matrix if equations is not None and equations.has("mass_matrix") else None
    stated = Stated(comparison.joints)
    diagnosis = diagnose(comparison.tree, values, SECONDS_OF_CAUSE, bias, stated, mass_matrix)
    if not diagnosis.differs:
        return Why("", False)
    if not diagnosis.causes and is_single(values.packed):
        return Why(say(Finding("agreement", "single")), False)
    broken = []
    if equations is not None and equations.has("mass_matrix") and values.are_finite and not diagnosis.causes:
        tested = conditions(equations.mass_matrix, equations.bias, coordinates, values.q, values.qd)
        broken = [condition.text for condition in tested if not condition.is_met]
    mirrored = symmetric(M, values.tolerances[0].max(axis=(1, 2)), coordinates.speeds)
    if not diagnosis.is_symmetric:
        broken = [mirrored.text]
    return Why(" ".join([diagnosis.sentence(), *broken[:1]]), bool(diagnosis.causes))


def is_single(values: ndarray) -> bool:
    """Whether all numbers have single precision, and some of them need all of it."""
    finite = values[np.isfinite(values)]
    return bool((finite == finite.astype(np.float32)).all() and (finite != finite.astype(np.float16)).any())


def beside(comparison: Comparison, values: Values, tau: ndarray, qdd: ndarray) -> str:
    """What else is wrong with accelerations than the user's Mbar and h; "" where they follow from these."""
    left_over = LeftOver(comparison.tree, values, tau, qdd, comparison.rounding)
    if left_over.ratio <= 1.0:
        return ""
    return left_over.sentence() or say(Finding("agreement", "another"))


def of_accelerations(asked: Asked, values: Values, tau: ndarray, qdd: ndarray) -> Why:
    """What explains accelerations alone: a force, how they are solved for, or the bias if Mbar is right.

    values: the user's Mbar and h, as far as they are given; these are right.
    """
    tree, q, qd, rounding = asked.tree, values.q, values.qd, asked.rounding
    right = Values.of(tree, q, qd, literal.mass_matrix(tree, q), literal.bias(tree, q, qd), rounding)
    left_over = LeftOver(tree, right, tau, qdd, rounding)
    if left_over.causes:
        return Why(left_over.sentence(), True, left_over.causes)
    equations, solved = asked.equations, Why(say(Finding("agreement", "solved")), False)
    is_asked = equations is not None and equations.has("acceleration")
    if not is_asked or equations is None or equations.seconds * len(q) * (len(q[0]) + 1) > SECONDS_OF_SLOPES:
        return solved if values.are_finite else of_forces(asked, right, tau, qdd)
    affine = Affine(tree, equations)
    inputs = affine.inputs(q)
    if inputs is not None and (np.abs(inputs - np.eye(len(inputs))) > CONSTANT).any():
        return of_inputs(asked, inputs, LeftOver(tree, right, tau @ inputs.T, qdd, rounding))
    if values.are_finite:
        return solved
    own = affine.values(q, qd, rounding)
    if own is None:
        return of_forces(asked, right, tau, qdd)
    functions = (own[1], asked.stated, affine.mass_matrix) if equations.seconds <= QUICK else ()
    diagnosis = diagnose(tree, own[0], SECONDS_OF_CAUSE, *functions)
    return Why(diagnosis.sentence(), bool(diagnosis.causes), diagnosis.causes)


def of_inputs(asked: Asked, factors: ndarray, left_over: LeftOver) -> Why:
    """Torques that act with other factors or elsewhere, and what else acts; left_over: with these factors."""
    names = asked.coordinates.speeds
    off = np.argwhere(np.abs(factors - np.eye(len(names))) > CONSTANT).tolist()
    wrong = [(names[j], names[i] if i != j else "", float(factors[i, j])) for i, j in off]
    about: dict[str, Any] = {"rank": 2, "kind": "input", "unit": "times"}
    causes = tuple(
        Cause(place=f"tau of {name}{f' at {at}' * bool(at)}", stated=float(not at), explains=x, **about)
        for name, at, x in wrong
    )
    text = say(Finding("agreement", "inputs", {"factors": wrong}))
    is_found = left_over.ratio <= 1.0 or bool(left_over.causes)
    return Why(f"{text} {left_over.sentence()}".rstrip(), is_found, causes + left_over.causes)


def of_forces(asked: Asked, right: Values, tau: ndarray, qdd: ndarray) -> Why:
    """What explains accelerations by the forces Mbar qdd + h = tau - D qd - k (q - rest) that they need."""
    left_over = LeftOver(asked.tree, right, tau, qdd, asked.rounding)
    force = left_over.force + right.bias + np.einsum("sij,sj->si", right.mass_matrix, qdd)
    alone = right._replace(bias=force, tolerances=(right.tolerances[0], left_over.tolerance))
    diagnosis = diagnose(asked.tree, alone, SECONDS_OF_CAUSE, stated=asked.stated, qdd=qdd)
    text = diagnosis.sentence() if diagnosis.causes else say(Finding("agreement", "accelerations_alone"))
    return Why(text, bool(diagnosis.causes), diagnosis.causes)
