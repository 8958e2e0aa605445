"""What of an evaluation can be compiled and timed in reasonable time, for a robot of any joints."""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

import tmt
from tmt import kernels
from tmt.compiled.trace import Code
from tmt.equations import method

from ...case import Case, Coordinates
from ...engines.tmt import form_of
from ...judge.words import listed

MOST_RESULTS = 10_000_000  # numbers, the results of many states, of a robot of many joints
MOST_LITERAL = 3000  # operations of the literal form, up to which its straight-line code is compiled


def states_of(coordinates: Coordinates, rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """Random positions (count, nq), speeds and torques (count, nv)."""
    if set(coordinates.all_kinds) == {"hinge"}:
        return list(rng.uniform(-3.0, 3.0, (3, count, coordinates.nv)))
    return [coordinates.random(rng, count), *rng.uniform(-3.0, 3.0, (2, count, coordinates.nv))]


def most_states(tree: tmt.Tree) -> int:
    """How many states are evaluated at once at most, a power of ten."""
    n = len(tree.axis)
    return int(10.0 ** np.floor(np.log10(MOST_RESULTS / (n * (n + 3) // 2))))


@lru_cache(maxsize=8)
def lengths(tree: tmt.Tree) -> list[int] | None:
    """Of the straight-line code of the literal and of the composite form; None: none is made for so many joints."""
    if not kernels.is_evaluated_straight(tree):
        return None
    return [
        code.operations
        for code in (kernels.slope_source(tree, "rk4", method.mass_matrix_and_bias), straight_line(tree))
    ]


@lru_cache(maxsize=8)
def straight_line(tree: tmt.Tree) -> Code:
    """The forward dynamics of a tree in straight lines, of the composite form."""
    return kernels.slope_source(tree, "rk4")


def literal_is_compiled(tree: tmt.Tree) -> bool:
    """Whether the literal form of a tree is short enough for its compilation."""
    return kernels.is_evaluated_straight(tree) and lengths(tree)[0] <= MOST_LITERAL


def left_out_in_words(tree: tmt.Tree) -> list[str]:
    """What is not timed, and why, in sentences."""
    if not kernels.is_evaluated_straight(tree):
        return [
            f"Straight-line code for {len(tree.axis)} speeds would take too long to compile: the loop over any tree takes its "
            "place, and neither the kernel nor the literal form is timed."
        ]
    if not literal_is_compiled(tree):
        return [
            f"The literal form is not timed: its {lengths(tree)[0]} operations would take too long to compile. Neither is the "
            "composite form with the library's sine."
        ]
    return []


def forms_in_words(cases: Iterable[Case], methods: Iterable[str]) -> str:
    """Which code follows tmt's runs of these cases."""
    forms = {(form_of(case.tree, method), method) for case in cases for method in methods if not case.controller}
    straight, loop = ({method for form, method in forms if form == name} for name in ("straight_line", "loop"))
    parts = [f"straight-line code, traced and compiled for the model ({listed(sorted(straight))})"] * bool(straight)
    parts += [f"the loop over any tree, compiled once for all models ({listed(sorted(loop))})"] * bool(loop)
    return f"tmt's runs are followed by {' and by '.join(parts)}." if parts else ""
