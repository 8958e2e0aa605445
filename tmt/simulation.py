"""Motion by a method of integration, and why it ended where it did."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt import feedback
from tmt.compiled.runner import Ended, Runner, runner_of
from tmt.methods.stepping import DIVERGED, MANY, MOST_EVALUATIONS, NEWTON, SMALL
from tmt.model import singular, values
from tmt.model.tree import Tree, checked_model
from tmt.model.values import shown

Array = np.ndarray
STATES = 65_536  # that are held at once where each is looked at


class _Path(NamedTuple):
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray


class Motion(_Path):
    """The t, q, qd of a simulation, which it unpacks into, and what else is known of it.

    Attributes
    ----------
    t : (records,), s
    q, qd : (..., records, nq) and (..., records, nv), rad and rad/s, NaN from where a run ended early
    ended : str, None, or array of them in the shape of the batch: when and why a run ended early
    evaluations : int, of the dynamics, of all runs; those of an implicit method with their Jacobian

    >>> motion = tmt.simulate(tmt.ARM, [0.0] * 3, [0.0] * 3, [0.0] * 3, dt=0.01, steps=10)
    >>> print(motion.ended, motion.evaluations)  # four stages in each step
    None 40
    """

    ended: str | np.ndarray | None = None
    evaluations: int = 0


def simulate(
    model: Tree, q: ArrayLike, qd: ArrayLike, tau: ArrayLike | feedback.Torque, dt: float, steps: int, method: str = "rk4",
    tolerance: float | None = None, every: int = 1,
) -> Motion:  # fmt: skip
    """Motion under a torque: t (records,), s; q (..., records, nq), rad; qd (..., records, nv), rad/s.

    A run ends early, with NaN from there on, where the numbers overflow, a hinge has turned by 2^49 rad, Mbar
    is singular, Newton's method does not find the stages of an implicit method, an adaptive method would need
    steps below 1e-9 dt or more than 1e8 evaluations, or series take too many: `ended` of the result, a
    Motion, says which. Ctrl-C interrupts it. Assignment, part i.

    Parameters
    ----------
    model : Tree
    q, qd : (..., nq) and (..., nv), rad and rad/s, state at t = 0
    tau : (..., nv), N m, constant; or a function of (t, q, qd), which is asked with one state and returns (nv,)
        One that is linear in q and qd becomes gains of the model: compiled, and taken implicitly by implicit
        methods. Any other is asked at each stage, of a method with fixed steps that solves nothing.
    dt : float, s, step, above 0
    steps : int, how many, at least 1
    method : str, a key of METHODS, or "taylor": the true motion, rounded once, by a series in pairs of doubles
        Its evaluations are its steps. An adaptive method takes its own steps between those.
    tolerance : float, of adaptive methods: the error of each step, in units of 1 + |value|; 1e-9, of "taylor" 1e-33
    every : int, a divisor of steps: every n-th state alone is kept, records = steps / every + 1

    >>> start = np.array([0.5, 0.3, 1.0])
    >>> t, q, qd = tmt.simulate(tmt.ARM, start, [0.0] * 3, tmt.gravity_balance(tmt.ARM, start), dt=0.01, steps=100)
    >>> print(t[-1], q.shape, abs(q - start).max() < 1e-12)  # it is held
    1.0 (101, 3) True
    """
    checked_model(model)
    model, constant, law = feedback.as_gains(model, tau) if callable(tau) else (model, tau, None)
    taylor = isinstance(method, str) and method == "taylor"
    runner = runner_of(model, "dopri8_adaptive" if taylor else method)
    stepping = runner.stepping
    steps, every = values.whole("steps", steps), values.whole("every", every)
    dt = values.positive("dt", dt, "a step in s")
    values.require(steps % every == 0, "every", every, f"a divisor of steps = {shown(steps)} is")
    if tolerance is not None and not stepping.adaptive:
        raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
    usual = 1e-33 if taylor else 1e-9
    tolerance = usual if tolerance is None else values.positive("tolerance", tolerance, "a number")
    if law is not None and (stepping.adaptive or stepping.solves_stages):
        expected = "one with fixed steps that solves nothing is expected, such as rk4"
        raise ValueError(f"method {method!r} takes no tau that is not linear in q and qd; {expected}")
    state = values.states(model, q=q, qd=qd, tau=constant)
    batch, runs = state[0].shape[:-1], math.prod(state[0].shape[:-1])
    *start, torque = (np.ascontiguousarray(part).reshape(runs, part.shape[-1]) for part in state)
    path_q, path_qd = values.paths(runs, steps, every, model.coordinates.nq, model.coordinates.nv)
    if steps * dt == np.inf:
        sizes = f"dt is {dt:g} and steps is {shown(steps)}"
        raise ValueError(f"{sizes}; their product is beyond the largest double")
    path_q[:, 0], path_qd[:, 0] = start
    if taylor:
        ended, evaluations = by_series(model, path_q, path_qd, torque, dt, every, tolerance)
    elif law is not None:
        codes, evaluations = feedback.follow(model, stepping, law, path_q, path_qd, dt, every)
        ended = reasons(model, path_q, path_qd, codes, dt, tolerance)
    elif model.never_singular:
        codes, evaluations = runner.follow(path_q, path_qd, torque, dt, tolerance, every)
        ended = reasons(model, path_q, path_qd, codes, dt, tolerance)
    else:
        ended, evaluations = in_blocks(runner, path_q, path_qd, torque, dt, tolerance, every)
    t = dt * np.arange(0, steps + 1, every)
    q, qd = (path.reshape(*batch, *path.shape[1:]) for path in (path_q, path_qd))
    motion = Motion(t, q, qd)
    motion.ended, motion.evaluations = ended.reshape(batch)[()], evaluations
    return motion


def by_series(tree: Tree, q: Array, qd: Array, tau: Array, dt: float, every: int, tolerance: float) -> Ended:
    from tmt.exact.motion import followed  # here, so that `import tmt` need not wait for it

    ended, count, steps = np.full(len(q), None, dtype=object), 0, (q.shape[1] - 1) * every
    for run in range(len(q)):
        start = q[run, 0], qd[run, 0], tau[run]
        path, series, error = followed(tree, *start, dt, steps, every, tolerance=tolerance)
        count, alive = count + series, len(path)
        q[run, 1:alive], qd[run, 1:alive] = np.split(path[1:, 0], [q.shape[-1]], axis=1)
        q[run, alive:], qd[run, alive:] = np.nan, np.nan
        ended[run] = str(error) if error else None
    return ended, count


def in_blocks(
    runner: Runner, q: Array, qd: Array, tau: Array, dt: float, tolerance: float, every: int
) -> Ended:
    """Fill the paths where Mbar may be singular: a block of steps at a time, as each is looked at."""
    ended, evaluations, steps = np.full(len(q), None, dtype=object), 0, (q.shape[1] - 1) * every
    runs, start, carried = np.arange(len(q)), (q[:, 0], qd[:, 0]), runner.carried(len(q), dt)
    q[:, 1:], qd[:, 1:] = np.nan, np.nan
    size = max(1, STATES // max(1, len(q)))
    for first in range(0, steps, size):
        count = min(size, steps - first)
        block_q, block_qd = (np.full((len(x), count + 1, x.shape[1]), np.nan) for x in start)
        block_q[:, 0], block_qd[:, 0] = start
        codes, taken = runner.follow(block_q, block_qd, tau[runs], dt, tolerance, 1, carried)
        ended[runs] = reasons(runner.tree, block_q, block_qd, codes, dt, tolerance, first)
        evaluations += taken
        kept = np.arange(-first % every, count + 1, every)
        for path, block in ((q, block_q), (qd, block_qd)):
            path[runs[:, None], (first + kept) // every] = block[:, kept]
        alive = np.array([why is None for why in ended[runs]], bool)
        runs, start = runs[alive], (block_q[alive, -1], block_qd[alive, -1])
        carried = np.roll(carried[alive], 2, axis=1)
    return ended, evaluations


def reasons(
    tree: Tree, q: Array, qd: Array, codes: Array, dt: float, tolerance: float, first: int = 0
) -> Array:
    """Why each run ended, (runs,) of str or None; its states are NaN from where Mbar was singular.

    q, qd: the paths (runs, records, nq and nv), of each step where Mbar may be singular; codes (runs, 2): why
    the compiled loop ended each, 0: it did not, and after how many steps. first: the number of the first
    step.
    """
    ended = np.full(len(codes), None, dtype=object)
    if tree.never_singular and not codes.any():
        return ended
    words = {
        DIVERGED: "the motion diverges: its numbers overflow within a step, or a hinge passes 2^49 rad",
        NEWTON: f"Newton's method does not find the stages of a step of {dt:g} s",
        SMALL: f"the tolerance of {tolerance:g} would need steps below 1e-9 dt",
        MANY: f"the tolerance of {tolerance:g} takes more than {MOST_EVALUATIONS:.0e} evaluations",
    }
    for run, (code, step) in enumerate(codes.tolist()):
        why = words.get(code)
        if not tree.never_singular:  # the first and the last state, and that before the largest change
            alive = int(np.isfinite(q[run, :, 0]).sum())
            change = np.abs(np.diff(qd[run, :alive], axis=0)).max(axis=1, initial=0.0)
            records = np.unique([0, alive - 1, int(np.argmax([*change, -1.0]))])
            if place := singular.first(tree, q[run, records]):
                step, why = int(records[place[0]]), f"Mbar is singular: {place[1]}"
                q[run, step + 1 :] = qd[run, step + 1 :] = np.nan
        if why:
            ended[run] = f"at t = {(first + step) * dt:g} s: {why}"
    return ended
