"""What a method of integration is, and what it says of itself: `Method`, from which all in METHODS are made.

The rest of tmt asks these fields and never a type. An object that is not made from Method gets the defaults, see `completed`.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from tmt.derivation import articulated
from tmt.derivation.method import acceleration, mass_matrix_and_bias, reduced_force
from tmt.model.values import real_numbers, shown


class Method:
    """A method of integration. Another one is a subclass with a `step`; it must be hashable, as a frozen dataclass is.

    `step(slope, q, qd, dt)` returns the state (q, qd) one dt later, each a list of n scalars of any type; it asks
    `slope(q, qd)` for accelerations, a list of n. Which accelerations these are is said by the method's own `slope`. For a tree
    with balls it is given their coordinates too (see coordinates.py), `step(slope, q, qd, dt, joints)`: q is longer than qd.
    """

    order = 1  # the error of a run falls with dt to this power
    adaptive = (
        False  # chooses its own steps, takes a tolerance and has an `attempt`, as AdaptiveRungeKutta does
    )
    solves_stages = (
        False  # its stages solve an equation: it has `stage_states` and `finish`, as in implicit.py
    )
    damps_implicitly = False  # its slope takes the joint damping at the rates one dt later

    @cached_property
    def lanes(self) -> bool:
        """Whether it can be followed in lanes: then every run does the same in each step."""
        return not (self.adaptive or self.solves_stages)

    @cached_property
    def stages(self) -> int:
        """Evaluations of the dynamics in one step; of a method that solves its stages, in one iteration."""
        if self.solves_stages:
            raise ValueError(
                "it solves its stages and does not say how many they are; a field stages is expected"
            )
        asked = []

        def slope(q, qd):
            asked.append(q)
            return [0.0]

        try:
            self.step(slope, [0.0], [0.0], 1.0)
        except Exception as error:  # a step of the user's own
            raise ValueError(
                f"its stages cannot be counted, as its step of one hinge fails: {shown(error)}"
            ) from error
        return len(asked)

    def slope(self, tree, q, qd, tau, dt, terms=mass_matrix_and_bias):
        """qdd from Mbar qdd = tau - D qd - h; terms: the function that gives Mbar and h."""
        return acceleration(tree, q, qd, tau, terms)

    def articulates(self, tree) -> bool:
        """Whether `articulated` is the slope for a tree."""
        return True

    def articulated(self, tree, q, qd, tau, dt):
        """The slope by articulated bodies, with fewer operations for large trees; not asked where `slope` is another since."""
        return articulated.acceleration(tree, q, qd, reduced_force(tree, [0.0] * len(qd), q, qd, tau))


def stepped(stepping, tree, slope, q, qd, dt) -> tuple[list, list]:
    """The state (q, qd) of a tree one dt later by a method that asks `slope(q, qd)`."""
    joints = tree.coordinates
    return stepping.step(slope, q, qd, dt, joints) if joints.balls else stepping.step(slope, q, qd, dt)


OVERFLOW, TURNED, NEWTON, SMALL = 1, 2, 3, 4  # why a run ends; 0: it does not
FIELDS = dict.fromkeys(("adaptive", "solves_stages", "damps_implicitly", "lanes"), bool) | {
    "order": int,
    "stages": int,
}
EXPECTED = "a hashable method with a slope and a step is expected"
NEEDS = {"adaptive": ("attempt",), "solves_stages": ("stage_states", "finish")}


@dataclass(frozen=True)
class Completed(Method):
    """An object that is not made from Method, with the defaults of Method for the fields that it lacks."""

    own: object

    def __post_init__(self):
        names = {"slope", "step", *FIELDS, *(part for parts in NEEDS.values() for part in parts)}
        vars(self).update({name: getattr(self.own, name) for name in names if hasattr(self.own, name)})


def completed(stepping) -> Method:
    """The object as a method with all fields of Method; ValueError if it is no method, or says what cannot be."""
    try:
        hash(stepping)
    except Exception:  # what a user's own object raises
        raise ValueError(EXPECTED) from None
    return _completed(stepping)


@lru_cache(maxsize=64)
def _completed(stepping):
    if not all(callable(getattr(stepping, act, None)) for act in ("slope", "step")):
        raise ValueError(EXPECTED)
    if not all(hasattr(stepping, name) for name in FIELDS):
        stepping = Completed(stepping)
    for name, kind in FIELDS.items():
        value = getattr(stepping, name)
        if type(value) is not kind or (kind is int and value < 1):
            accepted = {bool: "True or False", int: "a whole number of at least 1"}[kind]
            raise ValueError(f"its {name} is {shown(value)}, where {accepted} is expected")
    for name, parts in NEEDS.items():
        if lacking := [part for part in parts if getattr(stepping, name) and not hasattr(stepping, part)]:
            raise ValueError(f"its {name} is {getattr(stepping, name)}, but it has no {lacking[0]}")
    return stepping


def checked_tableau(method, *rows) -> None:
    """Make order, b, c and these rows of a tableau plain numbers: a method is a value, and a key of what is compiled for it."""
    order = method.order
    if not isinstance(order, int) or isinstance(order, bool) or not 1 <= order <= 100:
        raise ValueError(f"order of the method is {shown(order)}; a whole number from 1 to 100 is expected")
    for name in ("b", "c", *rows):
        given = getattr(method, name)
        try:
            parts = [real_numbers(part) for part in (given if name in rows else [given])]
        except TypeError:  # one number where rows are expected
            parts = [None]
        if any(part is None or part.ndim != 1 or not np.isfinite(part).all() for part in parts):
            wanted = "rows of numbers" if name in rows else "numbers"
            raise ValueError(f"{name} of the method is {shown(given)}; {wanted} are expected")
        parts = tuple(tuple(part.tolist()) for part in parts)
        object.__setattr__(method, name, parts if name in rows else parts[0])


def checked_sums(method) -> None:
    """Raise ValueError unless every row of A sums to c and b to 1."""
    for i, (row, c) in enumerate(zip(method.A, method.c)):
        if abs(sum(row) - c) > 1e-14:
            raise ValueError(f"row {i} of A sums to {sum(row)}, not to c = {c}")
    if abs(sum(method.b) - 1.0) > 1e-14:
        raise ValueError(f"b sums to {sum(method.b)}, not to 1")


def increments(dt, weights, slopes, n) -> list:
    """dt * sum of weights * slopes, (n,); 0.0 where there are none."""
    return advance([0.0] * n, dt, weights, slopes)


def advance(start, dt, weights, slopes):
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result


def left_over(M, a, force) -> list:
    """M a - force."""
    return [sum((m * x for m, x in zip(row, a)), f * -1.0) for row, f in zip(M, force)]
