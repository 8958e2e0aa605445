"""A second robot, of four hinges: nothing in compare knows it.

Its hinges branch, and stand in another order in the file; one body is fixed to the world, and two are on one hinge.
For the tests that import it.
"""

from pathlib import Path

import numpy as np

import tmt
from compare.robots import Robot
from compare.robots.case import Scene

XML = """
<mujoco model="crane">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"><flag contact="disable" constraint="disable" autoreset="disable"/></option>
  <worldbody>
    <body name="foot"><inertial pos="0 0.1 -0.5" mass="4.0" diaginertia="0.2 0.2 0.3"/></body>
    <body name="boom"><joint name="swing" axis="1 0 0"/><joint name="lift" axis="0 1 0"/>
      <inertial pos="0.02 0 -0.2" mass="2.0" diaginertia="0.03 0.028 0.004"/>
      <body name="weight" pos="0 0 0.3"><joint name="twist" axis="0.6 0 0.8"/>
        <inertial pos="0 0.05 -0.08" mass="0.5" diaginertia="0.002 0.0018 0.0009"/></body>
      <body name="jib" pos="0 0 -0.4"><joint name="bend" axis="0 1 0"/>
        <inertial pos="0 0.01 -0.15" mass="1.2" diaginertia="0.012 0.011 0.002"/>
        <body name="hook"><inertial pos="0.03 0 -0.3" mass="0.3" diaginertia="0.001 0.0012 0.0009"/></body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
MOMENTS = ((0.2, 0.2, 0.3), (0.03, 0.028, 0.004), (0.012, 0.011, 0.002), (0.001, 0.0012, 0.0009))
MOMENTS += ((0.002, 0.0018, 0.0009),)
TREE = tmt.Tree(
    joint_names=("swing", "lift", "bend", "twist"),  # the file has twist before bend
    parent=(-1, 0, 1, 1), offset=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -0.4), (0.0, 0.0, 0.3)),
    axis=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.0, 0.8)), damping=(0.0,) * 4,
    body_names=("foot", "boom", "jib", "hook", "weight"), body_joint=(-1, 1, 2, 2, 3),
    mass=(4.0, 2.0, 1.2, 0.3, 0.5),
    com=((0.0, 0.1, -0.5), (0.02, 0.0, -0.2), (0.0, 0.01, -0.15), (0.03, 0.0, -0.3), (0.0, 0.05, -0.08)),
    inertia=tuple(np.diag(moments).tolist() for moments in MOMENTS), gravity=(0.0, 0.0, -9.81),
)  # fmt: skip
SHORT = {"duration": 0.25, "dt": 0.25 / 64}
SCENES = (
    Scene("let go", "reaching", tags=("speed", "regular"), **SHORT),
    Scene("held up", "raised", "hold", **SHORT), Scene("let go, damped", "reaching", damping=0.1, **SHORT),
    Scene("thrown, weightless", "down", speed=(200.0, 100.0, 0.0, -100.0), gravity=False, **SHORT),
    Scene("jib alone", "reaching", locked=("swing", "lift", "twist"), **SHORT),
)  # fmt: skip


def crane(folder: Path) -> Robot:
    """The robot; its file is written into a folder."""
    path = folder / "crane.xml"
    path.write_text(XML, encoding="utf-8")
    postures = {"down": (0, 0, 0, 0), "raised": (150, 20, 10, 0), "reaching": (20, -60, -30, 15)}
    radians = {name: tuple(np.radians(angles).tolist()) for name, angles in postures.items()}
    return Robot("crane", path, TREE, radians, SCENES)
