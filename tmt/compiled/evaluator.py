"""Compiled quantities of a tree: of one state, and of many."""

import ctypes
import math
import threading
from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tmt.derivation.quantities import is_quantity, quantity_of, shape_of, what_is_known
from tmt.model.tree import Tree, checked_model
from tmt.model.values import require

from .cores import cores, in_threads

if TYPE_CHECKING:
    from .machine import Library

POINTER, WHOLE = ctypes.c_void_p, ctypes.c_int64
SMALL = 500  # states that NumPy evaluates faster than code is compiled
WIDE = 5_000  # evaluations beyond which code of several side by side is compiled, with the same bits
SHARED = 5_000  # states times speeds from which several cores share them
TOGETHER = 32  # states that are not parted


class Evaluator:
    """One quantity of a tree, `size` numbers for each state: it takes q (nq), qd and tau or qdd (nv), dt (1).

    Arrays are contiguous and float64: their shapes are not checked. Numbers are computed as they are: of
    angles beyond 2^49 rad results are NaN.
    """

    def __init__(self, tree: Tree, quantity: str):
        checked_model(tree)
        require(is_quantity(quantity), "quantity", quantity, what_is_known(quantity))
        self.tree, self.quantity = tree, quantity
        self.shapes = [(tree.nq,), (tree.nv,), (tree.nv,), (1,)]
        self.shape, self.has_parts = shape_of(quantity, tree), bool(quantity_of(quantity).parts)
        self.size = math.prod(self.shape)
        self.rest = [bytes(8 * size) for (size,) in self.shapes]  # at rest, without torque
        self.may_be_singular = quantity_of(quantity).solves and not tree.never_singular
        self.local = threading.local()
        self.loops: dict[bool, Callable[..., int]] = {}

    def library(self, width: int) -> "Library":
        from . import entries, store  # here, so that `import tmt` need not wait for llvmlite

        what = self.tree, self.quantity, width
        return store.library(partial(entries.source, *what), "quantity", *what)

    @cached_property
    def scalar(self) -> "Library":
        return self.library(1)

    @cached_property
    def one_state(self) -> Callable[..., int]:
        return self.scalar.function("one", WHOLE, *[ctypes.c_char_p] * 4, POINTER, keeps_lock=True)

    def loop(self, wide: bool) -> Callable[..., int]:
        if wide not in self.loops:
            from .machine import lanes

            library = self.library(lanes()) if wide else self.scalar
            self.loops[wide] = library.function("rows", WHOLE, *[POINTER] * 5, *[WHOLE] * 5)
        return self.loops[wide]

    def of_one(self, *arrays: np.ndarray) -> Any:
        """The quantity of one state in arrays of doubles; None where it is none or a number is not finite."""
        try:
            out, address = self.local.place
        except AttributeError:  # of this thread
            out = np.empty(self.shape)
            self.local.place = out, address = out, out.ctypes.data
        wrong = self.one_state(*[array.tobytes() for array in arrays], *self.rest[len(arrays) :], address)
        if wrong:
            return None
        return tuple(out.copy()) if self.has_parts else out.copy()

    def of_any(self, *arrays: np.ndarray) -> Any:
        """The quantity of states of any batch shape, as tmt's function returns it; None as above."""
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        q, *rates = (rows_of(x, batch if k == 0 or x.ndim > 1 else ()) for k, x in enumerate(arrays))
        rows = self.of_rows(q, *rates)
        if rows is None:
            return None
        result = rows.reshape(batch + self.shape)
        return tuple(np.moveaxis(result, len(batch), 0).copy()) if self.has_parts else result

    def of_rows(self, q: np.ndarray, *rates: np.ndarray) -> np.ndarray | None:
        """The quantity of rows of states, (N, size); of rates one row may stand for all. None as above."""
        count, arrays = len(q), [q, *rates]
        out = np.empty((count, self.size))
        wide = count > WIDE or True in self.loops
        self.loop(wide)  # is compiled once, before any thread asks for it

        def fill(part: slice) -> bool:
            return self.fill(wide, out[part], *(x if len(x) == 1 else x[part] for x in arrays))

        threads = max(1, min(cores(), count * self.tree.nv // SHARED))
        return out if all(in_threads(fill, count, threads, TOGETHER, threads)) else None

    def fill(self, wide: bool, out: np.ndarray, *arrays: np.ndarray) -> bool:
        """Fill rows out (N, size) in one thread, of N rows or of one for all; False: some are wrong."""
        arrays = (*arrays, *[np.zeros((1, *shape)) for shape in self.shapes[len(arrays) :]])
        steps = [0 if len(array) == 1 else array.shape[1] for array in arrays]
        return self.loop(wide)(*(x.ctypes.data for x in (*arrays, out)), len(out), *steps) == 0

    @cached_property
    def operations(self) -> int:
        """+ - * / and changes of sign of one evaluation; a sine, a cosine, a root count as one each."""
        from . import entries

        return entries.traced_quantity(self.tree, self.quantity).operations


def rows_of(array: np.ndarray, batch: tuple[int, ...]) -> np.ndarray:
    states = array if array.shape[:-1] == batch else np.broadcast_to(array, (*batch, array.shape[-1]))
    return np.require(states.reshape(-1, array.shape[-1]), requirements=["C", "A", "W"])
