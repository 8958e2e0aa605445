"""Random MJCF on the command line: files with attributes and elements dropped, doubled and changed get status 0, 1 or 2."""

import json
from xml.etree import ElementTree

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from in_process import without_workers
from models import PATHS

from compare.__main__ import main
from compare.robots.arm import ARM

FILES = [ARM.mjcf, *(path for name, path in PATHS.items() if "humanoid" not in name)]
VALUES = ["", "0", "-1", "1e-9", "1e300", "nan", "inf", "true", "x", "1 0 0", "0 0 0", "0 0 0 0", "1 2", "ball", "free",
          "slide", "hinge", "alpha", "world", "1 1 1 0.9 0.9 0.9", "\u00e4\n", "RK4", "integrator", "enable"]  # fmt: skip
TAGS = ["joint", "freejoint", "body", "inertial", "geom", "site", "default", "include", "option", "nothing"]
CHANGES = st.lists(
    st.tuples(
        st.sampled_from(["change attribute", "drop", "double", "add"]),
        st.integers(0, 10_000), st.integers(0, 10_000), st.sampled_from(VALUES), st.sampled_from(TAGS),
    ), min_size=1, max_size=3,
)  # fmt: skip


def changed(file, changes) -> str:
    """The text of a file after these changes, each to an element and an attribute by number."""
    root = ElementTree.fromstring(file.read_text(encoding="utf-8"))
    for how, at, which, value, tag in changes:
        inside = [(parent, child) for parent in root.iter() for child in parent]
        if not inside:
            break
        parent, child = inside[at % len(inside)]
        attributes = sorted(child.attrib)
        if how == "drop":
            parent.remove(child)
        elif how == "double":
            parent.append(child)
        elif how == "add":
            child.append(ElementTree.Element(tag, {"name": value} if value else {}))
        elif attributes:
            child.attrib[attributes[which % len(attributes)]] = value
    return ElementTree.tostring(root, encoding="unicode")


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["mass", "parameters", "acceleration"])
def test_a_random_file_gets_a_report_or_one_line_and_status_2(experiment, tmp_path, capsys):
    path, out = tmp_path / "random.xml", tmp_path / "out"

    @settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow])
    @given(st.sampled_from(FILES), CHANGES)
    def each(file, changes):
        path.write_text(changed(file, changes), encoding="utf-8")
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
        assert not [quantity for quantity in failed if quantity == "runs to its end" or "drawn" in quantity]

    each()
