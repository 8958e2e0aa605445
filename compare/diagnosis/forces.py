"""What else acts in accelerations than Mbar and h: a torque of the opposite sign, damping, springs, friction.

For given accelerations the force  r = tau - D qd - k (q - rest) - h - Mbar qdd  is left over, with Mbar and h of the same source:
zero if nothing else acts.
"""

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np

import tmt
from tmt import literal

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from .cause import Cause, Change, cause_of, tied
from .fit import Search
from .places import forces

SHARPER = 4.0  # times the tolerance: accelerations are rounded before Mbar is multiplied by them


def force_left_over(
    tree: tmt.Tree, q, qd, tau, M, h, qdd, rounding: float = FACTOR * EPS
) -> tuple[np.ndarray, np.ndarray]:
    """r and its tolerance, (states, nv). rounding: of the scale of an entry."""
    scale, drag = Entries(tree, q, qd), np.array(tree.damping) * qd
    left_over = tau - drag - spring_force(tree, q) - h - np.einsum("sij,sj->si", M, qdd)
    return left_over, SHARPER * rounding * scale.residual(scale.force(tau), qdd)


def spring_force(tree: tmt.Tree, q: np.ndarray) -> np.ndarray | float:
    return literal.spring_torque(q, tree) if tree.has_springs else 0.0


def causes_of_forces(tree: tmt.Tree, q, qd, tau, h, left_over, tolerance) -> tuple[Cause, ...]:
    """What explains the forces left over, r (states, nv): all causes of the first rank that has one.

    q: (states, nq), qd, tau, h: (states, nv). tolerance: of r, (states, nv) or what broadcasts to it.
    """
    if not (np.isfinite(left_over).all() and np.isfinite(tolerance).all()):
        return ()
    nothing = SimpleNamespace(values=lambda changes=None: np.zeros((1, *left_over.shape)))
    search = Search(
        nothing, list(forces(tree, q, qd)), left_over, np.broadcast_to(tolerance, left_over.shape)
    )
    if np.abs(search.off).max() <= 1.0:
        return ()
    causes = []
    for change, force in options_of_forces(tree, q, qd, tau, h):
        rest = search.weighted(force)
        if np.abs(rest).max() <= 1.0:
            causes.append(cause_of(1, [change], float(np.linalg.norm(rest)) / search.size))
    for fits in (search.singles, lambda: search.pairs(("number",))):
        for fit in fits() if not causes else ():
            changes = [place.changed(change) for place, change in zip(fit.places, fit.changes)]
            if fit.explains:
                causes.append(cause_of(1 + len(changes), changes, fit.left))
    return tied(causes)


def options_of_forces(tree: tmt.Tree, q, qd, tau, h) -> Iterator[tuple[Change, np.ndarray]]:
    """Each option and the force that is left over with it."""
    for place, stated, term in (
        ("torque in the acceleration", "tau", -tau),
        ("bias in the acceleration", "- h", h),
        ("damping in the acceleration", "- D qd", np.array(tree.damping) * qd),
        ("springs in the acceleration", "- k (q - rest)", np.zeros_like(qd) + spring_force(tree, q)),
    ):
        for explains, factor in (("left out", -1.0), ("of the other sign", -2.0), ("twice", 1.0)):
            if term.any():
                yield Change("option", place, stated, explains), factor * term
