"""The composite form as compiled loops over any tree, see generic.py. `tree` is a generic.Arrays; vectors are rows of arrays.

Positions and speeds may be complex: an imaginary part of 1e-100 carries an exact derivative along (see slope_and_jacobian).
"""

import numpy as np

from .machine_code import compiled

HINGE, SLIDE, BALL = 0, 1, 2
TINY = 1e-300  # as in coordinates.py


@compiled
def rotate(tree, i, q, R):
    """The turn of joint i's frame in its parent's, from q (nq,)."""
    k, v = tree.at[i], tree.by[i]
    if tree.kind[i] == BALL:
        w, x, y, z = q[k], q[k + 1], q[k + 2], q[k + 3]
        scale = 2.0 / (w * w + x * x + y * y + z * z)
        own = np.empty((3, 3), q.dtype)
        own[0, 0], own[0, 1], own[0, 2] = 1 - scale * (y * y + z * z), scale * (x * y - w * z), scale * (x * z + w * y)
        own[1, 0], own[1, 1], own[1, 2] = scale * (x * y + w * z), 1 - scale * (x * x + z * z), scale * (y * z - w * x)
        own[2, 0], own[2, 1], own[2, 2] = scale * (x * z - w * y), scale * (y * z + w * x), 1 - scale * (x * x + y * y)
        for j in range(3):
            for l in range(3):
                R[j, l] = 0.0
                for a in range(3):
                    for b in range(3):
                        R[j, l] += tree.axis[v + a, j] * own[a, b] * tree.axis[v + b, l]
        return
    angle = q[k] - tree.reference[i] if tree.kind[i] == HINGE else 0.0 * q[k]
    x, y, z = tree.axis[v]
    s, c = np.sin(angle), np.cos(angle)
    R[0, 0], R[0, 1], R[0, 2] = x * x + c * (1 - x * x), (1 - c) * x * y - s * z, (1 - c) * x * z + s * y
    R[1, 0], R[1, 1], R[1, 2] = (1 - c) * x * y + s * z, y * y + c * (1 - y * y), (1 - c) * y * z - s * x
    R[2, 0], R[2, 1], R[2, 2] = (1 - c) * x * z - s * y, (1 - c) * y * z + s * x, z * z + c * (1 - z * z)


@compiled
def mass_matrix_and_bias(tree, q, qd, M, h):
    """Mbar (nv, nv) and h (nv,) of one state; of Mbar the entries between a speed and those inward of it, below the diagonal."""
    n = len(tree.parent)
    matrices, vectors, scratch = (
        np.empty((2, n, 3, 3), q.dtype),
        np.zeros((6, n, 3), q.dtype),
        np.empty((7, 3), q.dtype),
    )
    R, P = matrices[0], matrices[1]
    a, omega, omegad, forces, moments, at = vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5]
    spin, force, torque, carried, product = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4:]
    for i in range(n):
        rotate(tree, i, q, R[i])
        p, v, slides = tree.parent[i], tree.by[i], tree.kind[i] == SLIDE
        off = q[tree.at[i]] - tree.reference[i] if slides else 0.0 * q[tree.at[i]]
        for k in range(3):
            at[i, k] = tree.offset[i, k] + tree.axis[v, k] * off
            spin[k] = tree.axis[v, k] * qd[v]
            if tree.kind[i] == BALL:
                spin[k] += tree.axis[v + 1, k] * qd[v + 1] + tree.axis[v + 2, k] * qd[v + 2]
        for j in range(3):
            moved = -tree.gravity[j] + 0.0 * spin[0]
            if p >= 0:
                moved = a[p, j]
                for k in range(3):
                    moved += P[p, j, k] * at[i, k]
            for k in range(3):
                a[i, k] += R[i, j, k] * moved
                if p >= 0:
                    omega[i, k] += R[i, j, k] * omega[p, j]
                    omegad[i, k] += R[i, j, k] * omegad[p, j]
        if slides:
            for k in range(3):
                spin[k] *= 2.0
            add_cross(a[i], omega[i], spin)
        else:
            add_cross(omegad[i], omega[i], spin)
            for k in range(3):
                omega[i, k] += spin[k]
        u, v, w = omega[i]
        P[i, 0, 0], P[i, 0, 1], P[i, 0, 2] = -(v * v + w * w), u * v - omegad[i, 2], u * w + omegad[i, 1]
        P[i, 1, 0], P[i, 1, 1], P[i, 1, 2] = u * v + omegad[i, 2], -(u * u + w * w), v * w - omegad[i, 0]
        P[i, 2, 0], P[i, 2, 1], P[i, 2, 2] = u * w - omegad[i, 1], v * w + omegad[i, 0], -(u * u + v * v)

    mass, moment, second = tree.mass.copy(), tree.moment + 0.0 * a, tree.second + 0.0 * R
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
        slides = tree.kind[i] == SLIDE
        for v in range(tree.by[i], tree.by[i + 1]):
            h[v] = 0.0
            for j in range(3):
                h[v] += tree.axis[v, j] * (forces[i, j] if slides else moments[i, j])
                force[j] = mass[i] * tree.axis[v, j] if slides else 0.0
                torque[j] = 0.0 if slides else trace * tree.axis[v, j]
                for k in range(3):
                    torque[j] -= 0.0 if slides else second[i, j, k] * tree.axis[v, k]
            if slides:
                add_cross(torque, moment[i], tree.axis[v])
            else:
                add_cross(force, tree.axis[v], moment[i])
            for w in range(tree.by[i], v + 1):
                M[v, w] = along(tree, w, i, force, torque)
            M[v, v] += tree.armature[v]
            j = i
            while tree.parent[j] >= 0:
                hand_down(R[j], at[j], force, torque)
                j = tree.parent[j]
                for w in range(tree.by[j], tree.by[j + 1]):
                    M[v, w] = along(tree, w, j, force, torque)
        p = tree.parent[i]
        if p >= 0:
            hand_down(R[i], at[i], forces[i], moments[i])
            for j in range(3):
                forces[p, j] += forces[i, j]
                moments[p, j] += moments[i, j]
                carried[j] = 0.0
                for k in range(3):
                    carried[j] += R[i, j, k] * moment[i, k]
                    product[j, k] = 0.0
                    for m in range(3):
                        product[j, k] += R[i, j, m] * second[i, m, k]
            r = at[i]
            mass[p] += mass[i]
            for j in range(3):
                moment[p, j] += carried[j] + mass[i] * r[j]
                for k in range(3):
                    second[p, j, k] += r[j] * carried[k] + (carried[j] + mass[i] * r[j]) * r[k]
                    for m in range(3):
                        second[p, j, k] += product[j, m] * R[i, k, m]


