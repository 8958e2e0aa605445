"""DART, through a URDF text of the model that MuJoCo compiled: its reader of MJCF makes every moving body 1 kg.

A URDF has no gravity, springs or armature. DART itself has no armature, but its dampers are implicit: of a coefficient c they
give (M + dt c) a = force - h - c v. A damper with c = armature / dt and the force c v together are the armature. A free body has
a rotation vector, and its angular velocity in world axes.
"""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.model import Body, File, Link
from .outside.of_urdf import OfUrdf
from .outside.order import order_of

ENGINE = EngineRecord(order=75, label="DART", colour="#882255", marker="*", package="dartpy", reads_file=True)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Its step adds to the angular velocity of a free body in world axes."""
    return {"semi-implicit Euler": (1, "dart_semi_implicit_euler")} if tree.coordinates.balls else METHODS


class Model(OfUrdf):
    """A Skeleton alone in a World that never lets bodies sleep, as it does by default."""

    has_free_bodies = True

    def load(self, text: str, file: File) -> Array:
        import dartpy

        loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        loader.setOptions(options)
        self.skeleton, self.world = loader.parseSkeletonString(text, ""), dartpy.simulation.World()
        self.world.addSkeleton(self.skeleton)
        never = self.world.getDeactivationOptions()
        never.mEnabled = False
        self.world.setDeactivationOptions(never)
        self.joints: dict[int, Any] = {}  # by their numbers in the Tree
        for k, (name, kind) in enumerate(zip(file.names, file.kinds)):
            joint = self.skeleton.getJoint(name.removesuffix(" turn") if kind == "ball" else name)
            if joint is not None:  # else it is a part of a free joint
                self.joints[k] = joint
        places = {k: joint.getIndexInSkeleton(0) for k, joint in self.joints.items()}  # in q and in v
        starts = {k: (place, place) for k, place in places.items()}
        self.order = order_of(file, starts, (3, 4, 5, 0, 1, 2), (3, 4, 5, 0, 1, 2), in_world=True)
        self.dampers = {places[k]: joint for k, joint in self.joints.items() if not file.is_free(k)}
        damping = np.zeros(len(self.order.v))
        for place, joint in self.dampers.items():
            damping[self.order.v[place]] = joint.getDampingCoefficient(0)
        return damping

    def links(self, q: Array) -> list[Link]:
        numbers = {joint.getName(): k for k, joint in self.joints.items()}
        links = []
        for node in self.skeleton.getBodyNodes():
            place, inertia, parent = node.getWorldTransform(), node.getInertia(), node.getParentBodyNode()
            body = Body(inertia.getMass(), node.getLocalCOM(), inertia.getMoment())
            joint = numbers.get(node.getParentJoint().getName())
            names = node.getName(), parent and parent.getName()
            links.append(Link(*names, joint, place.rotation(), place.translation(), body))
        return links

    def gravity(self) -> Array:
        return np.array(self.world.getGravity())

    def set_gravity(self, gravity: Array) -> None:
        self.world.setGravity(gravity)

    def set_state(self, q: Array, v: Array) -> None:
        self.q, (x, speeds) = q, self.order.engine(q, v)
        for at, place in self.order.turned:
            x[at] = Rotation.from_quat(np.roll(q[place], -1)).as_rotvec()
        self.skeleton.setPositions(x)
        self.skeleton.setVelocities(speeds)

    def start(self, course: Course) -> None:
        self.start_at(course.q, course.v, course.dt, self.damping)

    def start_at(self, q: Array, v: Array, dt: float, damping: Array) -> None:
        """Prepare steps of dt from a state, with this damping of the joints."""
        self.world.setTimeStep(dt)
        self.rotors = self.armature / dt  # coefficients of the dampers that are armature
        for place, joint in self.dampers.items():
            joint.setDampingCoefficient(0, (damping + self.rotors)[self.order.v[place]])
        self.set_state(q, v)

    def set_force(self, force: Array, v: Array) -> None:
        self.skeleton.setForces(self.order.engine(self.q, force + self.rotors * v)[1])

    def engine_step(self) -> None:
        self.world.step()

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        self.set_force(force, v)
        self.engine_step()
        x = self.skeleton.getPositions()
        self.q = np.empty_like(self.q)
        self.q[self.order.q] = x
        for at, place in self.order.turned:
            self.q[place] = np.roll(Rotation.from_rotvec(x[at]).as_quat(), 1)
        return self.q, self.order.tree(self.q, self.skeleton.getVelocities())

    def mass_matrix(self, q: Array) -> Array:
        self.set_state(q, np.zeros(len(self.armature)))
        return self.order.tree_matrix(q, self.skeleton.getMassMatrix()) + np.diag(self.armature)

    def bias(self, q: Array, v: Array) -> Array:
        self.set_state(q, v)
        return self.order.tree(q, self.skeleton.getCoriolisAndGravityForces())

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        self.start_at(q, v, 1.0, np.zeros_like(v))
        self.set_force(force, v)
        self.skeleton.computeForwardDynamics()
        return self.order.tree(q, self.skeleton.getAccelerations())
