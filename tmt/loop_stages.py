"""Implicit Runge-Kutta methods as compiled loops over any tree: implicit.py over arrays."""

import math

import numpy as np

from tmt.loop_joints import BALL
from tmt.loop_semi_implicit import NUDGE, solve
from tmt.loop_states import check, copy, kept, normalize, put_product, unsound
from tmt.loops import forward_dynamics, workspace
from tmt.machine_code import compiled, part
from tmt.methods.implicit import CLOSE, ITERATIONS
from tmt.templates import NEWTON


@compiled
def slope_and_jacobian(tree, q, qd, tau, value, by_q, by_qd):
    """qdd (nv,) and its derivatives by a movement of q and by qd, (nv, nv)."""
    n = len(qd)
    place, speeds, torque, found = q + 0j, qd + 0j, tau + 0j, np.empty(n, np.complex128)
    w = np.empty(workspace(tree), np.complex128)
    forward_dynamics(tree, q, qd, tau, np.empty(workspace(tree)), value)
    for i in range(len(tree.joints)):
        joint, k = tree.joints[i], tree.joints[i].at
        for j in range(joint.count):
            half, v = 0.5j * NUDGE, joint.by + j
            for faster in (False, True):  # the dynamics are called at one place, as each takes its time to compile
                if faster:
                    speeds[v] += NUDGE * 1j
                elif joint.kind == BALL:
                    put_product(q + 0j, 1.0 + 0j, half * (j == 0), half * (j == 1), half * (j == 2), place, k)
                else:
                    place[k] += NUDGE * 1j
                forward_dynamics(tree, place, speeds, torque, w, found)
                for u in range(n):
                    if faster:
                        by_qd[u, v] = found[u].imag / NUDGE
                    else:
                        by_q[u, v] = found[u].imag / NUDGE
                for u in range(len(q)):
                    place[u] = q[u]
                speeds[v] = qd[v]


@compiled
def stage_states(tree, A, q, qd, dt, a, places, speeds):
    """The positions (stages, nq) and speeds (stages, nv) of stages with accelerations a (stages, nv)."""
    count, n = a.shape
    for i in range(count):
        for v in range(n):
            speeds[i, v] = qd[v]
            for j in range(count):
                speeds[i, v] += dt * A[i, j] * a[j, v]
    matrix, right = np.empty((4 * count, 4 * count), a.dtype), np.empty(4 * count, a.dtype)
    for joint in tree.joints:
        k, v = joint.at, joint.by
        if joint.kind != BALL:
            for i in range(count):
                places[i, k] = q[k]
                for j in range(count):
                    places[i, k] += dt * A[i, j] * speeds[j, v]
            continue
        for i in range(count):
            for j in range(count):
                x, y, z = speeds[j, v], speeds[j, v + 1], speeds[j, v + 2]
                f, one = -0.5 * dt * A[i, j], 1.0 if i == j else 0.0
                r, c = 4 * i, 4 * j  # of the product p o (0, omega)
                matrix[r, c], matrix[r, c + 1], matrix[r, c + 2], matrix[r, c + 3] = one, -f * x, -f * y, -f * z
                r += 1
                matrix[r, c], matrix[r, c + 1], matrix[r, c + 2], matrix[r, c + 3] = f * x, one, f * z, -f * y
                r += 1
                matrix[r, c], matrix[r, c + 1], matrix[r, c + 2], matrix[r, c + 3] = f * y, -f * z, one, f * x
                r += 1
                matrix[r, c], matrix[r, c + 1], matrix[r, c + 2], matrix[r, c + 3] = f * z, f * y, -f * x, one
            for j in range(4):
                right[4 * i + j] = q[k + j]
        solve(matrix, right)
        for i in range(count):
            for j in range(4):
                places[i, k + j] = right[4 * i + j]


@compiled
def turns(tree, A, q, qd, dt, a, places):
    """d theta_i / d a_j of the balls' stages, (stages i, stages j, nv, nv), theta a movement at the stage."""
    count, n = a.shape
    result = np.zeros((count, count, n, n))
    nudged, moved, speeds = a + 0j, np.empty((count, len(q)), np.complex128), np.empty((count, n), np.complex128)
    start, rates = q + 0j, qd + 0j
    for joint in tree.joints:
        if joint.kind != BALL:
            continue
        k, first = joint.at, joint.by
        for j in range(count):
            for v in range(first, first + 3):
                nudged[j, v] += NUDGE * 1j
                stage_states(tree, A, start, rates, dt, nudged, moved, speeds)
                nudged[j, v] = a[j, v]
                for i in range(count):
                    p, dp = places[i], moved[i].imag / NUDGE
                    w, x, y, z, u = p[k], p[k + 1], p[k + 2], p[k + 3], dp[k : k + 4]
                    result[i, j, first, v] = 2.0 * (w * u[1] - x * u[0] - y * u[3] + z * u[2])
                    result[i, j, first + 1, v] = 2.0 * (w * u[2] - y * u[0] - z * u[1] + x * u[3])
                    result[i, j, first + 2, v] = 2.0 * (w * u[3] - z * u[0] - x * u[2] + y * u[1])
    return result


