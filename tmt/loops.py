"""The compiled loops of generic.py. `tree` is a generic.Arrays; vectors are rows of arrays."""

import math

import numpy as np

from .machine_code import compiled
from .templates import OVERFLOW


@compiled
def mass_matrix_and_bias(tree, q, qd, M, h):
    """Mbar (n, n) and h (n,) of one state; of Mbar the entries between a hinge and its ancestors, below the diagonal."""
    n = len(tree.parent)
    matrices, vectors, scratch = np.empty((2, n, 3, 3)), np.zeros((5, n, 3)), np.empty((7, 3))
    R, P = matrices[0], matrices[1]
    a, omega, omegad, forces, moments = vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]
    spin, force, torque, carried, product = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4:]
    for i in range(n):
        x, y, z = tree.axis[i]
        s, c = math.sin(q[i]), math.cos(q[i])
        R[i, 0, 0], R[i, 0, 1], R[i, 0, 2] = x * x + c * (1 - x * x), (1 - c) * x * y - s * z, (1 - c) * x * z + s * y
        R[i, 1, 0], R[i, 1, 1], R[i, 1, 2] = (1 - c) * x * y + s * z, y * y + c * (1 - y * y), (1 - c) * y * z - s * x
        R[i, 2, 0], R[i, 2, 1], R[i, 2, 2] = (1 - c) * x * z - s * y, (1 - c) * y * z + s * x, z * z + c * (1 - z * z)
        p = tree.parent[i]
        for k in range(3):
            spin[k] = tree.axis[i, k] * qd[i]
        for j in range(3):
            moved = -tree.gravity[j]
            if p >= 0:
                moved = a[p, j]
                for k in range(3):
                    moved += P[p, j, k] * tree.offset[i, k]
            for k in range(3):
                a[i, k] += R[i, j, k] * moved
                if p >= 0:
                    omega[i, k] += R[i, j, k] * omega[p, j]
                    omegad[i, k] += R[i, j, k] * omegad[p, j]
        add_cross(omegad[i], omega[i], spin)
        for k in range(3):
            omega[i, k] += spin[k]
        u, v, w = omega[i]
        P[i, 0, 0], P[i, 0, 1], P[i, 0, 2] = -(v * v + w * w), u * v - omegad[i, 2], u * w + omegad[i, 1]
        P[i, 1, 0], P[i, 1, 1], P[i, 1, 2] = u * v + omegad[i, 2], -(u * u + w * w), v * w - omegad[i, 0]
        P[i, 2, 0], P[i, 2, 1], P[i, 2, 2] = u * w - omegad[i, 1], v * w + omegad[i, 0], -(u * u + v * v)

    mass, moment, second = tree.mass.copy(), tree.moment.copy(), tree.second.copy()
    for i in range(n - 1, -1, -1):
        for j in range(3):
            forces[i, j] += tree.mass[i] * a[i, j]
            for k in range(3):
                forces[i, j] += P[i, j, k] * tree.moment[i, k]
                product[j, k] = 0.0
                for m in range(3):
                    product[j, k] += P[i, j, m] * tree.second[i, m, k]
        moments[i, 0] += product[2, 1] - product[1, 2]
        moments[i, 1] += product[0, 2] - product[2, 0]
        moments[i, 2] += product[1, 0] - product[0, 1]
        add_cross(moments[i], tree.moment[i], a[i])
        trace = second[i, 0, 0] + second[i, 1, 1] + second[i, 2, 2]
        h[i] = M[i, i] = 0.0
        for j in range(3):
            h[i] += tree.axis[i, j] * moments[i, j]
            force[j], torque[j] = 0.0, trace * tree.axis[i, j]
            for k in range(3):
                torque[j] -= second[i, j, k] * tree.axis[i, k]
            M[i, i] += tree.axis[i, j] * torque[j]
        add_cross(force, tree.axis[i], moment[i])
        j = i
        while tree.parent[j] >= 0:
            hand_down(R[j], tree.offset[j], force, torque)
            j = tree.parent[j]
            M[i, j] = tree.axis[j, 0] * torque[0] + tree.axis[j, 1] * torque[1] + tree.axis[j, 2] * torque[2]
        p = tree.parent[i]
        if p >= 0:
            hand_down(R[i], tree.offset[i], forces[i], moments[i])
            for j in range(3):
                forces[p, j] += forces[i, j]
                moments[p, j] += moments[i, j]
                carried[j] = 0.0
                for k in range(3):
                    carried[j] += R[i, j, k] * moment[i, k]
                    product[j, k] = 0.0
                    for m in range(3):
                        product[j, k] += R[i, j, m] * second[i, m, k]
            r = tree.offset[i]
            mass[p] += mass[i]
            for j in range(3):
                moment[p, j] += carried[j] + mass[i] * r[j]
                for k in range(3):
                    second[p, j, k] += r[j] * carried[k] + (carried[j] + mass[i] * r[j]) * r[k]
                    for m in range(3):
                        second[p, j, k] += product[j, m] * R[i, k, m]


