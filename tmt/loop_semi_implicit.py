"""The semi-implicit Euler methods as a compiled loop over any tree: what methods.py says, over arrays.

What is implicit at each joint alone counts as armature: then the step costs what an explicit one does. Derivatives are taken
along an imaginary part of 1e-100, which is exact but for rounding.
"""

import numpy as np

from tmt.inlined import inlined
from tmt.loop_joints import LEFT, ROW, SPEED
from tmt.loop_states import check, copy, kept, move, unsound
from tmt.loop_trees import Arrays
from tmt.loops import forward_dynamics, mass_matrix_and_bias, put_forces, workspace
from tmt.machine_code import compiled

NUDGE = 1e-100


@compiled
def run_semi_implicit(tree, own, springs, position_gain, speed_gain, q, qd, tau, dt, ended, every):
    """Fill q and qd (runs, records, nq or nv), while finite; evaluations of the dynamics.

    own (nv,): whose bias is implicit too; springs: whether they are; position_gain, speed_gain: their implicit entries.
    """
    check(tree, q, qd, tau, ended, every)
    evaluations, n = 0, len(tree.before)
    M, h, force, u, w = np.empty(n * n), np.empty(n), np.empty(n), np.empty(n), np.empty(workspace(tree))
    place, speeds = np.empty(tree.nq), np.empty(n)
    held = with_held(tree, springs, position_gain, speed_gain, dt)
    across = own.any()
    for gain in (position_gain, speed_gain):
        for v in range(len(gain)):
            across = across or gain[v, :v].any() or gain[v, v + 1 :].any()
    for i in range(q.shape[0]):
        copy(q[i, 0], place)
        copy(qd[i, 0], speeds)
        for k in range(1, (q.shape[1] - 1) * every + 1):
            if across:
                M[:] = 0.0
                mass_matrix_and_bias(held, place, speeds, w, M, h)
                put_forces(held, place, speeds, tau[i], w)
                matrix = M.reshape(n, n)
                for v in range(n):
                    force[v] = w[len(tree.joints) * ROW + v * SPEED + LEFT] - h[v]
                    for j in range(v):
                        matrix[j, v] = matrix[v, j]
                for v in range(len(speed_gain)):
                    for j in range(n):
                        matrix[v, j] += dt * speed_gain[v, j] * (j != v)
                for v in range(len(position_gain)):
                    for j in range(n):
                        matrix[v, j] += dt * dt * position_gain[v, j] * (j != v)
                        force[v] -= dt * position_gain[v, j] * speeds[j] * (j != v)
                if own.any():
                    add_bias_rates(tree, own, place, speeds, dt, matrix)
                solve(matrix, force)
            else:
                forward_dynamics(held, place, speeds, tau[i], w, force)
            for v in range(n):
                speeds[v] += dt * force[v]
                u[v] = dt * speeds[v]
            move(tree, place, u, place)
            evaluations += 1
            if not kept(q, qd, i, k, every, place, speeds, unsound(tree, place, speeds), ended):
                break
    return evaluations


@compiled
def with_held(tree, springs, position_gain, speed_gain, dt):
    """The tree with what is implicit at its joints on the diagonal of Mbar, and taken off the force at the speeds now.

    That is dt D + dt^2 k, and the gains' own dt S + dt^2 P, as armature, and dt k and dt P as damping.
    """
    joints = tree.joints.copy()
    for i in range(len(joints)):
        joint = joints[i]
        for j in range(joint.count):
            v, stiffness = joint.by + j, joint.stiffness if springs else 0.0
            if len(position_gain):
                stiffness += position_gain[v, v]
            joint.armature[j] += dt * joint.damping[j] + dt * dt * stiffness
            joint.damping[j] += dt * stiffness
            if len(speed_gain):
                joint.armature[j] += dt * speed_gain[v, v]
    return Arrays(joints, tree.before, tree.gravity, tree.nq, tree.position_gain, tree.speed_gain)


@compiled
def add_bias_rates(tree, own, q, qd, dt, matrix):
    """matrix += dt dh/dqd in the rows of `own`."""
    n = len(qd)
    place, speeds, w = q + 0j, qd + 0j, np.empty(workspace(tree), np.complex128)
    M, h = np.empty(n * n, np.complex128), np.empty(n, np.complex128)
    for j in range(n):
        speeds[j] += NUDGE * 1j
        mass_matrix_and_bias(tree, place, speeds, w, M, h)
        speeds[j] = qd[j]
        for v in range(n):
            if own[v]:
                matrix[v, j] += dt * (h[v].imag / NUDGE)


@compiled
def solve(matrix, right):
    """The solution of matrix x = right in place of right, by L U without pivots."""
    n = len(right)
    for k in range(n):
        for i in range(k + 1, n):
            factor = quotient(matrix[i, k], matrix[k, k])
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                right[i] -= factor * right[k]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[i, k] * right[k]
        right[i] = quotient(right[i], matrix[i, i])


@inlined
def quotient(a, b):
    return a / b
