"""Equations of motion of a tree of rigid bodies on hinges, slides and balls by the TMT method, and their integration.

Stands alone: needs NumPy, mpmath and (for `simulate`) numba, and knows nothing of any physics engine.
Every function takes states of any leading batch shape, a further argument `model` for another Tree than
the assignment's arm, and raises ValueError for wrong shapes, values that are not finite, unknown names, a singular Mbar
and results beyond the largest double.

Shapes: q (..., nq), qd and tau (..., nv). Of a hinge or slide one number each, of a ball four (a quaternion w, x, y, z of length
1) and three (angular velocity in its own axes, and torque): nq = nv = n, the number of joints, where no joint is a ball.

Units: rad, s, kg, m, N m, J; of a slide m and N. Frames: inertial frame at the shoulder, x north, y west, z up; "body axes"
are those that coincide with it at q = 0. Signs: Mbar qdd + h = tau - D qd, with h = `bias` (MuJoCo's
qfrc_bias) and D the joint damping; `gravity_balance` is +dV/dq, the torque that holds the arm at rest
where no springs act.
"""

import numpy as np
from numpy.typing import ArrayLike

from . import method as _method
from . import singular as _singular
from .arm import ARM
from .given import quantity as _quantity
from .given import states as _states
from .methods import METHODS
from .simulation import Motion, simulate
from .space import solve as _solve
from .tree import Tree

__all__ = [
    "ARM", "METHODS", "Motion", "Tree", "acceleration", "angular_velocities", "bias", "com_positions", "convective_terms",
    "energy", "gravity_balance", "jacobians", "mass_matrix", "potential_energy", "simulate", "spring_torque",
]  # fmt: skip


