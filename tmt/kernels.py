"""A model and a method as compiled code: traced to straight lines, compiled by numba, kept on disk.

Traced is the composite form of the dynamics, with a sine of our own. One trace serves two loops: one state at a time, and
LANES states side by side, which the compiler turns into SIMD instructions. Both give the same bits.
"""

import math
from collections.abc import Callable
from functools import lru_cache, partial

from tmt import generic
from tmt.cache import is_kept, load, name_of
from tmt.calls import Evaluator, checked_evaluator, checked_run
from tmt.compiled.trace import Code
from tmt.equations import composite
from tmt.methods import METHODS, method_named
from tmt.model.arguments import checked_model
from tmt.model.tree import Tree
from tmt.model.values import shown
from tmt.source import LANES as LANES
from tmt.source import evaluator_source, lanes_source, run_source, slope_code

LONGEST = 3_000  # lines of straight-line code that are compiled; beyond, the loops of loops.py are
INLINED = 0.15  # what a line of a slope counts each time it is called, beside 1 where it stands
LARGEST = 12  # speeds: larger trees are not even traced
QUANTITIES, SINES = ("forward_dynamics", "mass_matrix_and_bias"), ("sincos", "library_sincos")


def stepper(tree: Tree, method_name: str) -> Callable:
    """Compiled `run(q, qd, tau, dt)` of a Tree and one of METHODS: fills the paths q and qd from their first states.

    q, qd: (runs, steps + 1, nq and nv), of which [:, 0] is given; tau (runs, nv); all contiguous, float64; rad, s, N m. It
    returns how often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes its
    tolerance too: `run(q, qd, tau, dt, tolerance)`. Two arguments more: `ended` (runs, 2) of int64, zeros, is filled with why
    each run ended, see templates, and after how many steps; `every`: the paths hold each so-manyth state alone. Where
    straight-line code would take long to compile, the loop over any tree follows the method, if it has one.
    """
    checked_model(tree)
    stepping = method_named(method_name)
    return _stepper(tree, stepping) if is_traced(tree, stepping) else looped(tree, method_name)


def run_in(form: str, tree: Tree, method_name: str) -> Callable:
    """The run of `stepper` in a form of following.SIDE_BY_SIDE, or ValueError; for lanes the runs are a multiple of theirs."""
    stepping, lanes = method_named(method_name), form.endswith("_lanes")
    if lanes and not stepping.lanes:
        raise ValueError(f"method {method_name!r} has no lanes; an explicit one with a fixed step is expected")
    if form.startswith("loop"):
        return looped(tree, method_name, lanes)
    return (_lane_stepper if lanes else _stepper)(tree, stepping)


def looped(tree: Tree, method_name: str, lanes: bool = False) -> Callable:
    """The run of `stepper`, or of `lane_stepper`, by the loop over any tree; ValueError if the method has none."""
    stepping = method_named(method_name)
    if not stepping.loop:
        raise ValueError(
            f"method {method_name!r} has no loop over any tree, and for {len(tree.axis)} speeds its straight-line code would "
            f"have more than {LONGEST} lines; a smaller tree is expected"
        )
    return _loop_stepper(tree, stepping, lanes=True) if lanes else _loop_stepper(tree, stepping)


def is_traced(tree: Tree, stepping) -> bool:
    """Whether a method follows a tree in straight-line code: that of moderate length."""
    return _cost(tree, stepping, LONGEST) <= LONGEST


@lru_cache(maxsize=256)
def _cost(tree, stepping, longest):
    """The lines of straight-line code, those that are put in the place of a call with what that costs."""
    if len(tree.axis) > LARGEST:
        return math.inf
    slope = _slope_lines(tree)
    if slope * least_lines(tree, stepping) > longest:  # not worth its tracing
        return math.inf
    return _run_source(tree, stepping).count("\n") + INLINED * slope * (
        0 if stepping.solves_stages else stepping.stages
    )


