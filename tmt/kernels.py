"""A model and a method as compiled code: traced to straight lines, compiled by numba, kept on disk.

Traced is the composite form of the dynamics, with a sine of our own. One trace serves two loops: one state at a time, and
LANES states side by side, which the compiler turns into SIMD instructions. Both give the same bits.
"""

import math
from collections.abc import Callable
from functools import lru_cache, partial

from . import composite, generic
from .cache import load
from .calls import Evaluator, checked_evaluator, checked_run
from .given import checked_model
from .methods import METHODS, method_named
from .source import LANES as LANES
from .source import evaluator_source, lanes_source, run_source, slope_code
from .trace import Code
from .tree import Tree
from .values import shown

LONGEST = 14_000  # lines of straight-line code that are compiled, which takes half a minute; beyond, the loops of generic.py are
INLINED = 0.15  # what a line costs each time it is put in the place of a call, beside 1 where it stands
LARGEST = 24  # speeds: larger trees are not even traced
QUANTITIES, SINES = ("forward_dynamics", "mass_matrix_and_bias"), ("sincos", "library_sincos")
FEW = 300_000  # steps of all runs together, with gains: up to there the loop is done before a compilation would be
WORTH = 10_000_000  # steps of all runs together from which lanes are worth their compilation


def stepper(tree: Tree, method_name: str, steps: int | None = None) -> Callable:
    """Compiled `run(q, qd, tau, dt)` of a Tree and one of METHODS: fills the paths q and qd from their first states.

    q, qd: (runs, steps + 1, nq and nv), of which [:, 0] is given; tau (runs, nv); all contiguous, float64; rad, s, N m. It
    returns how often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes its
    tolerance too: `run(q, qd, tau, dt, tolerance)`. A last argument (runs,) of int8, zeros, is filled with why each run ended,
    see templates. Where straight-line code would take long to compile, the loop over any tree follows the method, if it has one;
    and where a tree with gains, of which a robot may have many, is to be followed for no more than so many steps of all runs.
    """
    checked_model(tree)
    stepping = method_named(method_name)
    if tree.has_gains and stepping.loop and steps is not None and steps < FEW:
        return _loop_stepper(tree, stepping)
    if not is_traced(tree, stepping):
        if not stepping.loop:
            raise ValueError(
                f"method {method_name!r} has no loop over any tree, and for {len(tree.axis)} speeds its straight-line code would "
                f"have more than {LONGEST} lines; a smaller tree is expected"
            )
        return _loop_stepper(tree, stepping)
    return _stepper(tree, stepping)


def is_traced(tree: Tree, stepping) -> bool:
    """Whether a method follows a tree in straight-line code: that of moderate length."""
    return _cost(tree, stepping) <= LONGEST


@lru_cache(maxsize=256)
def _cost(tree, stepping):
    """The lines of straight-line code, those that are put in the place of a call with what that costs."""
    if len(tree.axis) > LARGEST:
        return math.inf
    slope = _slope_lines(tree)
    if slope * _least_lines(tree, stepping) > LONGEST:  # not worth its tracing
        return math.inf
    return _run_source(tree, stepping).count("\n") + INLINED * slope * (
        0 if stepping.solves_stages else stepping.stages
    )


def _least_lines(tree, stepping):
    """How many times the lines of the slopes those of a step are at least, about: measured on trees of 3 to 15 speeds."""
    if stepping.solves_stages:
        return (9, 25)["ball" in tree.kind] if stepping.stages > 1 else (7, 9)["ball" in tree.kind]
    return 3 if getattr(stepping, "implicit_bias", False) else 1


@lru_cache(maxsize=256)
def _slope_lines(tree):
    return slope_code(tree, METHODS["rk4"]).text.count("\n")


@lru_cache(maxsize=64)
def _run_source(tree, stepping):
    return run_source(tree, stepping)


@lru_cache(maxsize=64)
def _stepper(tree, stepping):
    run = load(_run_source(tree, stepping)).run
    return checked_run(run, tree.coordinates.nq, tree.coordinates.nv, stepping.adaptive)


