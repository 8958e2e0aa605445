"""A model and a method as compiled code: traced to straight lines, compiled by numba, kept on disk.

Traced is the composite form of the dynamics, with a sine of our own. One trace serves two loops: one state at a time, and
LANES states side by side, which the compiler turns into SIMD instructions. Both give the same bits.
"""

from collections.abc import Callable
from functools import lru_cache

from . import composite, generic
from .cache import load
from .calls import Evaluator, checked_evaluator, checked_run
from .given import checked_model
from .methods import method_named
from .source import LANES as LANES
from .source import evaluator_source, lanes_source, run_source, slope_code
from .trace import Code
from .tree import Tree, shown

TRACED = 12  # hinges up to which straight-line code is worth its compilation
QUANTITIES, SINES = ("forward_dynamics", "mass_matrix_and_bias"), ("sincos", "library_sincos")
WORTH = 10_000_000  # steps of all runs together from which lanes are worth their compilation


def stepper(tree: Tree, method_name: str) -> Callable:
    """Compiled `run(q, qd, tau, dt)` of a Tree and one of METHODS: fills the paths q and qd from their first states.

    q, qd: (runs, steps + 1, nq and nv), of which [:, 0] is given; tau (runs, nv); all contiguous, float64; rad, s, N m. It returns how
    often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes its tolerance too:
    `run(q, qd, tau, dt, tolerance)`. A last argument (runs,) of int8, zeros, is filled with why each run ended, see templates.
    For many hinges a method that has `loop` takes the generic loop, which needs no compilation.
    """
    checked_model(tree)
    stepping = method_named(method_name)
    return _stepper(tree, stepping, bool(stepping.loop) and not is_traced(tree, stepping))


def is_traced(tree: Tree, stepping) -> bool:
    return len(tree.axis) <= TRACED


@lru_cache(maxsize=64)
def _stepper(tree, stepping, large):
    compiled = generic.stepper(tree, stepping) if large else load(run_source(tree, stepping)).run
    return checked_run(compiled, tree.coordinates.nq, tree.coordinates.nv, stepping.adaptive)


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
    terms: the form of the dynamics that is traced; sine: "sincos" or "library_sincos".
    """
    checked_model(tree)
    for name, value, accepted in (("quantity", quantity, QUANTITIES), ("sine", sine, SINES)):
        if not isinstance(value, str) or value not in accepted:
            raise ValueError(f"{name} is {shown(value)}; known are {', '.join(accepted)}")
    if not callable(terms) or terms.__hash__ is None:
        raise ValueError(f"terms is {shown(terms)}; a function terms(tree, q, qd) -> (Mbar, h) is expected")
    return _evaluator(tree, quantity, terms, sine)


@lru_cache(maxsize=64)
def _evaluator(tree, quantity, terms, sine):
    nq, n = tree.coordinates.nq, tree.coordinates.nv
    m = n if quantity == "forward_dynamics" else n * (n + 3) // 2
    return checked_evaluator(load(evaluator_source(tree, quantity, terms, sine)), nq, n, m)


def slope_source(tree: Tree, method_name: str, terms: Callable = composite.mass_matrix_and_bias) -> Code:
    """Straight-line source of slope(q, qd, tau, dt), with its number of operations."""
    checked_model(tree)
    return slope_code(tree, method_named(method_name), terms)


for _public, _cached in ((stepper, _stepper), (lane_stepper, _lane_stepper), (evaluator, _evaluator)):
    _public.cache_clear = _cached.cache_clear
