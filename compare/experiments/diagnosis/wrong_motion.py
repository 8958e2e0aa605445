"""Faults that neither M nor h has: forces in the accelerations, and steps of an integrator, made by formulas of their own."""

import dataclasses
import time
from collections.abc import Iterator

import numpy as np

import tmt

from ...diagnosis.forces import causes_of_forces
from ...diagnosis.steps import Steps, diagnose_steps
from ...diagnosis.words import Cause
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from .faults import Fault
from .made_values import by_composite

DT = 0.01  # s
MOST_TORQUE = 5.0  # N m


def wrong_motions(robot: str, tree: tmt.Tree) -> Iterator[Fault]:
    """Forces and steps that are wrong."""
    names = tree.hinge_names

    def fault(name, kind, expected, values, *make) -> Fault:
        return Fault(robot, tree, name, kind, "list", None, (expected,), tuple(values), make)

    yield fault("sign of the torque", "force", "torque in the acceleration", [], "force", "tau", -2.0)
    yield fault("torque left out", "force", "torque in the acceleration", [], "force", "tau", -1.0)
    yield fault("sign of the bias in the acceleration", "force", "bias in the acceleration", [], "force", "h", 2.0)
    for v, name in enumerate(names):
        damping, stiffness = tree.damping[v], tree.stiffness[v]
        yield fault(f"more damping of {name}", "force", f"damping of {name}", [damping + 0.2], "force", "qd", -0.2, v)
        yield fault(f"spring at {name}", "force", f"stiffness of {name}", [stiffness + 3.0], "force", "q", -3.0, v)
        yield fault(f"friction of {name}", "force", f"friction of {name}", [0.4], "force", "sign", -0.4, v)
    if any(tree.damping):
        yield fault("damping left out", "force", "damping in the acceleration", [], "force", "D", 1.0)
    damped = tree if any(tree.damping) else dataclasses.replace(tree, damping=(0.5,) * len(names))
    for said in ("rk4", "semi_implicit_euler", "implicit", "explicit_euler"):
        for real in ("rk4", "semi_implicit_euler", "implicit", "explicit_euler"):
            if real != said:
                made = fault(f"{real} in place of {said}", "step", "scheme", [], "step", said, real, DT)
                yield made._replace(tree=damped)
        made = fault(f"{said} with dt 0.02 s", "step", "dt", [2.0 * DT], "step", said, said, 2.0 * DT)
        yield made._replace(tree=damped)
    of_bias, of_damping = "derivative of the bias in the implicit step", "damping in the implicit step"
    for name, place, said, real in (
        ("derivative of the bias with the wrong sign", of_bias, "implicit", ("implicit", 1.0, -1.0)),
        ("derivative of the bias halved", of_bias, "implicit", ("implicit", 1.0, 0.5)),
        ("damping explicit in Euler", of_damping, "semi_implicit_euler", ("semi_implicit_euler", 0.0, 0.0)),
        ("damping explicit in implicit", of_damping, "implicit", ("implicit", 0.0, 1.0)),
        ("damping with the wrong sign", of_damping, "semi_implicit_euler", ("semi_implicit_euler", -1.0, 0.0)),
    ):
        made = fault(name, "step", place, [], "step", said, real, DT)
        yield made._replace(tree=damped)


def row_of_motion(fault: Fault, q: np.ndarray, qd: np.ndarray) -> tuple[bool, list[Cause], float]:
    """Whether a fault is visible, what explains it, and the seconds that the search took."""
    tau = np.random.default_rng(5).uniform(-MOST_TORQUE, MOST_TORQUE, qd.shape)
    started = time.perf_counter()
    if fault.make[0] == "step":
        _, said, real, dt = fault.make
        after_q, after_qd = step_by_hand(fault.tree, q, qd, tau, real, dt)
        off, causes = diagnose_steps(fault.tree, Steps(q, qd, tau, DT, after_q, after_qd), said)
        return off > 1.0, list(causes), time.perf_counter() - started
    acting, h = force_by_hand(fault, q, qd, tau)
    scale = Entries(fault.tree, q, qd)
    allowed = FACTOR * EPS * scale.force(tau)
    return (
        bool((np.abs(acting) > allowed).any()),
        causes_of_forces(fault.tree, q, qd, tau, h, acting, allowed),
        (time.perf_counter() - started),
    )


def force_by_hand(fault: Fault, q, qd, tau) -> tuple[np.ndarray, np.ndarray]:
    """What is left over, tau - D qd - h - M qdd, of accelerations with one more force; and h."""
    _, what, factor, *where = fault.make
    tree = fault.tree
    M, h = by_composite(tree, q, qd)
    forces = {
        "tau": tau,
        "h": h,
        "qd": qd,
        "q": q - np.array(tree.reference),
        "sign": np.sign(qd),
        "D": tree.damping * qd,
    }
    more = factor * forces[what]
    if where:
        more = more * np.eye(qd.shape[1])[where[0]]
    right = tau - np.array(tree.damping) * qd - h
    qdd = np.linalg.solve(M, (right + more)[..., None])[..., 0]
    return right - np.einsum("sij,sj->si", M, qdd), h


def step_by_hand(tree: tmt.Tree, q, qd, tau, real: str | tuple, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """One step of each state by a formula that is written out. real: a scheme, or it with factors of dt D and dt dh/dqd."""
    name, of_damping, of_bias = (real, 1.0, 1.0) if isinstance(real, str) else real
    D = np.array(tree.damping)

    def acceleration(q, qd):
        M, h = by_composite(tree, q, qd)
        return np.linalg.solve(M, (tau - D * qd - h)[..., None])[..., 0]

    if name == "rk4":
        a = acceleration(q, qd)
        v2 = qd + dt / 2.0 * a
        b = acceleration(q + dt / 2.0 * qd, v2)
        v3 = qd + dt / 2.0 * b
        c = acceleration(q + dt / 2.0 * v2, v3)
        v4 = qd + dt * c
        d = acceleration(q + dt * v3, v4)
        return q + dt / 6.0 * (qd + 2.0 * v2 + 2.0 * v3 + v4), qd + dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    if name == "explicit_euler":
        return q + dt * qd, qd + dt * acceleration(q, qd)
    M, h = by_composite(tree, q, qd)
    matrix = M + of_damping * dt * np.diag(D)
    if name == "implicit":  # h is quadratic in the rates: these differences are exact
        for j, unit in enumerate(np.eye(qd.shape[1])):
            ahead, behind = (by_composite(tree, q, qd + sign * unit)[1] for sign in (1.0, -1.0))
            matrix[:, :, j] += of_bias * dt * (ahead - behind) / 2.0
    after = qd + dt * np.linalg.solve(matrix, (tau - D * qd - h)[..., None])[..., 0]
    return q + dt * after, after
