"""The probable cause of a difference, in a sentence: what the diagnosis finds in Mbar and h, and what can only be in qdd."""

import dataclasses
from typing import NamedTuple

import numpy as np

import tmt

from ..diagnosis import STATES, Diagnosis, diagnose, packed
from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from .given import Given, over

SHARPER = 4.0  # times: Mbar and h that are found from accelerations are off by so much more


class Values(NamedTuple):
    """Mbar and h of one's own with their tolerances, in the model's joints, at states: what a diagnosis is given."""

    q: np.ndarray
    qd: np.ndarray
    mass_matrix: np.ndarray | None
    bias: np.ndarray | None
    tolerances: tuple[np.ndarray, np.ndarray]  # of Mbar and h


def cause_of(given: Given) -> str:
    """The sentence."""
    failing = [name for name, one in given.compared.items() if (one.ratio > 1.0).any()]
    of_equations = [name for name in failing if name != "acceleration"]
    if not of_equations and (simple := of_acceleration(given)):
        return simple
    if not of_equations and {"mass_matrix", "bias"} <= given.compared.keys():
        return "mass_matrix and bias agree: the difference comes from how they are solved, or from damping or springs."
    values = known_values(given, of_equations)
    if values is None:
        return "It is not sought from accelerations that are numbers: give mass_matrix and bias too."
    return diagnosed(given, values)


def diagnosed(given: Given, values: Values) -> str:
    """What a diagnosis says of values; joints that it finds to be otherwise are stated anew, and not beside what was stated."""
    M, h = values.mass_matrix, values.bias
    names = given.coordinates.names

    def found(q, qd, M, h, *tolerances) -> Diagnosis:
        states = len(q)
        tolerance = packed(*tolerances, given.coordinates.nv, states)
        return diagnose(given.tree, names, q, qd, packed(M, h, given.coordinates.nv, states), tolerance)

    first = found(values.q, values.qd, M, h, *values.tolerances)
    of_joints = any(cause.kind in ("order", "sign", "unit", "zero", "order and sign") for cause in first.causes)
    joints = given.joints
    if of_joints and not joints.is_same:
        turned = [None if M is None else joints.own_mass_matrix(M), None if h is None else joints.own_forces(h)]
        sizes = [np.abs(joints.own_mass_matrix(values.tolerances[0])), np.abs(joints.own_forces(values.tolerances[1]))]
        anew = found(joints.own_positions(values.q), joints.own_speeds(values.qd), *turned, *sizes)
        if anew.causes:
            return f"{anew.sentence} That takes the place of joints={[str(joint) for joint in joints.joints]}."
    return first.sentence


def known_values(given: Given, failing: list[str]) -> Values | None:
    """Mbar and h at some of the states, the worst one among them; None if nothing is known of them."""
    which = some_states(given)
    q, qd = given.q[which], given.qd[which]
    own = {name: values[which] for name, values in given.values.items()}
    M, h = own.get("mass_matrix"), own.get("bias")
    if failing == ["gravity"] or (h is None and "gravity" in own):
        h, qd = own["gravity"], np.zeros_like(qd)
        M = None if failing == ["gravity"] else M
    if M is None and h is None:
        return of_accelerations(given, which)
    scale = Entries(given.tree, q, qd)
    rounding = FACTOR * EPS + given.rtol
    sizes = (np.broadcast_to(size, (len(q), *size.shape[1:])) for size in (scale.mass_matrix, scale.bias))
    return Values(q, qd, M, h, tuple(positive(rounding * size) for size in sizes))


def positive(tolerance: np.ndarray) -> np.ndarray:
    """A tolerance that can be divided by."""
    return np.maximum(tolerance, np.finfo(float).tiny / EPS)


def some_states(given: Given) -> np.ndarray:
    """The numbers of so many states as a diagnosis takes: of those with finite values the first, and the worst."""
    worst = np.max([one.ratio.reshape(len(given.q), -1).max(axis=1) for one in given.compared.values()], axis=0)
    order = np.argsort(~np.isfinite(worst), kind="stable")[:STATES]
    finite = np.where(np.isfinite(worst), worst, -1.0)
    return np.unique([int(np.argmax(finite)), *order[: STATES - 1]])


def of_accelerations(given: Given, which: np.ndarray) -> Values | None:
    """Mbar and h from a function of accelerations: these are linear in the torque, and Mbar^-1 is their slope."""
    own, tree = given.own, given.tree
    if own is None or not own.has("acceleration"):
        return None
    q, qd, tau = given.q[which], given.qd[which], given.tau[which]
    base = own.acceleration(q, qd, tau)
    size = np.abs(tau).max() + 1.0
    slopes = [(own.acceleration(q, qd, tau + size * e) - base) / size for e in np.eye(given.coordinates.nv)]
    inverse = np.stack(slopes, axis=-1)
    if not np.isfinite(inverse).all() or np.linalg.cond(inverse).max() > 1.0 / np.sqrt(EPS):
        return None
    M = np.linalg.inv(inverse)
    h = tau - own.passive(q, qd) - np.einsum("sij,sj->si", M, base)
    scale = Entries(tree, q, qd)
    force = scale.force(np.abs(tau) + size)
    spread = np.abs(scale.M) @ scale.inverse
    root = np.sqrt(np.einsum("sii->si", scale.M))
    of_M = spread @ (scale.mass_matrix + root[:, :, None] * root[:, None, :]) @ spread.transpose(0, 2, 1)
    off = np.einsum("sij,sj->si", spread, scale.residual(force, base))
    # an acceleration is off by eps of all of its terms: those of one more torque are as large as they
    of_M = of_M + off[:, :, None] * np.abs(M).max() / size
    of_h = off + np.einsum("sij,sj->si", of_M, np.abs(base))
    rounding = SHARPER * (FACTOR * EPS + given.rtol)
    return Values(q, qd, M, h, (positive(rounding * of_M), positive(rounding * of_h)))


def of_acceleration(given: Given) -> str:
    """What explains accelerations alone: torque, damping and springs, which are not in Mbar and h; "" if they do not."""
    own, compared, tree = given.values["acceleration"], given.compared["acceleration"], given.tree
    tolerance = given.joints.forces(compared.tolerance)
    undamped = dataclasses.replace(tree, damping=np.zeros_like(tree.damping))
    loose = dataclasses.replace(tree, stiffness=np.zeros_like(tree.stiffness))
    tried = {
        "the sign of tau: qdd is that of -tau": (tree, -given.tau),
        "tau is left out": (tree, np.zeros_like(given.tau)),
        "damping D qd is left out": (undamped, given.tau),
        "damping D qd has the other sign": (undamped, given.tau + np.array(tree.damping) * given.qd),
        "springs k (q - rest) are left out": (loose, given.tau),
        "damping D qd and springs k (q - rest) are left out": (
            dataclasses.replace(loose, damping=undamped.damping),
            given.tau,
        ),
    }
    for text, (changed, tau) in tried.items():
        right = tmt.acceleration(given.q, given.qd, tau, changed)
        if (over(np.abs(own - right), np.abs(tolerance)) <= 1.0).all():
            return f"In qdd {text}; mass_matrix and bias are right."
    return ""
