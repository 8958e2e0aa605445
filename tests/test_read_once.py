"""In a run a robot's file is read once and compiled once, whatever is compared."""

from collections import Counter
from xml.etree import ElementTree

import mujoco
import pytest
from models import PATHS

from compare.__main__ import main
from compare.robots.arm import ARM

OWNERS = {mujoco.MjSpec: "from_file from_string compile", mujoco.MjModel: "from_xml_path from_xml_string"}
OWNERS[ElementTree] = "iterparse"


@pytest.fixture
def counts(monkeypatch):
    counts = Counter()

    def count(owner, name):
        function = getattr(owner, name)

        def counted(*arguments, **options):
            counts[name] += 1
            return function(*arguments, **options)

        monkeypatch.setattr(owner, name, counted)

    for owner, names in OWNERS.items():
        for name in names.split():
            count(owner, name)
    return counts


@pytest.mark.parametrize("words", [
    ["parameters", "--mjcf", str(PATHS["gripper"])], ["stability", "--mjcf", str(PATHS["free_body"])],
    ["kinematics", "--mjcf", str(ARM.mjcf), "--reference", "arm"],
])  # fmt: skip
def test_a_file_is_parsed_and_compiled_once(inside, tmp_path, counts, words):
    assert main([*words, "--quick", "--out", str(tmp_path / "out")]) == 0
    # iterparse: for pipes among the files that it includes, for which MuJoCo would wait
    assert counts == {"iterparse": 1, "from_file": 1, "compile": 1}