@_quantity
def com_positions(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Positions x_b of the centres of mass in the inertial frame, m, shape (..., m, 3).

    q: joint positions (..., nq), rad. Assignment, part b, equation (1).
    """
    (q,) = _states(model, q=q)
    return _gather((list(b.x) for b in _method.bodies(model, q)), q[0].shape)


@_quantity
def angular_velocities(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Angular velocities omega_b = B_b qd in body axes, rad/s, shape (..., m, 3).

    q, qd: joint positions (..., nq) and speeds (..., nv), rad and rad/s. Assignment, part d.
    """
    q, qd = _states(model, q=q, qd=qd)
    return _gather((list(b.omega) for b in _method.bodies(model, q, qd)), q[0].shape)


@_quantity
def jacobians(q: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """T_b = dx_b/dq in the inertial frame, m/rad, and B_b with omega_b = B_b qd in body axes; both (..., m, 3, nv).

    q: joint positions (..., nq), rad. Assignment, parts d and e.
    """
    (q,) = _states(model, q=q)
    parts = _method.bodies(model, q)
    shape = q[0].shape
    return _gather((zip(*b.T) for b in parts), shape), _gather((zip(*b.B) for b in parts), shape)


@_quantity
def convective_terms(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """v_conv = d(T_b qd)/dq qd, m/s2, inertial frame, and w_conv = d(B_b qd)/dq qd, rad/s2, body axes.

    q, qd: joint positions (..., nq) and speeds (..., nv), rad and rad/s. both results are (..., m, 3).
    h_b and g_b in the assignment, part e.
    """
    q, qd = _states(model, q=q, qd=qd)
    parts = _method.bodies(model, q, qd)
    shape = q[0].shape
    return _gather((list(b.v_conv) for b in parts), shape), _gather((list(b.w_conv) for b in parts), shape)


@_quantity
def mass_matrix(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Reduced mass matrix Mbar = sum T' m T + B' I B, kg m2, shape (..., nv, nv), symmetric positive definite.

    q: joint positions (..., nq), rad. Assignment, part e.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.mass_matrix(_method.bodies(model, q), model.armature), q[0].shape)


@_quantity
def bias(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Bias h = Coriolis, centrifugal and gravity terms, N m, shape (..., nv): Mbar qdd + h = tau - D qd.

    q, qd: joint positions (..., nq) and speeds (..., nv), rad and rad/s. It is -Qbar at tau = 0 (assignment, part e)
    without the joint damping D, and MuJoCo's qfrc_bias.
    """
    q, qd = _states(model, q=q, qd=qd)
    return _gather(_method.bias(_method.bodies(model, q, qd), model.gravity), q[0].shape)


@_quantity
def gravity_balance(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque +dV/dq that holds the model at rest, N m, shape (..., nv).

    q: joint positions (..., nq), rad. Assignment, parts c and h; MuJoCo's qfrc_bias at rest.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.bias(_method.bodies(model, q), model.gravity), q[0].shape)


@_quantity
def spring_torque(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque k (q - rest) that holds the springs of the joints, N m, shape (..., nv): of a ball k times the turn from its rest.

    q: joint positions (..., nq), rad. With `gravity_balance` it is the torque that holds the model at rest.
    """
    (q,) = _states(model, q=q)
    return _gather(_method.spring_torque(model, q), q[0].shape)


@_quantity
def acceleration(q: ArrayLike, qd: ArrayLike, tau: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Accelerations qdd from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h, rad/s2, shape (..., nv).

    q, qd, tau: joint positions (..., nq), speeds and torques (..., nv), rad, rad/s, N m. P and S: the model's position_gain and
    speed_gain. Assignment, parts e and f.
    """
    q, qd, tau = _states(model, q=q, qd=qd, tau=tau)
    M, h = _method.mass_matrix_and_bias(model, q, qd)
    if not model.never_singular:
        angles, n = _gather(q, q[0].shape).reshape(-1, len(q)), len(qd)
        if found := _singular.first(model, angles, _gather(M, q[0].shape).reshape(-1, n, n)):
            at = ", ".join(f"{angle:.6g}" for angle in angles[found[0]])
            unit = " rad" if set(model.kind) == {"hinge"} else ""
            raise ValueError(f"Mbar is singular at q = ({at}){unit}: {found[1]}")
    return _gather(_solve(M, _method.reduced_force(model, h, q, qd, tau)), q[0].shape)


@_quantity
def potential_energy(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Potential energy V, J, shape (...), zero with every centre of mass at the height of the origin, and springs at rest.

    q: joint positions (..., nq), rad.
    """
    (q,) = _states(model, q=q)
    parts = _method.bodies(model, q)
    return _gather(_method.potential(parts, model.gravity) + _method.spring_energy(model, q), q[0].shape)


@_quantity
def energy(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Total energy, kinetic and potential, of no controller, J, shape (...); infinite where it is beyond the largest double.

    q, qd: joint positions (..., nq) and speeds (..., nv), rad and rad/s. Its zero is that of `potential_energy`.
    """
    q, qd = _states(model, q=q, qd=qd)
    parts = _method.bodies(model, q, qd)
    total = _method.potential(parts, model.gravity) + _method.kinetic(parts, qd, model.armature)
    total = total + _method.spring_energy(model, q)
    return _gather(total, q[0].shape, overflow=np.inf)


def _gather(nested, batch, overflow=None) -> np.ndarray:
    """Nested iterables of scalars, each of the batch shape or constant, as one array with that shape in front.

    overflow: what stands for what is not finite, since all that was given is; None: it is a ValueError.
    """

    def lists(item):
        return [lists(i) for i in item] if not isinstance(item, (float, np.ndarray)) else np.broadcast_to(item, batch)

    array = np.array(lists(nested), dtype=float)
    finite = np.isfinite(array)
    if not finite.all():
        if overflow is None:
            raise ValueError(
                "the result is beyond the largest double; smaller numbers in the state or model are expected"
            )
        array = np.where(finite, array, overflow)
    own = array.ndim - len(batch)
    return np.moveaxis(array, range(own), range(-own, 0)).copy()
