"""DART, through a URDF text of the model that MuJoCo compiled: its reader of MJCF makes every moving body 1 kg.

A URDF has no gravity, springs or armature. DART itself has no armature, but its dampers are implicit: of a coefficient c they
give (M + dt c) a = force - h - c v. A damper with c = armature / dt and the force c v together are the armature.
"""

import numpy as np

from . import EngineRecord
from .outside.of_urdf import OfUrdf

ENGINE = EngineRecord(
    order=75, label="DART", colour="#882255", marker="*", package="dartpy", extra="dart", reads_file=True
)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


class Model(OfUrdf):
    """A Skeleton with a fixed base, alone in a World that never lets bodies sleep, as it does by default."""

    def load(self, text, names):
        import dartpy

        loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        loader.setOptions(options)
        self.skeleton, self.world = loader.parseSkeletonString(text, ""), dartpy.simulation.World()
        self.world.addSkeleton(self.skeleton)
        never = self.world.getDeactivationOptions()
        never.mEnabled = False
        self.world.setDeactivationOptions(never)
        self.joints = [self.skeleton.getJoint(name) for name in names]
        self.dofs = [joint.getIndexInSkeleton(0) for joint in self.joints]  # in DART's vectors
        self.order = np.argsort(self.dofs)  # DART's vectors of those of the Tree
        return np.array([joint.getDampingCoefficient(0) for joint in self.joints])

    def bodies(self):
        bodies = {joint.getName(): [] for joint in self.joints}
        moved_by = {None: None}  # the joint that moves a body, by the body's name
        for body in self.skeleton.getBodyNodes():
            joint, parent = body.getParentJoint().getName(), body.getParentBodyNode()
            moved_by[body.getName()] = joint if joint in bodies else moved_by[parent and parent.getName()]
            if moved_by[body.getName()]:
                R, inertia = body.getWorldTransform().rotation(), body.getInertia()
                moment = R @ inertia.getMoment() @ R.T
                bodies[moved_by[body.getName()]].append((inertia.getMass(), body.getCOM(), moment))
        return list(bodies.values())

    def gravity(self):
        return self.world.getGravity()

    def set_gravity(self, gravity):
        self.world.setGravity(gravity)

    def set_state(self, q, v=None):
        self.skeleton.setPositions(q[self.order])
        if v is not None:
            self.skeleton.setVelocities(v[self.order])

    def start(self, q, v, dt, damping):
        self.world.setTimeStep(dt)
        self.rotors = self.armature / dt  # coefficients of the dampers that are armature
        for joint, coefficient in zip(self.joints, damping + self.rotors):
            joint.setDampingCoefficient(0, coefficient)
        self.set_state(q, v)

    def step(self, force, v):
        self.skeleton.setForces((force + self.rotors * v)[self.order])
        self.world.step()
        return self.skeleton.getPositions()[self.dofs], self.skeleton.getVelocities()[self.dofs]

    def mass_matrix(self, q):
        self.set_state(q)
        return self.skeleton.getMassMatrix()[np.ix_(self.dofs, self.dofs)] + np.diag(self.armature)

    def bias(self, q, v):
        self.set_state(q, v)
        return self.skeleton.getCoriolisAndGravityForces()[self.dofs]

    def acceleration(self, q, v, force):
        self.start(q, v, 1.0, 0.0)
        self.skeleton.setForces((force + self.rotors * v)[self.order])
        self.skeleton.computeForwardDynamics()
        return self.skeleton.getAccelerations()[self.dofs]
