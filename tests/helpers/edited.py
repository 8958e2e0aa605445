"""Models with an edited file, for the tests of experiments: the arm; a cart, an arm and a ball; a stone."""

from models import PATHS

from compare.core.check import Result
from compare.engines.mujoco import Mujoco, parse, reading
from compare.experiments import speed
from compare.experiments.speed import runs, settings
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.run.examine import Setup, engines

XML = ARM.mjcf.read_text(encoding="utf-8")
MOON = XML.replace("0 0 -9.81", "0 0 -1.62")
STONE = PATHS["free_body"].read_text(encoding="utf-8")
CART = """<mujoco model="cart">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="cart" pos="0.1 0.2 0.3" quat="0.9 0.1 0.3 -0.2">
      <joint name="rail" type="slide" axis="1 0.2 0" armature="0.3" stiffness="20" springref="0.1" damping="0.4"/>
      <inertial pos="0.02 0 0.05" mass="2" diaginertia="0.02 0.03 0.025"/>
      <body name="arm" pos="0 0 0.2" quat="0.8 0 0.5 0.3">
        <joint name="swing" axis="0 1 0.3" pos="0.01 0 0" ref="0.4" armature="0.02" stiffness="5" springref="-0.3"/>
        <inertial pos="0.1 0 0.02" mass="1.2" diaginertia="0.004 0.01 0.009"/>
        <body name="bob" pos="0.3 0 0" quat="0.7 0.6 0 0.1">
          <joint name="wrist" type="ball" pos="0 0.01 0" armature="0.01" stiffness="2"/>
          <inertial pos="0.03 0.02 0.1" mass="0.5" diaginertia="0.002 0.003 0.004" quat="0.9 0.2 0.1 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""


def edited(*edits: tuple[str, str], text: str = XML) -> str:
    """The arm's file, or another text, with each of these replaced, which must be there once."""
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def setup_of(model: str | Mujoco = XML, make=Setup.small, **fields) -> Setup:
    """What an experiment needs of the arm, MuJoCo with this MJCF text or engine."""
    return make(ARM, engines(parse(model, ARM.tree) if isinstance(model, str) else model), **fields)


def setup_between(text: str, edited: str | None = None, states: int = 30, exact_states: int = 1) -> Setup:
    """What an experiment needs to compare tmt's equations for a text with MuJoCo's for an edited one."""
    engine, robot = reading.engine(reading.read(edited or text)), robot_of(reading.read(text), "a text")
    return Setup(robot, engines(engine), states=states, exact_states=exact_states, size="small")


def setup_of_file(source, make=Setup.small, **fields) -> Setup:
    """What an experiment needs of the robot of a file or text."""
    found = reading.read(source)
    return make(robot_of(found, "robot.xml"), engines(reading.engine(found)), reading=found, **fields)


def untimed_speed(setup: Setup) -> Result:
    """What speed judges in its regular scene, without times."""
    return speed.judged(setup, [runs.scene_runs(settings.regular_of(setup.robot), setup.engines, setup.size)])
