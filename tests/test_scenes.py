"""A scene changes what it says and nothing else; what cannot be a scene is refused in one line."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tmt
from compare.engine_file import ARM_XML, parse
from compare.scenes import SCENES, Scene, shorten

XML = ARM_XML.read_text()
MINE = {"name": "mine", "posture": "zero", "torque": "free"}
FIELDS = [field.name for field in dataclasses.fields(Scene)]
ODD = [None, 3, -1, 0, True, 2.5, "x", "", "no", b"alpha", [],
       (), {}, [["alpha"]], ("alpha", 1), (1, 2), (1, 2, "3"), ("1", "2", "3"),
       ((1,), (2, 3), 4), 1j, (1j, 2, 3), np.nan, np.inf, (np.nan, 0, 0), 10**400, (10**400, 0, 0), 1e308, 5e-324, "5", object(),
       lambda: 0, Fraction(1, 2), np.zeros((2, 2)), np.array(["a"]), np.ones(3), set(), {"alpha"}, iter("abc"), "line\nline",
       "x" * 10_000, [0] * 10_000, range(3), (True, False, True), np.float32(1.0), SCENES[0]]  # fmt: skip


def refused(**fields) -> str | None:
    """The message with which a scene is refused; None if it is one."""
    try:
        Scene(**MINE | fields)
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
            scene = Scene(**MINE | {field: value})
            assert scene == dataclasses.replace(scene) and hash(scene) == hash(dataclasses.replace(scene))
            assert scene.steps > 0 and scene.start[0].shape == scene.tau.shape


@pytest.mark.parametrize(
    "wrong, says",
    [
        ({"name": 3}, "scene 3: name is 3; a text that is not empty is expected"),
        ({"judged": "x"}, "scene 'mine': judged is 'x'; None, or a time in s above 0 and at most 5 is expected"),
        ({"judged": 6.0}, "scene 'mine': judged is 6.0; None, or a time in s above 0 and at most 5 is expected"),
        ({"gravity": "no"}, "scene 'mine': gravity is 'no'; True, the model's own, or False, none is expected"),
        ({"locked": None}, "scene 'mine': locked is None; a tuple of at most two of alpha, beta, gamma is expected"),
        ({"speed": None}, "scene 'mine': speed is None; three numbers, one per hinge (alpha, beta, gamma), in deg/s is expected"),
        ({"duration": "5"}, "scene 'mine': duration is '5'; a time in s above 0 is expected"),
        ({"dt": 1e-300}, "scene 'mine': dt is 1e-300; a step that divides 5 s into at most 10,000,000 is expected"),
        ({"damping": True}, "scene 'mine': damping is True; at least 0 N m s/rad is expected"),
    ],
)  # fmt: skip
def test_what_is_said_of_a_wrong_field(wrong, says):
    assert refused(**wrong) == says


@given(
    st.dictionaries(
        st.sampled_from(FIELDS), st.one_of(st.floats(), st.text(), st.none(), st.tuples(*[st.floats()] * 3)), min_size=1
    )
)
def test_any_fields_are_a_scene_or_one_line(fields):
    assert "\n" not in (refused(**fields) or "")


def test_numbers_are_kept_as_tuples_of_floats():
    scene = Scene(**MINE | {"posture": np.array([1, 2, 3]), "speed": [0, 1, 0], "locked": ["gamma"]})
    assert (scene.posture, scene.speed, scene.locked) == ((1.0, 2.0, 3.0), (0.0, 1.0, 0.0), ("gamma",))
    assert shorten("a" * 60) == "a" * 60 and len(shorten("a" * 61)) == 60


MOON = parse(XML.replace("0 0 -9.81", "0 0 -1.62"))
STICKY = parse(XML.replace('axis="1 0 0"/>', 'axis="1 0 0" damping="0.3"/>'))


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_a_scene_keeps_the_gravity_and_the_damping_of_the_file(scene):
    assert scene.engine(MOON).model.opt.gravity[2] == (-1.62 if scene.gravity else 0.0)
    sticky = scene.engine(STICKY)
    damping = sticky.model.dof_damping[sticky.dofs]
    assert damping.tolist() == [scene.damping + 0.3 * (name == "beta") for name in scene.hinges]
    arm = scene.model
    assert arm.gravity == (tmt.ARM.gravity if scene.gravity else (0.0, 0.0, 0.0))
    assert arm.damping == (scene.damping,) * len(scene.hinges)
