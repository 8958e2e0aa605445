"""A robot of four hinges goes through every experiment that can serve it, and nothing in compare knows it."""

import json
import re

import pytest
from crane import TREE
from small_runs import of_crane


@pytest.mark.slow
def test_all_experiments_pass_and_draw_and_the_report_is_of_this_robot(shared):
    made = shared(of_crane)
    assert [name for name in made.reasons if name != "engines"] == ["published"]
    for section in made.sections:
        assert section.name == "diagnosis" or section.result.checks
        assert [str(check) for check in section.result.checks if not check.passed] == []
        assert all(made.sizes[figure] > 5000 and caption for figure, caption in section.figures)
    text, results = made.texts["report.md"], json.loads(made.texts["results.json"])
    assert not re.search(r"alpha|gamma|forearm|ball catch|assignment|α", text)
    assert all(joint in text for joint in TREE.joint_names) and results["passed"]
