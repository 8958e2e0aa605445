"""Evaluations of many states in compiled loops over any tree, and of one state again and again."""

import numpy as np

from .loops import BALL, forward_dynamics, mass_matrix_and_bias
from .machine_code import compiled


@compiled
def repeat_forward_dynamics(tree, q, qd, tau, qdd, count):
    """The same state so many times, for timing."""
    for _ in range(count):
        forward_dynamics(tree, q, qd, tau, qdd)


@compiled
def repeat_mass_matrix_and_bias(tree, q, qd, M, h, count):
    """The same state so many times, for timing."""
    for _ in range(count):
        mass_matrix_and_bias(tree, q, qd, M, h)


@compiled
def evaluate(tree, dynamics, q, qd, tau, M, out):
    """qdd of one state, else the rows of the upper triangle of Mbar and then h, to out."""
    n = len(qd)
    if dynamics:
        forward_dynamics(tree, q, qd, tau, out)
        return
    M[:] = 0.0
    mass_matrix_and_bias(tree, q, qd, M, out[n * (n + 1) // 2 :])
    k = 0
    for i in range(n):
        for j in range(i, n):
            out[k] = M[j, i]
            k += 1


@compiled
def each(tree, dynamics, q, qd, tau, out):
    """One state at a time: rows of q (N, nq), qd, tau (N, nv) to rows of out."""
    n = len(tree.before)
    size = n if dynamics else n * (n + 3) // 2
    if not (q.shape == (len(q), tree.at[-1]) and qd.shape == tau.shape == (len(q), n) and out.shape == (len(q), size)):
        raise ValueError("q of shape (N, nq), qd and tau (N, nv) and out (N, results) are expected")
    apart(q, qd, tau, out)
    M = np.empty((n, n))
    for i in range(len(q)):
        evaluate(tree, dynamics, q[i], qd[i], tau[i], M, out[i])


@compiled
def lanes(tree, dynamics, q, qd, tau, out):
    """The same of columns of q (nq, N), qd, tau (nv, N) to columns of out, one state at a time too."""
    n, count = len(tree.before), q.shape[1]
    size = n if dynamics else n * (n + 3) // 2
    if not (q.shape == (tree.at[-1], count) and qd.shape == tau.shape == (n, count) and out.shape == (size, count)):
        raise ValueError("q of shape (nq, N), qd and tau (nv, N) and out (results, N) are expected")
    apart(q, qd, tau, out)
    M, result = np.empty((n, n)), np.empty(size)
    for i in range(count):
        evaluate(tree, dynamics, q[:, i].copy(), qd[:, i].copy(), tau[:, i].copy(), M, result)
        out[:, i] = result


@compiled
def apart(q, qd, tau, out):
    """Raise ValueError if results would be written over arguments that are still needed."""
    for given in (q, qd, tau):
        if given.ctypes.data < out.ctypes.data + out.nbytes and out.ctypes.data < given.ctypes.data + given.nbytes:
            raise ValueError("out shares memory with q, qd or tau; an array of its own is expected")


@compiled
def chain(tree, dynamics, size, q, qd, tau, count):
    """The same state count times, each waiting for the one before; size: of the results."""
    n = len(tree.before)
    if not (len(q) == tree.at[-1] and len(qd) == len(tau) == n):
        raise ValueError("q of shape (nq,), qd and tau (nv,) are expected")
    M, result, last = np.empty((n, n)), np.empty(size), 0.0
    for _ in range(count):
        evaluate(tree, dynamics, q + 1e-300 * last, qd, tau, M, result)
        last = result.sum()
    return last


@compiled
def rate(tree, y, tau):
    """dy/dt of y = (q, qd)."""
    nq, n = tree.at[-1], len(tree.before)
    if not (len(y) == nq + n and len(tau) == n):
        raise ValueError("y of shape (nq + nv,) and tau of shape (nv,) are expected")
    q, qd, result = y[:nq].copy(), y[nq:].copy(), np.empty(nq + n)
    for i in range(len(tree.parent)):
        k, v = tree.at[i], tree.by[i]
        if tree.kind[i] != BALL:
            result[k] = qd[v]
            continue
        w, a, b, c, x, y_, z = q[k], q[k + 1], q[k + 2], q[k + 3], qd[v], qd[v + 1], qd[v + 2]
        result[k], result[k + 1] = -0.5 * (a * x + b * y_ + c * z), 0.5 * (w * x + b * z - c * y_)
        result[k + 2], result[k + 3] = 0.5 * (w * y_ + c * x - a * z), 0.5 * (w * z + a * y_ - b * x)
    forward_dynamics(tree, q, qd, tau, result[nq:])
    return result
