"""A scene changes what it says and nothing else; what cannot be a scene, or a case of a robot, is refused in one line."""

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tmt
from compare.case import Case, Scene
from compare.engines.mujoco import parse
from compare.given import shorten
from compare.judge.run import required_time
from compare.robots import Robot
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")
FIELDS = [field.name for field in dataclasses.fields(Scene)]
ODD = [None, 3, -1, 0, True, 2.5, "x", "", "no", b"alpha", [],
       (), {}, [["alpha"]], ("alpha", 1), (1, 2), (1, 2, "3"), ("1", "2", "3"),
       ((1,), (2, 3), 4), 1j, (1j, 2, 3), np.nan, np.inf, (np.nan, 0, 0), 10**400, (10**400, 0, 0), 1e308, 5e-324, "5", object(),
       lambda: 0, Fraction(1, 2), np.zeros((2, 2)), np.array(["a"]), np.ones(3), set(), {"alpha"}, iter("abc"), "line\nline",
       "x" * 10_000, [0] * 10_000, range(3), (True, False, True), (1, True, 0), np.float32(1.0), np.array(5.0), np.bool_(True),
       {1: 2, 3: 4, 5: 6}, {1, 2, 3}, iter([1, 2, 3]), b"abc", ("alpha", "alpha"), ARM.scenes[0]]  # fmt: skip


def refused(**fields) -> str | None:
    """The message with which a scene of the arm is refused; None if it is one."""
    try:
        ARM.case(**{"name": "mine"} | fields)
    except ValueError as error:
        return str(error)
    return None


@pytest.mark.parametrize("field", FIELDS)
def test_every_field_takes_a_value_or_says_in_one_line_what_it_accepts(field):
    for value in ODD:
        message = refused(**{field: value})
        if message is not None:
            assert message.startswith("scene ") and message.endswith(" is expected") and "\n" not in message
            assert len(message) < 300, message
        else:
            case = ARM.case(**{"name": "mine"} | {field: value})
            assert case == dataclasses.replace(case) and hash(case) == hash(dataclasses.replace(case))
            assert case.scene == dataclasses.replace(case.scene) and case.steps > 0
            assert case.q.shape == case.v.shape == case.tau.shape == (len(case.joints),) == (len(case.tree.parent),)
            assert np.isfinite([case.q, case.v, case.tau]).all()