@lru_cache(maxsize=64)
def _loop_stepper(tree, stepping):
    return checked_run(generic.stepper(tree, stepping), tree.coordinates.nq, tree.coordinates.nv, stepping.adaptive)


def lane_stepper(tree: Tree, method_name: str) -> Callable:
    """`run(q, qd, tau, dt)` for a batch that is a multiple of LANES; the same bits. For methods that have `lanes`."""
    checked_model(tree)
    stepping = method_named(method_name)
    if not stepping.lanes:
        raise ValueError(f"method {method_name!r} has no lanes; an explicit one with a fixed step is expected")
    return _lane_stepper(tree, stepping)


@lru_cache(maxsize=64)
def _lane_stepper(tree, stepping):
    run = load(lanes_source(tree, stepping)).run
    return checked_run(run, tree.coordinates.nq, tree.coordinates.nv, adaptive=False)


def evaluator(
    tree: Tree, quantity: str, terms: Callable = composite.mass_matrix_and_bias, sine: str = "sincos"
) -> Evaluator:
    """Compiled evaluation of many states: `each(q, qd, tau, out)`, `lanes(q, qd, tau, out)` and `chain`.

    quantity: "forward_dynamics", the nv of qdd, and besides `rate(y, tau)` for solvers; or "mass_matrix_and_bias", the rows of
    the upper triangle of Mbar, then h. Arrays are contiguous: for each of shape (N, nq or nv), out (N, m); for lanes,
    component by component as registers want them, (nq or nv, N) and (m, N). rad, s, kg, m, N m.
    terms: the form of the dynamics that is traced; sine: "sincos" or "library_sincos". Where straight-line code would take long
    to compile, the loop over any tree evaluates the composite form, and other terms are a ValueError.
    """
    checked_model(tree)
    for name, value, accepted in (("quantity", quantity, QUANTITIES), ("sine", sine, SINES)):
        if not isinstance(value, str) or value not in accepted:
            raise ValueError(f"{name} is {shown(value)}; known are {', '.join(accepted)}")
    if not callable(terms) or terms.__hash__ is None:
        raise ValueError(f"terms is {shown(terms)}; a function terms(tree, q, qd) -> (Mbar, h) is expected")
    if not is_evaluated_straight(tree):
        if terms is not composite.mass_matrix_and_bias:
            raise ValueError(
                f"terms {shown(terms)} of {len(tree.axis)} speeds would take more than a minute to compile; for so many the "
                "composite form alone is evaluated, by a loop"
            )
        return _loop_evaluator(tree, quantity)
    return _evaluator(tree, quantity, terms, sine)


def is_evaluated_straight(tree: Tree) -> bool:
    """Whether `evaluator` compiles straight-line code for a tree: some four times as it stands, in loops of their own."""
    return len(tree.axis) <= LARGEST and 1.7 * _slope_lines(tree) <= LONGEST / 1.5


@lru_cache(maxsize=64)
def _loop_evaluator(tree, quantity):
    nq, n = tree.coordinates.nq, tree.coordinates.nv
    m = n if quantity == "forward_dynamics" else n * (n + 3) // 2
    return checked_evaluator(generic.evaluator(tree, quantity == "forward_dynamics"), nq, n, m)


@lru_cache(maxsize=64)
def _evaluator(tree, quantity, terms, sine):
    nq, n = tree.coordinates.nq, tree.coordinates.nv
    m = n if quantity == "forward_dynamics" else n * (n + 3) // 2
    return checked_evaluator(load(evaluator_source(tree, quantity, terms, sine)), nq, n, m)


def slope_source(tree: Tree, method_name: str, terms: Callable = composite.mass_matrix_and_bias) -> Code:
    """Straight-line source of slope(q, qd, tau, dt), with its number of operations."""
    checked_model(tree)
    return slope_code(tree, method_named(method_name), terms)


def _clear(caches):
    for cached in caches:
        cached.cache_clear()


for _public, *_cached in (
    (stepper, _stepper, _loop_stepper, _run_source, _cost),
    (lane_stepper, _lane_stepper),
    (evaluator, _evaluator, _loop_evaluator),
):
    _public.cache_clear = partial(_clear, _cached)
