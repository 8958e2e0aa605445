"""Small robots with a servo or a spring, as MJCF text: for tests of judge, truth, experiments and robots."""

from compare.engines.mujoco import read
from compare.robots.file import robot_of

INERTIA = 0.05  # kg m2, of the one hinge

# one hinge about an upright axis: gravity does nothing
HINGE = """<mujoco><option timestep="0.002"/><worldbody><body><joint name="turn" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody>
  <actuator><position joint="turn" kp="{kp}" kv="{kv}"/></actuator></mujoco>"""
SPRING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0" stiffness="{}"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def robot(source):
    """The robot of a file or text."""
    return robot_of(read(source), "robot.xml")


def spring(stiffness: float):
    """A robot of 1 kg m2 on one spring."""
    return robot(SPRING.format(stiffness))


def hinge(kp: float = 20.0, kv: float = 0.0) -> str:
    return HINGE.format(kp=kp, kv=kv)
