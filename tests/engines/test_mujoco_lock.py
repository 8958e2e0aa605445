"""Joints of a model locked in MuJoCo: the smaller model is the sub-block of the whole."""

import numpy as np
import pytest

from compare.engines.mujoco import ModelError, parse
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")
OTHER = """<mujoco>
  <compiler angle="degree"/>
  <option gravity="1 2 -9"><flag contact="disable" constraint="disable"/></option>
  <default><joint damping="0.1"/></default>
  <worldbody>
    <frame pos="0.1 0.2 0.3" euler="10 20 30">
      <body name="upper" pos="0.1 0.2 0.1" euler="40 50 60">
        <frame pos="0 0.1 0" euler="0 0 20"><joint name="alpha" axis="0 1 0" pos="0.1 0.2 0.3" ref="20"/></frame>
        <joint name="beta" axis="1 1 0" pos="0 0.1 0.05"/>
        <geom type="box" size="0.01 0.02 0.03" pos="0.1 0.1 0.1" density="5000"/>
        <frame pos="0.3 0 0" euler="0 90 0">
          <body name="fore">
            <joint name="gamma" axis="0 0.2 1" pos="0.02 0.03 0.04"/>
            <geom type="capsule" size="0.02 0.1" pos="0.1 0.1 0.1"/>
          </body>
        </frame>
      </body>
    </frame>
  </worldbody>
  <actuator><motor joint="gamma"/></actuator>
  <sensor><jointpos joint="gamma"/><jointpos joint="alpha"/></sensor>
  <keyframe><key qpos="1 2 3"/></keyframe>
</mujoco>"""
SUBSETS = (("alpha",), ("beta",), ("gamma",), ("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma"))


@pytest.mark.parametrize("text", [XML, OTHER], ids=["arm", "other"])
def test_a_locked_model_is_the_sub_block_of_the_whole(text, rng):
    engine = parse(text.replace("0 0 -9.81", "1 -2 -8"), ARM.tree)
    whole = engine.of(ARM.case(damping=0.3))
    for locked in SUBSETS:
        angles, v = np.degrees(rng.uniform(-3.0, 3.0, 3)), rng.uniform(-3.0, 3.0, 3)
        case = ARM.case("locked", posture=angles, locked=locked, damping=0.3)
        free = [i for i, name in enumerate(ARM.joints) if name not in locked]
        v[[i for i in range(3) if i not in free]] = 0.0
        q, state = case.posture, (case.q, v[free])
        smaller = engine.of(case)
        assert smaller.coordinates.names == tuple(ARM.joints[i] for i in free) and smaller.model.nv == len(free)
        assert np.allclose(smaller.mass_matrix(q[free]), whole.mass_matrix(q)[np.ix_(free, free)], atol=1e-14)
        assert np.allclose(smaller.bias(*state), whole.bias(q, v)[free], atol=1e-13)
        assert np.allclose(smaller.com_positions(q[free]), whole.com_positions(q), atol=1e-14)
        assert np.allclose(smaller.model.dof_damping, whole.model.dof_damping[free])
        assert smaller.model.nu == whole.model.nu * ("gamma" not in locked)


def test_a_tendon_on_a_locked_joint_is_refused_in_one_line():
    tendon = '<tendon><fixed><joint joint="gamma" coef="1"/></fixed></tendon><actuator>'
    engine = parse(OTHER.replace("<actuator>", tendon), ARM.tree)
    with pytest.raises(ModelError, match="with gamma locked") as error:
        engine.of(ARM.case("locked", posture=(0, 0, 6), locked=("gamma",)))
    assert "\n" not in str(error.value)
