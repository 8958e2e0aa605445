"""DART, through a URDF text of the model that MuJoCo compiled: its reader of MJCF makes every moving body 1 kg.

A URDF has no gravity, springs or armature. DART itself has no armature, but its dampers are implicit: of a coefficient c they
give (M + dt c) a = force - h - c v. A damper with c = armature / dt and the force c v together are the armature. A free body has
a rotation vector, and its angular velocity in world axes.
"""

from typing import Any

import numpy as np

from tmt import Tree

from . import Array, EngineRecord
from .outside.of_urdf import OfUrdf
from .outside.order import VECTOR, Order, State, of_free

ENGINE = EngineRecord(order=75, label="DART", colour="#882255", marker="*", package="dartpy", reads_file=True)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Its step adds to the angular velocity of a free body in world axes."""
    return {"semi-implicit Euler": (1, "dart_semi_implicit_euler")} if tree.coordinates.balls else METHODS


class Model(OfUrdf):
    """A Skeleton alone in a World that never lets bodies sleep, as it does by default."""

    def load(self, text: str) -> None:
        import dartpy

        loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        loader.setOptions(options)
        self.skeleton, self.world = loader.parseSkeletonString(text, ""), dartpy.simulation.World()
        self.world.addSkeleton(self.skeleton)
        never = self.world.getDeactivationOptions()
        never.mEnabled = False
        self.world.setDeactivationOptions(never)
        starts, self.dampers = (
            dict[int, tuple[int, int]](),
            dict[int, Any](),
        )  # the latter by their places in q and v
        for k, name in enumerate(self.file.names):
            is_free = self.file.is_free(k)
            joint = self.skeleton.getJoint(name.removesuffix(" turn") if is_free else name)
            if joint is None:  # a part of a free joint
                continue
            place = joint.getIndexInSkeleton(0)
            starts |= of_free(k, (place + 3, place + 3), (place, place)) if is_free else {k: (place, place)}
            if not is_free:
                self.dampers[place] = joint
        self.order = Order(self.file, starts, free=VECTOR, angular_in_world=True)

    def gravity(self) -> Array:
        return np.array(self.world.getGravity())

    def set_gravity(self, gravity: Array) -> None:
        self.world.setGravity(gravity)

    def set_state(self, at: State) -> None:
        self.skeleton.setPositions(at.x)
        self.skeleton.setVelocities(at.u)

    def start(self, at: State, dt: float, method: str | None) -> None:
        self.world.setTimeStep(dt)
        self.rotors = self.used["armature"] / dt  # coefficients of the dampers that are armature
        damping = self.rotors + (0.0 if method is None else self.stated["damping"])
        for place, joint in self.dampers.items():
            joint.setDampingCoefficient(0, damping[self.order.v[place]])
        self.set_state(at)

    def set_force(self, force: Array) -> None:
        push = self.rotors[self.order.v] * self.skeleton.getVelocities()
        self.skeleton.setForces(force + push)

    def step(self) -> None:
        self.world.step()

    def reached(self) -> tuple[Array, Array]:
        return self.skeleton.getPositions(), self.skeleton.getVelocities()

    def mass_matrix(self, at: State) -> Array:
        self.set_state(at)
        return np.asarray(self.skeleton.getMassMatrix() + self.armature_matrix())

    def bias(self, at: State) -> Array:
        self.set_state(at)
        return np.array(self.skeleton.getCoriolisAndGravityForces())
