"""The dynamics as compiled loops for any tree, see loops.py: nothing to trace and compile for a new model, but slower code.

Straight-line code grows with the number of hinges, and so does the time to compile it; for large trees these loops are used.
"""

import sys
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import numpy as np

from tmt.loop_trees import arrays


def compiled():
    """The module of compiled evaluations; imported when it is first asked for, as numba takes its time."""
    from tmt import loop_calls

    return loop_calls


def loops() -> dict:
    """The compiled loops of all methods by their names."""
    from tmt import loop_runs, loop_semi_implicit, loop_stages

    return vars(loop_stages) | vars(loop_semi_implicit) | vars(loop_runs)


def is_compiled(name: str) -> bool:
    """Whether a loop of that name is there in this process."""
    modules = (
        sys.modules.get(f"{__package__}.{module}") for module in ("loop_runs", "loop_semi_implicit", "loop_stages")
    )
    return any(vars(module)[name].signatures for module in modules if module and name in vars(module))


def stepper(tree, stepping, lanes=False) -> Callable:
    """run(q, qd, tau, dt, ended, every) of a Tree and a method that has `loop`, as in kernels.stepper.

    lanes: of runs that are a multiple of eight, eight side by side where the method has such a loop.
    """
    from numba.core.compiler_lock import global_compiler_lock

    known = loops()
    loop = known[stepping.loop]
    if lanes:
        loop = known.get(f"{stepping.loop}_lanes", loop)
    run = partial(loop, arrays(tree), *stepping.looped(tree))
    # of no run: compiled for these types and then for no others, which it would take as they are (whole numbers, say)
    nothing = (
        np.empty((0, 1, tree.coordinates.nq)),
        np.empty((0, 1, tree.coordinates.nv)),
        np.empty((0, len(tree.axis))),
    )
    with global_compiler_lock:  # until nothing is to be compiled another thread does not ask
        run(*nothing, 0.0, *([1.0] if stepping.adaptive else []), np.empty((0, 2), np.int64), 1)
        loop.disable_compile()
    return run


def evaluator(tree, dynamics: bool) -> SimpleNamespace:
    """each, lanes, chain and rate of a Tree, as in kernels.evaluator; dynamics: of qdd, else of Mbar and h."""
    from numba.core.compiler_lock import global_compiler_lock

    loops, numbers = compiled(), arrays(tree)
    nq, nv = tree.coordinates.nq, tree.coordinates.nv
    m = nv if dynamics else nv * (nv + 3) // 2
    sizes = nq, nv, nv, m
    found = {name: partial(getattr(loops, name), numbers, dynamics) for name in ("each", "lanes")}
    found["chain"] = partial(loops.chain, numbers, dynamics, m)
    used = [loops.each, loops.lanes, loops.chain]
    with global_compiler_lock:  # as above
        loops.each(numbers, dynamics, *(np.empty((0, size)) for size in sizes))
        loops.lanes(numbers, dynamics, *(np.empty((size, 0)) for size in sizes))
        loops.chain(numbers, dynamics, m, np.array(tree.zero), np.zeros(nv), np.zeros(nv), 0)
        if dynamics:
            loops.rate(numbers, np.array([*tree.zero, *[0.0] * nv]), np.zeros(nv))
            found["rate"] = partial(loops.rate, numbers)
            used.append(loops.rate)
        for loop in used:
            loop.disable_compile()
    return SimpleNamespace(**found)
