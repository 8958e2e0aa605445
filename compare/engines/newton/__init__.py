"""Newton on the CPU, which reads MJCF itself; its numbers are float32."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from tmt import Tree

from .. import Array, Course, EngineRecord
from ..outside.model import EngineError, File
from ..warp import METHODS as OF_WARP
from ..warp import methods_for as methods_of_warp
from .imported import Imported

ENGINE = EngineRecord(order=70, label="Newton", colour="#999933", marker="h", package="newton",
                      reads_file=True, precision="float32")  # fmt: skip
FEATHERSTONE, BY_MUJOCO = "Featherstone", "SolverMuJoCo"  # of its solvers
USED = "implicitfast", "RK4"  # integrators of SolverMuJoCo; the others are those of MuJoCo Warp too
UNCONSTRAINED = (
    0b11111  # MuJoCo's flags that disable constraints, equalities, friction losses, limits and contacts
)


def by_mujoco(methods: dict[str, tuple[int, str]]) -> dict[str, tuple[int, str]]:
    return {f"{BY_MUJOCO} {name}": methods[name] for name in USED}


METHODS = {FEATHERSTONE: (1, "newton_featherstone")} | by_mujoco(OF_WARP)


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Featherstone is semi-implicit Euler whose damping is explicit; SolverMuJoCo has the integrators of MuJoCo Warp."""
    return METHODS | by_mujoco(methods_of_warp(tree))


class Model(Imported):
    def __init__(self, file: File, precision: str):
        super().__init__(file, precision)
        self.next, self.control = self.model.state(), self.model.control()
        self.solver = cache(self.made_solver)

    def made_solver(self, method: str) -> Any:
        if method == FEATHERSTONE:
            return self.newton.solvers.SolverFeatherstone(self.model, angular_damping=0.0)
        options = {"integrator": method.split()[-1].lower(), "disable_contacts": True}
        solver = self.newton.solvers.SolverMuJoCo(self.model, **options)
        solver.mjw_model.opt.disableflags |= UNCONSTRAINED
        for prm in (solver.mjw_model.actuator_gainprm, solver.mjw_model.actuator_biasprm):
            prm.zero_()  # with actuation disabled implicitfast would be explicit in the damping
        return solver

    def own_mass_matrix(self) -> Array:
        """M in Newton's coordinates; each tree of the file is an articulation of its own."""
        sizes = np.diff(self.model.joint_qd_start.numpy()[self.model.articulation_start.numpy()])
        blocks = self.newton.eval_mass_matrix(self.model, self.state).numpy()
        return block_diag(*(block[:size, :size] for block, size in zip(blocks, sizes)))

    def mass_matrix(self, q: Array) -> Array:
        S, _ = self.set_state(q, np.zeros(len(self.dofs)))
        return S.T @ self.own_mass_matrix() @ S

    def bias(self, q: Array, v: Array) -> Array:
        S, c = self.set_state(q, v)
        weight, rest = self.model.state().joint_qd, self.model.state().joint_qd
        forces = {"gravity_force": weight, "coriolis_force": rest}
        self.newton.eval_inverse_dynamics_passive(self.model, self.state, **forces)
        return S.T @ (weight.numpy().astype(float) + rest.numpy() + self.own_mass_matrix() @ c)

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        S, c = self.set_state(q, v)
        self.model.joint_damping.zero_()
        self.model.joint_stiffness.zero_()
        self.control.joint_f.assign(np.linalg.solve(S.T, force))
        self.solver(FEATHERSTONE).step(self.state, self.next, self.control, None, 1.0)
        change = self.next.joint_qd.numpy().astype(float) - self.state.joint_qd.numpy()
        return np.linalg.solve(S, change - c)

    def prepare(self, course: Course) -> None:
        for name in ("damping", "stiffness"):
            getattr(self.model, f"joint_{name}").assign(self.read[name])
        damped = [self.read["damping"][dof] for _, dof, body in self.turns if body is not None]
        if course.method == FEATHERSTONE and any(
            (*damped, *(self.read["stiffness"][at] for _, at, _ in self.turns))
        ):
            missing = "no springs of ball joints and no damping of free joints"
            raise EngineError(f"the Featherstone solver has {missing}")
        self.solver(course.method)

    def step_alone(self, course: Course) -> Callable[[], object]:
        self.set_state(course.q, course.v)
        return partial(self.solver(course.method).step, self.state, self.next, self.control, None, course.dt)

    def run(self, course: Course) -> tuple[Array, int]:
        self.prepare(course)
        states, (S, _), solver = (
            [course.start],
            self.set_state(course.q, course.v),
            self.solver(course.method),
        )
        force = course.force(course.q, course.v)
        for step in range(1, course.steps + 1):
            self.control.joint_f.assign(np.linalg.solve(S.T, force))
            solver.step(self.state, self.next, self.control, None, course.dt)
            self.state, self.next = self.next, self.state
            x, v = (values.numpy().astype(float) for values in (self.state.joint_q, self.state.joint_qd))
            S, _ = self.speeds(x, v)
            for at, _, _ in self.turns:
                x[at : at + 4] = np.roll(x[at : at + 4], 1)
            q, v = (x + self.reference)[self.coords], np.linalg.solve(S, v)
            force = course.force(q, v)
            if step % course.every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), course.steps
