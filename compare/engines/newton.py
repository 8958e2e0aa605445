"""Newton on the CPU, which reads MJCF itself; its numbers are float32.

Its coordinates differ from MuJoCo's: slides before hinges in a body; no `ref`; quaternions x y z w; a ball's angular velocity in
the axes of its joint; of a free body the velocity of its centre of mass and the angular velocity in world axes. So
v_newton = S v and a_newton = S a + c.
"""

from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.model import Body, EngineError, File, Link, Numbers, OtherJoints, SteppedModel
from .outside.order import order_of
from .warp import METHODS as OF_WARP
from .warp import methods_for as methods_of_warp

ENGINE = EngineRecord(order=70, label="Newton", colour="#999933", marker="h", package="newton",
                      reads_file=True, precision="float32")  # fmt: skip
FEATHERSTONE, BY_MUJOCO = "Featherstone", "SolverMuJoCo"  # of its solvers
USED = "implicitfast", "RK4"  # integrators of SolverMuJoCo; the others are those of MuJoCo Warp too
UNCONSTRAINED = 0b11111  # MuJoCo's flags that disable all constraints
OFF = ("target_ke", "target_kd", "limit_ke", "limit_kd")  # actuators and limits
FIELDS = "armature", "damping", "stiffness"


def by_mujoco(methods: dict[str, tuple[int, str]]) -> dict[str, tuple[int, str]]:
    return {f"{BY_MUJOCO} {name}": methods[name] for name in USED}


