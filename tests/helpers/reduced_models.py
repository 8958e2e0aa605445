"""Models whose motion is reduced, for tests of reduction, and their runs by plain MuJoCo."""

from dataclasses import replace

import mujoco
import numpy as np
from helpers.edited import setup_of_file

from compare.core.check import Result
from compare.experiments import reduction
from compare.experiments.options import ReductionOptions
from compare.experiments.reduction.scene import scene_of

ARM = """<body name="{0}" pos="{1} 0 1"><joint name="{0} upper" axis="0 1 0" damping="0.1" range="-170 170"/>
<geom size="0.05" mass="1" pos="0 0 -0.2"/><body name="{0} hand" pos="0 0 -0.4">
<joint name="{0} lower" axis="0 1 0" damping="0.1"/>
<geom type="box" size="0.02 0.02 0.1" mass="0.3" pos="0 0 -0.1"/><site name="{0} tip" pos="0 0 -0.2"/></body></body>"""
SERVOS = "".join(f'<position name="{side} {part}" joint="{side} {part}" kp="50" dampratio="1"/>'
                 for side in ("left", "right") for part in ("upper", "lower"))  # fmt: skip
FLOOR = '<geom name="floor" type="plane" size="3 3 0.1"/><light pos="0 0 3"/><camera name="eye"/>'
TWO_ARMS = f"""<mujoco><option integrator="implicitfast"><flag energy="enable"/></option><asset><texture name="sky" type="skybox"
builtin="flat" width="8" height="48"/></asset><worldbody>{FLOOR}{ARM.format("left", 0)}{ARM.format("right", 1)}
<geom name="shelf" type="box" size="0.1 0.1 0.1" pos="-2 0 1"/></worldbody><equality><joint name="never" joint1="left upper"
active="false"/></equality><tendon><fixed name="slack"><joint joint="left upper" coef="1"/></fixed></tendon>
<actuator>{SERVOS}<motor name="unused" joint="left lower"/></actuator><sensor><jointpos joint="left upper"/></sensor>
<keyframe><key name="home" qpos="0 0 0 0"/></keyframe></mujoco>"""
# a hand with a moving and a still finger, whose two joints a tendon ties
LINK = '<body pos="{1} 0 0"><joint name="{0}" axis="0 1 0" damping="0.05"{2}/><geom size="0.01" mass="0.02" pos="{1} 0 0"/>'
HAND = f"""<mujoco><option integrator="implicitfast"/><worldbody><body><joint name="wrist" axis="0 1 0" damping="1"/>
<geom size="0.05" mass="0.5"/>{LINK.format("index", 0.1, "")}</body>{LINK.format("thumb", -0.1, "")}
{LINK.format("thumb tip", -0.1, ' stiffness="5"')}</body></body></body></worldbody>
<tendon><fixed name="thumb"><joint joint="thumb" coef="1"/><joint joint="thumb tip" coef="1"/></fixed></tendon>
<actuator><position name="wrist" joint="wrist" kp="20"/><position name="index" joint="index" kp="2"/>
<position name="thumb" tendon="thumb" kp="5"/></actuator></mujoco>"""
TUMBLES = """<mujoco><worldbody><geom type="plane" size="3 3 0.1"/><body pos="0 0 0.3" euler="20 30 0"><freejoint/>
<geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


STANDS = """<mujoco><worldbody><body pos="0 0 1"><joint name="{0}" type="slide" axis="0 0 1" stiffness="{1}" damping="100"/>
<geom type="box" size="0.1 0.1 0.1" mass="1"/></body></worldbody></mujoco>"""


def setup_for(xml, **asked):
    options = ReductionOptions(**asked)
    return replace(setup_of_file(xml), alone=True, options=options, command="run --error 0.001")


def scene(xml, **asked):
    setup = setup_for(xml, **asked)
    return scene_of(setup, setup.reading)[0]


def waves(*names):
    """Controls that wave, of these actuators."""
    times = np.linspace(0.0, 0.4, 21)
    return {"time": times} | {name: 0.3 * np.sin(2.0 * np.pi * times) for name in names}


def answered(xml, **asked) -> Result:
    return reduction.rows(setup_for(xml, **asked))


def told(result) -> dict:
    return result.top[0].values


def failed(result) -> list[str]:
    return [str(check) for check in result.checks if not check.passed]


def run(path, joint, steps, controls=None, key=0, names=None):
    """The positions of a joint by plain MuJoCo, from a keyframe; controls: a column of each step by actuators."""
    model = (
        mujoco.MjModel.from_xml_path(str(path))
        if hasattr(path, "exists")
        else mujoco.MjModel.from_xml_string(path)
    )
    data, places = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, key)
    for step in range(steps):
        for name, values in (controls or {}).items():
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) >= 0:
                data.actuator(name).ctrl[:] = values[step]
        mujoco.mj_step(model, data)
        places.append(data.joint(joint).qpos.copy())
    return np.array(places)
