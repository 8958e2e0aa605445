"""Newton on the CPU, which reads MJCF itself; its numbers are float32.

Its coordinates differ from MuJoCo's: slides before hinges in a body; no `ref`; quaternions x y z w; a ball's angular velocity in
the axes of its joint; of a free body the velocity of its centre of mass and the angular velocity in world axes. So
v_newton = S v and a_newton = S a + c.
"""

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from . import Array, Course, EngineRecord
from .outside.model import Body, File, Link, Numbers, ReadModel, Unread, carried

ENGINE = EngineRecord(order=70, label="Newton", colour="#999933", marker="h", package="newton",
                      reads_file=True, precision="float32")  # fmt: skip
METHODS = {"Featherstone": (1, "newton_featherstone")}  # semi-implicit Euler whose damping is explicit
OFF = ("target_ke", "target_kd", "limit_ke", "limit_kd")  # actuators and limits


class Model(ReadModel):
    def __init__(self, file: File, precision: str):
        import newton
        import warp

        from .mujoco.names import joint_places, kind_of
        from .mujoco.source import Source

        builder, warp.config.enable_backward = newton.ModelBuilder(), False
        if file.path.suffix == ".urdf":
            builder.add_urdf(str(file.path), floating=False)
        else:
            builder.add_mjcf(str(file.path), skip_equality_constraints=True)
        self.newton, self.model = newton, builder.finalize(device="cpu")
        for name in OFF:
            getattr(self.model, f"joint_{name}").zero_()
        own = Source(file.path).model  # for the order of its joints and their `ref`
        if (self.model.joint_coord_count, self.model.joint_dof_count) != (own.nq, own.nv):
            raise Unread(f"it has read {self.model.joint_dof_count} speeds, the file has {own.nv}")
        firsts, children = self.model.joint_qd_start.numpy().tolist(), self.model.joint_child.numpy()
        coords, dofs, self.reference = {}, {}, np.zeros(own.nq)  # in Newton's vectors
        # the first coordinate and dof of balls, and the centre of mass of a free body
        self.turns: list[tuple[int, int, Array | None]] = []
        places, nq, nv = joint_places(own), 0, 0

        def slides_first(name: str) -> tuple[int, bool]:
            return own.jnt_bodyid[places[name].joint], places[name].kind != "slide"

        for name in sorted(places, key=slides_first):
            place = places[name]
            is_free = kind_of(own, place.joint) == "free"
            coords[name], dofs[name] = range(nq, nq + len(place.qpos)), range(nv, nv + len(place.dofs))
            if place.kind == "ball":
                centre = self.model.body_com.numpy()[children[firsts.index(nv - 3)]] if is_free else None
                self.turns.append((nq, nv, centre))
            elif not is_free:
                self.reference[nq] = own.qpos0[place.qpos.start]
            nq, nv = coords[name].stop, dofs[name].stop
        self.coords, self.dofs = ([i for name in file.names for i in of[name]] for of in (coords, dofs))
        self.joint_of = {dofs[name][-1]: joint for joint, name in enumerate(file.names)}
        fields = "armature", "damping", "stiffness"
        self.read = {name: getattr(self.model, f"joint_{name}").numpy().copy() for name in fields}
        self.solver = newton.solvers.SolverFeatherstone(self.model, angular_damping=0.0)
        self.state, self.next, self.control = self.model.state(), self.model.state(), self.model.control()

    def fields(self) -> Numbers:
        speeds = {name: values[self.dofs] for name, values in self.read.items()}
        return {"gravity": np.ravel(self.model.gravity.numpy()), **speeds}

    def bodies(self) -> list[list[Body]]:
        model, fixed, links = self.model, self.newton.JointType.FIXED, []
        mass, com, inertia = (getattr(model, f"body_{name}").numpy() for name in ("mass", "com", "inertia"))
        self.newton.eval_fk(model, model.joint_q, model.joint_qd, self.state)
        fields = model.joint_type, model.joint_parent, model.joint_child
        kinds, parents, children = (field.numpy() for field in fields)
        for kind, parent, child, end in zip(kinds, parents, children, model.joint_qd_start.numpy()[1:]):
            x = self.state.body_q.numpy()[child].astype(float)
            R = Rotation.from_quat(x[3:]).as_matrix()
            body = Body(float(mass[child]), x[:3] + R @ com[child], R @ inertia[child] @ R.T)
            links.append(Link(child, parent, None if kind == fixed else self.joint_of[end - 1], body))
        return carried(links, len(self.joint_of))

    def mend(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.model.gravity.assign(np.reshape(values, (1, 3)))
        elif name in self.read:
            self.read[name][self.dofs] = values
            getattr(self.model, f"joint_{name}").assign(self.read[name])
        return name not in ("mass", "moments")

    def speeds(self, x: Array, v: Array) -> tuple[Array, Array]:
        """S at Newton's coordinates x, and c at the Tree's speeds v."""
        S, c = np.eye(len(v))[np.argsort(self.dofs)], np.zeros(len(v))
        for at, dof, centre in self.turns:
            R, own = Rotation.from_quat(x[at : at + 4]).as_matrix(), slice(dof, dof + 3)
            S[own] = R @ S[own]
            if centre is not None:
                S[dof - 3 : dof] += np.cross(S[own].T, R @ centre).T
                c[dof - 3 : dof] = np.cross(S[own] @ v, np.cross(S[own] @ v, R @ centre))
        return S, c

    def set_state(self, q: Array, v: Array) -> tuple[Array, Array]:
        x = -self.reference
        x[self.coords] += q
        for at, _, _ in self.turns:
            x[at : at + 4] = np.roll(x[at : at + 4], -1)
        S, c = self.speeds(x, v)
        for vector, values in ((self.state.joint_q, x), (self.state.joint_qd, S @ v)):
            vector.assign(values)
        self.newton.eval_fk(self.model, self.state.joint_q, self.state.joint_qd, self.state)
        return S, c

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
        self.solver.step(self.state, self.next, self.control, None, 1.0)
        change = self.next.joint_qd.numpy().astype(float) - self.state.joint_qd.numpy()
        return np.linalg.solve(S, change - c)

    def prepare(self, course: Course) -> None:
        damping, stiffness = self.read["damping"], self.read["stiffness"]
        self.model.joint_damping.assign(damping)
        self.model.joint_stiffness.assign(stiffness)
        damped = [damping[dof] for _, dof, centre in self.turns if centre is not None]
        if any(damped) or any(stiffness[dof] for _, dof, _ in self.turns):
            missing = "no springs of ball joints and no damping of free joints"
            raise Unread(f"the Featherstone solver has {missing}")

    def run(self, course: Course) -> tuple[Array, int]:
        self.prepare(course)
        states, (S, _) = [course.start], self.set_state(course.q, course.v)
        for step in range(1, course.steps + 1):
            self.control.joint_f.assign(np.linalg.solve(S.T, course.tau))
            self.solver.step(self.state, self.next, self.control, None, course.dt)
            self.state, self.next = self.next, self.state
            x, v = (values.numpy().astype(float) for values in (self.state.joint_q, self.state.joint_qd))
            S, _ = self.speeds(x, v)
            for at, _, _ in self.turns:
                x[at : at + 4] = np.roll(x[at : at + 4], 1)
            if step % course.every == 0:
                states.append(np.concatenate([(x + self.reference)[self.coords], np.linalg.solve(S, v)]))
        return np.array(states), course.steps
