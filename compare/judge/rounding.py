"""How far rounding alone may drive two runs of the same method apart."""

import numpy as np

from tmt import Tree
from tmt.methods.derivatives import FEW_SPEEDS, amplification, has_residual, linear_system
from tmt.methods.stepping import Method, stepped

from .scale import EPS, FACTOR, bias_scale, gain_scale, spring_scale

SAMPLED = 16  # states of a block at which the bound of a step is taken
NARROW = 1e-3  # rad, m: while the band of the positions is below, a run is judged
# of the turn that a ball makes in a step: its new quaternion is a product, of unit length, of the old one and that of the
# movement. Cosine and sine are off by 1.5 eps, each of the four sums of four products by 2 eps, which makes 4 eps of all four,
# and the division by the length by 0.5 eps: 6 eps of the quaternion, 12 of the turn, 24 on both sides. The difference of two
# quaternions is once more such a product, 8 eps of the turn
OF_A_BALL = 32 * EPS


def slope_rounding(stepping: Method, tree: Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float) -> tuple:
    """a, |a| and the bound of the rounding of a, rad/s2; (states,) each: a solves A a = force, A the method's matrix.

    |A^-1| (64 eps |A| |a| + 64 eps S): A by its singular values, S the sum of the absolute terms of the force.
    """
    shape = q.shape[:1]
    if len(tree.axis) > FEW_SPEEDS and has_residual(stepping):
        A, right = linear_system(stepping, tree, list(q.T), list(qd.T), tau, dt)
        a = list(np.linalg.solve(A, right[..., None])[..., 0].T)
    else:
        a = stepping.slope(tree, list(q.T), list(qd.T), tau, dt)
        rows = stepping.matrix(tree, list(q.T), list(qd.T), dt)
        A = np.array([[np.broadcast_to(entry, shape) for entry in row] for row in rows]).transpose(2, 0, 1)
    values = np.linalg.svd(A, compute_uv=False)
    size = np.abs([np.broadcast_to(component, shape) for component in a]).max(axis=0)
    force = bias_scale(tree, q, qd) + np.abs(tau).max() + np.max(tree.damping) * np.abs(qd).max(axis=1)
    if tree.has_springs:
        force = force + spring_scale(tree, q).max(axis=1)
    if tree.has_gains:
        force = force + gain_scale(tree, q, qd).max(axis=1)
    return a, size, FACTOR * EPS * (values[:, 0] * size + force) / values[:, -1]


def step_rounding(
    stepping: Method, tree: Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float
) -> np.ndarray:
    """Bound delta, to first order in dt, of the difference that rounding adds in one step, (steps, 2 nv), of movements first.

    Speeds: dt x the rounding of the slope, the largest over the stages of the step, plus that of the sum qd + dt a.
    Positions: that of the sum q + dt qd, plus dt times that of the speeds. The sums have at most 8 roundings on both sides; in
    place of that of q a ball has the rounding of a product of quaternions, see OF_A_BALL.
    """
    stages = []

    def slope(q, qd):
        a, *bounds = slope_rounding(stepping, tree, np.stack(q, axis=-1), np.stack(qd, axis=-1), tau, dt)
        stages.append(bounds)
        return a

    stepped(stepping, tree, slope, list(q.T), list(qd.T), dt)
    size, rounding = np.max(stages, axis=0)[..., None]
    rates = dt * rounding + 8 * EPS * (np.abs(qd) + dt * size)
    angles = 8 * EPS * (of_positions(tree, q) + dt * np.abs(qd)) + dt * rates
    return np.concatenate([angles, rates], axis=1)


def of_positions(tree: Tree, q: np.ndarray) -> np.ndarray:
    """What 8 eps are a part of in the sum of a position and its change, for each movement, (states, nv)."""
    if not tree.coordinates.balls:
        return np.abs(q)
    sizes = np.full((len(q), tree.coordinates.nv), OF_A_BALL / (8 * EPS))
    for kind, at, by in tree.coordinates.joints:
        if kind != "ball":
            sizes[:, by] = np.abs(q[:, at])
    return sizes


def band(
    stepping: Method,
    tree: Tree,
    q: np.ndarray,
    qd: np.ndarray,
    tau: np.ndarray,
    dt: float,
    every: int = 1,
    most: int | None = None,
) -> np.ndarray:
    """band(t_n) = sum over k of |J_n ... J_(k+1)| delta_k along a run of states (steps + 1, nq, nv), at every so many steps.

    Shape (steps / every + 1, 2 nv). Infinite from where the run has diverged, or the band is far too wide to judge by, and after
    at most so many steps.
    """
    blocks = (len(q) - 1) // every
    finite = np.isfinite([*q.T, *qd.T]).all(axis=0)
    ran = (int(np.argmin(finite)) - 1) // every if not finite.all() else blocks  # whole blocks before it diverges
    ran = ran if most is None else min(ran, most // every)
    size = 2 * qd.shape[1]
    widths = np.full((blocks + 1, size), np.inf)
    widths[0] = 0.0
    if ran <= 0:
        return widths
    q, qd = q[: ran * every], qd[: ran * every]
    jacobians = amplification(stepping, tree, q, qd, tau, dt).reshape(ran, every, size, size)
    # the bound varies slowly: at fine steps it is taken at some of the states, and holds for those that follow
    stride = max(1, every // SAMPLED)
    delta = step_rounding(stepping, tree, q[::stride], qd[::stride], tau, dt)
    delta = np.repeat(delta, stride, axis=0).reshape(ran, every, size)

    # to_end[j, k]: from after step k of block j to the end of the block; all blocks at once
    to_end = np.empty_like(jacobians)
    to_end[:, -1] = np.eye(size)
    for k in reversed(range(every - 1)):
        to_end[:, k] = to_end[:, k + 1] @ jacobians[:, k + 1]
    across = to_end[:, 0] @ jacobians[:, 0]

    carried = np.empty((size, ran * every, size))  # carried[:, k]: what has become of step k's rounding
    for j in range(ran):
        done, here = j * every, (j + 1) * every
        carried[:, :done] = np.tensordot(across[j], carried[:, :done], axes=1)
        carried[:, done:here] = to_end[j].transpose(1, 0, 2)
        widths[j + 1] = np.abs(carried[:, :here]).reshape(size, -1) @ delta.reshape(-1, size)[:here].ravel()
        if not widths[j + 1].max() < 1e6 * NARROW:
            break
    return widths


def growth(
    stepping: Method, tree: Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float, every: int
) -> np.ndarray:
    """log10 of how much a small difference of the state at the start has grown, at every so many steps.

    The 2-norm of J_n ... J_1 (rad and rad/s together), rescaled on the way so that it may grow without limit. NaN from where
    the run has diverged.
    """
    product, scale = np.eye(2 * qd.shape[1]), 0.0
    finite = np.isfinite([*q.T, *qd.T]).all(axis=0)
    result = np.full((len(q) - 1) // every + 1, np.nan)
    result[0] = 0.0
    for k, J in enumerate(amplification(stepping, tree, q[:-1], qd[:-1], tau, dt), start=1):
        product = J @ product
        if not (finite[k] and np.isfinite(product).all()):
            break
        if k % every == 0:
            size = np.linalg.norm(product, 2)
            product, scale = product / size, scale + np.log10(size)
            result[k // every] = scale
    return result
