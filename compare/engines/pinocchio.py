"""Pinocchio: its model of a robot's file.

Its quaternions are x y z w; a continuous joint has the cosine and the sine of its angle. The velocity of a free body is in body
axes: where the Tree has v and a, it has R' v and R' a - w x R' v. Of several root bodies it reads the first one only.
"""

from pathlib import Path

import numpy as np

from . import Array, EngineRecord
from .outside.mjcf_text import original_or_copy
from .outside.model import Body, File, Link, Numbers, OtherJoints, OtherNames, ReadModel
from .outside.order import order_of

ENGINE = EngineRecord(
    order=55, label="Pinocchio", colour="#56B4E9", marker="X", package="pinocchio", reads_file=True
)
METHODS: dict[str, tuple[int, str]] = {}  # it has no integrators


class Model(ReadModel):
    has_places = True
    drops = ("damping", "stiffness")  # aba applies no damping, and its model has no springs

    def __init__(self, file: File, precision: str):
        import pinocchio

        self.pinocchio, self.file = pinocchio, file
        *_, self.copied = original_or_copy(file.path, self.read)
        self.data = self.model.createData()

    def read(self, path: Path) -> None:
        """The model of a URDF or MJCF file; Unread where its joints are not those of the compared model."""
        is_urdf = path.suffix == ".urdf"
        build = self.pinocchio.buildModelFromUrdf if is_urdf else self.pinocchio.buildModelFromMJCF
        self.model, file = build(str(path)), self.file
        self.last: dict[int, int] = {}  # the number in the Tree of the last joint of each of Pinocchio's
        starts, circles, q = {}, [], 0  # where each joint begins; which angles are continuous
        for number, (name, joint) in enumerate(zip(self.model.names, self.model.joints)):
            if number == 0:  # the world
                continue
            is_composite, name = joint.shortname() == "JointModelComposite", name.removeprefix("Composite_")
            v, name = joint.idx_v, f"{name} turn" if name in file.free else name
            for part in joint.extract().joints if is_composite else [joint]:
                if name not in file.names:
                    raise OtherNames(f"the file has no joint {name!r}")
                self.last[number] = k = file.names.index(name)
                is_circle = part.nq == 2
                circles += [q] if is_circle else []
                starts[k], q, v = (q, v), q + (1 if is_circle else part.nq), v + part.nv
                name = file.names[min(k + 1, len(file.names) - 1)]  # of the next one of a composite joint
        self.circles, self.starts = np.array(circles, int), starts
        if self.model.nv != file.coordinates.nv:
            raise OtherJoints(f"it has {self.model.nv} speeds, the file {file.coordinates.nv}")
        self.order = order_of(
            file, starts, (0, 1, 2, 4, 5, 6, 3), range(6), in_world=False, ball_q=(1, 2, 3, 0)
        )

    def own(self, q: Array, *vectors: Array) -> list[Array]:
        """q, and vectors of speeds or forces, as Pinocchio has them."""
        q, *placed = self.order.engine(q, *vectors)
        if self.circles.size:
            sines, q[self.circles] = np.sin(q[self.circles]), np.cos(q[self.circles])
            q = np.insert(q, self.circles + 1, sines)
        return [q, *placed]

    def fields(self) -> Numbers:
        armature, damping = np.zeros((2, self.model.nv))
        armature[self.order.v], damping[self.order.v] = self.model.armature, self.model.damping
        gravity = self.model.gravity.linear
        return {"gravity": gravity, "armature": armature, "damping": damping}

    def links(self, q: Array) -> list[Link]:
        """Those that Pinocchio's joints move."""
        self.pinocchio.forwardKinematics(self.model, self.data, *self.own(q))
        links = []
        for number, k in self.last.items():
            inertia, place = self.model.inertias[number], self.data.oMi[number]
            body = Body(inertia.mass, inertia.lever.copy(), inertia.inertia.copy())
            links.append(Link(number, None, k, place.rotation.copy(), place.translation.copy(), body))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        self.model.inertias[link.name] = self.pinocchio.Inertia(*body)

    def set_field(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.model.gravity.linear = values
        else:
            setattr(self.model, name, values[self.order.v])
        return True

    def mass_matrix(self, q: Array) -> Array:
        upper = np.triu(self.pinocchio.crba(self.model, self.data, *self.own(q)))
        return self.order.tree_matrix(q, upper + np.triu(upper, 1).T)

    def turning(self, v: Array) -> Array:
        """The acceleration that Pinocchio's speeds have where those of the Tree have none: -w x v of a free body."""
        turning = np.zeros_like(v)
        for at, _ in self.order.turned:
            turning[at] = np.cross(v[at], v[at.stop : at.stop + 3])
        return turning

    def bias(self, q: Array, v: Array) -> Array:
        q_own, v_own = self.own(q, v)
        return self.order.tree(
            q, self.pinocchio.rnea(self.model, self.data, q_own, v_own, self.turning(v_own))
        )

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        q_own, v_own, force = self.own(q, v, force)
        a_own = self.pinocchio.aba(self.model, self.data, q_own, v_own, force) - self.turning(v_own)
        return self.order.tree(q, a_own)

    @property
    def lacks(self) -> tuple[str, ...]:
        """Movements of a free body are in other axes; of a composite joint Pinocchio 4.1 has wrong derivatives."""
        composite = any(joint.shortname() == "JointModelComposite" for joint in self.model.joints)
        return ("derivatives",) if self.file.free or composite else ()

    def derivatives(self, q: Array, v: Array, force: Array) -> Array:
        by = self.pinocchio.computeABADerivatives(self.model, self.data, *self.own(q, v, force))
        upper = np.triu(by[2])
        matrices = np.array([by[0], by[1], upper + np.triu(upper, 1).T])
        placed = np.empty_like(matrices)
        placed[:, self.order.v[:, None], self.order.v] = matrices
        return placed
