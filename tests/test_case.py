"""A scene changes what it says and nothing else; what cannot be a scene of a robot is refused in one line."""

from pathlib import Path

import numpy as np
import pytest
from edited import XML

import tmt
from compare.engines.mujoco import parse
from compare.robots import Robot
from compare.robots.arm import ARM
from compare.robots.case import Case, Scene
from compare.robots.scene import WrongField


def refused(robot=ARM, **fields) -> WrongField:
    """The error with which a scene is refused."""
    with pytest.raises(WrongField) as error:
        robot.case(**{"name": "mine"} | fields)
    return error.value


@pytest.mark.parametrize("field, value, more", [
    ("name", "a\nb", {}), ("judged", 5.001, {}), ("judged", -0.001, {}), ("gravity", "no", {}), ("locked", "beta", {}),
    ("locked", ("wrist",), {}), ("locked", ("alpha", "beta", "gamma"), {}), ("speed", None, {}), ("speed", (1, 2), {}),
    ("speed", (0, 1, 0), {"locked": ("beta",)}), ("duration", 0, {}), ("dt", 1e-300, {}), ("dt", 0.3, {}),
    ("dt", 7.0, {}), ("damping", -1, {}), ("posture", "sitting", {}), ("posture", (1, 2), {}), ("torque", "pull", {}),
    ("torque", "servos", {}), ("torque", (1, 2, np.inf), {}), ("targets", 2.0, {}),
    ("targets", "far", {"torque": "servos"}),
])  # fmt: skip
def test_a_wrong_field_is_named(field, value, more):
    error = refused(**{field: value} | more)
    assert error.field == field and "\n" not in str(error)


def test_another_robot_has_its_own_joints_and_its_postures_in_degrees():
    two = Robot("two", Path("none.xml"), tmt.ARM.lock({"alpha": 0.0}), {"low": (0, 90)}, ())
    for field, value in (("posture", "high"), ("torque", (1, 2, 3)), ("locked", ("beta", "gamma"))):
        error = refused(two, **{field: value})
        assert error.field == field and "beta" in error.accepted and "alpha" not in error.accepted
    case = Case(two, Scene("low", "low", speed=(0, 180), locked=("beta",)))
    assert case.joints == case.tree.joint_names == case.coordinates.names == ("gamma",)
    assert case.q.tolist() == [np.pi / 2] and case.v.tolist() == [np.pi] and case.locked == {"beta": 0.0}
    assert two.case().q.tolist() == [0.0, 0.0] and two.case().joints == ("beta", "gamma")


def test_a_case_keeps_the_gravity_and_the_damping_of_the_file():
    moon = parse(XML.replace("0 0 -9.81", "0.5 -0.3 -1.62"), ARM.tree)
    sticky = parse(XML.replace('axis="1 0 0"/>', 'axis="1 0 0" damping="0.3"/>'), ARM.tree)
    for case in ARM.cases:
        gravity, damping = case.scene.gravity, case.scene.damping
        of_moon = [0.5, -0.3, -1.62] if gravity else [0.0, 0.0, 0.0]
        assert moon.of(case).model.opt.gravity.tolist() == of_moon
        one, added = sticky.of(case), [0.3 * (name == "beta") for name in case.joints]
        assert one.model.dof_damping[one.dofs].tolist() == [damping + more for more in added]
        assert case.tree.gravity == (tmt.ARM.gravity if gravity else (0.0, 0.0, 0.0))
        assert case.tree.damping == (damping,) * len(case.joints)


def test_cases_that_differ_in_one_change_have_their_own_models():
    changes = [
        {}, {"gravity": False}, {"damping": 0.1}, {"damping": 0.1001}, {"locked": ("beta",)}, {"locked": ("gamma",)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0)}, {"locked": ("beta",), "posture": (0.0, 40.001, 0.0)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0), "gravity": False}, {"locked": ("alpha", "beta")},
    ]  # fmt: skip
    engine, cases = parse(XML, ARM.tree), [ARM.case("one", **change) for change in changes]
    for case in cases[::-1] + cases:
        q, v = np.full((2, len(case.joints)), 0.7)
        found = engine.of(case).acceleration(q, v, v)
        assert np.allclose(found, tmt.acceleration(q, v, v, case.tree), rtol=1e-10, atol=1e-10), case.scene
