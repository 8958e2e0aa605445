"""The smallest model that has a scene's motion: which joints stay where they start, whatever the others do.

A set of joints stays if, with these at their start value and at rest, their accelerations vanish for all values of the
others: then the motion with them at rest solves the equations of the whole model, and its solution is the only one. The
union of two such sets is one too, so there is a largest, and it is found by taking out of all joints those that move
until none does. "For all values" is decided on the expressions of the traced method, where the acceleration must fold to
the number 0; "moves" is decided by one state at which 50 digits give another value than 0. A joint of which neither can
be said is kept: sin of the double nearest to pi is not 0, and terms that only cancel in sum do not fold.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import mpmath
import numpy as np

from tmt import Tree, method
from tmt.reference import DIGITS
from tmt.trace import Tape

from ..case import SEED, Case

TRIALS = 3  # random states of the other joints, with 50 digits
EVERY_TRIAL = 6  # up to which every trial is made
OF_ROUNDED_NUMBERS = 1e-9  # rad/s2 or m/s2: an acceleration below it is that of a model whose numbers are rounded
ZERO = mpmath.mpf(10) ** (10 - DIGITS)  # rad/s2: what 50 digits leave of an acceleration that vanishes


class Needed(NamedTuple):
    """Of the free joints of a case: which stay, and why each of the others is needed."""

    stays: tuple
    moves: dict  # name: why
    undecided: tuple  # no state was found at which they move, but their acceleration does not fold to 0
    hardly: tuple = ()  # of those that move: they accelerate by less than OF_ROUNDED_NUMBERS at all states tried


def needed(case: Case) -> Needed:
    """Which joints of the case its motion needs."""
    tree = case.tree
    names, coordinates = case.joints, case.coordinates
    joints = dict(zip(names, coordinates.places.joints))
    units = {name: coordinates.units[joint.qd.start] for name, joint in joints.items()}
    moves = {name: f"{name} has a speed at the start" for name, joint in joints.items() if any(case.v[joint.qd])}
    undecided, hardly = (), ()
    while still := tuple(name for name in names if name not in moves and name not in undecided):
        when = "at the start" if len(still) == len(names) else "when the others move"
        largest = dict.fromkeys(still, 0.0)
        rng = np.random.default_rng(SEED)
        for _ in range(TRIALS):
            (q,), qd = coordinates.random(rng, 1), rng.uniform(-10.0, 10.0, coordinates.nv)
            for name, values in exact_accelerations(case, tree, still, q, qd).items():
                largest[name] = max(largest[name], *map(abs, values))
            if len(names) > EVERY_TRIAL and min(largest.values()) > ZERO:
                break  # of many joints an evaluation takes long, and nothing is left to be found
        found = {
            name: f"{name} accelerates by {float(a):.2g} {units[name]}/s2 {when}"
            for name, a in largest.items()
            if a > ZERO
        }
        moves |= found
        hardly += tuple(name for name in found if largest[name] < OF_ROUNDED_NUMBERS)
        if not found:
            unfolded = tuple(name for name, parts in folded(case, tree, still).items() if any(n != 0.0 for n in parts))
            if not unfolded:
                break
            undecided += unfolded
    return Needed(still, moves, undecided, hardly)


def accelerations(case: Case, tree: Tree, still: Sequence[str], scalar: Callable, q: Sequence, qd: Sequence) -> dict:
    """Accelerations of the joints in `still`, at their start and at rest, the others at q, qd: tuples by name, over any scalar.

    A torque that holds is the model's own bias (and springs) at the start, over the same scalar: not its rounded value.
    """
    start = [scalar(float(value)) for value in case.q]
    q, qd, joints = list(q), list(qd), dict(zip(case.joints, tree.coordinates.joints))
    for name in still:
        _, at, by = joints[name]
        q[at], qd[by] = start[at], [scalar(0.0)] * len(qd[by])
    if case.scene.torque == "hold":
        tau = method.bias(method.bodies(tree, start), tree.gravity)
        tau = [h + spring for h, spring in zip(tau, method.spring_torque(tree, start))] if tree.has_springs else tau
    else:
        tau = [scalar(float(torque)) for torque in case.tau]
    found = method.acceleration(tree, q, qd, tau)
    return {name: tuple(found[joints[name].qd]) for name in still}


def exact_accelerations(case: Case, tree: Tree, still: Sequence[str], q: np.ndarray, qd: np.ndarray) -> dict:
    """The accelerations with 50 digits, rad/s2."""
    with mpmath.workdps(DIGITS):
        q, qd = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd))
        return accelerations(case, tree, still, mpmath.mpf, q, qd)


def folded(case: Case, tree: Tree, still: Sequence[str]) -> dict:
    """The numbers to which the traced accelerations fold; None where one remains an expression."""
    tape, sizes = Tape(), {"q": tree.coordinates.nq, "qd": tree.coordinates.nv}
    q, qd = (tape.inputs(*(f"{name}{i}" for i in range(count))) for name, count in sizes.items())
    found = accelerations(case, tree, still, tape.lift, q, qd)
    return {name: tuple(tape.lift(a).number for a in parts) for name, parts in found.items()}


def reduced(case: Case, need: Needed | None = None) -> Case | None:
    """The same case with the joints locked that stay; None if it needs all of them, or none. need: what `needed` found."""
    stays = (need or needed(case)).stays
    if not stays or len(stays) == len(case.joints):
        return None
    return case.changed(name=f"{case.name}, {' and '.join(stays)} locked", locked=case.scene.locked + stays)
