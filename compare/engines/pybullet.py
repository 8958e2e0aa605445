"""PyBullet, through a URDF text of the model that MuJoCo compiled: its reader of MJCF loses joints.

It has no forward dynamics but its step, and no armature, which can only be added to M: a robot with armature has no accelerations
and no runs here.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from tmt import Tree

from . import Array, Course, EngineRecord
from .outside.model import Body, File, Link
from .outside.of_urdf import OfUrdf

ENGINE = EngineRecord(
    order=80, label="PyBullet", colour="#661100", marker="d", package="pybullet", reads_file=True
)
METHODS = {"semi-implicit Euler": (1, "semi_implicit_euler")}


def methods_for(tree: Tree) -> dict[str, tuple[int, str]]:
    """Its damping is explicit."""
    if any(tree.armature):
        return {}
    return {"semi-implicit Euler": (1, "explicit_damping_euler")} if any(tree.damping) else METHODS


class Model(OfUrdf):
    def load(self, text: str, file: File) -> Array:
        import pybullet
        from pybullet_utils.bullet_client import BulletClient

        self.bullet = BulletClient(pybullet.DIRECT)
        with TemporaryDirectory() as folder:
            (Path(folder) / "robot.urdf").write_text(text)
            flags = self.bullet.URDF_USE_INERTIA_FROM_FILE
            self.robot = self.bullet.loadURDF(f"{folder}/robot.urdf", useFixedBase=True, flags=flags)
        # of the links, and of the joints that move them
        numbers = range(self.bullet.getNumJoints(self.robot))
        self.infos = [self.bullet.getJointInfo(self.robot, link) for link in numbers]
        by_name = {info[1].decode(): info for info in self.infos}
        self.link_numbers = [by_name[name][0] for name in file.names]
        self.order = np.argsort(self.link_numbers)  # the Tree's joints in PyBullet's vectors
        for link in numbers:
            self.bullet.changeDynamics(self.robot, link, linearDamping=0.0, angularDamping=0.0)
            self.bullet.changeDynamics(self.robot, link, maxJointVelocity=1e9)
        self.apply(pybullet.VELOCITY_CONTROL, np.zeros(len(file.names)))
        return np.array([by_name[name][6] for name in file.names])

    def apply(self, mode: int, forces: Array) -> None:
        """Set the torques of the joints, or the largest ones of the motors that they have by default."""
        self.bullet.setJointMotorControlArray(self.robot, self.link_numbers, mode, forces=forces.tolist())

    def links(self, q: Array) -> list[Link]:
        joints, links = {link: k for k, link in enumerate(self.link_numbers)}, []
        for number, info in enumerate(self.infos):
            mass, _, moments, *_ = self.bullet.getDynamicsInfo(self.robot, number)
            centre, turn, *_ = self.bullet.getLinkState(self.robot, number, computeForwardKinematics=True)
            body = Body(mass, np.zeros(3), np.diag(moments))  # axes and origin are those of the inertia
            R = Rotation.from_quat(turn).as_matrix()
            links.append(Link(number, info[16], joints.get(number), R, np.array(centre), body))
        return links

    def gravity(self) -> Array:
        engine = self.bullet.getPhysicsEngineParameters()
        return np.array([engine[f"gravityAcceleration{axis}"] for axis in "XYZ"])

    def set_gravity(self, gravity: Array) -> None:
        self.bullet.setGravity(*gravity)

    @property
    def lacks(self) -> tuple[str, ...]:
        return ("acceleration",) if self.armature.any() else ()

    def mass_matrix(self, q: Array) -> Array:
        M, own = np.empty((len(q), len(q))), q[self.order].tolist()
        M[np.ix_(self.order, self.order)] = self.bullet.calculateMassMatrix(self.robot, own)
        return M + np.diag(self.armature)

    def bias(self, q: Array, v: Array) -> Array:
        h, zero = np.empty_like(q), [0.0] * len(q)
        state = q[self.order].tolist(), v[self.order].tolist()
        h[self.order] = self.bullet.calculateInverseDynamics(self.robot, *state, zero)
        return h

    def start(self, course: Course) -> None:
        self.start_at(course.q, course.v, course.dt, self.damping)

    def start_at(self, q: Array, v: Array, dt: float, damping: Array) -> None:
        """Prepare steps of dt from a state, with this damping of the joints."""
        self.bullet.setTimeStep(dt)
        for link, coefficient, *state in zip(self.link_numbers, damping, q, v):
            self.bullet.changeDynamics(self.robot, link, jointDamping=coefficient)
            self.bullet.resetJointState(self.robot, link, *state)

    def engine_step(self) -> None:
        self.bullet.stepSimulation()

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        self.apply(self.bullet.TORQUE_CONTROL, force)
        self.engine_step()
        states = self.bullet.getJointStates(self.robot, self.link_numbers)
        q, v = np.array([state[:2] for state in states]).T
        return q, v

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        self.start_at(q, v, 1.0, np.zeros_like(v))
        return self.step(force, v)[1] - v
