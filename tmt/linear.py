"""The dynamics made linear: derivatives of accelerations, torques and steps; frames with their Jacobians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered
from tmt.arm import ARM
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


def derivatives(q: ArrayLike, qd: ArrayLike, tau: ArrayLike, model: Tree = ARM) -> Derivatives:
    """Exact derivatives of `acceleration` by q, qd, tau, of `inverse_dynamics` by q, qd, each (..., nv, nv).

    Those of the inverse dynamics are at qdd = acceleration(q, qd, tau): dqdd/dq = -Mbar^-1 dtau/dq, and so by
    qd; dqdd/dtau = Mbar^-1. By q means by movements: of a hinge or slide by its number in q; of a ball by
    turns about its own three axes, for which its quaternion p changes by p o (0, u) / 2; of a free joint,
    three slides and a ball, by the position of its origin in the inertial frame, then by turns in its own
    axes. MuJoCo's mj_integratePos moves so, and mjd_transitionFD differentiates so.
    q (..., nq), qd (..., nv), tau (..., nv): positions, speeds and torques, rad, rad/s and N m.

    >>> q, rest = np.array([0.0, 0.0, np.pi / 2]), np.zeros(3)
    >>> by = tmt.derivatives(q, rest, rest)  # the arm hangs
    >>> print(by.dtau_dq.round(9)[2, 2])  # 1.5 9.81 0.15
    2.20725
    """
    return Derivatives(*answered("derivatives", model, q, qd, tau))


def inverse_dynamics_derivatives(
    q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, model: Tree = ARM
) -> tuple[np.ndarray, np.ndarray]:
    """Exact derivatives of `inverse_dynamics` by q, N m/rad, and by qd, N m s/rad, each (..., nv, nv).

    By q means by movements, see `derivatives`; the derivative by qdd is `mass_matrix`.
    q (..., nq), qd (..., nv), qdd (..., nv): positions, speeds and accelerations, rad, rad/s and rad/s2.

    >>> rest = np.zeros(3)
    >>> dtau_dq, dtau_dqd = tmt.inverse_dynamics_derivatives([0.0, 0.0, np.pi / 2], rest, rest)
    >>> print(dtau_dq.round(9)[2, 2], dtau_dqd[2, 2])  # gravity; the arm has no damping
    2.20725 0.0
    """
    return answered("inverse_dynamics_derivatives", model, q, qd, qdd)


def step_derivatives(
    q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dt: ArrayLike, method: str = "rk4", model: Tree = ARM
) -> tuple[np.ndarray, np.ndarray]:
    """Exact A = dx+/dx (..., 2 nv, 2 nv) and B = dx+/dtau (..., 2 nv, nv) of one step, x = (movement, qd).

    The torque is constant during the step. Movements as in `derivatives`: before the step from q, after it
    from the q that it reaches. Of an adaptive method the step is one of its own, of that size.
    q (..., nq), qd (..., nv), tau (..., nv): positions, speeds and torques, rad, rad/s and N m; dt (...): the
    step, s, above 0; method: a key of METHODS. ValueError also where an implicit method does not find its
    stages.

    >>> A, B = tmt.step_derivatives([0.0, 0.0, np.pi / 2], [0.0] * 3, [0.0] * 3, 0.01, "semi_implicit_euler")
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


class Frame(NamedTuple):
    """What `frame` returns, in the inertial frame."""

    position: np.ndarray  # (..., 3) m
    rotation: np.ndarray  # (..., 3, 3)
    jacobian: np.ndarray  # (..., 6, nv)
    convective: np.ndarray  # (..., 6)


def frame(name: str, q: ArrayLike, qd: ArrayLike | None = None, model: Tree = ARM) -> Frame:
    """Pose of a site or body, its Jacobian J (..., 6, nv), J' qd = dJ/dt qd (..., 6), in the inertial frame.

    J qd is the velocity of the frame's origin, m/s, and then its angular velocity, rad/s: MuJoCo's mj_jac,
    jacp above jacr. J' qd, m/s2 and rad/s2, is what both accelerations are at qdd = 0 (mj_jacDot times qd).
    The rotation takes components in the frame to inertial ones. name: a site of the model (see Tree), or a
    body: then the frame is that of its joint, with body axes.
    q (..., nq), qd (..., nv): positions and speeds, rad and rad/s; without qd at rest.

    >>> tool = dataclasses.replace(
    ...     tmt.ARM, site_names=["tool"], site_joint=[2], site_offset=[(0.3, 0.0, 0.0)]
    ... )
    >>> print(tmt.frame("tool", [0.0] * 3, [0.0, 0.0, 2.0], tool).convective[:3] + 0.0)  # 0.3 m (2 rad/s)^2
    [-1.2  0.   0. ]
    """
    checked_model(model)
    if not isinstance(name, str):
        raise ValueError(f"the name of a site or body is a text, not {shown(name)}")
    speeds = np.zeros(model.coordinates.nv) if qd is None else qd
    pose, jacobian = (answered(f"frame_{part}:{name}", model, q) for part in ("pose", "jacobian"))
    convective = answered(f"frame_convective:{name}", model, q, speeds)
    return Frame(pose[..., 3], pose[..., :3], jacobian, convective)
