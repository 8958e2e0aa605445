"""Compiled quantities of a tree: of one state, and of many."""

import ctypes
import math
import threading
from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from tmt.derivation.quantities import QUANTITIES, shape_of
from tmt.model.arguments import checked_model
from tmt.model.tree import Tree
from tmt.model.values import shown

from .cores import side_by_side
from .runner import check

POINTER, WHOLE = ctypes.c_void_p, ctypes.c_int64
TERMS = "mass_matrix_and_bias"
SMALL = 500  # states for which code of several side by side is not compiled


class Evaluator:
    """One quantity of a tree, flat, `size` numbers for each state: what it takes stands in q (nq), qd and tau (nv).

    `terms` is another form of Mbar and h that is traced in place of the fastest. Arrays are contiguous and float64; anything else
    is a ValueError. Numbers are computed as they are: of states that are none, or angles beyond 2^49 rad, results are NaN.
    """

    def __init__(self, tree: Tree, quantity: str, terms: Callable | None = None):
        checked_model(tree)
        if not isinstance(quantity, str) or quantity not in (*QUANTITIES, TERMS):
            raise ValueError(f"quantity is {shown(quantity)}; known are {', '.join([*QUANTITIES, TERMS])}")
        if terms is not None and not callable(terms):
            raise ValueError(
                f"terms is {shown(terms)}; a function terms(tree, q, qd) -> (Mbar, h) is expected"
            )
        self.tree, self.quantity, self.terms = tree, quantity, terms
        self.sizes = tree.coordinates.nq, tree.coordinates.nv, tree.coordinates.nv
        n = len(tree.axis)
        self.shape = (n * (n + 3) // 2,) if quantity == TERMS else shape_of(quantity, tree)
        self.several = quantity in QUANTITIES and bool(QUANTITIES[quantity].parts)
        self.size = int(math.prod(self.shape))
        self.rest = [bytes(8 * size) for size in self.sizes]  # at rest, without torque
        self.local = threading.local()

    def library(self, width: int, chain: bool = False):
        from . import entries, store  # here, so that `import tmt` need not wait for llvmlite

        what = self.tree, self.quantity, width, self.terms, chain
        return store.library(partial(entries.source, *what), "quantity", *what)

    @cached_property
    def alone(self) -> Callable:
        """The functions for one state at a time."""
        return self.library(1)

    @cached_property
    def one_state(self) -> Callable:
        return self.alone.function("one", WHOLE, *[ctypes.c_char_p] * 3, POINTER, keeps_lock=True)

    @cached_property
    def row_by_row(self) -> Callable:
        return self.alone.function("rows", WHOLE, *[POINTER] * 4, *[WHOLE] * 4)

    @cached_property
    def together(self):
        """The functions for several states side by side."""
        from .machine import lanes

        return self.library(lanes())

    @cached_property
    def rows(self) -> Callable:
        return self.together.function("rows", WHOLE, *[POINTER] * 4, *[WHOLE] * 4)

    @cached_property
    def columns(self) -> Callable:
        return self.together.function("columns", WHOLE, *[POINTER] * 4, *[WHOLE] * 4)

    def single(self) -> Callable:
        """`of_one`, compiled."""
        return self.of_one if self.one_state else None

    def of_one(self, *given) -> np.ndarray | None:
        """The quantity of one state, arrays of doubles of the right shapes; None where it is none or a number is not finite."""
        try:
            out, address = self.local.place
        except AttributeError:  # of this thread
            out = np.empty(self.shape)
            self.local.place = out, address = out, out.ctypes.data
        wrong = self.one_state(*[array.tobytes() for array in given], *self.rest[len(given) :], address)
        return None if wrong else tuple(out.copy()) if self.several else out.copy()

    def of_any(self, *given) -> np.ndarray | tuple | None:
        """The quantity of states of any batch shape, arrays of doubles, as tmt's function returns it; None as above."""
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in given))
        q, *rates = (
            rows_of(array, batch if k == 0 or array.ndim > 1 else ()) for k, array in enumerate(given)
        )
        if (found := self.of_rows(q, *rates)) is None:
            return None
        found = found.reshape(batch + self.shape)
        if self.several:
            return tuple(np.moveaxis(found, len(batch), 0).copy())
        return found

    def of_rows(self, q, *rates) -> np.ndarray | None:
        """The quantity of rows of states, (N, size), some in each thread; of rates one row may stand for all. None as above."""
        arrays = [q, *rates, *[np.zeros((1, size)) for size in self.sizes[1 + len(rates) :]]]
        alone = len(q) <= SMALL and "rows" not in vars(self)
        out, rows = np.empty((len(q), self.size)), self.row_by_row if alone else self.rows

        def answers(part):
            own = [array if len(array) == 1 else array[part] for array in arrays]
            steps = [0 if len(array) == 1 else array.shape[1] for array in arrays]
            return rows(*(x.ctypes.data for x in (*own, out[part])), part.stop - part.start, *steps) == 0

        return out if all(side_by_side(answers, len(out), len(self.tree.axis))) else None

    def each(self, q, qd, tau, out) -> None:
        """One state after the other: rows q (N, nq), qd, tau (N, nv) to rows out (N, size)."""
        count = len(q) if isinstance(q, np.ndarray) and q.ndim else "N"
        self.checked((q, qd, tau, out), [(count, size) for size in (*self.sizes, self.size)])
        self.row_by_row(*(x.ctypes.data for x in (q, qd, tau, out)), count, *self.sizes)

    def lanes(self, q, qd, tau, out) -> None:
        """Several side by side: columns q (nq, N), qd, tau (nv, N) to columns out (size, N)."""
        from .machine import lanes

        count = q.shape[1] if isinstance(q, np.ndarray) and q.ndim == 2 else "N"
        self.checked((q, qd, tau, out), [(size, count) for size in (*self.sizes, self.size)])
        if count >= lanes():
            self.columns(*(x.ctypes.data for x in (q, qd, tau, out)), count, 0, 0, 0)
        elif count:
            result = np.empty((count, self.size))
            self.each(*(np.ascontiguousarray(x.T) for x in (q, qd, tau)), result)
            out[:] = result.T

    def chain(self, q, qd, tau, count: int) -> float:
        """One state, (nq,) and (nv,), count times, each waiting for the one before: its latency."""
        for name, array, size in zip(("q", "qd", "tau"), (q, qd, tau), self.sizes):
            check(name, array, (size,))
        if not isinstance(count, int | np.integer) or isinstance(count, bool) or not 0 <= count < 2**63:
            raise ValueError(f"count is {shown(count)}; a whole number below 2^63 is expected")
        return self.latency(*(x.ctypes.data for x in (q, qd, tau)), int(count))

    @cached_property
    def latency(self) -> Callable:
        return self.library(1, chain=True).function("chain", ctypes.c_double, *[POINTER] * 3, WHOLE)

    @cached_property
    def operations(self) -> int:
        """+ - * / and changes of sign of one evaluation; a sine, a cosine, a root count as one each."""
        from . import forms

        return forms.quantity(self.tree, self.quantity, self.terms).operations

    def checked(self, arrays, shapes) -> None:
        """Raise ValueError unless compiled code can take these arrays, of which it writes the last."""
        for name, array, shape in zip(("q", "qd", "tau", "out"), arrays, shapes):
            check(name, array, shape)
        if any(np.may_share_memory(arrays[-1], array) for array in arrays[:-1]):
            raise ValueError("out shares memory with q, qd or tau; an array of its own is expected")


def rows_of(array, batch) -> np.ndarray:
    """States of a batch one after the other, as compiled code takes them."""
    size = array.shape[-1]
    whole = array if array.shape[:-1] == batch else np.broadcast_to(array, (*batch, size))
    return np.require(whole.reshape(-1, size), requirements="CAW")


def evaluator(tree: Tree, quantity: str, terms: Callable | None = None) -> Evaluator:
    """The Evaluator of a quantity: of tmt's public ones, flat, or "mass_matrix_and_bias": the upper triangle of Mbar, then h."""
    return Evaluator(tree, quantity, terms)
