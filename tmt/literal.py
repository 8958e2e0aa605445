"""The public functions in the literal form: the method as it stands in method.py, with NumPy, nothing compiled.

It answers until compiled code is worth getting, see answers.py, and says what is wrong with what is given. Comparisons ask
for it by name: what the functions of the package return is compared with it. Arguments and results as there.
"""

import numpy as np
from numpy.typing import ArrayLike

from tmt.arm import ARM
from tmt.equations import method
from tmt.equations.vectors import solve
from tmt.model import singular
from tmt.model.arguments import quantity, states
from tmt.model.tree import Tree


@quantity
def com_positions(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Positions x_b of the centres of mass in the inertial frame, m, shape (..., m, 3)."""
    (q,) = states(model, q=q)
    return gather((list(b.x) for b in method.bodies(model, q)), q[0].shape)


@quantity
def angular_velocities(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Angular velocities omega_b = B_b qd in body axes, rad/s, shape (..., m, 3)."""
    q, qd = states(model, q=q, qd=qd)
    return gather((list(b.omega) for b in method.bodies(model, q, qd)), q[0].shape)


@quantity
def jacobians(q: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """T_b = dx_b/dq in the inertial frame, m/rad, and B_b with omega_b = B_b qd in body axes; both (..., m, 3, nv)."""
    (q,) = states(model, q=q)
    parts = method.bodies(model, q)
    shape = q[0].shape
    return gather((zip(*b.T) for b in parts), shape), gather((zip(*b.B) for b in parts), shape)


@quantity
def convective_terms(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """v_conv = d(T_b qd)/dq qd, m/s2, inertial frame, and w_conv = d(B_b qd)/dq qd, rad/s2, body axes."""
    q, qd = states(model, q=q, qd=qd)
    parts = method.bodies(model, q, qd)
    shape = q[0].shape
    return gather((list(b.v_conv) for b in parts), shape), gather((list(b.w_conv) for b in parts), shape)


@quantity
def mass_matrix(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Reduced mass matrix Mbar = sum T' m T + B' I B, kg m2, shape (..., nv, nv), symmetric positive definite."""
    (q,) = states(model, q=q)
    return gather(method.mass_matrix(method.bodies(model, q), model.armature), q[0].shape)


@quantity
def bias(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Bias h = Coriolis, centrifugal and gravity terms, N m, shape (..., nv): Mbar qdd + h = tau - D qd."""
    q, qd = states(model, q=q, qd=qd)
    return gather(method.bias(method.bodies(model, q, qd), model.gravity), q[0].shape)


@quantity
def gravity_balance(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque +dV/dq that holds the model at rest, N m, shape (..., nv)."""
    (q,) = states(model, q=q)
    return gather(method.bias(method.bodies(model, q), model.gravity), q[0].shape)


@quantity
def spring_torque(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque k (q - rest) that holds the springs of the joints, N m, shape (..., nv); of a ball k times the turn from rest."""
    (q,) = states(model, q=q)
    return gather(method.spring_torque(model, q), q[0].shape)


@quantity
def acceleration(q: ArrayLike, qd: ArrayLike, tau: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Accelerations qdd from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h, rad/s2, shape (..., nv)."""
    q, qd, tau = states(model, q=q, qd=qd, tau=tau)
    M, h = method.mass_matrix_and_bias(model, q, qd)
    if not model.never_singular:
        angles, n = gather(q, q[0].shape).reshape(-1, len(q)), len(qd)
        if found := singular.first(model, angles, gather(M, q[0].shape).reshape(-1, n, n)):
            at = ", ".join(f"{angle:.6g}" for angle in angles[found[0]])
            unit = " rad" if set(model.kind) == {"hinge"} else ""
            raise ValueError(f"Mbar is singular at q = ({at}){unit}: {found[1]}")
    return gather(solve(M, method.reduced_force(model, h, q, qd, tau)), q[0].shape)


@quantity
def potential_energy(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Potential energy V, J, shape (...), zero with every centre of mass at the height of the origin, and springs at rest."""
    (q,) = states(model, q=q)
    parts = method.bodies(model, q)
    return gather(method.potential(parts, model.gravity) + method.spring_energy(model, q), q[0].shape)


@quantity
def energy(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Total energy, kinetic and potential, of no controller, J, shape (...); infinite where it is beyond the largest double."""
    q, qd = states(model, q=q, qd=qd)
    parts = method.bodies(model, q, qd)
    total = method.potential(parts, model.gravity) + method.kinetic(parts, qd, model.armature)
    total = total + method.spring_energy(model, q)
    return gather(total, q[0].shape, overflow=np.inf)


def gather(nested, batch, overflow=None) -> np.ndarray:
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
