"""Random MJCF on the command line: files with attributes and elements dropped, doubled and changed get status 0, 1 or 2."""

import json
from copy import deepcopy
from xml.etree import ElementTree

import pytest
from helpers.in_process import without_workers
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from models import PATHS

from compare.__main__ import main
from compare.robots.arm import ARM

FILES = {"arm": ARM.mjcf} | {name: path for name, path in PATHS.items() if "humanoid" not in name}
VALUES = ["", "0", "-1", "1e-9", "1e300", "nan", "inf", "true", "x", "1 0 0", "0 0 0", "0 0 0 0", "1 2", "ball", "free",
          "slide", "hinge", "alpha", "world", "1 1 1 0.9 0.9 0.9", "\u00e4\n", "RK4", "integrator", "enable"]  # fmt: skip
TAGS = ["joint", "freejoint", "body", "inertial", "geom", "site", "default", "include", "option", "nothing"]
HOW = ["drop attribute", "change attribute", "drop", "double", "move", "add"]
NUMBERS = st.integers(0, 10_000)
CHANGES = st.lists(
    st.tuples(st.sampled_from(HOW), NUMBERS, NUMBERS, st.sampled_from(VALUES), st.sampled_from(TAGS)),
    min_size=1, max_size=3,
)  # fmt: skip


def changed(name, changes) -> str:
    """The text of a file after these changes, each to an element and an attribute by number."""
    root = ElementTree.fromstring(FILES[name].read_text(encoding="utf-8"))
    for how, at, which, value, tag in changes:
        inside = [(parent, child) for parent in root.iter() for child in parent] or [(root, root)]
        (parent, child), (_, other) = inside[at % len(inside)], inside[which % len(inside)]
        key = sorted(child.attrib)[which % len(child.attrib)] if child.attrib else "name"
        is_loop = child in other.iter() or other in child.iter()
        if how == "drop attribute":
            child.attrib.pop(key, None)
        elif how == "change attribute":
            child.set(key, value)
        elif how == "add":
            child.append(ElementTree.Element(tag, {"name": value} if value else {}))
        elif how == "double":
            parent.append(deepcopy(child))
        elif child is not root and (how == "drop" or not is_loop):
            parent.remove(child)
            if how == "move":
                other.append(child)
    return ElementTree.tostring(root, encoding="unicode")


def answers(name, changes, tmp_path, capsys, experiment="mass"):
    """A report with status 0 or 1 and nothing on stderr, or one line and status 2."""
    path, out = tmp_path / "random.xml", tmp_path / "out"
    path.write_text(changed(name, changes), encoding="utf-8")
    capsys.readouterr()
    with without_workers():
        status = main([experiment, "--quick", "--mjcf", str(path), "--out", str(out)])
    said, err = capsys.readouterr()
    if status == 2:
        assert said == "" and len(err.splitlines()) == 1 and "cannot go on: " not in err
        return
    checks = json.loads((out / "results.json").read_text(encoding="utf-8"))["checks"]
    failed = [check["quantity"] for check in checks if not check["passed"]]
    assert (err, status) == ("", int(bool(failed)))
    assert not any(quantity == "runs to its end" or "drawn" in quantity for quantity in failed)


FEW = {"suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]}


@settings(max_examples=6, **FEW)
@given(st.sampled_from(["arm", "loop", "pendulum_ball", "free_body"]), CHANGES)
def test_a_random_file_gets_a_status(tmp_path, capsys, name, changes):
    answers(name, changes, tmp_path, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["mass", "parameters", "acceleration"])
def test_many_random_files_get_a_status(tmp_path, capsys, experiment):
    @settings(max_examples=150, **FEW)
    @given(st.sampled_from(list(FILES)), CHANGES)
    def each(name, changes):
        answers(name, changes, tmp_path, capsys, experiment)

    each()