@pytest.mark.parametrize(
    "wrong, says",
    [
        ({"name": 3}, "scene 3: name is 3; a text that is not empty, in one line is expected"),
        ({"name": "a\nb"}, r"scene 'a\nb': name is 'a\nb'; a text that is not empty, in one line is expected"),
        ({"judged": "x"}, "scene 'mine': judged is 'x'; None, or a time in s of at least 0 and at most 5 is expected"),
        ({"judged": 6.0}, "scene 'mine': judged is 6.0; None, or a time in s of at least 0 and at most 5 is expected"),
        ({"gravity": "no"}, "scene 'mine': gravity is 'no'; True, the model's own, or False, none is expected"),
        ({"locked": None}, "scene 'mine': locked is None; a tuple of names is expected"),
        ({"locked": ("wrist",)}, "scene 'mine': locked is ('wrist',); a tuple of at most 2 of alpha, beta, gamma is expected"),
        ({"speed": None}, "scene 'mine': speed is None; a speed in deg/s for each joint is expected"),
        ({"speed": (1, 2)}, "scene 'mine': speed is (1.0, 2.0); 3 numbers, one per joint (alpha, beta, gamma), in deg/s is "
         "expected"),
        ({"duration": "5"}, "scene 'mine': duration is '5'; a time in s above 0 is expected"),
        ({"dt": 1e-300}, "scene 'mine': dt is 1e-300; a step that divides 5 s into at most 10,000,000 is expected"),
        ({"damping": True}, "scene 'mine': damping is True; at least 0 N m s/rad is expected"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_wrong_field(wrong, says):
    assert refused(**wrong) == says


@pytest.mark.parametrize(
    "wrong, says",
    [
        ({"posture": "sitting"}, "posture is 'sitting'; zero, hanging, upright, ball catch, bent or 3 numbers"),
        ({"posture": (1, 2)}, "one per joint"),
        ({"torque": "pull"}, "torque is 'pull'; free, hold, servos, or a torque in N m"),
        ({"torque": "servos"}, "torque is 'servos'; free, hold or numbers, as no actuator of this robot takes part"),
        ({"targets": 2.0}, 'targets is 2.0; torque = "servos" is expected'),
        ({"targets": "far", "torque": "servos"}, "targets is 'far'; a movement in deg .m., for all joints or for each"),
        ({"torque": (1, 2, np.inf)}, "in N m"),
        ({"torque": ()}, "3 numbers, one per joint"),
        ({"speed": "fast"}, "in deg/s"),
        ({"damping": -1}, "damping is -1; at least 0"),
        ({"duration": 0}, "duration is 0; a time in s above 0"),
        ({"dt": 0.3}, "dt is 0.3; a step that divides 5 s"),
        ({"dt": 7.0}, "a step that divides 5 s"),
        ({"locked": ("wrist",)}, "locked is .'wrist',.; a tuple of at most 2 of alpha, beta, gamma"),
        ({"locked": "beta"}, "a tuple of names"),
        ({"locked": ("alpha", "beta", "gamma")}, "a tuple of at most 2"),
        ({"locked": ("beta",), "speed": (0, 1, 0)}, "no speed of a locked joint .beta."),
    ],
)
def test_what_cannot_be_a_scene_is_refused_in_one_line(wrong, says):
    with pytest.raises(ValueError, match=says) as error:
        ARM.case(**{"name": "mine", "posture": "zero"} | wrong)
    assert str(error.value).startswith("scene 'mine': ") and "\n" not in str(error.value)


@given(
    st.dictionaries(
        st.sampled_from(FIELDS), st.one_of(st.floats(), st.text(), st.none(), st.tuples(*[st.floats()] * 3)), min_size=1
    )
)
def test_any_fields_are_a_scene_or_one_line(fields):
    assert "\n" not in (refused(**fields) or "")


def test_numbers_are_kept_as_floats_and_tuples_of_floats():
    scene = Scene(
        "mine", np.array([1, 2, 3]), speed=[0, 1, 0], locked=["gamma", "gamma"], damping=1, judged=np.array(2)
    )
    assert (scene.posture, scene.speed, scene.locked) == ((1.0, 2.0, 3.0), (0.0, 1.0, 0.0), ("gamma",))
    assert all(type(value) is float for value in (scene.damping, scene.duration, scene.dt, scene.judged))
    assert shorten("a" * 60) == "a" * 60 and len(shorten("a" * 61)) == 60


def test_a_torque_in_newton_metres_acts_on_the_free_joints():
    case = ARM.case("pushed", posture="bent", torque=(1.0, 0.5, -1.0), locked=("beta",))
    assert case.joints == ("alpha", "gamma") and case.tau.tolist() == [1.0, -1.0]
    assert np.allclose(case.q, np.radians([30, 60])) and case.locked == {"beta": np.radians(20.0)}
    held = ARM.case("held", posture="bent", torque="hold", locked=("beta",))
    assert np.allclose(tmt.acceleration(*held.start, held.tau, held.tree), 0.0, atol=1e-12) and held.tau.any()


def test_how_long_a_run_must_be_judged():
    short = {"duration": 2.0, "dt": 0.5}
    all_along = ARM.case("all", **short)
    assert required_time(all_along, "rk4", 0.5) == required_time(all_along, "implicit", 0.005) == 2.0
    assert required_time(all_along, "implicit", 0.5) == 0.3  # stable for no longer with so long a step
    for judged in (1.5, 0.0):
        assert required_time(ARM.case("some", judged=judged, **short), "rk4", 0.5) == judged
    assert required_time(ARM.case("own", judged=0.0, **short), "implicit", 0.5) == 0.0


# any robot


def robot(**fields) -> Robot:
    """A robot of two hinges."""
    tree = tmt.ARM.lock({"alpha": 0.0})
    return Robot(
        **{"name": "two", "mjcf": Path("none.xml"), "tree": tree, "postures": {"low": (0, 90)}, "scenes": ()} | fields
    )


@pytest.mark.parametrize(
    "fields, scene, says",
    [
        ({}, {"posture": "high"}, "posture is 'high'; low or 2 numbers, one per joint (beta, gamma), in deg is expected"),
        ({"postures": {}}, {"posture": "low"}, "posture is 'low'; 2 numbers, one per joint (beta, gamma), in deg is expected"),
        ({"postures": {"low": (0, 0, 90), "high": (0, -90)}}, {"posture": "low"}, "posture is 'low'; high or 2 numbers, one per "
         "joint (beta, gamma), in deg is expected"),
        ({}, {"torque": (1, 2, 3)}, "torque is (1.0, 2.0, 3.0); 2 numbers, one per joint (beta, gamma), in N m is expected"),
        ({}, {"locked": ("alpha",)}, "locked is ('alpha',); a tuple of at most 1 of beta, gamma is expected"),
        ({}, {"locked": ("beta", "gamma")}, "locked is ('beta', 'gamma'); a tuple of at most 1 of beta, gamma is expected"),
    ],
)  # fmt: skip
def test_a_case_has_the_joints_of_its_robot(fields, scene, says):
    with pytest.raises(ValueError) as error:
        robot(**fields).case("mine", **scene)
    assert str(error.value) == f"scene 'mine': {says}"


def test_a_case_takes_the_angles_of_a_posture_in_degrees():
    case = Case(robot(), Scene("low", "low", speed=(0, 180), locked=("beta",)))
    assert case.joints == case.tree.hinge_names == ("gamma",) and case.coordinates.names == case.joints
    assert case.q.tolist() == [np.pi / 2] and case.v.tolist() == [np.pi] and case.locked == {"beta": 0.0}
    assert robot().case().q.tolist() == [0.0, 0.0] and robot().case().joints == ("beta", "gamma")


# what a case changes


MOON = parse(XML.replace("0 0 -9.81", "0.5 -0.3 -1.62"), ARM.tree)
STICKY = parse(XML.replace('axis="1 0 0"/>', 'axis="1 0 0" damping="0.3"/>'), ARM.tree)


@pytest.mark.parametrize("case", ARM.cases, ids=lambda case: case.name)
def test_a_case_keeps_the_gravity_and_the_damping_of_the_file(case):
    gravity, damping = case.scene.gravity, case.scene.damping
    assert MOON.of(case).model.opt.gravity.tolist() == ([0.5, -0.3, -1.62] if gravity else [0.0, 0.0, 0.0])
    sticky = STICKY.of(case)
    assert sticky.model.dof_damping[sticky.dofs].tolist() == [damping + 0.3 * (name == "beta") for name in case.joints]
    assert case.tree.gravity == (tmt.ARM.gravity if gravity else (0.0, 0.0, 0.0))
    assert case.tree.damping == (damping,) * len(case.joints)


def test_an_engine_keeps_the_models_of_the_last_cases_only():
    engine = parse(XML, ARM.tree)
    first = engine.of(ARM.case())
    for k in range(200):
        engine.of(ARM.case("damped", damping=0.01 * k))
        assert engine.of(ARM.case()) is first  # asked for again and again
    assert len(engine.known) <= 64


@pytest.mark.parametrize("again", [False, True])
def test_cases_that_differ_in_one_change_have_their_own_models(again):
    """Of one engine, which keeps models: each is the stated model of its own case, in whatever order they are asked for."""
    changes = [
        {}, {"gravity": False}, {"damping": 0.1}, {"damping": 0.1001}, {"locked": ("beta",)}, {"locked": ("gamma",)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0)}, {"locked": ("beta",), "posture": (0.0, 40.001, 0.0)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0), "gravity": False}, {"locked": ("alpha", "beta")},
    ]  # fmt: skip
    engine, cases = parse(XML, ARM.tree), [ARM.case("one", **change) for change in changes]
    for case in cases[::-1] * again + cases:
        q, v = np.full((2, len(case.joints)), 0.7)
        found = engine.of(case).acceleration(q, v, v)
        assert np.allclose(found, tmt.acceleration(q, v, v, case.tree), rtol=1e-10, atol=1e-10), case.scene
