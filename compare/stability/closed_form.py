"""The step of small deviations from rest in closed form: mass matrix and bias by TMT, the forces near the state, the rows.

At rest each row that acts has a force that is linear in the deviation. With s = actuators + springs and dampers - bias:

    (J M^-1 J' + R) df = -J M^-1 (ds + dJ' f) - dR f + daref,      v+ = v + dt (M + dt Di)^-1 (ds + dJ' f + J' df)

and q+ = q + dt v+. Di is what an integrator takes implicitly: damping of joints and of
their actuators in Euler, d force/d speed between speeds on one path
in implicitfast and implicit. MuJoCo solves the force of the constraints with M alone: that is why contacts lower the limit of
implicitfast. RK4 is the polynomial of its order in the step with Di = 0. MuJoCo documentation, Computation.
"""

import numpy as np

import tmt
from tmt.derivation.composite import mass_matrix_and_bias
from tmt.derivation.dual import seeded
from tmt.methods import by_speed

from ..engines.mujoco.forces import Forces, forces_near
from ..engines.mujoco.names import on, reflected
from .rest import Rest

ALONE = 1e-8  # of an entry of the derivative: none
COVERED = "Euler", "implicitfast", "implicit", "RK4"  # `discrete` solves the rows with a left side of its own


def radius_apart(rest: Rest, tree: tmt.Tree) -> float | None:
    """The spectral radius of the step in closed form, minus that of the same part of its derivative by differences.

    None: no closed form, or the edge of an active set.
    """
    forces = forces_near(rest.step, rest.state) if is_covered(rest) else None
    if forces is None:
        return None
    ours = matrix(rest, tree, forces)
    n = len(ours)
    return spectral_radius(ours) - spectral_radius(rest.A[:n, :n])


def spectral_radius(A: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(A)).max())


def is_covered(rest: Rest) -> bool:
    """RK4 only if the activations do not depend on the motion: they are left out there.

    Not what MuJoCo's noslip solver changes: it takes R out of the rows of friction, in a few iterations.
    """
    moved = 2 * rest.step.model.nv
    alone = rest.step.integrator != "RK4" or not (np.abs(rest.A[moved:, :moved]) > ALONE).any()
    return rest.step.integrator in COVERED and alone and not rest.step.model.opt.noslip_iterations


def matrix(rest: Rest, tree: tmt.Tree, forces: Forces) -> np.ndarray:
    """The derivative of a step by the deviation, (n, n); the rows of activations are those of MuJoCo."""
    step, nv, dt = rest.step, rest.step.model.nv, rest.step.dt
    M, by_state = mass_and_force(rest, tree, forces)
    if step.integrator == "RK4":
        return runge_kutta(rest, np.linalg.solve(M, by_state))
    left = M + dt * implicit(rest, tree, forces)
    A = rest.A.copy()
    A[nv : 2 * nv] = np.eye(nv, step.size, nv) + dt * np.linalg.solve(left, by_state)
    A[:nv] = np.eye(nv, step.size) + dt * A[nv : 2 * nv]
    return A


def mass_and_force(rest: Rest, tree: tmt.Tree, forces: Forces) -> tuple[np.ndarray, np.ndarray]:
    """M, (nv, nv), and the derivative of all forces by the deviation, (nv, n)."""
    nv, rows = rest.step.model.nv, forces.rows
    rest.step.put(rest.state)
    q = rest.step.data.qpos.tolist()
    M = np.array(mass_matrix_and_bias(tree, q, [0.0] * nv)[0], float)
    force = forces.smooth.copy()
    force[:, :nv] += forces.dJf - bias_slope(tree, q)
    eased = np.linalg.solve(M, rows.J.T).T
    pull = -eased @ force - forces.dR * rows.f[:, None] + forces.daref
    return M, force + rows.J.T @ np.linalg.solve(eased @ rows.J.T + np.diag(rows.R), pull)


def bias_slope(tree: tmt.Tree, q: list[float]) -> np.ndarray:
    """The derivative of the bias at rest along movements, (nv, nv), by dual numbers."""
    nv = tree.coordinates.nv
    moving = seeded(q, tree.coordinates.component_rates(q, list(np.eye(nv))))
    bias = mass_matrix_and_bias(tree, moving, [0.0] * nv)[1]
    slopes = [moving[0].parts(entry)[1] for entry in bias]
    return np.array([np.broadcast_to(slope, nv) for slope in slopes])


def implicit(rest: Rest, tree: tmt.Tree, forces: Forces) -> np.ndarray:
    """What the integrator takes implicitly, (nv, nv)."""
    model, nv = rest.step.model, rest.step.model.nv
    if rest.step.integrator == "Euler":
        damping = model.dof_damping + reflected(model, "actuator_damping")
        return np.diag(damping * on(model, "EULERDAMP"))
    joint = np.array(by_speed(tree, range(len(tree.parent))))
    on_path = carries(tree) | carries(tree).T
    return np.where(on_path[np.ix_(joint, joint)], -forces.smooth[:, nv : 2 * nv], 0.0)


def carries(tree: tmt.Tree) -> np.ndarray:
    """[i, j]: whether joint i carries joint j, or is it."""
    carrying = np.eye(len(tree.parent), dtype=bool)
    for j, before in enumerate(tree.parent):
        if before >= 0:
            carrying[:, j] |= carrying[:, before]
    return carrying


def runge_kutta(rest: Rest, acceleration: np.ndarray) -> np.ndarray:
    """The step of RK4 of the linear equations; without activations, of which MuJoCo shows none alone."""
    nv, dt = rest.step.model.nv, rest.step.dt
    slope = dt * np.vstack([np.eye(nv, 2 * nv, nv), acceleration[:, : 2 * nv]])
    A, power = np.eye(2 * nv), np.eye(2 * nv)
    for order in range(1, 5):
        power = power @ slope / order
        A = A + power
    return A
