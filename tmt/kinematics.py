"""Where bodies are and how they move: centres of mass, angular velocities, Jacobians, momentum, frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered, documented
from tmt.model.tree import Tree, checked_model
from tmt.model.values import require


@documented
def com_positions(model: Tree, q: ArrayLike) -> np.ndarray:
    """Positions x_b of the centres of mass, in the inertial frame.

    Assignment, part b, equation (1); MuJoCo's xipos. Returns (..., m, 3), m.

    >>> print(tmt.com_positions(tmt.ARM, [0.0, 0.0, 0.0])[1] + 0.0)  # the upper arm hangs, the forearm points ahead
    [ 0.15  0.   -0.3 ]
    """
    return answered("com_positions", model, q)


@documented
def angular_velocities(model: Tree, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
    """Angular velocities omega_b = B_b qd, in body axes.

    Assignment, part d. Returns (..., m, 3), rad/s.

    >>> print(tmt.angular_velocities(tmt.ARM, [0.0, 0.0, 0.0], [1.0, 0.0, 2.0])[1])  # both joints turn it about y
    [0. 3. 0.]
    """
    return answered("angular_velocities", model, q, qd)


@documented
def jacobians(model: Tree, q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """T_b = dx_b/dq in the inertial frame, and B_b with omega_b = B_b qd in body axes.

    Assignment, parts d and e; MuJoCo's mj_jacBodyCom, of B_b turned into the body.
    Returns T, B : (..., m, 3, nv), m/rad and 1; columns of slides 1 and 0.

    >>> T, B = tmt.jacobians(tmt.ARM, [0.0, 0.0, 0.0])
    >>> print(T[1, :, 2], B[1, :, 2])  # gamma lowers the forearm, 0.15 m ahead of the elbow
    [ 0.    0.   -0.15] [0. 1. 0.]
    """
    return answered("jacobians", model, q)


@documented
def convective_terms(model: Tree, q: ArrayLike, qd: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """v_conv = d(T_b qd)/dq qd in the inertial frame, and w_conv = d(B_b qd)/dq qd in body axes.

    What the centre of mass and the angular velocity of a body accelerate by at qdd = 0; h_b and g_b in the
    assignment, part e. Returns v_conv, w_conv : (..., m, 3), m/s2 and rad/s2.

    >>> v_conv, w_conv = tmt.convective_terms(tmt.ARM, [0.0, 0.0, 0.0], [0.0, 0.0, 2.0])
    >>> print(v_conv[1])  # towards the elbow: 0.15 m times (2 rad/s)^2
    [-0.6  0.   0. ]
    """
    return answered("convective_terms", model, q, qd)


@documented
def com(model: Tree, q: ArrayLike) -> np.ndarray:
    """Position of the centre of mass of all bodies, in the inertial frame.

    sum_b m_b x_b / sum_b m_b; MuJoCo's subtree_com of the world. Returns (..., 3), m.

    >>> print(tmt.com(tmt.ARM, [0.0, 0.0, np.pi / 2]).round(9)[2])  # -(1.9 0.15 + 1.5 (0.3 + 0.15)) / 3.4
    -0.282352941
    """
    return answered("com", model, q)


@documented
def com_jacobian(model: Tree, q: ArrayLike) -> np.ndarray:
    """Jacobian of `com`: its velocity for unit speeds, in the inertial frame.

    sum_b m_b T_b / sum_b m_b; MuJoCo's mj_jacSubtreeCom of the world.
    Returns (..., 3, nv), m/rad; columns of slides 1.

    >>> print(tmt.com_jacobian(tmt.ARM, [0.0, 0.0, 0.0])[2, 2].round(9))  # -1.5 0.15 / 3.4
    -0.066176471
    """
    return answered("com_jacobian", model, q)


@documented
def centroidal_momentum_matrix(model: Tree, q: ArrayLike) -> np.ndarray:
    """Matrix A with A qd the momentum of all bodies, about their common centre of mass, in the inertial frame.

    Rows 0 to 2 are the linear momentum, the mass times `com_jacobian`; rows 3 to 5 the angular one,
    sum_b m_b (x_b - c) x T_b + R_b I_b B_b: MuJoCo's mj_angmomMat.
    Returns (..., 6, nv), kg m/rad and kg m2/rad; columns of slides kg and kg m.

    >>> A = tmt.centroidal_momentum_matrix(tmt.ARM, [0.0, 0.0, 0.0])
    >>> print(A[:3, 2].round(9))  # -1.5 0.15
    [ 0.     0.    -0.225]
    """
    return answered("centroidal_momentum_matrix", model, q)


class Frame(NamedTuple):
    """What `frame` returns, in the inertial frame."""

    position: np.ndarray  # (..., 3) m
    rotation: np.ndarray  # (..., 3, 3)
    jacobian: np.ndarray  # (..., 6, nv)
    convective: np.ndarray  # (..., 6)


def frame(model: Tree, name: str, q: ArrayLike, qd: ArrayLike | None = None) -> Frame:
    """Pose of a site or body, its Jacobian J, and J' qd = dJ/dt qd, in the inertial frame.

    J qd is the velocity of the frame's origin and then its angular velocity: MuJoCo's mj_jac, jacp above
    jacr. J' qd is what both accelerations are at qdd = 0 (mj_jacDot times qd). The rotation takes components
    in the frame to inertial ones. Returns a Frame of arrays: position (..., 3), m; rotation (..., 3, 3);
    jacobian (..., 6, nv), m/rad and 1; convective (..., 6), m/s2 and rad/s2. Raises ValueError for an unknown
    name, wrong shapes and values that are not finite.

    Parameters
    ----------
    model : Tree
    name : str, a site of the model (see Tree), or a body: then the frame is that of its joint, with body axes
    q, qd : (..., nq), (..., nv), as in the other functions; qd by default at rest

    >>> tool = dataclasses.replace(
    ...     tmt.ARM, site_names=["tool"], site_joint=[2], site_offset=[(0.3, 0.0, 0.0)]
    ... )
    >>> print(tmt.frame(tool, "tool", [0.0] * 3, [0.0, 0.0, 2.0]).convective[:3] + 0.0)  # 0.3 m (2 rad/s)^2
    [-1.2  0.   0. ]
    """
    checked_model(model)
    require(isinstance(name, str), "name", name, "that of a site or body is")
    speeds = np.zeros(model.nv) if qd is None else qd
    pose, jacobian = (answered(f"frame_{part}:{name}", model, q) for part in ("pose", "jacobian"))
    convective = answered(f"frame_convective:{name}", model, q, speeds)
    return Frame(pose[..., 3], pose[..., :3], jacobian, convective)
