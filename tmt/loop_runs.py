"""Explicit methods of integration as compiled loops over any tree, see generic.py: what methods.py says, over arrays."""

import math

import numpy as np

from tmt.eight import WIDTH
from tmt.inlined import get, put, zero
from tmt.loop_joints import BALL
from tmt.loop_states import check, copy, kept, move, put_rates, unsound
from tmt.loops import forward_dynamics, workspace
from tmt.machine_code import compiled
from tmt.templates import SMALL


@compiled
def stages(tree, A, mean_speed, q, qd, tau, dt, w, u, place, speeds, rates, changes):
    """The rates of the movement and the accelerations (stages * nv,) of an explicit Runge-Kutta method, of one run or of eight.

    u and speeds (nv,), place (nq,) and w (workspace(tree),) are written over.
    """
    n = len(qd)
    for s in range(len(A)):
        for j in range(n):
            by, change = zero(u), zero(u)
            for r in range(s):
                by = by + A[s, r] * get(rates, r * n + j)
                change = change + A[s, r] * get(changes, r * n + j)
            put(u, j, dt * by)
            put(speeds, j, get(qd, j) + dt * change)
        move(tree, q, u, place)
        if mean_speed:
            for j in range(n):
                put(rates, s * n + j, get(speeds, j))
        else:
            put_rates(tree, u, speeds, rates, s * n)
        forward_dynamics(tree, place, speeds, tau, w, changes[s * n : (s + 1) * n])


@compiled
def combine(tree, b, q, qd, dt, u, rates, changes, new_q, new_qd):
    """The state one dt later, from the rates and accelerations of all stages; u (nv,) is written over."""
    n = len(qd)
    for j in range(n):
        by, change = zero(u), zero(u)
        for s in range(len(b)):
            by = by + b[s] * get(rates, s * n + j)
            change = change + b[s] * get(changes, s * n + j)
        put(u, j, dt * by)
        put(new_qd, j, get(qd, j) + dt * change)
    move(tree, q, u, new_q)


@compiled
def run_tableau(tree, A, b, mean_speed, q, qd, tau, dt, ended, every):
    """Fill q and qd (runs, records, nq or nv) by an explicit Runge-Kutta method, while finite; evaluations of the dynamics."""
    check(tree, q, qd, tau, ended, every)
    evaluations, n = 0, len(tree.before)
    w, u, place, speeds = np.empty(workspace(tree)), np.empty(n), np.empty(tree.nq), np.empty(n)
    rates, changes = np.empty(len(b) * n), np.empty(len(b) * n)
    state, rate = np.empty(tree.nq), np.empty(n)
    for i in range(q.shape[0]):
        copy(q[i, 0], state)
        copy(qd[i, 0], rate)
        for k in range(1, (q.shape[1] - 1) * every + 1):
            stages(tree, A, mean_speed, state, rate, tau[i], dt, w, u, place, speeds, rates, changes)
            combine(tree, b, state, rate, dt, u, rates, changes, state, rate)
            evaluations += len(b)
            if not kept(q, qd, i, k, every, state, rate, unsound(tree, state, rate), ended):
                break
    return evaluations


