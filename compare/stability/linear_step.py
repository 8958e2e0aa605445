"""One step of a method in a linear motion: a deviation from a held posture."""

from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from tmt.methods import RungeKutta, SemiImplicitEuler, amplification
from tmt.methods.implicit import ImplicitRungeKutta
from tmt.methods.stepping import Method, Tableau

if TYPE_CHECKING:
    from .held import Held


def is_runge_kutta(stepping: Method) -> TypeGuard[Tableau]:
    """Whether a method is one of tmt's Runge-Kutta methods, explicit or implicit; a subclass may step otherwise."""
    return type(stepping) in (RungeKutta, ImplicitRungeKutta)


def linear_step(at: "Held", stepping: Method, dt: np.ndarray) -> np.ndarray:
    """The matrix of a step for small deviations from a held posture, see linear.Held: (k, 2nv, 2nv) for dt (k,), s."""
    n, each = at.nv, dt[:, None, None]
    if is_runge_kutta(stepping):
        return stability_function(stepping, each * at.matrix)
    if type(stepping) is not SemiImplicitEuler:
        return amplification(stepping, at.tree, at.q, np.zeros(n), at.tau, dt)
    # at rest the bias has no derivative by the speeds: an implicit bias makes no difference
    unit = np.eye(2 * n)
    stiff, damped = map(np.array, stepping.held(at.tree))
    matrix = at.mass_matrix + each * damped + each**2 * stiff
    force = at.mass_matrix @ at.matrix[n:] - each * np.hstack([0.0 * stiff, stiff])
    speeds = unit[n:] + each * np.linalg.solve(matrix, force)
    return np.concatenate([unit[:n] + each * speeds, speeds], axis=1)


def stability_function(stepping: Tableau, Z: np.ndarray) -> np.ndarray:
    """The stability function of a Runge-Kutta method, 1 + b Z (1 - A Z)^-1, at matrices Z (..., m, m)."""
    s, m = len(stepping.b), Z.shape[-1]
    unit, stages = np.eye(m), list[np.ndarray]()
    if type(stepping) is RungeKutta:
        for row in stepping.A:
            stages.append(Z @ (unit + sum(a * stage for a, stage in zip(row, stages) if a)))
    else:
        coupled = np.eye(s * m) - np.kron(stepping.A, Z)
        solved = np.linalg.solve(coupled, np.tile(Z, (s, 1))).reshape(*Z.shape[:-2], s, m, m)
        stages = list(np.moveaxis(solved, -3, 0))
    return unit + sum(b * stage for b, stage in zip(stepping.b, stages))


def growth_of(stepping: Tableau, z: np.ndarray) -> np.ndarray:
    """The stability function of a Runge-Kutta method at z = lambda dt, of any shape."""
    return stability_function(stepping, np.asarray(z)[..., None, None])[..., 0, 0]
