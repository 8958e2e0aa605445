"""Motion by a method of integration, and why it ended where it did."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import given, singular
from .arm import ARM
from .methods import method_named
from .templates import NEWTON, OVERFLOW, SMALL, TURNED
from .tree import Tree


class _Path(NamedTuple):
    t: np.ndarray  # (steps + 1,) s
    q: np.ndarray  # (..., steps + 1, nq) rad
    qd: np.ndarray  # (..., steps + 1, nv) rad/s


class Motion(_Path):
    """The t, q, qd of a simulation, and what else is known of it.

    ended: why a run ended early, a line that says when, or None; for a batch an array of its shape. Its states are NaN from
    there on. evaluations: of the dynamics, of all runs; those of an implicit method with their Jacobian.
    """

    ended: str | np.ndarray | None
    evaluations: int

    def __new__(cls, t, q, qd, ended, evaluations):
        motion = super().__new__(cls, t, q, qd)
        motion.ended, motion.evaluations = ended, evaluations
        return motion

    def __reduce__(self):
        """How a copy is made, in this process or another."""
        return type(self), (*self, self.ended, self.evaluations)


def simulate(
    q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dt: float, steps: int, method: str = "rk4", model: Tree = ARM,
    tolerance: float | None = None,
) -> Motion:  # fmt: skip
    """Motion under constant torque: t (steps+1,) s, q (..., steps+1, nq) and qd (..., steps+1, nv), rad and rad/s.

    q (..., nq), qd (..., nv): state at t = 0; tau (..., nv): torque. dt: step in s, above 0; steps: how many, at least 1;
    method: a key of METHODS, or "taylor". An adaptive method takes its own steps between those; tolerance (default 1e-9): the
    error of each, in units of 1 + |value|. "taylor" is the true motion, rounded once (default tolerance 1e-33): a Taylor series
    in pairs of doubles, whose evaluations are its steps. A run ends early, with NaN from there on, where the numbers overflow, a
    hinge has turned by 2^49 rad, Mbar is singular, Newton's method does not find the stages of an implicit method, an adaptive
    method would need steps below 1e-9 dt, or series take too many: `ended` of the result says which. Assignment, part i.
    """
    taylor = isinstance(method, str) and method == "taylor"
    stepping = method_named("dopri8_adaptive" if taylor else method)
    steps, dt = given.whole("steps", steps), given.positive("dt", dt, "a step in s")
    if tolerance is not None and not stepping.adaptive:
        raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
    usual = 1e-33 if taylor else 1e-9
    tolerance = usual if tolerance is None else given.positive("tolerance", tolerance, "a number")
    state = given.states(model, q=q, qd=qd, tau=tau)
    batch, nq, nv = state[0][0].shape, model.coordinates.nq, model.coordinates.nv
    runs = math.prod(batch)
    path_q, path_qd = given.paths(runs, steps, nq, nv)
    if steps * dt == np.inf:
        raise ValueError(f"dt is {dt:g} and steps is {given.shown(steps)}; their product is beyond the largest double")
    path_q[:, 0], path_qd[:, 0], tau = (np.stack(part, axis=-1).reshape(runs, len(part)) for part in state)
    arguments = path_q, path_qd, np.ascontiguousarray(tau)

    from . import kernels  # here, so that `import tmt` need not wait for numba

    codes, evaluations = np.zeros(runs, np.int8), 0
    if taylor:
        ended, evaluations = by_series(model, *arguments, dt, steps, tolerance)
    elif stepping.adaptive:
        evaluations = kernels.stepper(model, method, runs * steps)(*arguments, dt, tolerance, codes)
    else:
        worth = runs * steps >= kernels.WORTH and stepping.lanes
        in_lanes = runs // kernels.LANES * kernels.LANES if worth else 0
        if in_lanes:
            part = [array[:in_lanes] for array in arguments]
            evaluations += kernels.lane_stepper(model, method)(*part, dt, codes[:in_lanes])
        rest = [array[in_lanes:] for array in arguments]
        evaluations += kernels.stepper(model, method, runs * steps)(*rest, dt, codes[in_lanes:])
    ended = ended if taylor else reasons(model, path_q, path_qd, codes, dt, tolerance)
    t = dt * np.arange(steps + 1)
    q, qd = (path.reshape(*batch, *path.shape[1:]) for path in (path_q, path_qd))
    return Motion(t, q, qd, ended.reshape(batch)[()], evaluations)


def by_series(tree, q, qd, tau, dt, steps, tolerance) -> tuple[np.ndarray, int]:
    """Write the true motions to the paths (runs, steps + 1, nq and nv), which hold the starts: why each ended, and the steps."""
    from .reference_run import followed  # here, as kernels above

    ended, count = np.full(len(q), None, dtype=object), 0
    for run in range(len(q)):
        path, took, error = followed(tree, q[run, 0], qd[run, 0], tau[run], dt, steps, tolerance=tolerance)
        count, alive = count + took, len(path)
        q[run, 1:alive], qd[run, 1:alive] = np.split(path[1:, 0], [q.shape[-1]], axis=1)
        ended[run] = error and str(error)
    return ended, count


def reasons(tree, q, qd, codes, dt, tolerance) -> np.ndarray:
    """Why each run ended, (runs,) of str or None; where Mbar was singular its states are made NaN from there on.

    q, qd: the paths (runs, steps + 1, nq and nv); codes: why the compiled loop ended each, 0: it did not.
    """
    why = np.full(len(codes), None, dtype=object)
    if tree.never_singular and not codes.any():
        return why
    if not tree.never_singular:
        for run in range(len(codes)):
            if found := singular_in(tree, q[run], qd[run]):
                k, why[run] = found
                q[run, k + 1 :] = qd[run, k + 1 :] = np.nan
    words = {
        OVERFLOW: "the motion diverges: within a step its numbers overflow, or its angles pass 2^49 rad",
        TURNED: "a hinge turns by 2^49 rad or more, where doubles are too far apart for a sine",
        NEWTON: f"Newton's method does not find the stages of a step of {dt:g} s",
        SMALL: f"the tolerance of {tolerance:g} would need steps below 1e-9 dt",
    }
    for run in (run for run in range(len(codes)) if codes[run] or why[run]):
        last = int(np.argmax(np.isnan(q[run, :, 0]))) - 1
        code = int(codes[run])
        hinges = [joint for joint in tree.coordinates.joints if joint.kind == "hinge"]
        reach = max(
            (max(abs(q[run, last, at][0]), dt * abs(qd[run, last, by][0])) for _, at, by in hinges), default=0.0
        )
        if code in (OVERFLOW, NEWTON) and reach > 2.0**48:
            code = TURNED  # within the step: there is no sine at its stages
        why[run] = f"at t = {last * dt:g} s: {why[run] or words[code]}"
    return why


def singular_in(tree, q, qd) -> tuple[int, str] | None:
    """The first state of a run at which Mbar is singular, among those where it would show; and the words for it.

    They are its start, its last, and the one before the largest change of the rates.
    """
    alive = int(np.isfinite(q[:, 0]).sum())
    change = np.abs(np.diff(qd[:alive], axis=0)).max(axis=1)
    places = np.unique([0, alive - 1, int(np.argmax(change)) if len(change) else 0])
    found = singular.first(tree, q[places])
    return found and (int(places[found[0]]), f"Mbar is singular: {found[1]}")
