"""DART, through a URDF text of the model that MuJoCo compiled: its reader of MJCF makes every moving body 1 kg.

A URDF has no gravity, springs or armature. DART itself has no armature, but its dampers are implicit: of a coefficient c they
give (M + dt c) a = force - h - c v. A damper with c = armature / dt and the force c v together are the armature. A free body has
a rotation vector, and its angular velocity in world axes.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from . import EngineRecord
from .outside.of_urdf import OfUrdf
from .outside.order import Order

ENGINE = EngineRecord(
    order=75, label="DART", colour="#882255", marker="*", package="dartpy", extra="dart", reads_file=True
)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


def methods_for(tree):
    """Its step adds to the angular velocity of a free body in world axes."""
    return {"semi-implicit Euler": (1, "dart_semi_implicit_euler")} if tree.coordinates.balls else METHODS


class Model(OfUrdf):
    """A Skeleton alone in a World that never lets bodies sleep, as it does by default."""

    has_free_bodies = True

    def load(self, text, file):
        import dartpy

        loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        loader.setOptions(options)
        self.skeleton, self.world = loader.parseSkeletonString(text, ""), dartpy.simulation.World()
        self.world.addSkeleton(self.skeleton)
        never = self.world.getDeactivationOptions()
        never.mEnabled = False
        self.world.setDeactivationOptions(never)
        q, v = np.zeros((2, file.coordinates.nv), int)  # the places in the Tree of DART's numbers
        self.joints, self.free = (
            {},
            {},
        )  # by their numbers in the Tree; quaternions by the first of DART's numbers
        for k, (name, place) in enumerate(zip(file.names, file.coordinates.places.joints)):
            joint = self.skeleton.getJoint(name.removesuffix(" turn") if place.kind == "ball" else name)
            if joint is None:  # a part of a free joint
                continue
            self.joints[k], own = joint, joint.getIndexInSkeleton(0)
            q[own], v[own] = place.q.start, place.qd.start
            if place.kind == "ball":
                self.free[own] = place.q
                q[own : own + 6] = np.r_[place.q.start : place.q.start + 3, place.q.start - 3 : place.q.start]
                v[own : own + 6] = np.r_[place.qd, place.qd.start - 3 : place.qd.start]
        turned = tuple((slice(own, own + 3), at) for own, at in self.free.items())
        self.order = Order(q, v, turned, in_world=True)
        numbered = {joint.getIndexInSkeleton(0): joint for joint in self.joints.values()}
        self.dampers = {own: joint for own, joint in numbered.items() if own not in self.free}
        damping = np.zeros(len(v))
        damping[v[list(self.dampers)]] = [joint.getDampingCoefficient(0) for joint in self.dampers.values()]
        return damping

    def bodies(self):
        bodies, numbers = (
            [[] for _ in self.file.names],
            {joint.getName(): k for k, joint in self.joints.items()},
        )
        moved_by = {None: None}  # the joint that moves a body, by the body's name
        for body in self.skeleton.getBodyNodes():
            parent = body.getParentBodyNode()
            k = numbers.get(body.getParentJoint().getName(), moved_by[parent and parent.getName()])
            moved_by[body.getName()] = k
            if k is not None:
                R, inertia = body.getWorldTransform().rotation(), body.getInertia()
                bodies[k].append((inertia.getMass(), body.getCOM(), R @ inertia.getMoment() @ R.T))
        return bodies

    def gravity(self):
        return self.world.getGravity()

    def set_gravity(self, gravity):
        self.world.setGravity(gravity)

    def set_state(self, q, v):
        self.q, (x, speeds) = q, self.order.engine(q, v)
        for own, at in self.free.items():
            x[own : own + 3] = Rotation.from_quat(np.roll(q[at], -1)).as_rotvec()
        self.skeleton.setPositions(x)
        self.skeleton.setVelocities(speeds)

    def start(self, q, v, dt, damping):
        self.world.setTimeStep(dt)
        self.rotors = self.armature / dt  # coefficients of the dampers that are armature
        for own, joint in self.dampers.items():
            joint.setDampingCoefficient(0, (damping + self.rotors)[self.order.v[own]])
        self.set_state(q, v)

    def set_force(self, force, v):
        self.skeleton.setForces(self.order.engine(self.q, force + self.rotors * v)[1])

    def step(self, force, v):
        self.set_force(force, v)
        self.world.step()
        x, self.q = self.skeleton.getPositions(), self.q.copy()
        self.q[self.order.q] = x
        for own, at in self.free.items():
            self.q[at] = np.roll(Rotation.from_rotvec(x[own : own + 3]).as_quat(), 1)
        return self.q, self.order.tree(self.q, self.skeleton.getVelocities())

    def mass_matrix(self, q):
        self.set_state(q, np.zeros(len(self.armature)))
        return self.order.tree_matrix(q, self.skeleton.getMassMatrix()) + np.diag(self.armature)

    def bias(self, q, v):
        self.set_state(q, v)
        return self.order.tree(q, self.skeleton.getCoriolisAndGravityForces())

    def acceleration(self, q, v, force):
        self.start(q, v, 1.0, 0.0)
        self.set_force(force, v)
        self.skeleton.computeForwardDynamics()
        return self.order.tree(q, self.skeleton.getAccelerations())
