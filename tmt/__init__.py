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
from .methods import METHODS
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
    q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dt: float, steps: int, method: str = "rk4", model: Tree = ARM
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Motion under constant torque: t (steps+1,) s, q and qd (..., steps+1, n), rad and rad/s.

    q, qd: state at t = 0; tau: torque; each (..., n). dt: step in s, above 0; steps: how many, at least 1;
    method: a key of METHODS. States after a run has left the finite numbers are NaN, and so are those after Newton's
    method has failed in an implicit one (METHODS[method].step then raises ArithmeticError). Assignment, part i.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"unknown method {method!r}; known are {', '.join(METHODS)}")
    if not isinstance(steps, numbers.Integral) or isinstance(steps, bool) or steps < 1:
        raise ValueError(f"steps is {steps!r}; a whole number of at least 1 is expected")
    try:
        seconds = float(dt) if isinstance(dt, numbers.Real) and not isinstance(dt, bool) else math.nan
    except OverflowError:
        seconds = math.inf
    if not 0.0 < seconds < math.inf:
        raise ValueError(f"dt is {reprlib.repr(dt)}; a step in s above 0 is expected")
    steps, dt = int(steps), seconds
    q, qd, tau = (np.stack(state, axis=-1) for state in _states(model, q=q, qd=qd, tau=tau))
    batch, n = q.shape[:-1], q.shape[-1]
    path_q, path_qd = np.full((2, q.size // n, steps + 1, n), np.nan)
    path_q[:, 0], path_qd[:, 0] = q.reshape(-1, n), qd.reshape(-1, n)

    from .kernels import stepper  # here, so that `import tmt` need not wait for numba

    stepper(model, method)(path_q, path_qd, np.ascontiguousarray(tau.reshape(-1, n)), dt)
    return dt * np.arange(steps + 1), path_q.reshape(*batch, steps + 1, n), path_qd.reshape(*batch, steps + 1, n)


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
