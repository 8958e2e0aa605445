"""Pinocchio's algorithms for the same tree, for timing; only where it is installed (the extra `peers`)."""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from tmt import Tree

from . import rows_of_states


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
