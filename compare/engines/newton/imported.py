"""What Newton's reader of MJCF has made of a file, and its coordinates.

These differ from MuJoCo's: slides before hinges in a body; no `ref`; quaternions x y z w; a ball's angular velocity in the axes
of its joint; of a free body the velocity of its centre of mass and the angular velocity in world axes. So v_newton = S v and
a_newton = S a + c.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from .. import Array
from ..outside.model import Body, File, Link, Numbers, OtherJoints, ReadModel, carried
from ..outside.order import near, wrong_masses

OFF = ("target_ke", "target_kd", "limit_ke", "limit_kd")  # actuators and limits
FIELDS = "armature", "damping", "stiffness"
FLOAT32 = 1e-6  # share of the largest that a number loses


class Imported(ReadModel):
    has_places = True

    def __init__(self, file: File, precision: str):
        import newton
        import warp

        from ..mujoco.names import joint_places, kind_of
        from ..mujoco.source import Source

        builder, warp.config.enable_backward = newton.ModelBuilder(), False
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        if file.path.suffix == ".urdf":
            builder.add_urdf(str(file.path), floating=False)
        else:
            builder.add_mjcf(str(file.path), skip_equality_constraints=True)
        self.newton, self.file, self.model = newton, file, builder.finalize(device="cpu")
        for name in OFF:
            getattr(self.model, f"joint_{name}").zero_()
        own = Source(file.path).model  # for the order of its joints and their `ref`
        if (self.model.joint_coord_count, self.model.joint_dof_count) != (own.nq, own.nv):
            raise OtherJoints(f"it has {self.model.joint_dof_count} speeds, the file has {own.nv}")
        self.firsts, self.children = self.model.joint_qd_start.numpy(), self.model.joint_child.numpy()
        coords, dofs, self.reference = {}, {}, np.zeros(own.nq)  # in Newton's vectors
        # the first coordinate and dof of balls, and the body of a free joint
        self.turns: list[tuple[int, int, int | None]] = []
        places, nq, nv = joint_places(own), 0, 0

        def slides_first(name: str) -> tuple[int, bool]:
            return own.jnt_bodyid[places[name].joint], places[name].kind != "slide"

        for name in sorted(places, key=slides_first):
            place = places[name]
            is_free = kind_of(own, place.joint) == "free"
            coords[name], dofs[name] = range(nq, nq + len(place.qpos)), range(nv, nv + len(place.dofs))
            if place.kind == "ball":
                body = self.children[self.firsts.tolist().index(nv - 3)] if is_free else None
                self.turns.append((nq, nv, body))
            elif not is_free:
                self.reference[nq] = own.qpos0[place.qpos.start]
            nq, nv = coords[name].stop, dofs[name].stop
        self.coords, self.dofs = ([i for name in file.names for i in of[name]] for of in (coords, dofs))
        self.joint_of = {dofs[name][-1]: joint for joint, name in enumerate(file.names)}
        self.read = {name: getattr(self.model, f"joint_{name}").numpy().copy() for name in FIELDS}
        self.state = self.model.state()

    def fields(self) -> Numbers:
        speeds = {name: values[self.dofs] for name, values in self.read.items()}
        return {"gravity": np.ravel(self.model.gravity.numpy()), **speeds}

    def links(self) -> list[Link]:
        """Its bodies where the state has them, in the order of their joints; their names are their numbers."""
        arrays = self.state.body_q, self.model.body_mass, self.model.body_com, self.model.body_inertia
        numbers, links = [array.numpy().astype(float) for array in arrays], []
        kinds, parents = self.model.joint_type.numpy(), self.model.joint_parent.numpy()
        for kind, parent, child, end in zip(kinds, parents, self.children, self.firsts[1:]):
            x, mass, com, inertia = (array[child] for array in numbers)
            R = Rotation.from_quat(x[3:]).as_matrix()
            joint = None if kind == self.newton.JointType.FIXED else self.joint_of[end - 1]
            links.append(Link(child, parent, joint, Body(mass, x[:3] + R @ com, R @ inertia @ R.T)))
        return links

    def bodies(self, q: Array) -> list[list[Body]]:
        self.set_state(q, np.zeros(len(self.dofs)))
        return carried(self.links(), len(self.joint_of))

    def twists(self, q: Array) -> dict[int, tuple[Array, Array, Array]]:
        """By the Jacobian of the centres of mass."""
        self.set_state(q, np.zeros(len(self.dofs)))
        blocks = self.newton.eval_jacobian(self.model, self.state).numpy().astype(float)
        roots, frames = self.model.articulation_start.numpy(), self.model.joint_X_c.numpy()
        twists, none = {}, np.zeros(3)
        for number, link in enumerate(self.links()):
            tree = int(np.searchsorted(roots, number, side="right")) - 1
            J = blocks[tree, 6 * (number - roots[tree]) :]
            for dof in range(self.firsts[number], self.firsts[number + 1]):
                column, joint = J[:6, dof - self.firsts[roots[tree]]], self.joint_of.get(dof)
                if joint is not None and self.file.kinds[joint] == "ball":
                    x = self.state.body_q.numpy()[link.name].astype(float)
                    twists[joint] = none, none, x[:3] + Rotation.from_quat(x[3:]).apply(frames[number][:3])
                elif joint is not None:
                    twists[joint] = column[:3], column[3:], link.body.com
        return {joint: twist for joint, twist in twists.items() if not self.file.is_free(joint)}

    def mend(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.model.gravity.assign(np.reshape(values, (1, 3)))
        elif name in self.read:
            self.read[name][self.dofs] = values
            getattr(self.model, f"joint_{name}").assign(self.read[name])
        else:
            for joint in wrong_masses(self.numbers(), self.stated, FLOAT32):
                self.set_masses(joint)
        return bool(near(self.numbers()[name], values, FLOAT32).all())

    def set_masses(self, joint: int) -> None:
        """Set what moves with a joint and not with the next one: all of it in the first of these bodies."""
        self.set_state(self.stated["reference"], np.zeros(len(self.dofs)))
        moved: dict[object, int | None] = {}
        for link in self.links():
            moved[link.name] = moved.get(link.parent) if link.joint is None else link.joint
        bodies = [number for number, moved_by in moved.items() if moved_by == joint]
        x, model = self.state.body_q.numpy().astype(float)[bodies[0]], self.model
        R = Rotation.from_quat(x[3:]).as_matrix()
        mass, com, inertia = (self.stated[name][joint] for name in ("mass", "com", "inertia"))
        numbers = {"mass": mass, "com": R.T @ (com - x[:3]), "inertia": R.T @ inertia @ R}
        numbers |= {"inv_mass": 1.0 / mass, "inv_inertia": np.linalg.inv(numbers["inertia"])}
        for name, value in numbers.items():
            values = getattr(model, f"body_{name}").numpy()
            values[bodies] = 0.0
            values[bodies[0]] = value
            getattr(model, f"body_{name}").assign(values)

    def speeds(self, x: Array, v: Array) -> tuple[Array, Array]:
        """S at Newton's coordinates x, and c at the Tree's speeds v."""
        S, c = np.eye(len(v))[np.argsort(self.dofs)], np.zeros(len(v))
        for at, dof, body in self.turns:
            R, own = Rotation.from_quat(x[at : at + 4]).as_matrix(), slice(dof, dof + 3)
            S[own] = R @ S[own]
            if body is not None:
                centre = self.model.body_com.numpy()[body]
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
