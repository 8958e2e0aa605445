"""The smallest model that has a scene's motion: which hinges stay where they start, whatever the others do.

A set of hinges stays if, with these at their start value and at rest, their accelerations vanish for all values of the
others: then the motion with them at rest solves the equations of the whole model, and its solution is the only one. The
union of two such sets is one too, so there is a largest, and it is found by taking out of all hinges those that move
until none does. "For all values" is decided on the expressions of the traced method, where the acceleration must fold to
the number 0; "moves" is decided by one state at which 50 digits give another value than 0. A hinge of which neither can
be said is kept: sin of the double nearest to pi is not 0, and terms that only cancel in sum do not fold.
"""

import dataclasses
from typing import NamedTuple

import mpmath
import numpy as np

from tmt import method
from tmt.reference import DIGITS
from tmt.trace import Tape

from .agreement import SEED
from .scenes import Scene

TRIALS = 3  # random states of the other hinges, with 50 digits
ZERO = mpmath.mpf(10) ** (10 - DIGITS)  # rad/s2: what 50 digits leave of an acceleration that vanishes


class Needed(NamedTuple):
    """Of the free hinges of a scene: which stay, and why each of the others is needed."""

    stays: tuple
    moves: dict  # name: why
    undecided: tuple  # no state was found at which they move, but their acceleration does not fold to 0


def needed(scene) -> Needed:
    """Which hinges of the scene its motion needs."""
    model, (_, rates) = scene.model, scene.start
    names = model.hinge_names
    moves = {name: f"{name} has a speed at the start" for name, rate in zip(names, rates) if rate}
    undecided = ()
    while still := tuple(name for name in names if name not in moves and name not in undecided):
        when = "at the start" if len(still) == len(names) else "when the others move"
        largest = dict.fromkeys(still, 0.0)
        rng = np.random.default_rng(SEED)
        for _ in range(TRIALS):
            q, qd = rng.uniform(-np.pi, np.pi, len(names)), rng.uniform(-10.0, 10.0, len(names))
            for name, value in exact_accelerations(scene, model, still, q, qd).items():
                largest[name] = max(largest[name], abs(value))
        found = {name: f"{name} accelerates by {float(a):.2g} rad/s2 {when}" for name, a in largest.items() if a > ZERO}
        moves |= found
        if not found:
            unfolded = tuple(name for name, number in folded(scene, model, still).items() if number != 0.0)
            if not unfolded:
                break
            undecided += unfolded
    return Needed(still, moves, undecided)


def accelerations(scene, model, still, scalar, q, qd) -> dict:
    """Accelerations of the hinges in `still`, at their start and at rest, the others at q, qd: by name, over any scalar.

    A torque that holds is the model's own bias at the start, over the same scalar: not its rounded value.
    """
    start = [scalar(float(angle)) for angle in scene.start[0]]
    q = [s if name in still else v for name, s, v in zip(model.hinge_names, start, q)]
    qd = [scalar(0.0) if name in still else v for name, v in zip(model.hinge_names, qd)]
    if scene.torque == "hold":
        tau = method.bias(method.bodies(model, start), model.gravity)
    else:
        tau = [scalar(float(torque)) for torque in scene.tau]
    by_name = dict(zip(model.hinge_names, method.acceleration(model, q, qd, tau)))
    return {name: by_name[name] for name in still}


def exact_accelerations(scene, model, still, q, qd) -> dict:
    """The accelerations with 50 digits, rad/s2."""
    with mpmath.workdps(DIGITS):
        q, qd = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd))
        return accelerations(scene, model, still, mpmath.mpf, q, qd)


def folded(scene, model, still) -> dict:
    """The numbers to which the traced accelerations fold; None where one remains an expression."""
    tape = Tape()
    q, qd = (tape.inputs(*(f"{name}{i}" for i in range(len(model.parent)))) for name in ("q", "qd"))
    return {name: tape.lift(a).number for name, a in accelerations(scene, model, still, tape.lift, q, qd).items()}


def reduced(scene, need=None) -> Scene | None:
    """The same scene with the hinges locked that stay; None if it needs all of them, or none. need: what `needed` found."""
    stays = (need or needed(scene)).stays
    if not stays or len(stays) == len(scene.hinges):
        return None
    return dataclasses.replace(scene, name=f"{scene.name}, {' and '.join(stays)} locked", locked=scene.locked + stays)
