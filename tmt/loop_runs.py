"""The methods of integration as compiled loops over any tree, see generic.py: what methods.py and implicit.py say, over arrays.

Derivatives are taken along an imaginary part of 1e-100, which is exact but for rounding.
"""

import math

import numpy as np

from .loop_states import check, end, move, movement_rates, unsound
from .loops import BALL, forward_dynamics, mass_matrix_and_bias, reduced_force
from .machine_code import compiled
from .templates import SMALL

NUDGE = 1e-100


@compiled
def stages(tree, A, mean_speed, q, qd, tau, dt, rates, changes):
    """The rates of the movement and the accelerations (stages, nv) of an explicit Runge-Kutta method."""
    n = len(qd)
    u, place, speeds = np.empty(n), np.empty(len(q)), np.empty(n)
    for s in range(len(A)):
        for j in range(n):
            u[j], speeds[j] = 0.0, 0.0
            for r in range(s):
                u[j] += A[s, r] * rates[r, j]
                speeds[j] += A[s, r] * changes[r, j]
            u[j], speeds[j] = dt * u[j], qd[j] + dt * speeds[j]
        move(tree, q, u, place)
        movement_rates(tree, u, speeds, rates[s])
        if mean_speed:
            rates[s] = speeds
        forward_dynamics(tree, place, speeds, tau, changes[s])


@compiled
def combine(tree, b, q, qd, dt, rates, changes, new_q, new_qd):
    """The state one dt later, from the rates and accelerations of all stages."""
    u = np.zeros(len(qd))
    for j in range(len(qd)):
        change = 0.0
        for s in range(len(b)):
            u[j] += b[s] * rates[s, j]
            change += b[s] * changes[s, j]
        u[j] *= dt
        new_qd[j] = qd[j] + dt * change
    move(tree, q, u, new_q)


@compiled
def run_tableau(tree, A, b, mean_speed, q, qd, tau, dt, ended):
    """Fill q and qd (runs, steps + 1, nq or nv) by an explicit Runge-Kutta method, while finite; evaluations of the dynamics."""
    check(tree, q, qd, tau, ended)
    evaluations, n = 0, len(tree.before)
    rates, changes = np.empty((len(b), n)), np.empty((len(b), n))
    for i in range(q.shape[0]):
        for k in range(1, q.shape[1]):
            stages(tree, A, mean_speed, q[i, k - 1], qd[i, k - 1], tau[i], dt, rates, changes)
            combine(tree, b, q[i, k - 1], qd[i, k - 1], dt, rates, changes, q[i, k], qd[i, k])
            evaluations += len(b)
            why = unsound(tree, q[i, k], qd[i, k])
            if why:
                end(q, qd, k, ended, i, why)
                break
    return evaluations


@compiled
def run_adaptive(tree, A, b, errors, order, q, qd, tau, dt, tolerance, ended):
    """The same by a method that chooses its own steps."""
    check(tree, q, qd, tau, ended)
    evaluations, n = 0, len(tree.before)
    rates, changes = np.empty((len(b), n)), np.empty((len(b), n))
    state, speeds, new, new_speeds = np.empty(q.shape[2]), np.empty(n), np.empty(q.shape[2]), np.empty(n)
    for i in range(q.shape[0]):
        state[:], speeds[:] = q[i, 0], qd[i, 0]
        wanted, why = dt / 8.0, 0
        for k in range(1, q.shape[1]):
            left = dt
            while left > 0.0 and why == 0:
                pieces = math.ceil(left / wanted)
                h = left / pieces
                stages(tree, A, False, state, speeds, tau[i], h, rates, changes)
                combine(tree, b, state, speeds, h, rates, changes, new, new_speeds)
                evaluations += len(b)
                error = estimate(tree, errors, tolerance, h, rates, changes, state, speeds, new, new_speeds)
                if error < 1.0:
                    state[:], speeds[:] = new, new_speeds
                    left = left - h if pieces > 1 else 0.0
                factor = 6.0 if error == 0.0 else 0.333
                if error > 0.0:
                    factor = min(6.0, max(0.333, 0.9 * error ** (-1.0 / order)))
                wanted = h * factor
                why = unsound(tree, state, speeds)
                if why == 0 and not h > 1e-9 * dt:
                    why = SMALL
            if why:
                end(q, qd, k, ended, i, why)
                break
            q[i, k], qd[i, k] = state, speeds
    return evaluations


