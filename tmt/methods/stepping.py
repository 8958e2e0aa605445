"""What a method of integration is, and what it says of itself: `Method`, from which all in METHODS are made.

The rest of tmt asks these fields and never a type. An object that is not made from Method gets the defaults, see `completed`.
"""

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Any

from tmt.derivation.coordinates import FLAT, Coordinates, Flat
from tmt.derivation.mechanism import AnyTree
from tmt.derivation.vectors import Scalar, Values
from tmt.methods.dynamics import LITERAL, Terms, dynamics_of
from tmt.model.values import shown

Slope = Callable[[Values, Values], Values]
State = tuple[Values, Values]
Joints = Coordinates | Flat


class Method:
    """A method of integration. Another one is a subclass with a `step`; it must be hashable, as a frozen dataclass is.

    `step(slope, q, qd, dt)` returns the state (q, qd) one dt later, each a list of n scalars of any type; it asks
    `slope(q, qd)` for accelerations, a list of n. Which accelerations these are is said by the method's own `slope`. For a tree
    with balls it is given their coordinates too (see coordinates.py), `step(slope, q, qd, dt, joints)`: q is longer than qd.
    """

    order: int = 1  # the error of a run falls with dt to this power
    adaptive = False  # chooses its own steps, takes a tolerance and has an `attempt`, see AdaptiveRungeKutta
    solves_stages = False  # its stages solve an equation: it has `stage_states` and `finish`, see implicit.py
    damps_implicitly = False  # its slope takes the joint damping at the rates one dt later

    @cached_property
    def lanes(self) -> bool:
        """Whether it can be followed in lanes: then every run does the same in each step."""
        return not (self.adaptive or self.solves_stages)

    @cached_property
    def stages(self) -> int:
        """Evaluations of the dynamics in one step; of a method that solves its stages, in one iteration."""
        if self.solves_stages:
            why = "it solves its stages and does not say how many they are"
            raise ValueError(f"{why}; a field stages is expected")
        positions = []

        def slope(q: Values, qd: Values) -> Values:
            positions.append(q)
            return [0.0]

        try:
            self.step(slope, [0.0], [0.0], 1.0)
        except Exception as error:  # a step of the user's own
            why = f"its stages cannot be counted, as its step of one hinge fails: {shown(error)}"
            raise ValueError(why) from error
        return len(positions)

    def slope(
        self, tree: AnyTree, q: Values, qd: Values, tau: Values, dt: Scalar, terms: Terms = LITERAL
    ) -> Values:
        """qdd from Mbar qdd = tau - D qd - h; terms: Dynamics, or a function that gives Mbar and h."""
        return dynamics_of(terms).acceleration(tree, q, qd, tau)

    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Joints = FLAT) -> State:
        """The state (q, qd) one dt later, from `slope(q, qd)`."""
        raise NotImplementedError


def stepped(stepping: Method, tree: AnyTree, slope: Slope, q: Values, qd: Values, dt: Scalar) -> State:
    """The state (q, qd) of a tree one dt later by a method that asks `slope(q, qd)`."""
    joints = tree.coordinates
    return stepping.step(slope, q, qd, dt, joints) if joints.balls else stepping.step(slope, q, qd, dt)


OVERFLOW, TURNED, NEWTON, SMALL = 1, 2, 3, 4  # why a run ends; 0: it does not
FLAGS, COUNTS = ("adaptive", "solves_stages", "damps_implicitly", "lanes"), ("order", "stages")
FIELDS = dict.fromkeys(FLAGS, "True or False") | dict.fromkeys(COUNTS, "a whole number of at least 1")
ACTS = ("slope", "step")
NEEDS = {"adaptive": ("attempt",), "solves_stages": ("stage_states", "finish")}
EXPECTED = "a hashable method with a slope and a step is expected"


class Completed(Method):
    """An object that is not made from Method, with the defaults of Method for the fields that it lacks."""

    def __init__(self, stepping: object):  # of a user's own class
        for name in (*ACTS, *FIELDS, *NEEDS["adaptive"], *NEEDS["solves_stages"]):
            if hasattr(stepping, name):
                setattr(self, name, getattr(stepping, name))


def completed(stepping: object) -> Method:
    """The object as a method with all fields of Method; ValueError if it is no method, or says what cannot be."""
    try:
        hash(stepping)
    except Exception:  # what a user's own object raises
        raise ValueError(EXPECTED) from None
    return _completed(stepping)


@lru_cache(maxsize=64)
def _completed(stepping: object) -> Method:
    if not all(callable(getattr(stepping, act, None)) for act in ACTS):
        raise ValueError(EXPECTED)
    complete = stepping if isinstance(stepping, Method) else Completed(stepping)
    for name, accepted in FIELDS.items():
        value: Any = getattr(complete, name)
        is_right = isinstance(value, bool) if name in FLAGS else type(value) is int and value >= 1
        if not is_right:
            raise ValueError(f"its {name} is {shown(value)}, where {accepted} is expected")
    for name, parts in NEEDS.items():
        if lacking := [part for part in parts if getattr(complete, name) and not hasattr(complete, part)]:
            raise ValueError(f"its {name} is {getattr(complete, name)}, but it has no {lacking[0]}")
    return complete


def increments(dt: Scalar, weights: Sequence[float], slopes: Sequence[Values], n: int) -> Values:
    """dt * sum of weights * slopes, (n,); 0.0 where there are none."""
    return advance([0.0] * n, dt, weights, slopes)


def advance(start: Values, dt: Scalar, weights: Sequence[float], slopes: Sequence[Values]) -> Values:
    """start + dt * sum of weights * slopes, component by component."""
    result = []
    for k, value in enumerate(start):
        terms = [slope[k] if w == 1.0 else w * slope[k] for w, slope in zip(weights, slopes) if w != 0.0]
        result.append(value + dt * sum(terms[1:], terms[0]) if terms else value)
    return result