@compiled
def along(tree, v, i, force, torque):
    """What force and torque do along speed v of joint i."""
    chosen = force if tree.kind[i] == SLIDE else torque
    return tree.axis[v, 0] * chosen[0] + tree.axis[v, 1] * chosen[1] + tree.axis[v, 2] * chosen[2]


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
def take_springs(tree, q, force):
    """force (nv,) less k (q - rest)."""
    for i in range(len(tree.parent)):
        stiffness, k, v = tree.stiffness[i], tree.at[i], tree.by[i]
        if stiffness == 0.0:
            continue
        if tree.kind[i] != BALL:
            force[v] -= stiffness * (q[k] - tree.rest[k])
            continue
        a, x, y, z = tree.rest[k], -tree.rest[k + 1], -tree.rest[k + 2], -tree.rest[k + 3]
        b, u, s, t = q[k], q[k + 1], q[k + 2], q[k + 3]
        w, x, y, z = (
            a * b - x * u - y * s - z * t,
            a * u + x * b + y * t - z * s,
            a * s + y * b + z * u - x * t,
            a * t + z * b + x * s - y * u,
        )
        size, length = np.sqrt(w * w + TINY), np.sqrt(x * x + y * y + z * z + TINY)
        share = stiffness * np.arctan(length / (1.0 + size)) * 4.0 / length * (w / size)
        force[v] -= x * share
        force[v + 1] -= y * share
        force[v + 2] -= z * share


@compiled
def take_fed_back(tree, q, qd, force):
    """force (nv,) less P q + S qd, the torque of a linear controller."""
    for i in range(len(tree.parent) if len(tree.position_gain) else 0):
        if tree.kind[i] != BALL:
            for v in range(len(force)):
                force[v] -= tree.position_gain[v, tree.by[i]] * q[tree.at[i]]
    for w in range(len(tree.speed_gain)):
        for v in range(len(force)):
            force[v] -= tree.speed_gain[v, w] * qd[w]


@compiled
def reduced_force(tree, h, q, qd, tau, force):
    """Qbar = tau - D qd - k (q - rest) - P q - S qd - h, (nv,)."""
    for v in range(len(force)):
        force[v] = tau[v] - tree.damping[v] * qd[v] - h[v]
    take_springs(tree, q, force)
    take_fed_back(tree, q, qd, force)


@compiled
def forward_dynamics(tree, q, qd, tau, qdd):
    """qdd (nv,) of one state, from Mbar qdd = Qbar, factorised from the tips inward along the ancestors."""
    n = len(qd)
    M, h = np.empty((n, n), q.dtype), np.empty(n, q.dtype)
    mass_matrix_and_bias(tree, q, qd, M, h)
    reduced_force(tree, h, q, qd, tau, qdd)
    for k in range(n - 1, -1, -1):
        i = tree.before[k]
        while i >= 0:
            factor = M[k, i] / M[k, k]
            j = i
            while j >= 0:
                M[i, j] -= factor * M[k, j]
                j = tree.before[j]
            qdd[i] -= factor * qdd[k]
            i = tree.before[i]
    for k in range(n):
        i = tree.before[k]
        while i >= 0:
            qdd[k] -= M[k, i] * qdd[i]
            i = tree.before[i]
        qdd[k] /= M[k, k]
