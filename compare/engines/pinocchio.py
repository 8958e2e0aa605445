"""Pinocchio: its model of a robot's file, and its algorithms for a Tree, for timing; only where it is installed.

Its quaternions are x y z w; a continuous joint has the cosine and the sine of its angle. The velocity of a free body is in body
axes: where the Tree has v and a, it has R' v and R' a - w x R' v. Of several root bodies it reads the first one only.
"""

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tmt import Tree

from . import EngineRecord, rows_of_states
from .outside import File, ReadModel, Unread
from .outside.mjcf_text import whole_text
from .outside.order import near, order_of, wrong_masses

ENGINE = EngineRecord(
    order=55, label="Pinocchio", colour="#56B4E9", marker="X", package="pinocchio", extra="pinocchio", reads_file=True
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
            raise Unread(f"Pinocchio has {self.model.nv} speeds, the compared model {file.coordinates.nv}")
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
                mass, com, inertia = (self.stated[part][self.last[number]] for part in ("mass", "com", "inertia"))
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
        return self.order.tree(q, pinocchio.aba(self.model, self.data, q_own, v_own, force) - self.turning(v_own))


def built(path: Path):
    """The model of a URDF or MJCF file: of that a copy without includes, which Pinocchio skips, and with a name for each body."""
    import pinocchio

    if path.suffix == ".urdf":
        return pinocchio.buildModelFromUrdf(str(path))
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_text(whole_text(path), encoding="utf-8")
        return pinocchio.buildModelFromMJCF(str(copy))


class PinocchioCalls:
    """Quantities of a Tree of hinges and slides by Pinocchio, whose model is built from it joint by joint.

    Its aba has the armature; the forces of dampers and springs are taken off the torque before.
    """

    def __init__(self, tree: Tree):
        import pinocchio

        self.tree, self.model = tree, pinocchio.Model()
        self.model.gravity = pinocchio.Motion(np.array(tree.gravity), np.zeros(3))
        for i, (parent, offset) in enumerate(zip(tree.parent, tree.offset)):
            place = pinocchio.SE3(np.eye(3), np.array(offset))
            self.model.addJoint(parent + 1, joint(tree.kind[i], np.array(tree.axis[i])), place, str(i))
        for at, mass, com, inertia in zip(tree.body_hinge, tree.mass, tree.com, tree.inertia):
            body = pinocchio.Inertia(mass, np.array(com), np.array(inertia))
            self.model.appendBodyToJoint(at + 1, body, pinocchio.SE3.Identity())
        self.model.armature = np.array(tree.armature)
        self.data = self.model.createData()

    @staticmethod
    def unavailable() -> str | None:
        return None if find_spec("pinocchio") else "Pinocchio is not installed; `pip install .[peers]` installs it"

    @staticmethod
    def unfit(tree: Tree) -> str | None:
        if "ball" in tree.kind or tree.has_gains:
            return "its model is built only for trees of hinges and slides without a controller"
        return None

    def acceleration(self, q, v, tau) -> np.ndarray:
        """rad/s2, (..., nv): aba."""
        import pinocchio

        batch, states = rows_of_states(*self.given(q, v, tau))
        values = [pinocchio.aba(self.model, self.data, *state).copy() for state in zip(*states)]
        return np.reshape(values, (*batch, -1))

    def given(self, q, v, tau) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The state as Pinocchio takes it."""
        q, tree = np.asarray(q, float), self.tree
        left = tau - np.array(tree.damping) * v - np.array(tree.stiffness) * (q - np.array(tree.rest))
        return q - np.array(tree.reference), np.asarray(v, float), left

    def aba_loop(self, q, v, tau) -> Callable[[int], object]:
        """run(count): aba of one state again and again, each a call from Python."""
        return aba_again(self.model, self.data, *self.given(q, v, tau))


def joint(kind: str, axis: np.ndarray):
    """Pinocchio's joint, which is a faster one where the axis is one of the coordinates'."""
    import pinocchio

    letter, name = {"hinge": ("R", "Revolute"), "slide": ("P", "Prismatic")}[kind]
    k = int(np.argmax(axis))
    if axis[k] == 1.0:
        return getattr(pinocchio, f"JointModel{letter}{'XYZ'[k]}")()
    return getattr(pinocchio, f"JointModel{name}Unaligned")(*axis)


def aba_again(*arguments) -> Callable[[int], object]:
    from pinocchio import aba

    def run(count):
        for _ in range(count):
            aba(*arguments)

    return run
