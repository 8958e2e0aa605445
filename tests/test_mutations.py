"""The command that tests the judge: its edits apply to the sources as they are, and it sees which ones no test notices."""

from pathlib import Path

import pytest
from mutations.__main__ import main
from mutations.edit import DoesNotApply, Edit, applied
from mutations.edits import EDITS

PROJECT = Path(__file__).resolve().parent.parent


def test_every_edit_applies_and_says_what_it_breaks():
    lost = []
    for edit in EDITS:
        try:
            place = applied(PROJECT, edit)
            assert place.after != place.before
        except DoesNotApply as error:
            lost.append(str(error))
    assert lost == [] and all(edit.breaks for edit in EDITS)
    assert len({edit.name for edit in EDITS}) == len(EDITS)


JUDGE = """WIDTH = 0.5


class Check:
    def passed(self, value, tolerance=1.0):
        return (abs( value )
                <= tolerance)  # the rule
"""
TEST = """from compare.rules import Check


def test_it():
    assert Check().passed(0.5) and not Check().passed(1.5)
"""


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A project of one judge and its test."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # as fast as may be
    monkeypatch.setenv("PYTEST_PLUGINS", "xdist.plugin")
    for name, text in (("compare/rules.py", JUDGE), ("tests/test_toy.py", TEST)):
        path = tmp_path / "toy" / name
        path.parent.mkdir(parents=True)
        path.write_text(text)
    return tmp_path / "toy"


def test_one_edit_is_caught_and_one_survives(toy, capfd):
    edits = [
        Edit("rules", "Check.passed", "abs(_1) <= tolerance", "True or _1", "always passes"),
        Edit("moved", "WIDTH", "0.5", "5", "wide"),
    ]
    assert main(["--jobs", "1"], toy, edits) == 1
    out = capfd.readouterr().out
    assert "always passes: caught by tests/test_toy.py::test_it" in out and "wide: SURVIVED" in out
    assert "-WIDTH = 0.5\n+WIDTH = (5)" in out
    assert (toy / "compare/rules.py").read_text() == JUDGE
    for wrong in (Edit("rules", "WIDTH", "0.6", "5", ""), Edit("rules", "Check.failed", "1.0", "5", "")):
        assert main([], toy, [wrong]) == 2
