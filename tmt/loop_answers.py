"""What the public functions ask of the loops: a quantity of one state, or of many, eight side by side; whether it was answered.

It is not where sizes are wrong, numbers not finite or quaternions not of length 1, or where a result is beyond the largest
double: then the literal form answers, or says what is wrong. `joints` and more: the parts of a loop_trees.Arrays; `outer`: the
joints of one about the world's origin.
"""

import numpy as np

from tmt.eight import WIDTH
from tmt.inlined import get, put
from tmt.loop_trees import Arrays
from tmt.model.lock import CLOSE_TO_ONE

from tmt.loop_bodies import (  # isort: skip
    ANGULAR_VELOCITIES, CONVECTIVE_TERMS, ENERGY, JACOBIANS, POSITIONS, POTENTIAL_ENERGY, SPRING_TORQUE, of_bodies,
)  # fmt: skip
from tmt.loop_bodies import workspace as workspace_of_bodies
from tmt.loop_joints import BALL
from tmt.loops import forward_dynamics, mass_matrix_and_bias, workspace
from tmt.machine_code import compiled, part

ACCELERATION, MASS_MATRIX, BIAS = 7, 8, 9  # beside those of loop_bodies.py
QUANTITIES = {  # the public functions
    "com_positions": POSITIONS, "angular_velocities": ANGULAR_VELOCITIES, "jacobians": JACOBIANS,
    "convective_terms": CONVECTIVE_TERMS, "potential_energy": POTENTIAL_ENERGY, "energy": ENERGY,
    "spring_torque": SPRING_TORQUE, "acceleration": ACCELERATION, "mass_matrix": MASS_MATRIX, "bias": BIAS,
    "gravity_balance": BIAS,
}  # fmt: skip
SHORTEST, LONGEST = (1.0 - CLOSE_TO_ONE) ** 2, (1.0 + CLOSE_TO_ONE) ** 2


@compiled
def one(joints, outer, bodies, before, world, gains, q, qd, tau, quantity, out):
    """The quantity of q (nq,), qd and tau (nv,), flat, to out. Arrays one by one: a tuple of them is slower to take."""
    tree, nv = with_world(joints, before, world, gains), len(before)
    if not (len(q) == tree.nq and len(qd) == len(tau) == nv):
        return False
    places = with_world(outer, before, world, gains)
    evaluate(tree, places, bodies, quantity, q, qd, tau, np.empty(numbers(tree)), np.zeros(nv * nv), out)
    return of_length_1(joints, q.reshape(1, -1)) and finite(q) and finite(qd) and finite(tau) and finite(out)


@compiled
def many(joints, outer, bodies, before, world, gains, q, qd, tau, quantity, out):
    """The same of rows of q (N, nq), qd and tau (N, nv), to rows of out; of qd and tau one row may stand for all."""
    tree, nv, full = with_world(joints, before, world, gains), len(before), len(q) // WIDTH * WIDTH
    places = with_world(outer, before, world, gains)
    w, M, results = np.empty((numbers(tree), WIDTH)), np.zeros((nv * nv, WIDTH)), np.empty((out.shape[1], WIDTH))
    states = np.empty((tree.nq, WIDTH)), np.empty((nv, WIDTH)), np.empty((nv, WIDTH))
    for first in range(0, full, WIDTH):
        taken(q, first, states[0])
        taken(qd, first, states[1])
        taken(tau, first, states[2])
        evaluate(tree, places, bodies, quantity, *states, w, M, results)
        given(results, out, first)
    w, M = np.empty(numbers(tree)), np.zeros(nv * nv)
    for i in range(full, len(q)):
        rates, torque = qd[i if len(qd) > 1 else 0], tau[i if len(tau) > 1 else 0]
        evaluate(tree, places, bodies, quantity, q[i], rates, torque, w, M, out[i])
    return right(joints, q, qd, tau, out)


@part
def taken(rows, first, states):
    """Eight rows, or one for all, to the columns of states."""
    for k in range(len(states)):
        for l in range(WIDTH):
            states[k, l] = rows[first + l if len(rows) > 1 else 0, k]


@part
def given(results, rows, first):
    """The columns of results to eight rows."""
    for l in range(WIDTH):
        for k in range(len(results)):
            rows[first + l, k] = results[k, l]


@compiled
def right(joints, q, qd, tau, out):
    """Whether rows of states are states, and results finite."""
    return (
        of_length_1(joints, q)
        and finite(q.ravel())
        and finite(qd.ravel())
        and finite(tau.ravel())
        and finite(out.ravel())
    )


@part
def with_world(joints, before, world, gains) -> Arrays:
    g = world[0].gravity
    return Arrays(joints, before, (g[0], g[1], g[2]), world[0].nq, gains[0], gains[1])


@part
def evaluate(tree, places, bodies, quantity, q, qd, tau, w, M, out):
    """The quantity of one state, or of eight; M: zeros where nothing is put."""
    n = len(tree.before)
    if quantity == ACCELERATION:
        forward_dynamics(tree, q, qd, tau, w, out)
    elif quantity == BIAS:
        mass_matrix_and_bias(tree, q, qd, w, M, out)
    elif quantity == MASS_MATRIX:
        mass_matrix_and_bias(tree, q, qd, w, M, out[:n])
        for i in range(n * n):
            put(out, i, get(M, max(i // n, i % n) * n + min(i // n, i % n)))
    else:
        of_bodies(places, bodies, quantity, q, qd, w, out)


@part
def numbers(tree) -> int:
    """How many numbers a workspace for any quantity has."""
    return max(workspace(tree), workspace_of_bodies(tree))


@part
def finite(values) -> bool:
    """Whether all of them are; counted, and by unsigned places, so that the compiler does that for several side by side."""
    others = 0
    for k in range(np.uint64(values.size)):
        others += not abs(values[k]) < np.inf
    return others == 0


@part
def of_length_1(joints, q) -> bool:
    """Whether the quaternions in rows of positions are of length 1."""
    for i in range(len(joints)):
        if joints[i].kind == BALL:
            k = joints[i].at
            for p in q[:, k : k + 4]:
                if not SHORTEST <= p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] <= LONGEST:
                    return False
    return True


@compiled
def to_columns(q, qd, tau, first, columns_q, columns_qd, columns_tau):
    """As many rows of each as there are columns, from `first` on; of qd and tau one may stand for all."""
    for rows, columns in ((q, columns_q), (qd, columns_qd), (tau, columns_tau)):
        for k in range(len(columns)):
            for i in range(columns.shape[1]):
                columns[k, i] = rows[first + i if len(rows) > 1 else 0, k]


@compiled
def to_rows(columns, quantity, out, first):
    """Columns of accelerations, or of the upper triangle of Mbar and of h, to rows of results from `first` on."""
    n = out.shape[1]
    if quantity == MASS_MATRIX:
        n, k = int(np.sqrt(n)), 0
        for i in range(n):
            for j in range(i, n):
                for l in range(columns.shape[1]):
                    out[first + l, i * n + j] = out[first + l, j * n + i] = columns[k, l]
                k += 1
        return
    for k in range(n):
        for l in range(columns.shape[1]):
            out[first + l, k] = columns[len(columns) - n + k, l]
