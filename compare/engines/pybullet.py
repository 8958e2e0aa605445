"""PyBullet, through a URDF text of the model that MuJoCo compiled: its reader of MJCF loses joints.

It has no forward dynamics but its step, and no armature, which can only be added to M: a robot with armature has no accelerations
and no runs here. A free base is the root link, with the centre of mass as origin and principal axes; angular speeds come first.
In the mass matrix and in inverse dynamics they are in these axes; the latter returns the linear forces first, and takes roll,
pitch and yaw of the given quaternion as angles about the base's own axes.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, EngineRecord
from .outside.of_urdf import OfUrdf, without_world
from .outside.order import XYZW, Order, State, of_free

ENGINE = EngineRecord(
    order=80, label="PyBullet", colour="#661100", marker="d", package="pybullet", reads_file=True
)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}
BASE = -1  # the number of the root link


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Its damping is explicit; its step adds to the angular velocity of a free base in world axes."""
    if any(tree.armature):
        return {}
    if tree.coordinates.balls:
        return {"semi-implicit Euler": (1, "pybullet_semi_implicit_euler")}
    return {"semi-implicit Euler": (1, "explicit_damping_euler")} if any(tree.damping) else METHODS


class Model(OfUrdf):
    def load(self, text: str) -> None:
        import pybullet
        from pybullet_utils.bullet_client import BulletClient

        self.bullet, self.free = BulletClient(pybullet.DIRECT), len(self.file.free)
        with TemporaryDirectory() as folder:
            (Path(folder) / "robot.urdf").write_text(without_world(text) if self.free else text)
            flags = self.bullet.URDF_USE_INERTIA_FROM_FILE
            self.robot = self.bullet.loadURDF(f"{folder}/robot.urdf", useFixedBase=not self.free, flags=flags)
        numbers = range(self.bullet.getNumJoints(self.robot))
        named = {self.bullet.getJointInfo(self.robot, link)[1].decode(): link for link in numbers}
        # the joints of the Tree by the links that they move, without a free base
        joints = dict(sorted((named[name], k) for k, name in enumerate(self.file.names) if name in named))
        starts = {k: (7 * self.free + i, 6 * self.free + i) for i, k in enumerate(joints.values())}
        self.moved, points = list(joints), dict[int, Array]()
        for ball in filter(self.file.is_free, range(len(self.file.names))):
            *_, centre, axes = self.bullet.getDynamicsInfo(self.robot, BASE)[:5]
            self.centre, self.axes = np.array(centre), Rotation.from_quat(axes)
            starts |= of_free(ball, (0, 3), (3, 0))
            points[ball] = self.centre
        self.order = Order(self.file, starts, free=XYZW, angular_in_world=True, points=points)
        for link in (BASE, *numbers):
            self.bullet.changeDynamics(self.robot, link, linearDamping=0.0, angularDamping=0.0)
            self.bullet.changeDynamics(self.robot, link, maxJointVelocity=1e9)
        self.control(pybullet.VELOCITY_CONTROL, np.zeros(len(self.moved)))

    def control(self, mode: int, forces: Array) -> None:
        """Set the torques of the joints, or the largest ones of the motors that they have by default."""
        self.bullet.setJointMotorControlArray(self.robot, self.moved, mode, forces=forces.tolist())

    def gravity(self) -> Array:
        engine = self.bullet.getPhysicsEngineParameters()
        return np.array([engine[f"gravityAcceleration{axis}"] for axis in "XYZ"])

    def set_gravity(self, gravity: Array) -> None:
        self.bullet.setGravity(*gravity)

    @property
    def quantities(self) -> tuple[str, ...]:
        return super().quantities[: 2 if self.used["armature"].any() else 3]

    def base(self, x: Array) -> tuple[Array, Rotation]:
        """The position of the centre of mass and the principal axes of a free base."""
        turn = Rotation.from_quat(x[3:7])
        return x[:3] + turn.apply(self.centre), turn * self.axes

    def split(self, x: Array) -> tuple[Array, Array]:
        """Positions of the joints, and (nv, nv): speeds in the axes of the base from those in the world's."""
        T = np.eye(len(self.order.v))
        if self.free:
            T[:3, :3] = T[3:6, 3:6] = self.base(x)[1].as_matrix().T
        return x[7 * self.free :], T

    def mass_matrix(self, at: State) -> Array:
        q, T = self.split(at.x)
        M = T.T @ np.array(self.bullet.calculateMassMatrix(self.robot, q.tolist())) @ T
        return np.asarray(M + self.armature_matrix())

    def bias(self, at: State) -> Array:
        q, T = self.split(at.x)
        if self.free:
            place, axes = self.base(at.x)
            q = np.concatenate([place, Rotation.from_euler("xyz", axes.as_euler("XYZ")).as_quat(), q])
        state = (values.tolist() for values in (q, T @ at.u, T @ at.c))
        h = np.array(self.bullet.calculateInverseDynamics(self.robot, *state))
        if self.free:
            h[:6] = np.roll(h[:6], 3)
        return T.T @ h

    def start(self, at: State, dt: float, method: str | None) -> None:
        self.bullet.setTimeStep(dt)
        damping = np.zeros_like(at.u) if method is None else self.stated["damping"][self.order.v]
        (q, _), free = self.split(at.x), 6 * self.free
        for link, coefficient, *state in zip(self.moved, damping[free:], q, at.u[free:]):
            self.bullet.changeDynamics(self.robot, link, jointDamping=coefficient)
            self.bullet.resetJointState(self.robot, link, *state)
        if free:
            place, axes = self.base(at.x)
            self.bullet.resetBasePositionAndOrientation(self.robot, place, axes.as_quat())
            self.bullet.resetBaseVelocity(self.robot, at.u[3:6], at.u[:3])

    def set_force(self, force: Array) -> None:
        free = 6 * self.free
        self.control(self.bullet.TORQUE_CONTROL, force[free:])
        if free:
            place, _ = self.bullet.getBasePositionAndOrientation(self.robot)
            in_world = self.bullet.WORLD_FRAME
            self.bullet.applyExternalForce(self.robot, BASE, force[3:6], place, in_world)
            self.bullet.applyExternalTorque(self.robot, BASE, force[:3], in_world)

    def step(self) -> None:
        self.bullet.stepSimulation()

    def reached(self) -> tuple[Array, Array]:
        states = self.bullet.getJointStates(self.robot, self.moved) or ()  # None of no joints
        q, v = np.array([state[:2] for state in states]).reshape(-1, 2).T
        if self.free:
            place, axes = self.bullet.getBasePositionAndOrientation(self.robot)
            turn = Rotation.from_quat(axes) * self.axes.inv()
            linear, angular = self.bullet.getBaseVelocity(self.robot)
            q, v = np.r_[place - turn.apply(self.centre), turn.as_quat(), q], np.r_[angular, linear, v]
        return q, v
