"""Calls of compiled code with what a user gives: as it is, and only where it is refused is it looked at.

Compiled code takes contiguous float64 arrays that can be written and checks their shapes itself; so a call that is right costs
one more call of Python, a tenth of a microsecond.
"""

import numbers
import operator
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .tree import shown

NOBODY = np.zeros(0, np.int8)  # asks why a run ended


class Evaluator(NamedTuple):
    """Compiled evaluations of one quantity of a Tree, see kernels.evaluator."""

    each: Callable
    lanes: Callable
    chain: Callable
    rate: Callable | None  # of forward dynamics


def checked_run(compiled, n, adaptive) -> Callable:
    """The run of kernels.stepper."""
    shapes = {"q": f"(runs, steps + 1, {n})", "qd": f"(runs, steps + 1, {n})", "tau": f"(runs, {n})"}

    def run(q, qd, tau, dt, ended=NOBODY):
        try:
            return compiled(q, qd, tau, dt, ended)
        except Exception as error:
            raise refusal(error, shapes, q=q, qd=qd, tau=tau, dt=dt, ended=ended) from None

    def run_adaptive(q, qd, tau, dt, tolerance, ended=NOBODY):
        try:
            return compiled(q, qd, tau, dt, tolerance, ended)
        except Exception as error:
            raise refusal(error, shapes, q=q, qd=qd, tau=tau, dt=dt, tolerance=tolerance, ended=ended) from None

    return run_adaptive if adaptive else run


def checked_evaluator(module, n, m) -> Evaluator:
    """The calls of kernels.evaluator, of n hinges and m results."""
    rows = dict.fromkeys(("q", "qd", "tau"), f"(N, {n})") | {"out": f"(N, {m})"}
    columns = dict.fromkeys(("q", "qd", "tau"), f"({n}, N)") | {"out": f"({m}, N)"}
    ends = dict.fromkeys(("q", "qd", "tau"), f"({n},)")
    compiled_each, compiled_lanes, compiled_chain = module.each, module.lanes, module.chain

    def each(q, qd, tau, out):
        try:
            compiled_each(q, qd, tau, out)
        except Exception as error:
            raise refusal(error, rows, q=q, qd=qd, tau=tau, out=out) from None

    def lanes(q, qd, tau, out):
        try:
            compiled_lanes(q, qd, tau, out)
        except Exception as error:
            raise refusal(error, columns, q=q, qd=qd, tau=tau, out=out) from None

    def chain(q, qd, tau, count):
        try:
            return compiled_chain(q, qd, tau, operator.index(count))
        except Exception as error:
            raise refusal(error, ends, q=q, qd=qd, tau=tau, count=count) from None

    compiled_rate = getattr(module, "rate", None)
    halves = {"y": f"({2 * n},)", "tau": f"({n},)"}

    def rate(y, tau):
        try:
            return compiled_rate(y, tau)
        except Exception as error:
            raise refusal(error, halves, y=y, tau=tau) from None

    for checked, compiled in ((each, compiled_each), (lanes, compiled_lanes), (chain, compiled_chain)):
        checked.__doc__ = compiled.__doc__
    return Evaluator(each, lanes, chain, compiled_rate and rate)


def refusal(error, shapes, **given) -> ValueError:
    """A ValueError that says which argument compiled code cannot take; the error itself if all of them look right."""
    for name, value in given.items():
        dtype, shape = (np.int8, "(runs,)") if name == "ended" else (np.float64, shapes.get(name))
        if shape is None:
            kind = numbers.Integral if name == "count" else numbers.Real
            if not isinstance(value, kind):
                return ValueError(f"{name} is {shown(value)}; a {'whole ' if name == 'count' else ''}number is expected")
            continue
        wanted = f"a contiguous array of {np.dtype(dtype)} of shape {shape} is expected"
        if type(value) is not np.ndarray:
            return ValueError(f"{name} is {shown(value)}; {wanted}")
        if value.dtype != dtype or value.ndim != shape.count(",") + (not shape.endswith(",)")):
            return ValueError(f"{name} has shape {value.shape} and numbers of type {value.dtype}; {wanted}")
        if not value.flags.c_contiguous or not value.flags.aligned or not value.flags.writeable:
            lacking = "contiguous" if not value.flags.c_contiguous else "aligned" if value.flags.writeable else "writable"
            return ValueError(f"{name} is not {lacking}; {wanted} that can be written")
    return error
