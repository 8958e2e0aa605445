"""Bounds of the difference that rounding alone makes between two runs of the same method."""

import numpy as np
from numpy import ndarray

from tmt import Tree
from tmt.methods import METHODS
from tmt.methods.derivatives import Differentiated, amplification
from tmt.methods.stepping import Method, stepped

from .entries import Entries
from .scale import EPS, FACTOR, gain_scale, motion_scale

SAMPLED = 16  # states of a block at which the bound of a step is computed
NARROW = 1e-3  # rad, m: a run is judged while the band of its positions is narrower
# Rounding of a ball's turn in a step, a product of quaternions scaled to length 1: cosine and sine 1.5 eps, four sums of four
# products 4 eps, division 0.5 eps: 6 eps of the quaternion, 12 of the turn, 24 for two runs; the difference of the runs 8 eps
OF_A_BALL = 32 * EPS
# N m or N: with servos MuJoCo's discrete takes forces for 0 whose sum of squares is below mjMINVAL, 1e-15
LEFT_OUT = 3.2e-8


def slope_rounding(
    stepping: Method, tree: Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float
) -> tuple:
    """a, |a| and the bound of the rounding error of a, rad/s2; (states, nv) each: A a = force, with the method's matrix A.

    The bound is |A^-1| (64 eps R |a| + 64 eps S), entry by entry, because entries have different units. S is the sum of the
    absolute terms of the force; R_ij = sqrt(A_ii A_jj) bounds the terms of A_ij and of its factorization, where A is Mbar.
    Of `discrete` with servos it has the force that MuJoCo leaves out, where the force is as small as that, or nearly so.
    """
    shape = q.shape[:1]
    dynamics = Differentiated()
    a = stepping.slope(tree, list(q.T), list(qd.T), tau, dt, dynamics)
    A, _ = dynamics.system
    size = np.stack([np.broadcast_to(np.abs(component), shape) for component in a], axis=-1)
    force = motion_scale(tree, q, qd) + Entries(tree, q).force(tau) + np.array(tree.damping) * np.abs(qd)
    if tree.has_gains:
        force = force + gain_scale(tree, q, qd)
    root = np.sqrt(np.abs(np.einsum("sii->si", A)))
    terms = np.maximum(np.abs(A), root[:, :, None] * root[:, None, :])
    errors = FACTOR * EPS * (np.einsum("sij,sj->si", terms, size) + force)
    if tree.has_gains and stepping == METHODS["discrete"]:
        whole = np.einsum("sij,sj->si", A, np.stack(np.broadcast_arrays(*a), axis=-1))
        errors = errors + LEFT_OUT * (np.linalg.norm(whole, axis=1, keepdims=True) < 4.0 * LEFT_OUT)
    return a, size, np.einsum("sij,sj->si", np.abs(np.linalg.inv(A)), errors)


def step_rounding(
    stepping: Method, tree: Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float
) -> np.ndarray:
    """Bound delta, to first order in dt, of the difference that rounding adds in one step, (steps, 2 nv), movements first.

    Speeds: dt x the rounding of the slope (maximum over the stages) plus that of the sum qd + dt a. Positions: the rounding of
    the sum q + dt qd plus dt x that of the speeds. The sums have at most 8 roundings in the two runs together; for a ball,
    OF_A_BALL replaces the rounding of q.
    """
    stages = []

    def slope(q, qd):
        a, *bounds = slope_rounding(stepping, tree, np.stack(q, axis=-1), np.stack(qd, axis=-1), tau, dt)
        stages.append(bounds)
        return a

    stepped(stepping, tree, slope, list(q.T), list(qd.T), dt)
    size, rounding = np.max(stages, axis=0)
    rates = dt * rounding + 8 * EPS * (np.abs(qd) + dt * size)
    angles = 8 * EPS * (of_positions(tree, q) + dt * np.abs(qd)) + dt * rates
    return np.concatenate([angles, rates], axis=1)


