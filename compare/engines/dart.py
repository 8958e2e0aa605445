"""DART, through a URDF text of the model that MuJoCo compiled: its reader of MJCF makes every moving body 1 kg.

A URDF has no gravity, springs or armature. DART itself has no armature, but its dampers are implicit: of a coefficient c they
give (M + dt c) a = force - h - c v. A damper with c = armature / dt and the force c v together are the armature.
"""

import numpy as np

from . import EngineRecord
from .outside import File, ReadModel, Unread, together

ENGINE = EngineRecord(
    order=75, label="DART", colour="#882255", marker="*", package="dartpy", extra="dart", reads_file=True
)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


class Model(ReadModel):
    """A Skeleton with a fixed base, alone in a World that never lets bodies sleep, as it does by default."""

    def __init__(self, file: File, precision: str):
        import dartpy

        from .mujoco.names import joint_places
        from .mujoco.source import compiled
        from .mujoco.urdf import urdf

        try:
            model, _ = compiled(file.path)
            text = urdf(model)
        except ValueError as error:
            raise Unread(str(error)) from None
        loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
        options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
        loader.setOptions(options)
        self.skeleton, self.world = loader.parseSkeletonString(text, ""), dartpy.simulation.World()
        self.world.addSkeleton(self.skeleton)
        never = self.world.getDeactivationOptions()
        never.mEnabled = False
        self.world.setDeactivationOptions(never)
        self.joints = [self.skeleton.getJoint(name) for name in file.names]
        self.dofs = [joint.getIndexInSkeleton(0) for joint in self.joints]  # in DART's vectors
        self.order = np.argsort(self.dofs)  # DART's vectors of those of the Tree
        self.damping = np.array([joint.getDampingCoefficient(0) for joint in self.joints])
        self.armature, self.stiffness = np.zeros((2, len(self.joints)))
        places = joint_places(model)
        self.rest = np.array([model.qpos_spring[places[name].qpos.start] for name in file.names])

    def numbers(self):
        bodies = {joint.getName(): [] for joint in self.joints}
        moved_by = {None: None}  # the joint that moves a body, by the body's name
        for body in self.skeleton.getBodyNodes():
            joint, parent = body.getParentJoint().getName(), body.getParentBodyNode()
            moved_by[body.getName()] = joint if joint in bodies else moved_by[parent and parent.getName()]
            if moved_by[body.getName()]:
                R, inertia = body.getWorldTransform().rotation(), body.getInertia()
                moment = R @ inertia.getMoment() @ R.T
                bodies[moved_by[body.getName()]].append((inertia.getMass(), body.getCOM(), moment))
        mass, moments = zip(*(together(own) for own in bodies.values()))
        numbers = {"gravity": self.world.getGravity(), "mass": np.array(mass), "moments": np.array(moments)}
        return numbers | {name: getattr(self, name) for name in ("armature", "damping", "stiffness")}

    def mend(self, name, values):
        if name == "gravity":
            self.world.setGravity(values)
        elif name in ("armature", "damping", "stiffness"):
            setattr(self, name, np.array(values))
        return name not in ("mass", "moments")

    def set_state(self, q, v=None):
        self.skeleton.setPositions(q[self.order])
        if v is not None:
            self.skeleton.setVelocities(v[self.order])

    def set_step(self, dt, damping):
        """Set the length of a step, s, and the dampers; the coefficients of those that are armature."""
        rotors = self.armature / dt
        self.world.setTimeStep(dt)
        for joint, coefficient in zip(self.joints, damping + rotors):
            joint.setDampingCoefficient(0, coefficient)
        return rotors

    def mass_matrix(self, q):
        self.set_state(q)
        return self.skeleton.getMassMatrix()[np.ix_(self.dofs, self.dofs)] + np.diag(self.armature)

    def bias(self, q, v):
        self.set_state(q, v)
        return self.skeleton.getCoriolisAndGravityForces()[self.dofs]

    def acceleration(self, q, v, force):
        rotors = self.set_step(1.0, 0.0)
        self.set_state(q, v)
        self.skeleton.setForces((force + rotors * v)[self.order])
        self.skeleton.computeForwardDynamics()
        return self.skeleton.getAccelerations()[self.dofs]

    def run(self, q, v, tau, times, steps, method, tolerance):
        every, states = steps // (len(times) - 1), [np.concatenate([q, v])]
        rotors = self.set_step(times[-1] / steps, self.damping)
        self.set_state(q, v)
        for step in range(1, steps + 1):
            springs = self.stiffness * (q - self.rest)
            self.skeleton.setForces((tau - springs + rotors * v)[self.order])
            self.world.step()
            q, v = self.skeleton.getPositions()[self.dofs], self.skeleton.getVelocities()[self.dofs]
            if step % every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), steps
