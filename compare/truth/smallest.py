"""The smallest model with the same motion in a scene: which joints stay, however the others move.

A set of joints stays if their accelerations vanish for all values of the others, with these joints at their start and
at rest. There is a largest such set: remove the joints that move from all joints until none moves. Whether a joint
moves is decided at a random state, by its acceleration in 50 digits: an analytic function that is 0 there is 0.
"""

import dataclasses
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import mpmath
import numpy as np

import tmt
from tmt.derivation import method
from tmt.derivation.vectors import solve
from tmt.exact.tree import DIGITS, exact_tree

from ..robots.case import SEED, Case

# an acceleration that counts as 0, relative to the largest one at that state, or to 1
ZERO = mpmath.mpf(10) ** (10 - DIGITS)


class Needed(NamedTuple):
    """Which free joints of a case stay, and why each of the others is needed."""

    stays: tuple[str, ...]
    moves: dict[str, str]  # name: why


def needed(case: Case) -> Needed:
    """Which joints of the case its motion needs."""
    names, coordinates = case.joints, case.coordinates
    joints = coordinates.by_name
    moves = {name: f"{name} has a speed at the start" for name in names if any(case.v[joints[name].qd])}
    while still := tuple(name for name in names if name not in moves):
        rng = np.random.default_rng(SEED)
        (q,), qd = coordinates.random(rng, 1), rng.uniform(-10.0, 10.0, coordinates.nv)
        when = "at the start" if len(still) == len(names) else "when the others move"
        for name, accelerations in exact_accelerations(case, still, q, qd).items():
            largest, unit = max(map(abs, accelerations)), coordinates.units[joints[name].qd.start]
            if largest > 0.0:
                moves[name] = f"{name} accelerates by {float(largest):.2g} {unit}/s2 {when}"
        if not moves.keys() & {*still}:
            break
    return Needed(still, moves)


def exact_accelerations(
    case: Case, still: Sequence[str], of_q: np.ndarray, of_qd: np.ndarray
) -> dict[str, tuple[mpmath.mpf, ...]]:
    """The accelerations of the joints in `still`, at their start and at rest: 50 digits, rad/s2 or m/s2, by name.

    A holding torque is the model's own bias (and springs) at the start in these numbers, not rounded.
    """
    joints = case.coordinates.by_name
    with mpmath.workdps(DIGITS):
        tree = exact_tree(case.tree, mpmath.mpf)
        start, q, qd, tau = (list(map(mpmath.mpf, v.tolist())) for v in (case.q, of_q, of_qd, case.tau))
        for joint in tree.coordinates.balls:
            for turns in (start, q):
                length = mpmath.sqrt(sum(part * part for part in turns[joint.q]))
                turns[joint.q] = [part / length for part in turns[joint.q]]
        for joint in (joints[name] for name in still):
            q[joint.q], qd[joint.qd] = start[joint.q], [mpmath.mpf(0)] * len(qd[joint.qd])
        springs = method.spring_torque(tree, q) if tree.has_springs else [0.0] * len(qd)
        if case.scene.torque == "hold":
            tau = method.bias(method.bodies(tree, start), tree.gravity)
            if tree.has_springs:  # the change from the start, 0 for a joint that stays
                springs = [now - before for now, before in zip(springs, method.spring_torque(tree, start))]
        h = method.bias(method.bodies(tree, q, qd), tree.gravity)
        values = [t - d * v - hi - spring for t, d, v, hi, spring in zip(tau, tree.damping, qd, h, springs)]
        if max(map(abs, values)) > ZERO:
            still_tree = dataclasses.replace(case.tree, damping=(0.0,) * len(qd))
            values = solve(exact_mass_matrix(still_tree, tuple(q)), values)
        zero = ZERO * max(1, *map(abs, values))
        values = [a if abs(a) > zero else mpmath.mpf(0) for a in values]
        return {name: tuple(values[joints[name].qd]) for name in still}


@lru_cache(maxsize=8)
def exact_mass_matrix(tree: tmt.Tree, q: tuple[mpmath.mpf, ...]) -> list[list[mpmath.mpf]]:
    """Mbar at a position in mpmath's current digits; cached, as the scenes of a robot share positions."""
    exact = exact_tree(tree, mpmath.mpf)
    return method.mass_matrix(method.bodies(exact, q), exact.armature)