def of_positions(tree: Tree, q: np.ndarray) -> np.ndarray:
    """The sizes of which the sum of a position and its change has 8 eps of rounding, (states, nv)."""
    sizes = np.full((len(q), tree.coordinates.nv), OF_A_BALL / (8 * EPS))
    for joint in tree.coordinates.joints:
        if joint.kind != "ball":
            sizes[:, joint.qd] = np.abs(q[:, joint.q])
    return sizes


def band(
    stepping: Method,
    tree: Tree,
    q: ndarray,
    qd: ndarray,
    tau: ndarray,
    dt: float,
    every=1,
    most: int | None = None,
) -> ndarray:
    """band(t_n) = sum over k of |J_n ... J_(k+1)| delta_k along a run of states (steps + 1, nq, nv), (steps / every + 1, 2 nv).

    every: steps between two values. Infinite from where the run has diverged or the band is far too wide, and after `most` steps.
    """
    blocks = (len(q) - 1) // every
    finite = np.isfinite([*q.T, *qd.T]).all(axis=0)
    ran = (
        (int(np.argmin(finite)) - 1) // every if not finite.all() else blocks
    )  # whole blocks before it diverges
    ran = ran if most is None else min(ran, most // every)
    size = 2 * qd.shape[1]
    widths = np.full((blocks + 1, size), np.inf)
    widths[0] = 0.0
    if ran <= 0:
        return widths
    q, qd = q[: ran * every], qd[: ran * every]
    jacobians = amplification(stepping, tree, q, qd, tau, dt).reshape(ran, every, size, size)
    # the bound varies slowly: at fine steps it is computed at some states, and used for those that follow
    stride = max(1, every // SAMPLED)
    delta = step_rounding(stepping, tree, q[::stride], qd[::stride], tau, dt)
    delta = np.repeat(delta, stride, axis=0).reshape(ran, every, size)

    # to_end[j, k]: from after step k of block j to the end of the block; all blocks at once
    to_end = np.empty_like(jacobians)
    to_end[:, -1] = np.eye(size)
    for k in reversed(range(every - 1)):
        to_end[:, k] = to_end[:, k + 1] @ jacobians[:, k + 1]
    across = to_end[:, 0] @ jacobians[:, 0]

    carried = np.empty((size, ran * every, size))  # carried[:, k]: the rounding of step k, propagated
    for j in range(ran):
        done, here = j * every, (j + 1) * every
        carried[:, :done] = np.tensordot(across[j], carried[:, :done], axes=1)
        carried[:, done:here] = to_end[j].transpose(1, 0, 2)
        widths[j + 1] = np.abs(carried[:, :here]).reshape(size, -1) @ delta.reshape(-1, size)[:here].ravel()
        if not widths[j + 1].max() < 1e6 * NARROW:
            break
    return widths


def growth(
    stepping: Method,
    tree: Tree,
    q: ndarray,
    qd: ndarray,
    tau: ndarray,
    dt: float,
    every: int,
    stride: int = 1,
) -> ndarray:
    """log10 of the growth of a small difference of the initial state, at every `every` steps.

    The 2-norm of J_n ... J_1 (rad and rad/s together), rescaled to avoid overflow. NaN from where the run has diverged.
    stride: steps for all of which the Jacobian of the first is taken; it divides `every`.
    """
    product, scale = np.eye(2 * qd.shape[1]), 0.0
    finite = np.isfinite([*q.T, *qd.T]).all(axis=0)
    result = np.full((len(q) - 1) // every + 1, np.nan)
    result[0] = 0.0
    jacobians = amplification(stepping, tree, q[:-1:stride], qd[:-1:stride], tau, dt)
    for k, J in zip(range(stride, len(q), stride), np.linalg.matrix_power(jacobians, stride)):
        product = J @ product
        if not (finite[k] and np.isfinite(product).all()):
            break
        if k % every == 0:
            size = np.linalg.norm(product, 2)
            product, scale = product / size, scale + np.log10(size)
            result[k // every] = scale
    return result
