"""Equations of motion of a tree of hinged rigid bodies by the TMT method, and their integration.

Stands alone: needs NumPy, mpmath and (for `simulate`) numba, and knows nothing of any physics engine.
Every function takes states of any leading batch shape, a further argument `model` for another Tree than
the assignment's arm, and raises ValueError for wrong shapes, values that are not finite and unknown names.

Units: rad, s, kg, m, N m, J. Frames: inertial frame at the shoulder, x north, y west, z up; "body axes"
are those that coincide with it at q = 0. Signs: Mbar qdd + h = tau - D qd, with h = `bias` (MuJoCo's
qfrc_bias) and D the joint damping; `gravity_balance` is +dV/dq, the torque that holds the arm at rest.
"""

import math
import numbers
import reprlib

import numpy as np
from numpy.typing import ArrayLike

from . import method as _method
from .arm import ARM
from .implicit import ImplicitRungeKutta
from .methods import METHODS, AdaptiveRungeKutta
from .tree import Tree

__all__ = [
    "ARM", "METHODS", "Tree", "acceleration", "angular_velocities", "bias", "com_positions", "convective_terms",
    "energy", "gravity_balance", "jacobians", "mass_matrix", "potential_energy", "simulate",
]  # fmt: skip


def com_positions(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Positions x_b of the centres of mass in the inertial frame, m, shape (..., m, 3).

    q: hinge angles (..., n), rad. Assignment, part b, equation (1).
    """
    (q,) = _states(model, q=q)
    return _gather((list(b.x) for b in _method.bodies(model, q)), q[0].shape)


def angular_velocities(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Angular velocities omega_b = B_b qd in body axes, rad/s, shape (..., m, 3).

    q, qd: hinge angles and rates (..., n), rad and rad/s. Assignment, part d.
    """
    q, qd = _states(model, q=q, qd=qd)
    return _gather((list(b.omega) for b in _method.bodies(model, q, qd)), q[0].shape)


def jacobians(q: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """T_b = dx_b/dq in the inertial frame, m/rad, and B_b with omega_b = B_b qd in body axes; both (..., m, 3, n).

    q: hinge angles (..., n), rad. Assignment, parts d and e.
    """
    (q,) = _states(model, q=q)
    parts = _method.bodies(model, q)
    shape = q[0].shape
    return _gather((zip(*b.T) for b in parts), shape), _gather((zip(*b.B) for b in parts), shape)


def convective_terms(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """v_conv = d(T_b qd)/dq qd, m/s2, inertial frame, and w_conv = d(B_b qd)/dq qd, rad/s2, body axes.

    q, qd: hinge angles and rates (..., n), rad and rad/s. both results are (..., m, 3).
    h_b and g_b in the assignment, part e.
    """
    q, qd = _states(model, q=q, qd=qd)
    parts = _method.bodies(model, q, qd)
    shape = q[0].shape
    return _gather((list(b.v_conv) for b in parts), shape), _gather((list(b.w_conv) for b in parts), shape)


def mass_matrix(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Reduced mass matrix Mbar = sum T' m T + B' I B, kg m2, shape (..., n, n), symmetric positive definite.

    q: hinge angles (..., n), rad. Assignment, part e.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.mass_matrix(_method.bodies(model, q)), q[0].shape)


def bias(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Bias h = Coriolis, centrifugal and gravity terms, N m, shape (..., n): Mbar qdd + h = tau - D qd.

    q, qd: hinge angles and rates (..., n), rad and rad/s. It is -Qbar at tau = 0 (assignment, part e)
    without the joint damping D, and MuJoCo's qfrc_bias.
    """
    q, qd = _states(model, q=q, qd=qd)
    return _gather(_method.bias(_method.bodies(model, q, qd), model.gravity), q[0].shape)


def gravity_balance(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque +dV/dq that holds the model at rest, N m, shape (..., n).

    q: hinge angles (..., n), rad. Assignment, parts c and h; MuJoCo's qfrc_bias at rest.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.bias(_method.bodies(model, q), model.gravity), q[0].shape)


def acceleration(q: ArrayLike, qd: ArrayLike, tau: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Hinge accelerations qdd from Mbar qdd = tau - D qd - h, rad/s2, shape (..., n).

    q, qd, tau: hinge angles, rates and torques (..., n), rad, rad/s, N m. Assignment, parts e and f.
    """
    q, qd, tau = _states(model, q=q, qd=qd, tau=tau)
    return _gather(_method.acceleration(model, q, qd, tau), q[0].shape)


def potential_energy(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Potential energy V, J, shape (...), zero with every centre of mass at the height of the origin.

    q: hinge angles (..., n), rad.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.potential(_method.bodies(model, q), model.gravity), q[0].shape)


def energy(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Total energy, kinetic and potential, J, shape (...).

    q, qd: hinge angles and rates (..., n), rad and rad/s. Its zero is that of `potential_energy`.
    """
    q, qd = _states(model, q=q, qd=qd)
    parts = _method.bodies(model, q, qd)
    return _gather(_method.potential(parts, model.gravity) + _method.kinetic(parts, qd), q[0].shape)


def simulate(
    q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dt: float, steps: int, method: str = "rk4", model: Tree = ARM,
    tolerance: float | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Motion under constant torque: t (steps+1,) s, q and qd (..., steps+1, n), rad and rad/s.

    q, qd: state at t = 0; tau: torque; each (..., n). dt: step in s, above 0; steps: how many, at least 1; method: a key of
    METHODS. An adaptive method takes its own steps between those; tolerance (default 1e-9): the error of each, in units
    of 1 + |value|. States after a run has left the finite numbers, or has turned by 2^49 rad, are NaN, and so are those
    after Newton's method has failed in an implicit one (its `step` then raises ArithmeticError). Assignment, part i.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"unknown method {method!r}; known are {', '.join(METHODS)}")
    if not isinstance(steps, numbers.Integral) or isinstance(steps, bool) or steps < 1:
        raise ValueError(f"steps is {steps!r}; a whole number of at least 1 is expected")
    steps, dt = int(steps), _positive("dt", dt, "a step in s")
    adaptive = isinstance(METHODS[method], AdaptiveRungeKutta)
    if tolerance is not None and not adaptive:
        raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
    q, qd, tau = (np.stack(state, axis=-1) for state in _states(model, q=q, qd=qd, tau=tau))
    batch, n = q.shape[:-1], q.shape[-1]
    runs = q.size // n
    path_q, path_qd = np.full((2, runs, steps + 1, n), np.nan)
    path_q[:, 0], path_qd[:, 0] = q.reshape(-1, n), qd.reshape(-1, n)
    paths = path_q, path_qd, np.ascontiguousarray(tau.reshape(-1, n))

    from . import kernels  # here, so that `import tmt` need not wait for numba

    if adaptive:
        tolerance = 1e-9 if tolerance is None else _positive("tolerance", tolerance, "a number")
        kernels.stepper(model, method)(*paths, dt, tolerance)
    else:
        worth = (
            runs * steps >= kernels.WORTH
            and n <= kernels.TRACED
            and not isinstance(METHODS[method], ImplicitRungeKutta)
        )
        in_lanes = runs // kernels.LANES * kernels.LANES if worth else 0
        if in_lanes:
            kernels.lane_stepper(model, method)(*(array[:in_lanes] for array in paths), dt)
        kernels.stepper(model, method)(*(array[in_lanes:] for array in paths), dt)
    return dt * np.arange(steps + 1), path_q.reshape(*batch, steps + 1, n), path_qd.reshape(*batch, steps + 1, n)


def _positive(name, value, kind) -> float:
    """The value as a finite float above 0."""
    try:
        number = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        number = math.inf
    if not 0.0 < number < math.inf:
        raise ValueError(f"{name} is {reprlib.repr(value)}; {kind} above 0 is expected")
    return number


def _states(model, **arrays):
    """Each array as n scalars of one batch shape, after a check of type, shape and values."""
    if not isinstance(model, Tree):
        raise ValueError(f"model is {model!r}; a tmt.Tree is expected")
    n = len(model.hinge_names)
    checked = []
    for name, values in arrays.items():
        try:
            array = np.asarray(values)
            if array.dtype.kind not in "fiu":
                raise TypeError
            array = array.astype(float)
        except (TypeError, ValueError):
            raise ValueError(
                f"{name} is {' '.join(reprlib.repr(values).split())}; real numbers of shape (..., {n}) are expected"
            ) from None
        if array.ndim == 0 or array.shape[-1] != n:
            hinges = ", ".join(model.hinge_names)
            raise ValueError(f"{name} has shape {array.shape}; (..., {n}) is expected, one number per hinge ({hinges})")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} has values that are not finite; finite numbers are expected")
        checked.append(array)
    try:
        checked = np.broadcast_arrays(*checked)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(arrays, checked))
        raise ValueError(f"the batch shapes do not fit together: {shapes}") from None
    return [[array[..., i] for i in range(n)] for array in checked]


def _gather(nested, batch) -> np.ndarray:
    """Nested iterables of scalars, each of the batch shape or constant, as one array with that shape in front."""

    def lists(item):
        return [lists(i) for i in item] if not isinstance(item, (float, np.ndarray)) else np.broadcast_to(item, batch)

    array = np.array(lists(nested), dtype=float)
    own = array.ndim - len(batch)
    return np.moveaxis(array, range(own), range(-own, 0)).copy()
