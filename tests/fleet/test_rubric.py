"""Points of a rubric: what is read, what is refused in one line, and what a file is given by its report."""

import csv
import json
import shutil

import pytest
import runs

from compare.__main__ import main
from compare.core.errors import Refused
from compare.fleet.models import place_of_report
from compare.fleet.rubric import read_rubric
from compare.fleet.table import AGREE, REFUSED, FileRow

EXPERIMENTS = "parameters", "mass"
RIGHT = """parameters = 4
[mass]
Mbar = 1.5
"M, bent" = 0.5
"""


def read(tmp_path, content):
    path = tmp_path / "points.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_rubric(str(path), EXPERIMENTS)


@pytest.mark.parametrize("content, word", [
    ("mass = ", "not a TOML file"), (b"\xff\xfe", "not a TOML file"), ("[[[", "not a TOML file"), ("", "no entry"),
    ("speed = 1", "speed is not an experiment of this fleet: parameters and mass"),
    ("[mas]\nMbar = 1", "mas is not an experiment"),
    ("mass = -1", "mass is -1; expected points"), ("mass = true", "mass is True"), ("mass = 'two'", "mass is 'two'"),
    ("mass = nan", "mass is nan"), ("[mass]\nMbar = [1]", r"mass: Mbar is \[1\]"),
])  # fmt: skip
def test_what_is_wrong_in_a_rubric_is_one_line(content, word, tmp_path):
    with pytest.raises(Refused, match=word) as refused:
        read(tmp_path, content)
    assert len(str(refused.value).splitlines()) == 1 and "points.toml" in str(refused.value)


def report(tmp_path, name, checks):
    """Write the report of a file with checks (experiment, quantity, scene, passed)."""
    folder = tmp_path / place_of_report(name)
    folder.mkdir(parents=True)
    fields = "experiment", "quantity", "scene", "passed"
    content = {"checks": [dict(zip(fields, check)) for check in checks]}
    (folder / "results.json").write_text(json.dumps(content))
    return FileRow(file=name, verdict=AGREE, has_report=True)


@pytest.mark.parametrize("checks, points", [
    ([("parameters", "com", "a", True), ("mass", "Mbar", "bent", True), ("mass", "M", "bent", True)], 6.0),
    ([("parameters", "com", "a", True), ("parameters", "com", "b", False), ("mass", "Mbar", "bent", True)], 1.5),
    ([("mass", "M", "bent", True), ("mass", "M", "zero", False), ("mass", "Mbar", "zero", False)], 0.5),
    ([("gravity", "Mbar", "bent", True)], 0.0),
])  # fmt: skip
def test_all_checks_of_an_entry_must_pass_and_one_at_least_be_there(checks, points, tmp_path):
    rubric = read(tmp_path, RIGHT)
    every = [("parameters", "", "", True), ("mass", "Mbar", "", True), ("mass", "M", "bent", True)]
    rows = [report(tmp_path, "a.xml", checks), report(tmp_path, "b.xml", every)]
    rows.append(FileRow(file="c.xml", verdict=REFUSED))
    rows.append(FileRow(file="d.xml", verdict=AGREE, has_report=True, same_as="a.xml"))
    rubric.award(rows, tmp_path)
    assert [row.points for row in rows] == [points, 6.0, 0.0, points] and rubric.total == 6.0


def test_a_check_that_no_file_has_is_named_with_those_that_are_known(tmp_path):
    rubric = read(tmp_path, "[mass]\nNbar = 1")
    row = report(tmp_path, "a.xml", [("mass", "Mbar", "bent", True)])
    with pytest.raises(Refused, match="mass: no file has a check 'Nbar'; known: Mbar"):
        rubric.award([row], tmp_path)
    rubric.award([FileRow(file="a.xml", verdict=REFUSED)], tmp_path)  # no report: nothing is known


def test_points_are_in_the_table_and_in_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(runs.ROOT / "tests" / "models" / "pendulum_ball.xml", "a.xml")
    (tmp_path / "b.xml").write_text("no model")
    (tmp_path / "points.toml").write_text("parameters = 3")
    words = ["fleet", "a.xml", "b.xml", "--only", "parameters", "--out", "out", "--workers", "1"]
    assert main([*words, "--rubric", "points.toml"]) == 0
    with (tmp_path / "out" / "fleet.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["file"]: row["points"] for row in csv.DictReader(file)}
    assert rows == {"a.xml": "3.0", "b.xml": "0.0"}
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert ">3 of 3<" in page and ">0 of 3<" in page and ">points<" in page
    assert main(words) == 0
    assert "points" not in (tmp_path / "out" / "fleet.csv").read_text(encoding="utf-8")
