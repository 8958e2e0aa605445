"""Compiled runs of a tree by a method, spread over the cores."""

import ctypes
from collections.abc import Callable, Sequence
from functools import lru_cache, partial

import numpy as np

from tmt.methods import method_named
from tmt.methods.stepping import MOST_EVALUATIONS, Method
from tmt.model.tree import Tree, checked_model

from .cores import cores, in_threads
from .evaluator import WIDE

SPREAD = 20_000  # evaluations of the dynamics from which several cores share them
PIECES = 4  # for each core, as one of them may be busy with something else
Array = np.ndarray
Ended = tuple[Array, int]  # why each run ended, and the evaluations
Call = Callable[[], None]
DIRECT = ctypes.c_void_p
ARGUMENTS = [*[DIRECT] * 3, *[ctypes.c_double] * 2, *[DIRECT] * 3, *[ctypes.c_int64] * 3]


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
        """A call that fills arrays q, qd, tau, info and may be given carried and stop, see runs.py."""
        q, qd, tau, info, *more = arrays
        carried, stop = more or (self.carried(len(q), dt), np.zeros(1, np.int64))
        held = q, qd, tau, info, carried, stop
        of_q, of_qd, of_tau, *others = (x.__array_interface__["data"][0] for x in held)
        arguments = of_q, of_qd, of_tau, dt, tolerance, *others, every, q.shape[1], len(q)
        function = self.compiled(width)

        def call(_: object = held) -> None:  # the arrays live as long as it
            function(*arguments)

        return call

    @staticmethod
    def carried(runs: int, dt: float) -> Array:
        """What an adaptive method begins with, see runs.py."""
        return np.tile([dt / 8.0, MOST_EVALUATIONS, np.nan, np.nan], (runs, 1))

    def follow(
        self, q: Array, qd: Array, tau: Array, dt: float, tolerance: float, every: int,
        carried: Array | None = None,
    ) -> Ended:  # fmt: skip
        """Fill the paths, which hold each `every`-th state alone; carried: see runs.py.

        Returns why each run ended (0: it did not) and after how many steps, (runs, 2); and the evaluations.
        Where a run ended, its path is NaN from there on. An interruption (Ctrl-C) ends all runs.
        """
        from .machine import lanes

        count, steps = len(q), (q.shape[1] - 1) * every
        # side by side where every run does the same in each step
        is_uniform = not (self.stepping.adaptive or self.stepping.solves_stages)
        evaluations = steps * count * self.stepping.stages
        width = lanes() if is_uniform and count >= lanes() and evaluations > WIDE else 1
        info, stop = np.zeros((count, 3), np.int64), np.zeros(1, np.int64)
        carried = self.carried(count, dt) if carried is None else carried

        def follow_some(part: slice) -> None:
            arrays = [array[part] for array in (q, qd, tau, info, carried)]
            self.call(width, [*arrays, stop], dt, tolerance, every)()

        threads = cores() if count > width and evaluations > SPREAD else 1
        parts = min(count // width, PIECES * threads) if threads > 1 else 1
        is_long = evaluations > SPREAD or not is_uniform
        in_threads(follow_some, count, parts, width, threads, partial(stop.fill, 1) if is_long else None)
        return self.outcome(q, qd, info, every)

    def outcome(self, q: Array, qd: Array, info: Array, every: int = 1) -> Ended:
        steps, codes = (q.shape[1] - 1) * every, info[:, :2]
        for i in np.flatnonzero(codes[:, 0]):
            first = codes[i, 1] // every + 1
            q[i, first:], qd[i, first:] = np.nan, np.nan
        if self.stepping.adaptive or self.stepping.solves_stages:
            return codes, int(info[:, 2].sum())
        taken = int(np.where(codes[:, 0], codes[:, 1] + 1, steps).sum())
        return codes, taken * self.stepping.stages


def runner_of(tree: Tree, name: str) -> Runner:
    """The Runner of a tree and the method of that name as it is now; ValueError if they are none."""
    checked_model(tree)
    return cached_runner(tree, method_named(name))


@lru_cache(maxsize=64)
def cached_runner(tree: Tree, stepping: Method) -> Runner:
    return Runner(tree, stepping)