def lines(tree: Tree, stepping) -> tuple[float, float]:
    """Of straight-line code that is traced: those that are compiled, and those that one evaluation runs through."""
    length, slope = _run_source(tree, stepping).count("\n"), _slope_lines(tree)
    return length, length if stepping.solves_stages else slope + (length - slope) / stepping.stages


def is_on_disk(tree: Tree, stepping, lanes: bool) -> bool:
    """Whether machine code of straight-line code that is traced lies in the cache folder."""
    return is_kept(f"{name_of((_lanes_source if lanes else _run_source)(tree, stepping))}.*")


def least_lines(tree: Tree, stepping) -> int:
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
def _lanes_source(tree, stepping):
    return lanes_source(tree, stepping)


@lru_cache(maxsize=64)
def _stepper(tree, stepping):
    run = load(_run_source(tree, stepping)).run
    return checked_run(run, tree.coordinates.nq, tree.coordinates.nv, stepping.adaptive)


@lru_cache(maxsize=64)
def _loop_stepper(tree, stepping, lanes=False):
    return checked_run(
        generic.stepper(tree, stepping, lanes), tree.coordinates.nq, tree.coordinates.nv, stepping.adaptive
    )


def lane_stepper(tree: Tree, method_name: str) -> Callable:
    """`run(q, qd, tau, dt)` for a batch that is a multiple of LANES; the same bits. For methods that have `lanes`."""
    checked_model(tree)
    stepping = method_named(method_name)
    if not stepping.lanes:
        raise ValueError(f"method {method_name!r} has no lanes; an explicit one with a fixed step is expected")
    if not is_traced(tree, stepping):
        return looped(tree, method_name, lanes=True)
    return _lane_stepper(tree, stepping)


@lru_cache(maxsize=64)
def _lane_stepper(tree, stepping):
    run = load(_lanes_source(tree, stepping)).run
    return checked_run(run, tree.coordinates.nq, tree.coordinates.nv, adaptive=False)


def evaluator(
    tree: Tree, quantity: str, terms: Callable = composite.mass_matrix_and_bias, sine: str = "sincos"
) -> Evaluator:
    """Compiled evaluation of many states: `each(q, qd, tau, out)`, `lanes(q, qd, tau, out)` and `chain`.

    quantity: "forward_dynamics", the nv of qdd, and besides `rate(y, tau)` for solvers; or "mass_matrix_and_bias", the rows of
    the upper triangle of Mbar, then h. Arrays are contiguous: for each of shape (N, nq or nv), out (N, m); for lanes,
    component by component as registers want them, (nq or nv, N) and (m, N). rad, s, kg, m, N m.
    terms: the form of the dynamics that is traced; sine: "sincos" or "library_sincos". Where straight-line code would take long
    to compile, the loop over any tree is taken, which has its own form, and other terms are a ValueError.
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
                "loop over any tree alone is taken, with its own form"
            )
        return _loop_evaluator(tree, quantity)
    return _evaluator(tree, quantity, terms, sine)


def lines_of_evaluator(tree: Tree) -> int:
    """How many lines one evaluation in straight-line code of `evaluator` runs through, about."""
    return _slope_lines(tree)


def is_evaluator_on_disk(tree: Tree, quantity: str) -> bool:
    """Whether machine code of the straight-line code of `evaluator` lies in the cache folder."""
    source = evaluator_source(tree, quantity, composite.mass_matrix_and_bias, "sincos")
    return is_kept(f"{name_of(source)}.*")


def is_evaluated_straight(tree: Tree) -> bool:
    """Whether `evaluator` compiles straight-line code for a tree: some four times as it stands, in loops of their own."""
    return len(tree.axis) <= LARGEST and 1.7 * _slope_lines(tree) <= LONGEST


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
        (cached.clear if isinstance(cached, dict) else cached.cache_clear)()


OF_STEPPERS = [_stepper, _loop_stepper, _run_source, _cost, _lane_stepper, _lanes_source]  # and what following.py adds
for _public, _cached in (
    (stepper, OF_STEPPERS),
    (lane_stepper, OF_STEPPERS),
    (evaluator, [_evaluator, _loop_evaluator]),
):
    _public.cache_clear = partial(_clear, _cached)
