"""Bounds of the difference that rounding alone makes between two runs of the same method."""

from typing import Any

import numpy as np
from numpy import ndarray

from tmt import Tree, acceleration
from tmt.derivation.form import COMPOSITE, Form
from tmt.derivation.vectors import Rows, Values
from tmt.literal import gather
from tmt.methods import METHODS, amplification
from tmt.methods.derivatives import PART
from tmt.methods.stepping import Method

from .entries import Entries
from .scale import EPS, FACTOR, gain_scale, motion_scale

SAMPLED = 4  # states of a block at which the Jacobian and the bound of a step are computed
NARROW = 1e-3  # rad, m: a run is judged while the band of its positions is narrower
# Rounding of a ball's turn in a step, a product of quaternions scaled to length 1: cosine and sine 1.5 eps,
# four sums of four products 4 eps, division 0.5 eps: 6 eps of the quaternion, 12 of the turn, 24 for two
# runs; the difference of the runs 8 eps
OF_A_BALL = 32 * EPS
# N m or N: with servos MuJoCo's discrete takes forces for 0 whose sum of squares is below mjMINVAL, 1e-15
LEFT_OUT = 3.2e-8


class Seen(Form):
    """It keeps the matrix of the linear system that it has solved last."""

    matrix: Rows

    def system(self, *of: Any) -> tuple[Rows, Values]:
        self.matrix, force = super().system(*of)
        return self.matrix, force


def accelerated(
    stepping: Method, tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, dt: float
) -> tuple[ndarray, ndarray]:
    """a (states, nv) and the matrix A (states, nv, nv) of the system A a = force."""
    dynamics = Seen(**vars(COMPOSITE))
    slope = stepping.slope(tree, list(q.T), list(qd.T), list(tau), dt, dynamics)
    a = np.stack([np.broadcast_to(component, q.shape[:1]) for component in slope], axis=-1)
    return a, gather(dynamics.matrix, q.shape[:1], overflow=np.nan)


def slope_rounding(
    stepping: Method, tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, a: ndarray, A: ndarray
) -> ndarray:
    """The bound of the rounding error of a, rad/s2, (states, nv), where A a = force.

    It is |A^-1| (64 eps R |a| + 64 eps S), entry by entry, because entries have different units. S is
    the sum of the absolute terms of the force; R_ij = sqrt(A_ii A_jj) bounds the terms of A_ij and of its
    factorization, where A is Mbar. Of `discrete` with servos it has the force that MuJoCo leaves out, where
    the force is as small as that, or nearly so.
    """
    force = motion_scale(tree, q, qd) + Entries(tree, q).force(tau) + np.array(tree.damping) * np.abs(qd)
    if tree.has_gains:
        force = force + gain_scale(tree, q, qd)
    root = np.sqrt(np.abs(np.einsum("sii->si", A)))
    terms = np.maximum(np.abs(A), root[:, :, None] * root[:, None, :])
    errors = FACTOR * EPS * (np.einsum("sij,sj->si", terms, np.abs(a)) + force)
    if tree.has_gains and stepping == METHODS["discrete"]:
        total = np.einsum("sij,sj->si", A, a)
        errors = errors + LEFT_OUT * (np.linalg.norm(total, axis=1, keepdims=True) < 4.0 * LEFT_OUT)
    return np.einsum("sij,sj->si", np.abs(np.linalg.inv(A)), errors)


def step_rounding(stepping: Method, tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, dt: float) -> ndarray:
    """Bound delta of the difference that rounding adds in one step, (steps, 2 nv), movements first.

    To first order in dt. Speeds: dt x the rounding of the slope (maximum over the stages) plus that of the
    sum qd + dt a. Positions: the rounding of the sum q + dt qd plus dt x that of the speeds. The sums have at
    most 8 roundings in the two runs together; for a ball, OF_A_BALL replaces the rounding of q.
    """
    stages: list[tuple[ndarray, ...]] = []

    def slope(q: list[ndarray], qd: list[ndarray]) -> list[ndarray]:
        state = np.stack(q, axis=-1), np.stack(qd, axis=-1)
        stages.append((*state, *accelerated(stepping, tree, *state, tau, dt)))
        return list(stages[-1][2].T)

    stepping.step(slope, list(q.T), list(qd.T), dt, tree.coordinates)
    positions, speeds, a, A = map(np.concatenate, zip(*stages))  # of all stages at once
    bounds = np.abs(a), slope_rounding(stepping, tree, positions, speeds, tau, a, A)
    size, rounding = (bound.reshape(len(stages), *qd.shape).max(axis=0) for bound in bounds)
    rates = dt * rounding + 8 * EPS * (np.abs(qd) + dt * size)
    angles = 8 * EPS * (of_positions(tree, q) + dt * np.abs(qd)) + dt * rates
    return np.concatenate([angles, rates], axis=1)


