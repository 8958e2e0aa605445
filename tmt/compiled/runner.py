"""Compiled runs of a tree by a method: what a user gives is checked, and many runs are spread over the cores."""

import ctypes
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy import ndarray

from tmt.methods import METHODS, method_named
from tmt.model.arguments import checked_model, positive, whole
from tmt.model.tree import Tree
from tmt.model.values import shown

from .cores import cores, in_threads

SPREAD = 20_000  # evaluations of the dynamics from which several cores share them
PIECES = 4  # for each core, as one of them may be busy with something else
MOST = 64  # trees and methods whose compiled runs are held
DIRECT = ctypes.c_void_p
ARGUMENTS = [DIRECT, DIRECT, DIRECT, ctypes.c_double, ctypes.c_double, DIRECT, *[ctypes.c_int64] * 3]
known = {}


class Runner:
    """The runs of a tree by a method, of one state at a time or of several side by side with the same bits."""

    def __init__(self, tree: Tree, stepping, given):
        self.tree, self.stepping, self.given, self.runs = tree, stepping, given, {}

    def compiled(self, width: int) -> Callable:
        """The compiled function for `width` runs side by side."""
        if width not in self.runs:
            from . import runs, store  # here, so that `import tmt` need not wait for llvmlite

            source = partial(runs.source, self.tree, self.stepping, width)
            made = store.library(source, "run", self.tree, self.stepping, width)
            self.runs[width] = made.function("run", None, *ARGUMENTS)
        return self.runs[width]

    def checked(self, dt, tolerance) -> tuple[float, float]:
        """A step and a tolerance as numbers above 0; a method of fixed steps has no tolerance."""
        adaptive = self.stepping.adaptive
        return positive("dt", dt, "a step in s"), positive(
            "tolerance", tolerance, "a number"
        ) if adaptive else 0.0

    def follow(self, q, qd, tau, dt: float, tolerance: float, every: int) -> tuple[np.ndarray, int]:
        """Fill the paths q (runs, records, nq) and qd (runs, records, nv) from their first states; tau (runs, nv).

        Returns why each run ended, 0 where it did not, and after how many steps, (runs, 2); and the evaluations of the dynamics.
        Where a run ended, its path is NaN from there on.
        """
        from .machine import lanes

        count, steps = len(q), (q.shape[1] - 1) * every
        width = lanes() if self.stepping.lanes and count >= lanes() else 1
        run, info = self.compiled(width), np.zeros((count, 3), np.int64)

        def follow_some(part):
            arrays = [q[part], qd[part], tau[part], info[part]]
            if missing := -len(arrays[0]) % width:  # too few for a register: their last one again
                arrays = [np.concatenate([array, *[array[-1:]] * missing]) for array in arrays]
            *given, found = map(address, arrays)
            run(*given, dt, tolerance, found, every, q.shape[1], len(arrays[0]))
            if missing:
                for array, filled in zip((q, qd, info), (arrays[0], arrays[1], arrays[3])):
                    array[part] = filled[:-missing]

        if count > width and steps * count * self.stepping.stages > SPREAD and cores() > 1:
            blocks = -(-count // width)
            pieces = min(blocks, PIECES * cores())
            bounds = [min(blocks * k // pieces * width, count) for k in range(pieces + 1)]
            in_threads(follow_some, [(slice(*pair),) for pair in pairwise(bounds)], cores())
        else:
            follow_some(slice(None))
        return self.outcome(q, qd, info, every)

    def outcome(self, q, qd, info, every: int) -> tuple[np.ndarray, int]:
        """What `follow` returns, once compiled code has filled the paths and info."""
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


def address(array) -> int:
    return array.__array_interface__["data"][0]


def runner_of(tree: Tree, name: str) -> Runner:
    """The Runner of a tree and the method of that name as it is now."""
    found = known.get((id(tree), name)) if type(name) is str else None
    # whose tree is held, so that no other has its id
    if found is None or found.given is not METHODS.get(name):
        checked_model(tree)
        stepping = method_named(name)
        if len(known) >= MOST:
            known.clear()
        known[id(tree), name] = found = Runner(tree, stepping, METHODS[name])
    return found


def runner(tree: Tree, method: str) -> Callable:
    """Compiled `run(q, qd, tau, dt)` of a tree and one of METHODS: fills the paths q and qd from their first states.

    q, qd: (runs, records, nq and nv), of which [:, 0] is given; tau (runs, nv); all contiguous, float64; rad, s, N m. It
    returns how often the dynamics were evaluated (an implicit method: with their Jacobian). An adaptive method takes its
    tolerance too: `run(q, qd, tau, dt, tolerance)`. Two arguments more: `ended` (runs, 2) of int64 is filled with why each run
    ended, see runs.py, and after how many steps; `every`: the paths hold each `every`-th state alone. ValueError for anything
    else.
    """
    own = runner_of(tree, method)

    def adaptive(q, qd, tau, dt, tolerance, ended=None, every=1):
        check_paths(tree, q, qd, tau)
        if ended is not None:
            check("ended", ended, (len(tau), 2), np.int64)
        codes, evaluations = own.follow(q, qd, tau, *own.checked(dt, tolerance), whole("every", every))
        if ended is not None:
            ended[:] = codes
        return evaluations

    def fixed(q, qd, tau, dt, ended=None, every=1):
        return adaptive(q, qd, tau, dt, 0.0, ended, every)

    own.compiled(1)
    return adaptive if own.stepping.adaptive else fixed


def prepared(tree: Tree, method: str, q, qd, tau, dt, tolerance=0.0) -> tuple[Callable, Callable]:
    """A `run()` that is nothing but compiled code, which fills these paths each time; and `outcome()` of the last time.

    Arguments as of `runner`, one run after the other; outcome: why each ended and after how many steps, and the evaluations.
    """
    own = runner_of(tree, method)
    check_paths(tree, q, qd, tau)
    info = np.zeros((len(tau), 3), np.int64)
    given = *map(address, (q, qd, tau)), *own.checked(dt, tolerance), address(info), 1, q.shape[1], len(tau)
    run = partial(own.compiled(1), *given)
    run.arrays = q, qd, tau, info  # they live as long as it
    return run, partial(own.outcome, q, qd, info, 1)


def check_paths(tree, q, qd, tau) -> None:
    """Raise ValueError unless compiled code can fill these paths."""
    records = q.shape[1] if isinstance(q, ndarray) and q.ndim == 3 else "records"
    count = len(tau) if isinstance(tau, ndarray) and tau.ndim else "runs"
    check("tau", tau, (count, tree.coordinates.nv))
    check("q", q, (count, records, tree.coordinates.nq))
    check("qd", qd, (count, records, tree.coordinates.nv))
    if np.may_share_memory(q, qd) or np.may_share_memory(q, tau) or np.may_share_memory(qd, tau):
        raise ValueError("q, qd and tau share memory; arrays of their own are expected")


def check(name: str, array, shape: tuple, dtype=np.float64) -> None:
    """Raise ValueError unless compiled code can take an array: its type, shape and how it lies in memory."""
    if not isinstance(array, ndarray) or isinstance(array, np.ma.MaskedArray):
        found = f"is {shown(array)}"
    elif array.dtype != dtype or array.shape != shape:
        found = f"has shape {array.shape} and numbers of type {array.dtype}"
    elif not array.flags.carray:
        found = "is not contiguous, aligned and writable"
    else:
        return
    wanted = (
        f"a contiguous array of {np.dtype(dtype)} of shape ({', '.join(map(str, shape))}) that can be written"
    )
    raise ValueError(f"{name} {found}; {wanted} is expected")
