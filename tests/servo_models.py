"""Small robots with servos, as MJCF text, and how they are asked: for engines, truth and experiments/stability."""

from compare.engines.mujoco import read
from compare.engines.mujoco.acting import Acting
from compare.robots.file import robot_of
from compare.truth.driven import Posture

INERTIA = 0.05  # kg m2, of the one hinge

# one hinge about an upright axis: gravity does nothing
HINGE = """<mujoco><option timestep="0.002" {option}/><worldbody><body><joint name="turn" axis="0 0 1" {joint}/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody>
  <actuator>{actuator}</actuator></mujoco>"""
# a palm that turns, with two fingers that one tendon closes
FORK = """<mujoco><option timestep="0.002"/><worldbody><body><joint name="turn" axis="0 0 1" damping="0.1" armature="0.01"/>
  <geom size="0.05" mass="1"/>
  <body pos="0.1 0 0"><joint name="left" type="slide" axis="0 1 0" damping="1"/><geom size="0.02" mass="0.1"/></body>
  <body pos="0.1 0 0"><joint name="right" type="slide" axis="0 -1 0" damping="1"/><geom size="0.02" mass="0.1"/></body>
  </body></worldbody>
  <tendon><fixed name="both"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
  <actuator><position name="turn" joint="turn" kp="5" kv="0.5"/><position name="grip" tendon="both" kp="500" kv="{kv}"/>
  <position name="hold left" joint="left" kp="200" kv="1"/><position name="hold right" joint="right" kp="200" kv="1"/>
  </actuator></mujoco>"""
# a free body with a ball joint on a spring, and a hinge with a servo
FLOATING = """<mujoco><option timestep="0.002"/><worldbody><body name="trunk"><freejoint name="base"/><geom size="0.1" mass="3"/>
  <body pos="0.2 0 0"><joint name="neck" type="ball" stiffness="30" damping="0.4"/>
  <geom type="box" size="0.1 0.03 0.05" pos="0.1 0 0" mass="1"/>
  <body pos="0.2 0 0"><joint name="jaw" axis="0 1 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.2 0 0.1" mass="0.4"/>
  </body></body></body></worldbody><actuator><position name="jaw" joint="jaw" kp="20" kv="1"/></actuator></mujoco>"""
FILTERED = """<general name="servo" joint="turn" dyntype="{kind}" dynprm="{constant}" gainprm="20" biastype="affine"
  biasprm="0 -20 -2"/>"""

SPRING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0" stiffness="{}"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def robot(source):
    """The robot of a file or text."""
    return robot_of(read(source), "robot.xml")


def spring(stiffness: float):
    """A robot of 1 kg m2 on one spring."""
    return robot(SPRING.format(stiffness))


def hinge(kp: float = 20.0, kv: float = 0.0, joint: str = "", option: str = "", actuator: str = "") -> str:
    servo = actuator or f'<position name="servo" joint="turn" kp="{kp}" kv="{kv}"/>'
    return HINGE.format(joint=joint, option=option, actuator=servo)


def posture_of(source, name: str | None = None):
    """A posture of a file or text, by default the first; and its reading."""
    reading = read(source)
    robot = robot_of(reading, "robot.xml")
    acting = Acting(reading.model, robot.drive)
    rows = acting.rows if acting.is_coupled else None
    return Posture(robot, name or next(iter(robot.positions)), acting.along, rows, reading.dt), reading
