"""Evaluations of many states in compiled loops over any tree, and of one state again and again."""

import numpy as np

from tmt.eight import WIDTH
from tmt.inlined import get, put
from tmt.loop_joints import BALL
from tmt.loops import forward_dynamics, mass_matrix_and_bias, workspace
from tmt.machine_code import compiled, part


@compiled
def repeat_forward_dynamics(tree, q, qd, tau, qdd, count):
    """The same state so many times, for timing."""
    w = np.empty(workspace(tree))
    for _ in range(count):
        forward_dynamics(tree, q, qd, tau, w, qdd)


@compiled
def repeat_mass_matrix_and_bias(tree, q, qd, M, h, count):
    """The same state so many times, for timing; M (nv * nv,)."""
    w = np.empty(workspace(tree))
    for _ in range(count):
        mass_matrix_and_bias(tree, q, qd, w, M, h)


@compiled
def terms(tree, q, qd, w, M, out):
    """The rows of the upper triangle of Mbar and then h, of one state, or of eight, to out."""
    n = len(qd)
    mass_matrix_and_bias(tree, q, qd, w, M, out[n * (n + 1) // 2 :])
    k = 0
    for i in range(n):
        for j in range(i, n):
            put(out, k, get(M, j * n + i))
            k += 1


@compiled
def each(tree, dynamics, q, qd, tau, out):
    """One state at a time: rows of q (N, nq), qd, tau (N, nv) to rows of out."""
    n = len(tree.before)
    size = n if dynamics else n * (n + 3) // 2
    if not (q.shape == (len(q), tree.nq) and qd.shape == tau.shape == (len(q), n) and out.shape == (len(q), size)):
        raise ValueError("q of shape (N, nq), qd and tau (N, nv) and out (N, results) are expected")
    apart(q, qd, tau, out)
    w, M, result = np.empty(workspace(tree)), np.zeros(n * n), np.empty(size)
    place, speeds, torque = np.empty(tree.nq), np.empty(n), np.empty(n)
    for i in range(len(q)):
        # a part of an array that is handed on costs more than to copy it
        copy(q[i], place)
        copy(qd[i], speeds)
        copy(tau[i], torque)
        if dynamics:
            forward_dynamics(tree, place, speeds, torque, w, result)
        else:
            terms(tree, place, speeds, w, M, result)
        copy(result, out[i])


@compiled
def lanes(tree, dynamics, q, qd, tau, out):
    """The same of columns of q (nq, N), qd, tau (nv, N) to columns of out: eight side by side, the rest one at a time."""
    n, count = len(tree.before), q.shape[1]
    size = n if dynamics else n * (n + 3) // 2
    if not (q.shape == (tree.nq, count) and qd.shape == tau.shape == (n, count) and out.shape == (size, count)):
        raise ValueError("q of shape (nq, N), qd and tau (nv, N) and out (results, N) are expected")
    apart(q, qd, tau, out)
    w, M, result = np.empty((workspace(tree), WIDTH)), np.zeros((n * n, WIDTH)), np.empty((size, WIDTH))
    states = np.empty((tree.nq, WIDTH)), np.empty((n, WIDTH)), np.empty((n, WIDTH))
    for first in range(0, count // WIDTH * WIDTH, WIDTH):
        for state, given in zip(states, (q, qd, tau)):
            copy_lanes(given, first, state, 0)
        if dynamics:
            forward_dynamics(tree, *states, w, result)
        else:
            terms(tree, *states[:2], w, M, result)
        copy_lanes(result, 0, out, first)
    w, M, result = np.empty(workspace(tree)), np.zeros(n * n), np.empty(size)
    for i in range(count // WIDTH * WIDTH, count):
        if dynamics:
            forward_dynamics(tree, q[:, i].copy(), qd[:, i].copy(), tau[:, i].copy(), w, result)
        else:
            terms(tree, q[:, i].copy(), qd[:, i].copy(), w, M, result)
        out[:, i] = result


@part
def copy(given, to):
    """One array's numbers to another."""
    for k in range(len(to)):
        to[k] = given[k]


@part
def copy_lanes(given, first, to, start):
    """Eight columns, from `first` on, to those from `start` on."""
    for k in range(len(given)):
        for l in range(WIDTH):
            to[k, start + l] = given[k, first + l]


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
    if not (len(q) == tree.nq and len(qd) == len(tau) == n):
        raise ValueError("q of shape (nq,), qd and tau (nv,) are expected")
    w, M, result, last = np.empty(workspace(tree)), np.zeros(n * n), np.empty(size), 0.0
    for _ in range(count):
        if dynamics:
            forward_dynamics(tree, q + 1e-300 * last, qd, tau, w, result)
        else:
            terms(tree, q + 1e-300 * last, qd, w, M, result)
        last = result.sum()
    return last


@compiled
def rate(tree, y, tau):
    """dy/dt of y = (q, qd)."""
    nq, n = tree.nq, len(tree.before)
    if not (len(y) == nq + n and len(tau) == n):
        raise ValueError("y of shape (nq + nv,) and tau of shape (nv,) are expected")
    q, qd, result = y[:nq].copy(), y[nq:].copy(), np.empty(nq + n)
    for i in range(len(tree.joints)):
        k, v = tree.joints[i].at, tree.joints[i].by
        if tree.joints[i].kind != BALL:
            result[k] = qd[v]
            continue
        w, a, b, c, x, y_, z = q[k], q[k + 1], q[k + 2], q[k + 3], qd[v], qd[v + 1], qd[v + 2]
        result[k], result[k + 1] = -0.5 * (a * x + b * y_ + c * z), 0.5 * (w * x + b * z - c * y_)
        result[k + 2], result[k + 3] = 0.5 * (w * y_ + c * x - a * z), 0.5 * (w * z + a * y_ - b * x)
    forward_dynamics(tree, q, qd, tau, np.empty(workspace(tree)), result[nq:])
    return result
