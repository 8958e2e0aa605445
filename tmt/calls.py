"""Calls of compiled code with what a user gives.

Compiled code takes contiguous float64 arrays that can be written, and checks their shapes itself. Nothing but arrays may reach
it: numba has crashed on other objects, and takes masked arrays without their mask. So types are compared first, and an array
is looked at more closely only where it was refused: a call that is right costs about 0.2 microseconds more.
"""

import operator
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt.model.arguments import whole
from tmt.model.values import shown

NOT_ASKED = np.zeros((0, 2), np.int64)  # where nobody wants to know why runs ended


def refused() -> tuple:
    """What compiled code raises for arguments that it cannot take: older versions of numba have an error of their own."""
    from numba.core.errors import NumbaError  # here, so that `import tmt` need not wait for numba

    return TypeError, NumbaError


class Evaluator(NamedTuple):
    """Compiled evaluations of one quantity of a Tree, see kernels.evaluator."""

    each: Callable
    lanes: Callable
    chain: Callable
    rate: Callable | None  # of forward dynamics


def checked_run(compiled, nq, n, adaptive) -> Callable:
    """The run of kernels.stepper."""
    shapes = {
        "q": f"(runs, records, {nq})",
        "qd": f"(runs, records, {n})",
        "tau": f"(runs, {n})",
        "ended": "(runs, 2)",
    }

    def run(q, qd, tau, dt, ended=NOT_ASKED, every=1):
        if not type(q) is type(qd) is type(tau) is type(ended) is ndarray:
            q, qd, tau, ended = plain(shapes, q, qd, tau, ended)
        if type(dt) is not float:
            dt = real("dt", dt)
        if type(every) is not int:
            every = whole("every", every)
        try:
            return compiled(q, qd, tau, dt, ended, every)
        except refused() as error:
            raise refusal(error, shapes, q, qd, tau, ended) from None

    def run_adaptive(q, qd, tau, dt, tolerance, ended=NOT_ASKED, every=1):
        if not type(q) is type(qd) is type(tau) is type(ended) is ndarray:
            q, qd, tau, ended = plain(shapes, q, qd, tau, ended)
        dt, tolerance, every = real("dt", dt), real("tolerance", tolerance), whole("every", every)
        try:
            return compiled(q, qd, tau, dt, tolerance, ended, every)
        except refused() as error:
            raise refusal(error, shapes, q, qd, tau, ended) from None

    return run_adaptive if adaptive else run


def checked_evaluator(module, nq, n, m) -> Evaluator:
    """The calls of kernels.evaluator, of nq numbers in q, n speeds and m results."""
    sizes = {"q": nq, "qd": n, "tau": n}
    rows = {name: f"(N, {size})" for name, size in (sizes | {"out": m}).items()}
    columns = {name: f"({size}, N)" for name, size in (sizes | {"out": m}).items()}
    ends = {name: f"({size},)" for name, size in sizes.items()}
    halves = {"y": f"({nq + n},)", "tau": f"({n},)"}
    compiled_chain, compiled_rate = module.chain, getattr(module, "rate", None)

    def of_many(compiled, shapes):
        def evaluate(q, qd, tau, out):
            if not type(q) is type(qd) is type(tau) is type(out) is ndarray:
                q, qd, tau, out = plain(shapes, q, qd, tau, out)
            try:
                compiled(q, qd, tau, out)
            except refused() as error:
                raise refusal(error, shapes, q, qd, tau, out) from None

        evaluate.__doc__ = compiled.__doc__
        return evaluate

    def chain(q, qd, tau, count):
        q, qd, tau = plain(ends, q, qd, tau)
        try:
            return compiled_chain(q, qd, tau, operator.index(count))
        except (*refused(), OverflowError) as error:
            if not isinstance(count, (int, np.integer)) or isinstance(error, OverflowError):
                raise ValueError(f"count is {shown(count)}; a whole number below 2^63 is expected") from None
            raise refusal(error, ends, q, qd, tau) from None

    def rate(y, tau):
        if not type(y) is type(tau) is ndarray:
            y, tau = plain(halves, y, tau)
        try:
            return compiled_rate(y, tau)
        except refused() as error:
            raise refusal(error, halves, y, tau) from None

    each, lanes = of_many(module.each, rows), of_many(module.lanes, columns)
    return Evaluator(each, lanes, chain, compiled_rate and rate)


def plain(shapes, *arrays) -> list[np.ndarray]:
    """The arrays without what a kind of array of its own adds (a file's memory); ValueError for what is no array, or masked."""
    for (name, shape), array in zip(shapes.items(), arrays):
        if not isinstance(array, np.ndarray) or isinstance(array, np.ma.MaskedArray):
            raise ValueError(f"{name} is {shown(array)}; an array of shape {shape} is expected, without a mask")
    return [np.asarray(array) for array in arrays]


def refusal(error, shapes, *arrays) -> Exception:
    """A ValueError that says which of the arrays compiled code cannot take; the error itself if all of them look right."""
    for (name, shape), array in zip(shapes.items(), arrays):
        dtype = np.dtype(np.int64 if name == "ended" else np.float64)
        wanted = f"a contiguous array of {dtype} of shape {shape} that can be written is expected"
        if array.dtype != dtype or array.ndim != 1 + shape.rstrip(",)").count(","):
            return ValueError(f"{name} has shape {array.shape} and numbers of type {array.dtype}; {wanted}")
        for lacking, there in (
            ("contiguous", array.flags.c_contiguous),
            ("writable", array.flags.writeable),
            ("aligned", array.flags.aligned),
        ):
            if not there:
                return ValueError(f"{name} is not {lacking}; {wanted}")
    return error


def real(name, value) -> float:
    """The value as a float."""
    if isinstance(value, (float, int, np.floating, np.integer)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            pass
    raise ValueError(f"{name} is {shown(value)}; a number is expected")
