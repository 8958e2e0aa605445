"""States of any tree in compiled loops: how positions move, and whether a run can go on; coordinates.py over arrays."""

import math

import numpy as np

from tmt.inlined import get, inlined, put
from tmt.loop_joints import BALL, HINGE, put_all
from tmt.machine_code import compiled, part
from tmt.model.coordinates import exponential, inverse_derivative, normalized, product
from tmt.sine import LIMIT
from tmt.templates import OVERFLOW, TURNED


@compiled
def move(tree, q, u, moved):
    """The position after a movement u (nv,) from q, as coordinates.py says it."""
    for i in range(len(tree.joints)):
        k, v = tree.joints[i].at, tree.joints[i].by
        if tree.joints[i].kind == BALL:
            put_turned(q, u, v, moved, k)
        else:
            put(moved, k, get(q, k) + get(u, v))


@inlined
def several(w, k, count=3) -> list:
    return [w[k + j] for j in range(count)]


@inlined
def put_turned(q, u, v, moved, k):
    """The quaternion at k of q after a movement, that at v of u, at length 1."""
    put_all(moved, k, tuple(normalized(product(several(q, k, 4), exponential(several(u, v))))))


@inlined
def put_product(q, b, x, y, z, result, k):
    """The quaternion at k of q times (b, x, y, z), to the same place of result."""
    put_all(result, k, tuple(product(several(q, k, 4), [b, x, y, z])))


@compiled
def normalize(q, k):
    """The quaternion at k at length 1."""
    put_normalized(q, k)


@inlined
def put_normalized(q, k):
    put_all(q, k, tuple(normalized(several(q, k, 4))))


@compiled
def put_rates(tree, u, qd, rates, at):
    """du/dt (nv,) at speeds qd after a movement u, to rates from `at` on: of balls dexp^-1(u) omega."""
    for i in range(len(tree.joints)):
        v = tree.joints[i].by
        if tree.joints[i].kind == BALL:
            put_rate_of_ball(u, qd, v, rates, at + v)
        else:
            put(rates, at + v, get(qd, v))


@inlined
def put_rate_of_ball(u, qd, v, rates, at):
    put_all(rates, at, tuple(inverse_derivative(several(u, v), several(qd, v))))


@compiled
def unsound(tree, q, qd) -> int:
    """Why a state cannot be gone on from, 0: it can."""
    angles = total = 0.0
    for i in range(len(tree.joints)):
        if tree.joints[i].kind == HINGE:
            angles += abs(q[tree.joints[i].at])
    for value in q:
        total += value
    for value in qd:
        total += value
    if not math.isfinite(total):
        return OVERFLOW
    return 0 if angles < LIMIT else TURNED


@compiled
def check(tree, q, qd, tau, ended, every):
    nv = len(tree.before)
    if not (
        q.shape == (len(tau), q.shape[1], tree.nq)
        and qd.shape == (len(tau), q.shape[1], nv)
        and tau.shape[1] == nv
        and ended.shape in ((0, 2), (len(q), 2))
        and every >= 1
    ):
        raise ValueError(
            "q of shape (runs, records, nq), qd (runs, records, nv), tau (runs, nv), ended (runs, 2) and every of at least 1 "
            "are expected"
        )


@part
def copy(given, to):
    """The numbers of one array to another: of slices numba would also compile what is said of wrong shapes."""
    for k in range(len(given)):
        to[k] = given[k]


@compiled
def end(q, qd, k, ended, i, why, steps):
    """Nothing is known of run i from record k on, and after so many steps."""
    q[i, k:], qd[i, k:] = np.nan, np.nan
    if len(ended):
        ended[i, 0], ended[i, 1] = why, steps


@compiled
def kept(q, qd, i, k, every, state, speeds, why, ended) -> bool:
    """Whether run i goes on after step k, of which the state is kept where it is a record; else why it does not is."""
    if why:
        end(q, qd, (k - 1) // every + 1, ended, i, why, k - 1)
    elif k % every == 0:
        copy(state, q[i, k // every])
        copy(speeds, qd[i, k // every])
    return why == 0