@compiled
def add_cross(to, a, b):
    """to += a x b."""
    to[0] += a[1] * b[2] - a[2] * b[1]
    to[1] += a[2] * b[0] - a[0] * b[2]
    to[2] += a[0] * b[1] - a[1] * b[0]


@compiled
def hand_down(R, offset, force, moment):
    """Force and moment about the origin of the parent's frame, in its axes, in place."""
    for vector in (force, moment):
        x, y, z = vector
        for j in range(3):
            vector[j] = R[j, 0] * x + R[j, 1] * y + R[j, 2] * z
    add_cross(moment, offset, force)


@compiled
def forward_dynamics(tree, q, qd, tau, qdd):
    """qdd (n,) of one state, from Mbar qdd = tau - D qd - h, factorised from the tips inward along the ancestors."""
    n = len(q)
    M, h = np.empty((n, n)), np.empty(n)
    mass_matrix_and_bias(tree, q, qd, M, h)
    for i in range(n):
        qdd[i] = tau[i] - tree.damping[i] * qd[i] - h[i]
    for k in range(n - 1, -1, -1):
        i = tree.parent[k]
        while i >= 0:
            factor = M[k, i] / M[k, k]
            j = i
            while j >= 0:
                M[i, j] -= factor * M[k, j]
                j = tree.parent[j]
            qdd[i] -= factor * qdd[k]
            i = tree.parent[i]
    for k in range(n):
        i = tree.parent[k]
        while i >= 0:
            qdd[k] -= M[k, i] * qdd[i]
            i = tree.parent[i]
        qdd[k] /= M[k, k]


@compiled
def run_tableau(tree, A, b, q, qd, tau, dt, ended):
    """Fill q and qd (batch, steps + 1, n) by an explicit Runge-Kutta method, while finite; evaluations of the dynamics."""
    n = len(tree.parent)
    if not (q.shape == qd.shape == (len(tau), q.shape[1], n) and tau.shape[1] == n and len(ended) in (0, len(q))):
        raise ValueError("q and qd of shape (runs, steps + 1, n) and tau of shape (runs, n) are expected")
    evaluations = 0
    stages = len(b)
    rates, changes = np.empty((stages, n)), np.empty((stages, n))
    angles = np.empty(n)
    for i in range(q.shape[0]):
        for k in range(1, q.shape[1]):
            for s in range(stages):
                for j in range(n):
                    angles[j], rates[s, j] = q[i, k - 1, j], qd[i, k - 1, j]
                    for r in range(s):
                        angles[j] += dt * A[s, r] * rates[r, j]
                        rates[s, j] += dt * A[s, r] * changes[r, j]
                forward_dynamics(tree, angles, rates[s], tau[i], changes[s])
            evaluations += stages
            size = 0.0
            for j in range(n):
                q[i, k, j], qd[i, k, j] = q[i, k - 1, j], qd[i, k - 1, j]
                for s in range(stages):
                    q[i, k, j] += dt * b[s] * rates[s, j]
                    qd[i, k, j] += dt * b[s] * changes[s, j]
                size += abs(q[i, k, j]) + abs(qd[i, k, j])
            if not size < np.inf:
                q[i, k], qd[i, k] = np.nan, np.nan
                if len(ended):
                    ended[i] = OVERFLOW
                break
    return evaluations


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