METHODS = {FEATHERSTONE: (1, "newton_featherstone")} | by_mujoco(OF_WARP)


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Featherstone is semi-implicit Euler whose damping is explicit; SolverMuJoCo has the integrators of MuJoCo Warp."""
    return METHODS | by_mujoco(methods_of_warp(tree))


class Model(SteppedModel):
    has_places = True
    share = 1e-6

    def __init__(self, file: File, precision: str):
        import newton
        import warp

        from .mujoco.names import joint_places, kind_of
        from .mujoco.source import Source

        builder, warp.config.enable_backward = newton.ModelBuilder(), False
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        if file.path.suffix == ".urdf":
            builder.add_urdf(str(file.path), floating=False)
        else:
            builder.add_mjcf(str(file.path), skip_equality_constraints=True)
        self.newton, self.file, self.model = newton, file, builder.finalize(device="cpu")
        self.state, self.next, self.control = self.model.state(), self.model.state(), self.model.control()
        self.solver = cache(self.made_solver)
        for name in OFF:
            getattr(self.model, f"joint_{name}").zero_()
        compiled = Source(file.path).model  # for the order of its joints and their `ref`
        if (self.model.joint_coord_count, self.model.joint_dof_count) != (compiled.nq, compiled.nv):
            raise OtherJoints(f"it has {self.model.joint_dof_count} speeds, the file has {compiled.nv}")
        places, joints = joint_places(compiled), file.coordinates.places.joints

        def slides_first(name: str) -> tuple[int, bool]:
            return compiled.jnt_bodyid[places[name].joint], places[name].kind != "slide"

        starts, nq, nv = {}, 0, 0
        self.reference = np.zeros(compiled.nq)  # in the Tree's order
        for name in sorted(places, key=slides_first):
            place, k = places[name], file.names.index(name)
            if kind_of(compiled, place.joint) != "free":
                starts[k] = nq, nv
                if place.kind != "ball":
                    self.reference[joints[k].q] = compiled.qpos0[place.qpos.start]
            elif place.kind == "ball":  # after its slides
                starts[k] = nq - 3, nv - 3
            nq, nv = nq + len(place.qpos), nv + len(place.dofs)
        free_q, xyzw = (0, 1, 2, 4, 5, 6, 3), (1, 2, 3, 0)
        self.order = order_of(file, starts, free_q, range(6), True, xyzw, turned_balls=True, turned_at=3)
        self.firsts, self.children = self.model.joint_qd_start.numpy(), self.model.joint_child.numpy()
        self.joint_at = {start: k for k, (_, start) in starts.items()}
        # of free bodies: the first speed, the quaternion in the Tree's q, the body
        self.free = [
            (start, joints[k].q, self.children[self.firsts.tolist().index(start)])
            for start, k in self.joint_at.items() if file.is_free(k)
        ]  # fmt: skip
        self.read = {name: self.in_order(f"joint_{name}") for name in FIELDS}

    def in_order(self, name: str) -> Array:
        values = np.empty(len(self.order.v))
        values[self.order.v] = getattr(self.model, name).numpy()
        return values

    def made_solver(self, method: str) -> Any:
        if method == FEATHERSTONE:
            return self.newton.solvers.SolverFeatherstone(self.model, angular_damping=0.0)
        options = {"integrator": method.split()[-1].lower(), "disable_contacts": True}
        solver = self.newton.solvers.SolverMuJoCo(self.model, **options)
        solver.mjw_model.opt.disableflags |= UNCONSTRAINED
        for prm in (solver.mjw_model.actuator_gainprm, solver.mjw_model.actuator_biasprm):
            prm.zero_()  # with actuation disabled implicitfast would be explicit in the damping
        return solver

    def fields(self) -> Numbers:
        return {"gravity": np.ravel(self.model.gravity.numpy()), **self.read}

    def set_field(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.model.gravity.assign(np.reshape(values, (1, 3)))
        else:
            self.read[name] = np.array(values)
            getattr(self.model, f"joint_{name}").assign(values[self.order.v])
        return bool(self.near(self.fields()[name], values).all())

    def links(self, q: Array) -> list[Link]:
        self.set_state(q, np.zeros(len(self.order.v)))
        arrays = self.state.body_q, self.model.body_mass, self.model.body_com, self.model.body_inertia
        numbers, links = [array.numpy().astype(float) for array in arrays], []
        kinds, parents = self.model.joint_type.numpy(), self.model.joint_parent.numpy()
        for kind, parent, child, first, end in zip(
            kinds, parents, self.children, self.firsts, self.firsts[1:]
        ):
            x, *body = (array[child] for array in numbers)
            # of several joints the last moves the body
            at = max((dof for dof in range(first, end) if dof in self.joint_at), default=None)
            joint = None if kind == self.newton.JointType.FIXED or at is None else self.joint_at[at]
            turn = Rotation.from_quat(x[3:]).as_matrix()
            links.append(Link(int(child), int(parent), joint, turn, x[:3], Body(*body)))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        numbers = {"mass": body.mass, "com": body.com, "inertia": body.inertia}
        is_massive = body.mass > 0.0
        numbers["inv_mass"] = 1.0 / body.mass if is_massive else 0.0
        numbers["inv_inertia"] = np.linalg.inv(body.inertia) if is_massive else np.zeros((3, 3))
        for name, value in numbers.items():
            array = getattr(self.model, f"body_{name}")
            values = array.numpy()
            values[link.name] = value
            array.assign(values)

    def speeds(self, q: Array, v: Array) -> tuple[Array, Array]:
        """S and c at a state of the Tree."""
        _, S = self.order.engine(q, np.eye(len(v)))
        c, coms = np.zeros(len(v)), self.model.body_com.numpy()
        for first, quaternion, body in self.free:
            linear, angular = slice(first, first + 3), slice(first + 3, first + 6)
            arm = self.order.turn(q[quaternion]) @ coms[body]
            S[linear] += np.cross(S[angular].T, arm).T
            c[linear] = np.cross(S[angular] @ v, np.cross(S[angular] @ v, arm))
        return S, c

    def set_state(self, q: Array, v: Array) -> tuple[Array, Array]:
        """S and c at a state, which Newton has then."""
        S, c = self.speeds(q, v)
        self.state.joint_q.assign(self.order.engine(q - self.reference)[0])
        self.state.joint_qd.assign(S @ v)
        self.newton.eval_fk(self.model, self.state.joint_q, self.state.joint_qd, self.state)
        return S, c

    def mass_matrix_of_state(self) -> Array:
        """M in Newton's coordinates; each tree of the file is an articulation of its own."""
        sizes = np.diff(self.firsts[self.model.articulation_start.numpy()])
        blocks = self.newton.eval_mass_matrix(self.model, self.state).numpy()
        return block_diag(*(block[:size, :size] for block, size in zip(blocks, sizes)))

    def mass_matrix(self, q: Array) -> Array:
        S, _ = self.set_state(q, np.zeros(len(self.order.v)))
        return S.T @ self.mass_matrix_of_state() @ S

    def bias(self, q: Array, v: Array) -> Array:
        S, c = self.set_state(q, v)
        weight, rest = self.model.state().joint_qd, self.model.state().joint_qd
        forces = {"gravity_force": weight, "coriolis_force": rest}
        self.newton.eval_inverse_dynamics_passive(self.model, self.state, **forces)
        return S.T @ (weight.numpy().astype(float) + rest.numpy() + self.mass_matrix_of_state() @ c)

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        S, c = self.set_state(q, v)
        self.model.joint_damping.zero_()
        self.model.joint_stiffness.zero_()
        self.control.joint_f.assign(np.linalg.solve(S.T, force))
        self.solver(FEATHERSTONE).step(self.state, self.next, self.control, None, 1.0)
        change = self.next.joint_qd.numpy().astype(float) - self.state.joint_qd.numpy()
        return np.linalg.solve(S, change - c)

    def prepare(self, course: Course) -> None:
        damping, stiffness = (self.read[name][self.order.v] for name in ("damping", "stiffness"))
        self.model.joint_damping.assign(damping)
        self.model.joint_stiffness.assign(stiffness)
        is_damped = any(damping[first : first + 6].any() for first, *_ in self.free)
        if course.method == FEATHERSTONE and (
            is_damped or any(stiffness[at].any() for at, _ in self.order.turned)
        ):
            missing = "no springs of ball joints and no damping of free joints"
            raise EngineError(f"the Featherstone solver has {missing}")
        self.solver(course.method)

    def start(self, course: Course) -> None:
        self.prepare(course)
        self.course = course
        self.S, _ = self.set_state(course.q, course.v)

    def engine_step(self) -> None:
        self.solver(self.course.method).step(self.state, self.next, self.control, None, self.course.dt)

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        self.control.joint_f.assign(np.linalg.solve(self.S.T, force))
        self.engine_step()
        self.state, self.next = self.next, self.state
        x, speeds = (values.numpy().astype(float) for values in (self.state.joint_q, self.state.joint_qd))
        q = self.order.positions(x) + self.reference
        self.S, _ = self.speeds(q, v)
        return q, np.linalg.solve(self.S, speeds)
