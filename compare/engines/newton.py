"""Newton on the CPU, which reads MJCF itself; its numbers are float32.

Its coordinates differ from MuJoCo's: slides before hinges in a body; no `ref`; quaternions x y z w; a ball's angular velocity in
the axes of its joint; of a free body the velocity of its centre of mass and the angular velocity in world axes.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.bodies import Body, Link
from .outside.file import EngineError, File, OtherJoints
from .outside.model import ReadModel
from .outside.order import XYZW, Order, State
from .warp import METHODS as OF_WARP
from .warp import MOST_CONTACTS, MOST_ROWS
from .warp import Stepper as OfWarp
from .warp import methods_for as methods_of_warp

ENGINE = EngineRecord(order=70, label="Newton", colour="#999933", marker="h", package="newton",
                      reads_file=True, precision="float32")  # fmt: skip
FEATHERSTONE, BY_MUJOCO = "Featherstone", "SolverMuJoCo"  # of its solvers
UNCONSTRAINED = 0b11111  # MuJoCo's flags that disable all constraints
OFF = ("target_ke", "target_kd", "limit_ke", "limit_kd")  # actuators and limits
PASSIVE = "damping", "stiffness"
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

        warp.config.enable_backward = False
        self.newton, self.file, self.model = newton, file, read(file, skip_equality_constraints=True)
        self.state, self.next, self.control = self.model.state(), self.model.state(), self.model.control()
        self.solver = cache(self.made_solver)
        for name in OFF:
            getattr(self.model, f"joint_{name}").zero_()
        self.firsts, self.children = self.model.joint_qd_start.numpy(), self.model.joint_child.numpy()
        self.order = self.made_order()
        self.joint_at = {start: k for k, (_, start) in self.order.starts.items()}
        self.used = {"gravity": np.ravel(self.model.gravity.numpy())}
        for name in ("armature", *PASSIVE):
            values = getattr(self.model, f"joint_{name}").numpy().astype(float)
            self.used[name] = self.order.tree_numbers(values)

    def made_order(self) -> Order:
        from .mujoco.names import joint_places, kind_of
        from .mujoco.source import Source

        file, compiled = self.file, Source(self.file.path, self.file.floating).model
        if (self.model.joint_coord_count, self.model.joint_dof_count) != (compiled.nq, compiled.nv):
            raise OtherJoints(self.model.joint_dof_count, compiled.nv)
        places, joints = joint_places(compiled), file.coordinates.places.joints

        def slides_first(name: str) -> tuple[int, bool]:
            return compiled.jnt_bodyid[places[name].joint], places[name].kind != "slide"

        starts, points, reference, nq, nv = {}, {}, np.zeros(compiled.nq), 0, 0
        coms, bodies = self.model.body_com.numpy(), dict(zip(self.firsts.tolist(), self.children))
        for name in sorted(places, key=slides_first):
            k, place = file.names.index(name), places[name]
            starts[k] = nq, nv
            if file.is_free(k):
                points[k] = coms[bodies[nv - 3]]
            elif kind_of(compiled, place.joint) in ("hinge", "slide"):
                reference[joints[k].q] = compiled.qpos0[place.qpos.start]
            nq, nv = nq + len(place.qpos), nv + len(place.dofs)
        order = Order(file, starts, XYZW, XYZW, angular_in_world=True, balls_in_parent=True)
        return replace(order, reference=reference, points=points)

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
            is_left = self.order.is_of_free() & (name == "armature")
            self.used[name] = np.where(is_left, self.used[name], values)
            getattr(self.model, f"joint_{name}").assign(self.used[name][self.order.v])

    def links(self, at: State) -> list[Link]:
        self.set_state(at)
        arrays = self.state.body_q, self.model.body_mass, self.model.body_com, self.model.body_inertia
        numbers, links = [array.numpy().astype(float) for array in arrays], []
        kinds, parents = self.model.joint_type.numpy(), self.model.joint_parent.numpy()
        for k, child in enumerate(self.children):
            x, *body = (array[child] for array in numbers)
            # of several joints the last moves the body
            last = max(filter(self.joint_at.__contains__, range(*self.firsts[k : k + 2])), default=None)
            joint = None if kinds[k] == self.newton.JointType.FIXED or last is None else self.joint_at[last]
            turn = Rotation.from_quat(x[3:]).as_matrix()
            links.append(Link(int(child), int(parents[k]), joint, turn, x[:3], Body(*body)))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        numbers = dict(zip(("mass", "com", "inertia"), body))
        numbers["inv_mass"] = 1.0 / body.mass if body.mass else 0.0
        numbers["inv_inertia"] = np.linalg.inv(body.inertia) if body.mass else np.zeros((3, 3))
        for array, value in ((getattr(self.model, f"body_{name}"), value) for name, value in numbers.items()):
            values = array.numpy()
            values[link.name] = value
            array.assign(values)
        self.order = self.made_order()  # centres of mass of free bodies

    def set_state(self, at: State) -> None:
        self.state.joint_q.assign(at.x)
        self.state.joint_qd.assign(at.u)
        self.newton.eval_fk(self.model, self.state.joint_q, self.state.joint_qd, self.state)

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        """Each tree of the file is an articulation of its own. Accelerations are those of a step of Featherstone's."""
        self.set_state(at)
        sizes = np.diff(self.firsts[self.model.articulation_start.numpy()])
        blocks = self.newton.eval_mass_matrix(self.model, self.state).numpy()
        M = block_diag(*(block[:size, :size] for block, size in zip(blocks, sizes))).astype(float)
        weight, rest = self.model.state().joint_qd, self.model.state().joint_qd
        self.newton.eval_inverse_dynamics_passive(
            self.model, self.state, gravity_force=weight, coriolis_force=rest
        )
        h = weight.numpy().astype(float) + rest.numpy() + M @ at.c
        self.start(at, 1.0, None)
        return M, h, self.reached(force)[1] - at.u

    def start(self, at: State, dt: float, method: str | None) -> None:
        """Prepare steps of dt from a state; method None: of Featherstone's, without damping and springs."""
        for name in PASSIVE:
            values = self.used[name][self.order.v] * (method is not None)
            getattr(self.model, f"joint_{name}").assign(values)
        is_damped = self.used["damping"][self.order.is_of_free()].any()
        if method == FEATHERSTONE and (is_damped or self.used["stiffness"][self.order.is_of_ball()].any()):
            raise EngineError("Featherstone has no springs of ball joints and no damping of free joints")
        self.set_state(at)
        self.method, self.dt = method or FEATHERSTONE, dt

    def step(self) -> None:
        self.solver(self.method).step(self.state, self.next, self.control, None, self.dt)

    def reached(self, force: Array) -> tuple[Array, Array]:
        """Positions and speeds after a step under a force, the start of the next one."""
        self.control.joint_f.assign(force)
        self.step()
        self.state, self.next = self.next, self.state
        x, u = (values.numpy().astype(float) for values in (self.state.joint_q, self.state.joint_qd))
        return x, u

    def step_alone(self, course: Course) -> Callable[[], object]:
        self.start(self.order.state(course.q, course.v), course.dt, course.method)
        return self.step

    def run(self, course: Course) -> tuple[Array, int]:
        at, states = self.order.state(course.q, course.v), [course.start]
        self.start(at, course.dt, course.method)
        for step in range(1, course.steps + 1):
            q, v = self.order.tree_state(*self.reached(at.force(course.tau)))
            at = self.order.state(q, v)
            if step % course.every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), course.steps


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
    """The model that SolverMuJoCo makes of Newton's, stepped by MuJoCo Warp as the solver does."""

    def __init__(self, file: File, model: Any):
        super().__init__(file, model)
        import newton

        options = {name: int(getattr(model.opt, name)) for name in ("iterations", "ls_iterations")}
        solver = newton.solvers.SolverMuJoCo(read(file), njmax=MOST_ROWS, nconmax=MOST_CONTACTS, **options)
        self.model, self.put_model = solver.mj_model, solver.mjw_model
        for name in ("nq", "nv", "nu", "na", "nbody", "ngeom"):
            theirs, ours = getattr(self.model, name), getattr(model, name)
            if theirs != ours:
                raise ValueError(f"{name} is {theirs} in its model, {ours} in MuJoCo's")
        for name in ("jnt_type", "qpos0"):
            if not np.allclose(getattr(self.model, name), getattr(model, name), atol=1e-6):
                raise ValueError(f"{name} is not that of MuJoCo's model")

    def put(self, data: Any) -> Any:
        from mujoco import MjData, mj_forward

        copied = MjData(self.model)
        for name in ("qpos", "qvel", "act", "ctrl", "qacc_warmstart"):
            getattr(copied, name)[:] = getattr(data, name)
        mj_forward(self.model, copied)
        copied.qacc_warmstart[:] = data.qacc_warmstart
        return super().put(copied)
