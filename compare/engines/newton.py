"""Newton on the CPU, which reads MJCF itself; its numbers are float32.

Its coordinates differ from MuJoCo's: slides before hinges in a body; no `ref`; quaternions x y z w; a ball's
angular velocity in the axes of its joint; of a free body the velocity of its centre of mass and the angular
velocity in world axes.
"""

from collections.abc import Callable
from functools import cache, cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, Course
from .outside import as_it_runs
from .outside.bodies import Body, Link
from .outside.file import EngineError, File, OtherJoints
from .outside.model import ReadModel
from .outside.order import XYZW, Order, State
from .warp import METHODS as OF_WARP
from .warp import MOST_CONTACTS, MOST_ROWS
from .warp import Stepper as OfWarp
from .warp import methods_for as methods_of_warp

FEATHERSTONE, BY_MUJOCO = "Featherstone", "SolverMuJoCo"  # of its solvers
UNCONSTRAINED = 0b11111  # MuJoCo's flags that disable all constraints
OFF = "target_ke", "target_kd", "limit_ke", "limit_kd"  # actuators and limits
PASSIVE = "damping", "stiffness"
NUMBERS = "armature", *PASSIVE
# Featherstone: semi-implicit Euler whose damping is explicit; SolverMuJoCo has the others of MuJoCo Warp too
METHODS = {FEATHERSTONE: (1, "newton_featherstone")}
METHODS |= {f"{BY_MUJOCO} {name}": OF_WARP[name] for name in ("implicitfast", "RK4")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """SolverMuJoCo has the integrators of MuJoCo Warp."""
    of_warp = {f"{BY_MUJOCO} {name}": method for name, method in methods_of_warp(tree).items()}
    return {name: of_warp.get(name, method) for name, method in METHODS.items()}


class Model(ReadModel):
    def __init__(self, file: File, precision: str):
        import newton
        import warp

        from .mujoco.names import joint_places, kind_of
        from .mujoco.source import Source

        warp.config.enable_backward = False
        compiled, self.newton, self.file = Source(file.path, file.floating).model, newton, file
        self.model = model = read(file, skip_equality_constraints=True)
        if (model.joint_coord_count, model.joint_dof_count) != (compiled.nq, compiled.nv):
            raise OtherJoints(model.joint_dof_count, compiled.nv)
        places, self.starts, self.reference, nq, nv = joint_places(compiled), {}, np.zeros(compiled.nq), 0, 0
        bodies = {name: int(compiled.jnt_bodyid[place.joint]) for name, place in places.items()}
        for name in sorted(places, key=lambda name: (bodies[name], places[name].kind != "slide")):
            k, place = file.names.index(name), places[name]
            self.starts[k] = nq, nv
            if kind_of(compiled, place.joint) in ("hinge", "slide"):
                self.reference[file.coordinates.places.joints[k].q] = compiled.qpos0[place.qpos.start]
            nq, nv = nq + len(place.qpos), nv + len(place.dofs)
        self.state, self.next, self.control = model.state(), model.state(), model.control()
        self.solver = cache(self.made_solver)
        for name in OFF:
            getattr(model, f"joint_{name}").zero_()
        self.used = {"gravity": np.ravel(model.gravity.numpy())}
        self.used |= {name: self.order.tree_numbers(array_of(model, f"joint_{name}")) for name in NUMBERS}

    @cached_property
    def order(self) -> Order:  # type: ignore[override]
        """With the centres of mass of free bodies."""
        children = dict(zip(self.model.joint_qd_start.numpy().tolist(), self.model.joint_child.numpy()))
        free = {k: children[v - 3] for k, (_, v) in self.starts.items() if self.file.is_free(k)}
        points = {k: array_of(self.model, "body_com")[child] for k, child in free.items()}
        return Order(self.file, self.starts, XYZW, XYZW, angular_in_world=True, balls_in_parent=True,
                     reference=self.reference, points=points)  # fmt: skip

    def made_solver(self, method: str) -> Any:
        if method == FEATHERSTONE:
            return self.newton.solvers.SolverFeatherstone(self.model, angular_damping=0.0)
        options = {"integrator": method.split()[-1].lower(), "disable_contacts": True}
        solver = self.newton.solvers.SolverMuJoCo(self.model, **options)
        solver.mjw_model.opt.disableflags |= UNCONSTRAINED
        for prm in (solver.mjw_model.actuator_gainprm, solver.mjw_model.actuator_biasprm):
            prm.zero_()  # with actuation disabled implicitfast would be explicit in the damping
        return solver

    def set(self, name: str, values: Array) -> None:
        """The armature of a free body would act on the velocity of its centre of mass: it is left as it is."""
        if name == "gravity":
            self.used[name] = values
            self.model.gravity.assign(np.reshape(values, (1, 3)))
        else:
            is_left = self.order.of_free & (name == "armature")
            self.used[name] = np.where(is_left, self.used[name], values)
            getattr(self.model, f"joint_{name}").assign(self.used[name][self.order.v])

    def links(self, at: State) -> list[Link]:
        self.set_state(at)
        numbers = [array_of(self.model, f"body_{name}") for name in Body._fields]
        ends, joint_at = self.model.joint_qd_start.numpy(), {v: k for k, (_, v) in self.starts.items()}
        movers: dict[int, int | None] = {-1: None}  # joints of the Tree, by bodies: of several the last
        links = []
        tree = zip(self.model.joint_child.numpy(), self.model.joint_parent.numpy(), ends, ends[1:])
        for child, parent, *dofs in tree:
            moving = [joint_at[dof] for dof in range(*dofs) if dof in joint_at]
            movers[child] = moving[-1] if moving else movers[parent]
            x, body = array_of(self.state, "body_q")[child], Body(*(array[child] for array in numbers))
            links.append(Link(int(child), movers[child], Rotation.from_quat(x[3:]).as_matrix(), x[:3], body))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        mass, _, inertia = body
        numbers = body._asdict() | {"inv_mass": 1.0 / mass if mass else 0.0}
        numbers["inv_inertia"] = np.linalg.inv(inertia) if mass else inertia
        for name, value in numbers.items():
            values = getattr(self.model, f"body_{name}").numpy()
            values[link.name] = value
            getattr(self.model, f"body_{name}").assign(values)
        del self.order

    def set_state(self, at: State) -> None:
        self.state.joint_q.assign(at.x)
        self.state.joint_qd.assign(at.u)
        self.newton.eval_fk(self.model, self.state.joint_q, self.state.joint_qd, self.state)

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        """Each tree of the file is an articulation of its own. Accelerations are those of a step of Featherstone's."""
        self.set_state(at)
        sizes = np.diff(self.model.joint_qd_start.numpy()[self.model.articulation_start.numpy()])
        blocks = self.newton.eval_mass_matrix(self.model, self.state).numpy()
        M = block_diag(*(block[:size, :size] for block, size in zip(blocks, sizes))).astype(float)
        parts = {name: self.model.state().joint_qd for name in ("gravity_force", "coriolis_force")}
        self.newton.eval_inverse_dynamics_passive(self.model, self.state, **parts)
        h = sum((part.numpy().astype(float) for part in parts.values()), M @ at.c)
        self.start(at, force, acts=False)
        self.step(FEATHERSTONE, 1.0)
        return M, h, array_of(self.state, "joint_qd") - at.u

    def start(self, at: State, force: Array, acts: bool) -> None:
        """A state and a force. acts: damping and springs do."""
        for name in PASSIVE:
            getattr(self.model, f"joint_{name}").assign(self.used[name][self.order.v] * acts)
        self.set_state(at)
        self.control.joint_f.assign(force)

    def step(self, method: str, dt: float) -> None:
        self.solver(method).step(self.state, self.next, self.control, None, dt)
        self.state, self.next = self.next, self.state

    def step_alone(self, course: Course) -> Callable[[], object]:
        lacking = self.used["damping"][self.order.of_free], self.used["stiffness"][self.order.of_ball]
        if course.method == FEATHERSTONE and np.concatenate(lacking).any():
            raise EngineError("Featherstone has no springs of ball joints and no damping of free joints")
        at = self.order.state(course.q, course.v)
        self.start(at, at.force(course.tau), acts=True)
        turns = bool(self.order.of_ball.any() and course.tau.any())

        def step() -> None:
            self.step(course.method, course.dt)
            if turns:  # the torque, with a ball
                self.control.joint_f.assign(self.order.state(*self.reached()).force(course.tau))

        return step

    def reached(self) -> tuple[Array, Array]:
        return self.order.tree_state(array_of(self.state, "joint_q"), array_of(self.state, "joint_qd"))


def array_of(of: Any, name: str) -> Array:
    return np.asarray(getattr(of, name).numpy(), float)


def read(file: File, **options: Any) -> Any:
    """Newton's model of a file."""
    import newton

    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    if file.is_urdf:
        builder.add_urdf(str(file.path), floating=file.floating)
    else:
        builder.add_mjcf(str(file.path), **options)
    return builder.finalize(device="cpu")


class Stepper(OfWarp):
    """The model that SolverMuJoCo makes of Newton's, stepped by MuJoCo Warp as the solver does, with the file's own step."""

    def __init__(self, file: File, model: Any):
        super().__init__(file, model)
        import newton

        names = "iterations", "ls_iterations", "integrator"
        options = {name: int(getattr(model.opt, name)) for name in names}
        solver = newton.solvers.SolverMuJoCo(read(file), njmax=MOST_ROWS, nconmax=MOST_CONTACTS, **options)
        self.model, self.put_model = solver.mj_model, solver.mjw_model
        as_it_runs.require_same(self.model, model)
        self.put_model.opt.timestep.fill_(model.opt.timestep)

    def put(self, data: Any) -> Any:
        return super().put(as_it_runs.copied(self.model, data))