@compiled
def run_tableau_lanes(tree, A, b, mean_speed, q, qd, tau, dt, ended, every):
    """The same of runs that are a multiple of eight, eight side by side; the same bits."""
    check(tree, q, qd, tau, ended, every)
    if len(q) % WIDTH:
        raise ValueError("a multiple of 8 runs is expected")
    evaluations, n, alive = 0, len(tree.before), np.empty(WIDTH, np.bool_)
    w, state, place = np.empty((workspace(tree), WIDTH)), np.empty((tree.nq, WIDTH)), np.empty((tree.nq, WIDTH))
    rate, speeds, torque, u = np.empty((n, WIDTH)), np.empty((n, WIDTH)), np.empty((n, WIDTH)), np.empty((n, WIDTH))
    rates, changes = np.empty((len(b) * n, WIDTH)), np.empty((len(b) * n, WIDTH))
    one, its_rate = np.empty(tree.nq), np.empty(n)
    for first in range(0, len(q), WIDTH):
        for l in range(WIDTH):
            copy(q[first + l, 0], state[:, l])
            copy(qd[first + l, 0], rate[:, l])
            copy(tau[first + l], torque[:, l])
        alive[:] = True
        for k in range(1, (q.shape[1] - 1) * every + 1):
            if not alive.any():
                break
            stages(tree, A, mean_speed, state, rate, torque, dt, w, u, place, speeds, rates, changes)
            combine(tree, b, state, rate, dt, u, rates, changes, state, rate)
            for l in range(WIDTH):
                i = first + l
                if alive[l]:
                    copy(state[:, l], one)
                    copy(rate[:, l], its_rate)
                    evaluations += len(b)
                    alive[l] = kept(q, qd, i, k, every, one, its_rate, unsound(tree, one, its_rate), ended)
    return evaluations


@compiled
def run_adaptive(tree, A, b, errors, order, q, qd, tau, dt, tolerance, ended, every):
    """The same as run_tableau by a method that chooses its own steps."""
    check(tree, q, qd, tau, ended, every)
    evaluations, n = 0, len(tree.before)
    w, u, place, along = np.empty(workspace(tree)), np.empty(n), np.empty(tree.nq), np.empty(n)
    rates, changes = np.empty(len(b) * n), np.empty(len(b) * n)
    state, speeds, new, new_speeds = np.empty(tree.nq), np.empty(n), np.empty(tree.nq), np.empty(n)
    for i in range(q.shape[0]):
        copy(q[i, 0], state)
        copy(qd[i, 0], speeds)
        wanted, why = dt / 8.0, 0
        for k in range(1, (q.shape[1] - 1) * every + 1):
            left = dt
            while left > 0.0 and why == 0:
                pieces = math.ceil(left / wanted)
                h = left / pieces
                stages(tree, A, False, state, speeds, tau[i], h, w, u, place, along, rates, changes)
                combine(tree, b, state, speeds, h, u, rates, changes, new, new_speeds)
                evaluations += len(b)
                error = estimate(tree, errors, tolerance, h, rates, changes, state, speeds, new, new_speeds)
                if error < 1.0:
                    copy(new, state)
                    copy(new_speeds, speeds)
                    left = left - h if pieces > 1 else 0.0
                factor = 6.0 if error == 0.0 else 0.333
                if error > 0.0:
                    factor = min(6.0, max(0.333, 0.9 * error ** (-1.0 / order)))
                wanted = h * factor
                why = unsound(tree, state, speeds)
                if why == 0 and not h > 1e-9 * dt:
                    why = SMALL
            if not kept(q, qd, i, k, every, state, speeds, why, ended):
                break
    return evaluations


@compiled
def estimate(tree, errors, tolerance, h, rates, changes, q, qd, new, new_qd):
    """The error of a step in units of the tolerance, from its two estimates."""
    n = len(qd)
    squares = np.zeros(2)
    for e in range(2):
        for i in range(len(tree.joints)):
            joint = tree.joints[i]
            for v in range(joint.by, joint.by + joint.count):
                by_rates = by_changes = 0.0
                for s in range(errors.shape[1]):
                    by_rates += errors[e, s] * rates[s * n + v]
                    by_changes += errors[e, s] * changes[s * n + v]
                size = 1.0 if joint.kind == BALL else max(abs(q[joint.at]), abs(new[joint.at]))
                squares[e] += (h * by_rates / (tolerance * (1.0 + size))) ** 2
                squares[e] += (h * by_changes / (tolerance * (1.0 + max(abs(qd[v]), abs(new_qd[v]))))) ** 2
    if not squares[0] > 0.0:  # nor where it is undefined: then the state is not finite
        return 0.0
    return squares[0] / math.sqrt(2 * n * (squares[0] + 0.01 * squares[1]))
