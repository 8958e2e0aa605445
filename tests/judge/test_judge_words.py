"""Names as parts of sentences: those of a user are never changed."""

from dataclasses import replace

import pytest

from compare.case import Scene
from compare.judge.words import posture_begins, scene_begins
from compare.robots.arm import ARM


@pytest.mark.parametrize(
    "tags, begins", [(("own",), "Scene mine"), (("own", "speed"), "Scene mine"), (("speed",), "Mine")]
)
def test_a_scene_of_a_user_begins_no_sentence(tags, begins):
    robot = replace(ARM, scenes=(*ARM.scenes, Scene("mine", tags=tags)))
    assert scene_begins("mine", robot) == begins
    assert scene_begins("bent, free", robot) == "Bent, free"


def test_a_posture_of_a_file_begins_no_sentence():
    robot = replace(ARM, positions={"open": (0.0, 0.0, 0.0)})
    assert posture_begins("open", robot) == "Posture open" and posture_begins("bent", robot) == "Bent"
