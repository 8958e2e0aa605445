"""Pinocchio: its model of a robot's file.

Its quaternions are x y z w; a continuous joint has the cosine and the sine of its angle. The velocity of a free body is in body
axes: where the Tree has v and a, it has R' v and R' a - w x R' v. Of several root bodies it reads the first one only.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from . import EngineRecord
from .outside.mjcf_text import whole_text
from .outside.model import File, ReadModel, Unread
from .outside.order import near, order_of, wrong_masses

ENGINE = EngineRecord(
    order=55,
    label="Pinocchio",
    colour="#56B4E9",
    marker="X",
    package="pinocchio",
    extra="pinocchio",
    reads_file=True,
)
METHODS = {}  # it has no integrators


class Model(ReadModel):
    drops = ("damping", "stiffness")  # aba applies no damping, and its model has no springs

    def __init__(self, file: File, precision: str):
        self.file, self.model = file, built(file.path)
        # the number in the Tree of the last joint of each of Pinocchio's; where each begins; which angles are continuous
        self.last, starts, circles, q = {}, {}, [], 0
        for number, (name, joint) in enumerate(zip(self.model.names, self.model.joints)):
            is_composite, name = joint.shortname() == "JointModelComposite", name.removeprefix("Composite_")
            v, name = joint.idx_v, f"{name} turn" if name in file.free else name
            for part in () if number == 0 else joint.extract().joints if is_composite else [joint]:
                if name not in file.names:
                    raise Unread(f"joint {name!r} of Pinocchio is not in the compared model")
                self.last[number] = k = file.names.index(name)
                circles += [q] if part.nq == 2 else []
                starts[k], q, v = (q, v), q + (1 if part.nq == 2 else part.nq), v + part.nv
                name = file.names[min(k + 1, len(file.names) - 1)]  # of the next one of a composite joint
        self.circles = np.array(circles, int)
        if self.model.nv != file.coordinates.nv:
            why = f"Pinocchio has {self.model.nv} speeds, the compared model {file.coordinates.nv}"
            raise Unread(f"{why}; of several root bodies it reads the first one")
        self.order = order_of(file, starts, (0, 1, 2, 4, 5, 6, 3), range(6), (1, 2, 3, 0), in_world=False)
        self.data = self.model.createData()

    def own(self, q, *vectors):
        """q, and vectors of speeds or forces, as Pinocchio has them."""
        q, *vectors = self.order.engine(q, *vectors)
        if self.circles.size:
            sines, q[self.circles] = np.sin(q[self.circles]), np.cos(q[self.circles])
            q = np.insert(q, self.circles + 1, sines)
        return q, *vectors

    def numbers(self):
        import pinocchio

        armature, damping, stiffness = np.zeros((3, self.model.nv))
        armature[self.order.v], damping[self.order.v] = self.model.armature, self.model.damping
        found = {name: np.zeros_like(self.stated[name]) for name in ("mass", "com", "inertia")}
        pinocchio.forwardKinematics(self.model, self.data, *self.own(self.stated["reference"]))
        for number, k in self.last.items():
            body, place = self.model.inertias[number], self.data.oMi[number]
            found["mass"][k], found["com"][k] = body.mass, place.act(body.lever)
            found["inertia"][k] = place.rotation @ body.inertia @ place.rotation.T
        found["com"][found["mass"] == 0.0] = 0.0
        return found | {"gravity": self.model.gravity.linear, "moments": np.linalg.eigvalsh(found["inertia"]),
                        "armature": armature, "damping": damping, "stiffness": stiffness}  # fmt: skip

    def mend(self, name, values):
        import pinocchio

        if name == "gravity":
            self.model.gravity.linear = values
        elif name == "armature":
            self.model.armature = values[self.order.v]
        else:
            wrong = wrong_masses(self.numbers(), self.stated)
            for number in [number for number, k in self.last.items() if k in wrong]:
                mass, com, inertia = (
                    self.stated[part][self.last[number]] for part in ("mass", "com", "inertia")
                )
                place = self.data.oMi[number]
                own = place.rotation.T @ inertia @ place.rotation
                self.model.inertias[number] = pinocchio.Inertia(mass, place.actInv(com), own)
            return bool(near(self.numbers()[name], values).all())
        return True

    def mass_matrix(self, q):
        import pinocchio

        upper = np.triu(pinocchio.crba(self.model, self.data, *self.own(q)))
        return self.order.tree_matrix(q, upper + np.triu(upper, 1).T)

    def turning(self, v):
        """The acceleration that Pinocchio's speeds have where those of the Tree have none: -w x v of a free body."""
        found = np.zeros_like(v)
        for at, _ in self.order.turned:
            (x, y, z), (a, b, c) = v[at], v[at.stop : at.stop + 3]
            found[at] = c * y - b * z, a * z - c * x, b * x - a * y
        return found

    def bias(self, q, v):
        import pinocchio

        q_own, v_own = self.own(q, v)
        return self.order.tree(q, pinocchio.rnea(self.model, self.data, q_own, v_own, self.turning(v_own)))

    def acceleration(self, q, v, force):
        import pinocchio

        q_own, v_own, force = self.own(q, v, force)
        return self.order.tree(
            q, pinocchio.aba(self.model, self.data, q_own, v_own, force) - self.turning(v_own)
        )


def built(path: Path):
    """The model of a URDF or MJCF file: of that a copy without includes, which Pinocchio skips, and with a name for each body."""
    import pinocchio

    if path.suffix == ".urdf":
        return pinocchio.buildModelFromUrdf(str(path))
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_text(whole_text(path), encoding="utf-8")
        return pinocchio.buildModelFromMJCF(str(copy))
