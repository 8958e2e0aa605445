"""States of any tree in compiled loops: how positions move, and whether a run can go on; coordinates.py over arrays."""

import math

import numpy as np

from .loops import BALL, HINGE, TINY
from .machine_code import compiled
from .sine import LIMIT
from .templates import OVERFLOW, TURNED


@compiled
def move(tree, q, u, moved):
    """The position after a movement u (nv,) from q, as coordinates.py says it."""
    for i in range(len(tree.parent)):
        k, v = tree.at[i], tree.by[i]
        if tree.kind[i] != BALL:
            moved[k] = q[k] + u[v]
            continue
        half = np.sqrt(u[v] * u[v] + u[v + 1] * u[v + 1] + u[v + 2] * u[v + 2] + TINY) * 0.5
        share, b = np.sin(half) / half * 0.5, np.cos(half)
        turned(q, k, b, u[v] * share, u[v + 1] * share, u[v + 2] * share, moved)
        normalize(moved, k)


@compiled
def turned(q, k, b, x, y, z, result):
    """The quaternion at k of q times (b, x, y, z), to the same place of result."""
    a, u, v, w = q[k], q[k + 1], q[k + 2], q[k + 3]
    result[k], result[k + 1] = a * b - u * x - v * y - w * z, a * x + u * b + v * z - w * y
    result[k + 2], result[k + 3] = a * y + v * b + w * x - u * z, a * z + w * b + u * y - v * x


@compiled
def normalize(q, k):
    """The quaternion at k at length 1."""
    length = np.sqrt(q[k] * q[k] + q[k + 1] * q[k + 1] + q[k + 2] * q[k + 2] + q[k + 3] * q[k + 3])
    for j in range(k, k + 4):
        q[j] /= length


@compiled
def movement_rates(tree, u, qd, rates):
    """du/dt (nv,) at speeds qd after a movement u: of balls dexp^-1(u) omega."""
    cross, twice = np.empty(3), np.empty(3)
    for i in range(len(tree.parent)):
        v = tree.by[i]
        if tree.kind[i] != BALL:
            rates[v] = qd[v]
            continue
        x, y, z = u[v], u[v + 1], u[v + 2]
        half = math.sqrt(x * x + y * y + z * z + TINY) * 0.5
        share = (1.0 - half * math.cos(half) / math.sin(half)) / (half * half) * 0.25
        cross[0], cross[1], cross[2] = (
            y * qd[v + 2] - z * qd[v + 1],
            z * qd[v] - x * qd[v + 2],
            x * qd[v + 1] - y * qd[v],
        )
        twice[0], twice[1], twice[2] = (
            y * cross[2] - z * cross[1],
            z * cross[0] - x * cross[2],
            x * cross[1] - y * cross[0],
        )
        for j in range(3):
            rates[v + j] = qd[v + j] + 0.5 * cross[j] + share * twice[j]


@compiled
def unsound(tree, q, qd) -> int:
    """Why a state cannot be gone on from, 0: it can."""
    angles = total = 0.0
    for i in range(len(tree.parent)):
        if tree.kind[i] == HINGE:
            angles += abs(q[tree.at[i]])
    for value in q:
        total += value
    for value in qd:
        total += value
    if not math.isfinite(total):
        return OVERFLOW
    return 0 if angles < LIMIT else TURNED


@compiled
def check(tree, q, qd, tau, ended):
    if not (
        q.shape == (len(tau), q.shape[1], tree.at[-1])
        and qd.shape == (len(tau), q.shape[1], tree.by[-1])
        and tau.shape[1] == tree.by[-1]
        and len(ended) in (0, len(q))
    ):
        raise ValueError("q of shape (runs, steps + 1, nq), qd (runs, steps + 1, nv) and tau (runs, nv) are expected")


@compiled
def end(q, qd, k, ended, i, why):
    """Nothing is known of run i from state k on."""
    q[i, k:], qd[i, k:] = np.nan, np.nan
    if len(ended):
        ended[i] = why