def of_positions(tree: Tree, q: ndarray) -> ndarray:
    """The sizes of which the sum of a position and its change has 8 eps of rounding, (states, nv)."""
    sizes = np.full((len(q), tree.coordinates.nv), OF_A_BALL / (8 * EPS))
    for joint in tree.coordinates.joints:
        if joint.kind != "ball":
            sizes[:, joint.qd] = np.abs(q[:, joint.q])
    return sizes


def of_a_step(tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, dt: float, A: ndarray) -> ndarray:
    """The sizes of which a step has 64 eps of rounding, there and carried through it by A: (states, 2 nv, 1).

    Of a difference of steps that is over the eps of the difference; a ball's turn is a quaternion.
    """
    entries, qdd = Entries(tree, q, qd), acceleration(tree, q, qd, tau)
    force = entries.force(tau) + gain_scale(tree, q, qd)
    rates = np.abs(qd) + dt * entries.acceleration(force, qdd)
    sizes = np.concatenate([of_positions(tree, q) + dt * rates, rates], axis=1)[:, :, None]
    return np.asarray(sizes + np.abs(A) @ sizes)


def band(
    stepping: Method, tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, dt: float,
    every: int = 1, most: int | None = None,
) -> ndarray:  # fmt: skip
    """band(t_n) = sum over k of |J_n ... J_(k+1)| delta_k along a run of states, (steps / every + 1, 2 nv).

    every: steps between two values. Infinite from where the run has diverged or the band is far too wide, and
    after `most` steps.
    """
    size = 2 * qd.shape[1]
    widths = np.full(((len(q) - 1) // every + 1, size), np.inf)
    widths[0] = 0.0
    steps = finite_states(q, qd) - 1
    blocks = (steps if most is None else min(steps, most)) // every
    if blocks <= 0:
        return widths
    # both vary slowly: at fine steps they are those of the middle of some steps, for all of these
    stride = max(1, every // SAMPLED)
    carried = np.empty((size, 0, size))  # [:, k]: the rounding of step k, propagated
    deltas = np.empty(0)
    # blocks whose Jacobians are computed at once
    together = max(1, PART * stride // (every * qd.shape[1]))
    for first in range(0, blocks, together):
        start, stop = first * every, min(first + together, blocks) * every
        middles = np.minimum(np.arange(start, stop, stride) + stride // 2, stop - 1)
        at = tree, q[middles], qd[middles], tau, dt
        jacobians, delta = (
            np.repeat(of_steps(stepping, *at), stride, axis=0)[: stop - start]
            for of_steps in (amplification, step_rounding)
        )
        jacobians = jacobians.reshape(-1, every, size, size)
        deltas = np.concatenate([deltas, delta.ravel()])
        to_end = np.empty_like(jacobians)  # [j, k]: from after step k of block j to the end of the block
        to_end[:, -1] = np.eye(size)
        for k in reversed(range(every - 1)):
            to_end[:, k] = to_end[:, k + 1] @ jacobians[:, k + 1]
        across = to_end[:, 0] @ jacobians[:, 0]
        for j, of_block in enumerate(to_end, first + 1):
            earlier = np.tensordot(across[j - first - 1], carried, axes=1)
            carried = np.concatenate([earlier, of_block.transpose(1, 0, 2)], axis=1)
            widths[j] = np.abs(carried).reshape(size, -1) @ deltas[: carried.shape[1] * size]
            if not widths[j].max() < 1e6 * NARROW:
                return widths
    return widths


def finite_states(q: ndarray, qd: ndarray) -> int:
    """The number of states of a run before the first that is not finite."""
    finite = np.isfinite(np.concatenate([q, qd], axis=1)).all(axis=1)
    return len(q) if finite.all() else int(np.argmin(finite))


def growth(
    stepping: Method, tree: Tree, q: ndarray, qd: ndarray, tau: ndarray, dt: float,
    every: int, stride: int = 1,
) -> ndarray:  # fmt: skip
    """log10 of the growth of a small difference of the initial state, at every `every` steps.

    The 2-norm of J_n ... J_1 (rad and rad/s together), rescaled to avoid overflow. NaN from where the run has
    diverged. stride: steps for all of which the Jacobian of the first is taken; it divides `every`.
    """
    product, scale = np.eye(2 * qd.shape[1]), 0.0
    result = np.full((len(q) - 1) // every + 1, np.nan)
    result[0] = 0.0
    jacobians = amplification(stepping, tree, q[:-1:stride], qd[:-1:stride], tau, dt)
    powers = np.linalg.matrix_power(jacobians, stride)
    for k, J in zip(range(stride, finite_states(q, qd), stride), powers):
        product = J @ product
        if not np.isfinite(product).all():
            break
        if k % every == 0:
            size = np.linalg.norm(product, 2)
            product, scale = product / size, scale + np.log10(size)
            result[k // every] = scale
    return result
