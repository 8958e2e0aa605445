"""The dynamics made linear: derivatives of accelerations, torques and steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered, documented
from tmt.methods import method_named
from tmt.model.tree import Tree, checked_model
from tmt.model.values import real_numbers, shown


class Derivatives(NamedTuple):
    """What `derivatives` returns, arrays (..., nv, nv): the derivative of row i by column j."""

    dqdd_dq: np.ndarray  # 1/s2
    dqdd_dqd: np.ndarray  # 1/s
    dqdd_dtau: np.ndarray  # 1/(kg m2)
    dtau_dq: np.ndarray  # N m/rad
    dtau_dqd: np.ndarray  # N m s/rad


@documented
def derivatives(model: Tree, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Derivatives:
    """Exact derivatives of `acceleration` by q, qd and tau, and of `inverse_dynamics` by q and qd.

    Those of the inverse dynamics are at qdd = acceleration(q, qd, tau): dqdd/dq = -Mbar^-1 dtau/dq, and so by
    qd; dqdd/dtau = Mbar^-1. By q means by tangent vectors: of a hinge or slide by its number in q; of a ball
    by turns about its own three axes, for which its quaternion p changes by p o (0, u) / 2; of a free joint,
    three slides and a ball, by the position of its origin in the inertial frame, then by turns in its own
    axes. MuJoCo's mj_integratePos moves so, and mjd_transitionFD differentiates so. Returns Derivatives of
    five arrays (..., nv, nv), the derivative of row i by column j.

    >>> q, rest = np.array([0.0, 0.0, np.pi / 2]), np.zeros(3)
    >>> by = tmt.derivatives(tmt.ARM, q, rest, rest)  # the arm hangs
    >>> print(by.dtau_dq.round(9)[2, 2])  # 1.5 9.81 0.15
    2.20725
    """
    return Derivatives(*answered("derivatives", model, q, qd, tau))


@documented
def inverse_dynamics_derivatives(
    model: Tree, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Exact derivatives of `inverse_dynamics` by q and by qd.

    By q means by tangent vectors, see `derivatives`; the derivative by qdd is `mass_matrix`. MuJoCo:
    mjd_inverseFD.

    Returns
    -------
    dtau_dq, dtau_dqd : (..., nv, nv), N m/rad and N m s/rad

    >>> rest = np.zeros(3)
    >>> dtau_dq, dtau_dqd = tmt.inverse_dynamics_derivatives(tmt.ARM, [0.0, 0.0, np.pi / 2], rest, rest)
    >>> print(dtau_dq.round(9)[2, 2], dtau_dqd[2, 2])  # gravity; the arm has no damping
    2.20725 0.0
    """
    return answered("inverse_dynamics_derivatives", model, q, qd, qdd)


def step_derivatives(
    model: Tree, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dt: ArrayLike, method: str = "rk4"
) -> tuple[np.ndarray, np.ndarray]:
    """Exact A = dx+/dx and B = dx+/dtau of one step, x = (tangent, qd).

    The torque is constant during the step. Movements as in `derivatives`: before the step from q, after it
    from the q that it reaches. Of an adaptive method the step is one of its own, of that size.
    Returns A, B : (..., 2 nv, 2 nv) and (..., 2 nv, nv), SI. Raises ValueError as the other functions, and
    where an implicit method does not find its stages.

    Parameters
    ----------
    model : Tree
    q, qd, tau : (..., nq), (..., nv) and (..., nv), rad, rad/s and N m; of slides m, m/s and N
    dt : (...), s, above 0
    method : str, a key of METHODS

    >>> A, B = tmt.step_derivatives(tmt.ARM, [0.0, 0.0, np.pi / 2], [0.0] * 3, [0.0] * 3, 0.01, "implicit")
    >>> print(A.shape, B.shape, A[2, 5].round(9))  # dq+ = dt dqd+
    (6, 6) (6, 3) 0.01
    """
    checked_model(model)
    method_named(method)
    steps = real_numbers(dt)
    if steps is None or not steps.size or not ((steps > 0.0) & (steps < np.inf)).all():
        raise ValueError(f"dt is {shown(dt)}; a step in s above 0 is expected")
    both = answered(f"step_derivatives:{method}", model, q, qd, tau, steps[..., None])
    return both[..., : 2 * model.coordinates.nv], both[..., 2 * model.coordinates.nv :]
