"""Pinocchio: its model of a robot's file.

A continuous joint has the cosine and the sine of its angle. Of several root bodies it reads the first one only.
"""

from pathlib import Path

import numpy as np

from . import Array, EngineRecord
from .outside.bodies import Body, Link
from .outside.file import File, OtherJoints, OtherNames
from .outside.mjcf_text import original_or_copy
from .outside.model import ReadModel
from .outside.order import XYZW, Order, State, of_free

ENGINE = EngineRecord(
    order=55, label="Pinocchio", colour="#56B4E9", marker="X", package="pinocchio", reads_file=True
)
METHODS: dict[str, tuple[int, str]] = {}  # it has no integrators
FREE = "JointModelFreeFlyer"


class Model(ReadModel):
    has_links = True
    drops = ("damping", "stiffness")  # aba applies no damping, and its model has no springs

    def __init__(self, file: File, precision: str):
        import pinocchio

        self.pinocchio, self.file = pinocchio, file
        *_, self.copied = original_or_copy(file.path, self.read)
        self.data = self.model.createData()
        self.used = {"gravity": self.model.gravity.linear}
        for name in ("armature", "damping"):
            self.used[name] = self.order.tree_numbers(getattr(self.model, name))

    def read(self, path: Path) -> None:
        """The model of a URDF or MJCF file; OtherJoints where its joints are not those of the compared model."""
        is_urdf = path.suffix == ".urdf"
        build = self.pinocchio.buildModelFromUrdf if is_urdf else self.pinocchio.buildModelFromMJCF
        # a base that --floating has freed
        is_freed = self.file.floating and 'type="floating"' not in path.read_text(encoding="utf-8")
        self.model = build(str(path), *[self.pinocchio.JointModelFreeFlyer()] * is_freed)
        self.last: dict[int, int] = {}  # the number in the Tree of the last joint of each of Pinocchio's
        starts: dict[int, tuple[int, int]] = {}
        circles, free = [], iter(self.file.free)
        for number, joint in list(enumerate(self.model.joints))[1:]:  # without the world
            parts = joint.extract().joints if joint.shortname() == "JointModelComposite" else [joint]
            name = self.model.names[number].removeprefix("Composite_")
            # one without a name is called by its body here, and as MuJoCo numbers it there
            name = f"{next(free, name)} turn" if joint.shortname() == FREE else name
            if name not in self.file.names:
                raise OtherNames(f"the file has no joint {name!r}")
            q, v, k = joint.idx_q, joint.idx_v, self.file.names.index(name)
            for part in parts:
                is_free, self.last[number] = part.nv == 6, k
                starts |= of_free(k, (q, v), (q + 3, v + 3)) if is_free else {k: (q, v)}
                circles += [k] * (part.nq == 2)
                q, v, k = q + part.nq, v + part.nv, k + 1
        if self.model.nv != self.file.coordinates.nv:
            raise OtherJoints(self.model.nv, self.file.coordinates.nv)
        self.order = Order(self.file, starts, XYZW, XYZW, linear_in_world=False, circles=tuple(circles))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Movements of a free body are in other axes; of a composite joint Pinocchio 4.1 has wrong derivatives."""
        composite = any(joint.shortname() == "JointModelComposite" for joint in self.model.joints)
        return super().quantities + ("derivatives",) * (not self.file.free and not composite)

    def links(self, at: State) -> list[Link]:
        """Those that Pinocchio's joints move."""
        self.pinocchio.forwardKinematics(self.model, self.data, at.x)
        links = []
        for number, k in self.last.items():
            inertia, place = self.model.inertias[number], self.data.oMi[number]
            body = Body(inertia.mass, inertia.lever.copy(), inertia.inertia.copy())
            links.append(Link(number, None, k, place.rotation.copy(), place.translation.copy(), body))
        return links

    def set_body(self, link: Link, body: Body) -> bool:
        self.model.inertias[link.name] = self.pinocchio.Inertia(*body)
        return True

    def apply(self, name: str) -> None:
        if name == "gravity":
            self.model.gravity.linear = self.used[name]
        else:
            setattr(self.model, name, self.used[name][self.order.v])

    def mass_matrix(self, at: State) -> Array:
        return symmetric(self.pinocchio.crba(self.model, self.data, at.x))

    def bias(self, at: State) -> Array:
        return np.array(self.pinocchio.rnea(self.model, self.data, at.x, at.u, at.c))

    def acceleration(self, at: State, force: Array) -> Array:
        return np.array(self.pinocchio.aba(self.model, self.data, at.x, at.u, force))

    def derivatives(self, at: State, force: Array) -> Array:
        by = self.pinocchio.computeABADerivatives(self.model, self.data, at.x, at.u, force)
        return np.array([by[0], by[1], symmetric(by[2])])


def symmetric(matrix: Array) -> Array:
    """The matrix of an upper triangle."""
    upper = np.triu(matrix)
    return np.asarray(upper + np.triu(upper, 1).T)
