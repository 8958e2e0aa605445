"""Compiled runs of a tree by a method, spread over the cores."""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from tmt.methods import METHODS, method_named
from tmt.methods.stepping import Method
from tmt.model.tree import Tree, checked_model

from .cores import cores, in_threads
from .evaluator import WIDE

SPREAD = 20_000  # evaluations of the dynamics from which several cores share them
PIECES = 4  # for each core, as one of them may be busy with something else
MOST = 64  # trees and methods whose compiled runs are held
Array = np.ndarray
Ended = tuple[Array, int]  # why each run ended, and the evaluations
Call = Callable[[], None]
DIRECT = ctypes.c_void_p
ARGUMENTS = [DIRECT, DIRECT, DIRECT, ctypes.c_double, ctypes.c_double, DIRECT, *[ctypes.c_int64] * 3]
runners: dict[tuple[int, str], "Runner"] = {}


class Runner:
    """The runs of a tree by a method, of one state at a time or of several side by side with the same bits.

    Paths q (runs, records, nq) and qd (runs, records, nv) begin with the first states; tau (runs, nv). That
    all are contiguous and float64 is not checked.
    """

    def __init__(self, tree: Tree, stepping: Method):
        self.tree, self.stepping = tree, stepping
        self.functions: dict[int, Callable[..., None]] = {}

    def compiled(self, width: int) -> Callable[..., None]:
        if width not in self.functions:
            from . import runs, store  # here, so that `import tmt` need not wait for llvmlite

            source = partial(runs.source, self.tree, self.stepping, width)
            library = store.library(source, "run", self.tree, self.stepping, width)
            self.functions[width] = library.function("run", None, *ARGUMENTS)
        return self.functions[width]

    def call(self, width: int, arrays: Sequence[Array], dt: float, tolerance: float, every: int = 1) -> Call:
        """A call that fills arrays q, qd, tau, info, see runs.py: they must live as long as it."""
        q, qd, tau, info = map(address, arrays)
        sizes = every, arrays[0].shape[1], len(arrays[0])
        return partial(self.compiled(width), q, qd, tau, dt, tolerance, info, *sizes)

    def follow(self, q: Array, qd: Array, tau: Array, dt: float, tolerance: float, every: int) -> Ended:
        """Fill the paths, which hold each `every`-th state alone.

        Returns why each run ended (0: it did not) and after how many steps, (runs, 2); and the evaluations.
        Where a run ended, its path is NaN from there on.
        """
        from .machine import lanes

        count, steps = len(q), (q.shape[1] - 1) * every
        # side by side where every run does the same in each step
        is_uniform = not (self.stepping.adaptive or self.stepping.solves_stages)
        evaluations = steps * count * self.stepping.stages
        width = lanes() if is_uniform and count >= lanes() and evaluations > WIDE else 1
        info = np.zeros((count, 3), np.int64)

        def follow_some(part: slice) -> None:
            self.call(width, [array[part] for array in (q, qd, tau, info)], dt, tolerance, every)()

        threads = cores() if count > width and evaluations > SPREAD else 1
        parts = min(count // width, PIECES * threads) if threads > 1 else 1
        in_threads(follow_some, count, parts, width, threads)
        return self.outcome(q, qd, info, every)

    def outcome(self, q: Array, qd: Array, info: Array, every: int = 1) -> Ended:
        steps, codes = (q.shape[1] - 1) * every, info[:, :2]
        taken = steps * len(q)
        if codes[:, 0].any():
            taken = int(np.where(codes[:, 0], codes[:, 1] + 1, steps).sum())
            for i in np.flatnonzero(codes[:, 0]):
                first = codes[i, 1] // every + 1
                q[i, first:], qd[i, first:] = np.nan, np.nan
        if self.stepping.adaptive or self.stepping.solves_stages:
            return codes, int(info[:, 2].sum())
        return codes, taken * self.stepping.stages


def address(array: Array) -> int:
    return array.__array_interface__["data"][0]


def runner_of(tree: Tree, name: str) -> Runner:
    """The Runner of a tree and the method of that name as it is now; ValueError if they are none."""
    runner = runners.get((id(tree), name)) if type(name) is str else None
    # whose tree is held, so that no other has its id
    if runner is None or runner.stepping is not METHODS.get(name):
        checked_model(tree)
        stepping = method_named(name)
        if len(runners) >= MOST:
            runners.clear()
        runners[id(tree), name] = runner = Runner(tree, stepping)
    return runner