@compiled
def estimate(tree, errors, tolerance, h, rates, changes, q, qd, new, new_qd):
    """The error of a step in units of the tolerance, from its two estimates."""
    n = len(qd)
    squares = np.zeros(2)
    for e in range(2):
        for i in range(len(tree.parent)):
            for v in range(tree.by[i], tree.by[i + 1]):
                by_rates = by_changes = 0.0
                for s in range(errors.shape[1]):
                    by_rates += errors[e, s] * rates[s, v]
                    by_changes += errors[e, s] * changes[s, v]
                size = 1.0 if tree.kind[i] == BALL else max(abs(q[tree.at[i]]), abs(new[tree.at[i]]))
                squares[e] += (h * by_rates / (tolerance * (1.0 + size))) ** 2
                squares[e] += (h * by_changes / (tolerance * (1.0 + max(abs(qd[v]), abs(new_qd[v]))))) ** 2
    if squares[0] == 0.0:
        return 0.0
    return squares[0] / math.sqrt(2 * n * (squares[0] + 0.01 * squares[1]))


@compiled
def run_semi_implicit(tree, own, springs, position_gain, speed_gain, q, qd, tau, dt, ended):
    """The same by the semi-implicit Euler method.

    own (nv,): whose bias is implicit too; springs: whether they are; position_gain, speed_gain: their implicit entries.
    """
    check(tree, q, qd, tau, ended)
    evaluations, n = 0, len(tree.before)
    M, h, force, u = np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n)
    held = dt * tree.damping
    if springs:
        for i in range(len(tree.parent)):
            for v in range(tree.by[i], tree.by[i + 1]):
                held[v] += dt * dt * tree.stiffness[i]
    for i in range(q.shape[0]):
        for k in range(1, q.shape[1]):
            place, speeds = q[i, k - 1], qd[i, k - 1]
            M[:] = 0.0
            mass_matrix_and_bias(tree, place, speeds, M, h)
            reduced_force(tree, h, place, speeds, tau[i], force)
            for v in range(n):
                for w in range(v):
                    M[w, v] = M[v, w]
                if springs:
                    force[v] -= (held[v] - dt * tree.damping[v]) / dt * speeds[v]
                M[v, v] += held[v]
            for v in range(len(speed_gain)):
                for w in range(n):
                    M[v, w] += dt * speed_gain[v, w]
            for v in range(len(position_gain)):
                for w in range(n):
                    M[v, w] += dt * dt * position_gain[v, w]
                    force[v] -= dt * position_gain[v, w] * speeds[w]
            if own.any():
                add_bias_rates(tree, own, place, speeds, dt, M)
            solve(M, force)
            for v in range(n):
                qd[i, k, v] = speeds[v] + dt * force[v]
                u[v] = dt * qd[i, k, v]
            move(tree, place, u, q[i, k])
            evaluations += 1
            why = unsound(tree, q[i, k], qd[i, k])
            if why:
                end(q, qd, k, ended, i, why)
                break
    return evaluations


@compiled
def add_bias_rates(tree, own, q, qd, dt, matrix):
    """matrix += dt dh/dqd in the rows of `own`."""
    n = len(qd)
    place, speeds = q + 0j, qd + 0j
    M, h = np.empty((n, n), np.complex128), np.empty(n, np.complex128)
    for w in range(n):
        speeds[w] += NUDGE * 1j
        mass_matrix_and_bias(tree, place, speeds, M, h)
        speeds[w] = qd[w]
        for v in range(n):
            if own[v]:
                matrix[v, w] += dt * (h[v].imag / NUDGE)


@compiled
def solve(matrix, right):
    """The solution of matrix x = right in place of right, by L U without pivots."""
    n = len(right)
    for k in range(n):
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
