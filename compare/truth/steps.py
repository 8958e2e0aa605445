"""One step of a method in a linear motion: a deviation from a held posture."""

import numpy as np

from tmt.methods import RungeKutta, SemiImplicitEuler, amplification, by_speed
from tmt.methods.implicit import ImplicitRungeKutta


def is_runge_kutta(stepping) -> bool:
    """Whether a method is one of tmt's Runge-Kutta methods, explicit or implicit; a subclass may step otherwise."""
    return type(stepping) in (RungeKutta, ImplicitRungeKutta)


def linear_step(at, stepping, dt: np.ndarray) -> np.ndarray:
    """The matrix of a step for small deviations from a held posture, see linear.Held: (k, 2nv, 2nv) for dt (k,), s."""
    unit, n, each = np.eye(2 * at.nv), at.nv, dt[:, None, None]
    if type(stepping) is SemiImplicitEuler:
        # at rest the bias has no derivative by the speeds: an implicit bias makes no difference
        stiff = np.diag(by_speed(at.tree, at.tree.stiffness)) * stepping.implicit_springs
        damped = np.diag(at.tree.damping)
        if at.tree.has_gains:
            position_gain, speed_gain = stepping.gains_held(at.tree)
            stiff, damped = stiff + (position_gain or 0.0), damped + (speed_gain or 0.0)
        matrix = at.mass_matrix + each * damped + each**2 * stiff
        force = at.mass_matrix @ at.matrix[n:] - each * np.hstack([0.0 * stiff, stiff])
        speeds = unit[n:] + each * np.linalg.solve(matrix, force)
        return np.concatenate([unit[:n] + each * speeds, speeds], axis=1)
    if type(stepping) is RungeKutta:
        stages, Z = [], each * at.matrix
        for row in stepping.A:
            stages.append(Z @ (unit + sum(a * stage for a, stage in zip(row, stages))))
        return unit + sum(b * stage for b, stage in zip(stepping.b, stages))
    if type(stepping) is ImplicitRungeKutta:
        s = len(stepping.b)
        coupled = np.eye(2 * n * s) - each * np.kron(stepping.A, at.matrix)
        stages = np.linalg.solve(coupled, each * np.tile(at.matrix, (s, 1))).reshape(-1, s, 2 * n, 2 * n)
        return unit + np.einsum("i,kiab->kab", stepping.b, stages)
    return amplification(stepping, at.tree, at.q, np.zeros(n), at.tau, dt)


def growth_of(stepping, z: np.ndarray) -> np.ndarray:
    """The stability function of a Runge-Kutta method at z = lambda dt, of any shape."""
    if type(stepping) is ImplicitRungeKutta:
        A = np.eye(len(stepping.b)) - z[..., None, None] * np.array(stepping.A)
        stages = np.linalg.solve(A, np.ones((*z.shape, len(stepping.b), 1)))[..., 0]
        return 1.0 + z * (stages @ np.array(stepping.b))
    stages = []
    for row in stepping.A:
        stages.append(1.0 + z * sum(a * stage for a, stage in zip(row, stages) if a))
    return 1.0 + z * sum(b * stage for b, stage in zip(stepping.b, stages) if b)


def beyond_limit(at, name: str, dt: float) -> float:
    """A step, s, over the largest one at which a mode of a held posture grows by at most a tenth more than it should."""
    steps = dt * np.geomspace(1e-5, 1.0, 201)
    fast = at.growth(name, steps) > 1.1 * np.exp(max(at.modes[0].real.max(), 0.0) * steps)
    return float(dt / steps[max(int(np.argmax(fast)) - 1, 0)]) if fast.any() else 1.0