@compiled
def newton(tree, A, q, qd, tau, dt, a, linear, by_q, by_qd, change):
    """The change of the accelerations a (stages, nv) by one step of Newton's method; linear: of the equations about (q, qd)."""
    count, n = a.shape
    places, speeds = np.empty((count, len(q))), np.empty((count, n))
    stage_states(tree, A, q, qd, dt, a, places, speeds)
    turn, is_ball = np.zeros((1, 1, 1, 1)), np.zeros(n, np.bool_)
    for joint in tree.joints:
        is_ball[joint.by : joint.by + joint.count] = joint.kind == BALL
    if is_ball.any():
        turn = turns(tree, A, q, qd, dt, a, places)
    twice = np.zeros((count, count))
    for i in range(count):
        for j in range(count):
            for m in range(count):
                twice[i, j] += A[i, m] * A[m, j]
    matrix, right, value, off = np.zeros((count * n, count * n)), np.empty(count * n), np.empty(n), np.empty(n)
    base = np.empty(n)
    for i in range(count):
        at, rate = (q, qd) if linear else (places[i], speeds[i])
        if i == 0 or not linear:
            slope_and_jacobian(tree, at, rate, tau, base, by_q, by_qd)
        copy(base, value)
        if linear:
            for joint in tree.joints:
                k, v = joint.at, joint.by
                if joint.kind != BALL:
                    off[v] = places[i, k] - q[k]
                    continue
                w, x, y, z, p = q[k], q[k + 1], q[k + 2], q[k + 3], places[i, k : k + 4]
                off[v] = 2.0 * (w * p[1] - x * p[0] - y * p[3] + z * p[2])
                off[v + 1] = 2.0 * (w * p[2] - y * p[0] - z * p[1] + x * p[3])
                off[v + 2] = 2.0 * (w * p[3] - z * p[0] - x * p[2] + y * p[1])
            for v in range(n):
                for w in range(n):
                    value[v] += by_q[v, w] * off[w] + by_qd[v, w] * (speeds[i, w] - qd[w])
        for v in range(n):
            right[i * n + v] = value[v] - a[i, v]
            for j in range(count):
                for w in range(n):
                    entry = dt * A[i, j] * by_qd[v, w]
                    if is_ball[w]:
                        for m in range(n):
                            entry += by_q[v, m] * turn[i, j, m, w]
                    else:
                        entry += dt * dt * twice[i, j] * by_q[v, w]
                    matrix[i * n + v, j * n + w] = (1.0 if i == j and v == w else 0.0) - entry
    solve(matrix, right)
    for i in range(count):
        copy(right[i * n : (i + 1) * n], change[i])


@compiled
def finish(tree, A, b, q, qd, dt, a, new_q, new_qd):
    """The state one dt later, from the accelerations of the stages."""
    count, n = a.shape
    places, speeds, rates = np.empty((count, len(q))), np.empty((count, n)), np.empty(len(q))
    stage_states(tree, A, q, qd, dt, a, places, speeds)
    copy(q, new_q)
    copy(qd, new_qd)
    for i in range(count):
        for v in range(n):
            new_qd[v] += dt * b[i] * a[i, v]
        for joint in tree.joints:
            k, v = joint.at, joint.by
            if joint.kind != BALL:
                new_q[k] += dt * b[i] * speeds[i, v]
                continue
            put_product(places[i], 0.0, speeds[i, v], speeds[i, v + 1], speeds[i, v + 2], rates, k)
            for j in range(k, k + 4):
                new_q[j] += dt * b[i] * 0.5 * rates[j]
    for joint in tree.joints:
        if joint.kind == BALL:
            normalize(new_q, joint.at)


@part
def larger(size, value):
    """The size, or that of the value; NaN if one of them is."""
    return size if size >= abs(value) or math.isnan(size) else abs(value)


@compiled
def run_implicit(tree, A, b, q, qd, tau, dt, ended, every):
    """Fill q and qd (runs, records, nq or nv) by an implicit Runge-Kutta method; evaluations of the dynamics."""
    check(tree, q, qd, tau, ended, every)
    evaluations, n, count = 0, len(tree.before), len(b)
    a, change = np.empty((count, n)), np.empty((count, n))
    by_q, by_qd, state, speeds = np.empty((n, n)), np.empty((n, n)), np.empty(tree.nq), np.empty(n)
    for i in range(q.shape[0]):
        copy(q[i, 0], state)
        copy(qd[i, 0], speeds)
        for k in range(1, (q.shape[1] - 1) * every + 1):
            a[:] = 0.0
            why = NEWTON
            for iteration in range(1 + ITERATIONS):
                newton(tree, A, state, speeds, tau[i], dt, a, iteration == 0, by_q, by_qd, change)
                evaluations += count if iteration else 1
                size = most = 0.0
                for s in range(count):
                    for v in range(n):
                        a[s, v] += change[s, v]
                        size, most = larger(size, a[s, v]), larger(most, change[s, v])
                if iteration == 0:
                    continue
                if most <= CLOSE * (1.0 + size):
                    why = 0
                    break
                if not math.isfinite(size):
                    break
            if why == 0:
                finish(tree, A, b, state, speeds, dt, a, state, speeds)
                why = unsound(tree, state, speeds)
            if not kept(q, qd, i, k, every, state, speeds, why, ended):
                break
    return evaluations
