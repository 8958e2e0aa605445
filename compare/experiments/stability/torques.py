"""The torques that hold a posture to the last bit, and how far a small torque moves an equilibrium."""

from collections.abc import Mapping
from itertools import product

import numpy as np

from tmt import literal

from ...engines import Engine, Method
from ...truth.linear import NEGLIGIBLE, Held

INSTANT = 1e-6  # s
MOST_VARIED = 5  # joints, whose torques are varied in all combinations


def own_torque(method: Method, engines: Mapping[str, Engine], at: Held) -> np.ndarray:
    """The torque under which the compiled arithmetic of an engine gives no acceleration at all at the posture, (n,) N m.

    MuJoCo's is its own bias. TMT's is sought among the torques within two ulps of its reference torque: the one whose
    residual is least; compiled code regroups the sums, and there may be no double that it takes for its bias.
    """
    if method.engine == "mujoco":
        own = engines["mujoco"].of(at.case).gravity_balance(at.q)
        return own + literal.spring_torque(at.q, at.tree) if at.tree.has_springs else own
    tau = variants(at.tau, 2)
    return tau[np.argmin(np.abs(residual(method, engines, at, tau)).max(axis=1))]


def residual(method: Method, engines: Mapping[str, Engine], at: Held, tau: np.ndarray) -> np.ndarray:
    """The torque by which tau, (..., n) N m, fails to hold the posture in the arithmetic of an engine, to less than an ulp.

    Read from the first step of a method, which is so short that nothing moves: Mbar qd / dt.
    """
    start = at.moved(np.zeros_like(tau))
    motion = engines[method.engine].of(at.case).run(start, np.zeros_like(tau), tau, INSTANT, 1, method.name)
    return motion.v[..., 1, :] @ at.mass_matrix / INSTANT


def variants(tau: np.ndarray, reach: int = 1) -> np.ndarray:
    """The torques within so many ulps of each component, (k, n) N m; the one in the middle is tau itself.

    (2 reach + 1)^n of them, 27 for one ulp of three joints; of more than five joints one component differs at a time.
    """
    ulps = range(-reach, reach + 1)
    if len(tau) <= MOST_VARIED:
        away = np.array(list(product(ulps, repeat=len(tau))))
    else:
        single = [k * unit for k in ulps if k for unit in np.eye(len(tau))]
        away = np.array([*single[: len(single) // 2], np.zeros(len(tau)), *single[len(single) // 2 :]])
    return tau + away * np.spacing(np.abs(tau))


def offset(at: Held, off: np.ndarray) -> np.ndarray:
    """How far the posture is from the equilibrium of the held torque plus a small torque, rad and N m (k, n).

    A torque along a mode without stiffness has no equilibrium, and is too small to matter.
    """
    n = at.nv
    accelerations = np.linalg.solve(at.mass_matrix, np.transpose(off))
    return (np.linalg.pinv(at.matrix[n:, :n], rcond=NEGLIGIBLE**2) @ accelerations).T
