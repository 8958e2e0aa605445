"""Pinocchio: its model of a robot's file.

A continuous joint has the cosine and the sine of its angle. Of several root bodies it reads the first one
only.
"""

import numpy as np

from . import Array
from .outside.bodies import Body, Link
from .outside.file import File, OtherJoints, OtherNames
from .outside.model import ReadModel
from .outside.order import XYZW, Order, State, of_free

METHODS: dict[str, tuple[int, str]] = {}  # it has no integrators
FREE, COMPOSITE = "JointModelFreeFlyer", "JointModelComposite"


class Model(ReadModel):
    """Its forward dynamics applies no damping, though the model has it, and there are no springs."""

    def __init__(self, file: File, precision: str):
        import pinocchio

        self.pinocchio, self.file = pinocchio, file
        build = pinocchio.buildModelFromUrdf if file.is_urdf else pinocchio.buildModelFromMJCF
        self.model = build(str(file.path), *[pinocchio.JointModelFreeFlyer()] * file.is_freed)
        self.data = self.model.createData()
        self.last: dict[int, int] = {}  # the number in the Tree of the last joint of each of Pinocchio's
        starts: dict[int, tuple[int, int]] = {}
        circles, free = [], iter(file.free)
        for number, joint in list(enumerate(self.model.joints))[1:]:  # without the world
            parts = joint.extract().joints if joint.shortname() == COMPOSITE else [joint]
            name = self.model.names[number].removeprefix("Composite_")
            # one without a name is called by its body here, and as MuJoCo numbers it there
            name = f"{next(free, name)} turn" if joint.shortname() == FREE else name
            if name not in file.names:
                raise OtherNames(f"the file has no joint {name!r}")
            q, v, k = joint.idx_q, joint.idx_v, file.names.index(name)
            for part in parts:
                self.last[number] = k
                starts |= of_free(k, (q, v), (q + 3, v + 3)) if part.nv == 6 else {k: (q, v)}
                circles += [k] * (part.nq == 2)
                q, v, k = q + part.nq, v + part.nv, k + 1
        if self.model.nv != file.coordinates.nv:
            raise OtherJoints(self.model.nv, file.coordinates.nv)
        self.order = Order(file, starts, XYZW, XYZW, linear_in_world=False, circles=tuple(circles))
        armature = self.order.tree_numbers(self.model.armature)
        self.used = {"gravity": self.model.gravity.linear.copy(), "armature": armature}

    def set(self, name: str, values: Array) -> None:
        self.used[name] = values
        if name == "gravity":
            self.model.gravity.linear = values
        else:
            self.model.armature = values[self.order.v]

    def links(self, at: State) -> list[Link]:
        """Those that Pinocchio's joints move."""
        self.pinocchio.forwardKinematics(self.model, self.data, at.x)
        links = []
        for number, k in self.last.items():
            inertia, place = self.model.inertias[number], self.data.oMi[number]
            body = Body(inertia.mass, inertia.lever.copy(), inertia.inertia.copy())
            links.append(Link(number, k, place.rotation.copy(), place.translation.copy(), body))
        return links

    def set_body(self, link: Link, body: Body) -> None:
        self.model.inertias[link.name] = self.pinocchio.Inertia(*body)

    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        model, data = self.model, self.data
        upper = np.triu(self.pinocchio.crba(model, data, at.x))
        bias = self.pinocchio.rnea(model, data, at.x, at.u, at.c).copy()
        return upper + np.triu(upper, 1).T, bias, self.pinocchio.aba(model, data, at.x, at.u, force).copy()
