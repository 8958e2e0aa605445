"""The row of a file, the order of rows, the table as CSV and as a page, and what has changed since an earlier fleet."""

import csv
import dataclasses
import json
import random
import re
import shutil
from functools import partial
from types import SimpleNamespace

import pytest
import runs

from compare.__main__ import main
from compare.core.cause import Cause
from compare.core.check import AT_OWN_STEP, ENDS, About, Result
from compare.core.errors import Refused
from compare.fleet import table
from compare.fleet.models import place_of_report
from compare.fleet.rubric import read_rubric
from compare.fleet.table import AGREE, BROKE, DIFFER, ITSELF, NOT_JUDGED, REFUSED, UNCONFIRMED, FileRow
from compare.report.verdict import Report, Section
from compare.robots.arm import ARM
from compare.run.reference import Reference

CAUSE = Cause(rank=2, place="", stated=1.0, explains=2.0, text="mass of upper: stated 1 kg, compiled 2 kg")
CAUSES = [CAUSE, dataclasses.replace(CAUSE, text="another")]
BROKEN = ENDS, None, 0.0, "ended by SIGKILL, 4 times", "equal", About.PROGRAM
OFF = "limit, observed / predicted - 1", 0.01, 0.001, "", "at most", About.PREDICTION
STILL = "motion", None, 0.0, "nothing moves", "not judged", About.MODELS
OWN = AT_OWN_STEP, 0.002, 0.001, "with Euler", "at most", About.STEP


ROW = FileRow(file="a b.xml", sha256="1", verdict=AGREE, joints=3, worst_ratio=0.123456, file_integrator="Euler", file_dt=0.002,
              stable_at_file_dt=True, limit=0.01, seconds=1.26, has_report=True, reference="arm")  # fmt: skip


row = partial(dataclasses.replace, ROW)


def good(share=0.5):
    return "M", share, 1.0, "", "at most", About.MODELS


def judged(*checks, limits=(), runs=(), causes=(), lost=(), reference="arm"):
    """The row of one section with checks: (quantity, value, tolerance, note, rule, about)."""
    result = Result("stability", tables={"step_limits": list(limits), "own_run": list(runs)})
    for quantity, value, tolerance, note, rule, about in checks:
        if rule == "not judged":
            result.not_judged("home", quantity, note)
            continue
        result.check("home", quantity, value, tolerance, "s", note, about == About.MODELS, rule, about)
    section, judged_row = Section("stability", "", "", "", result), row()
    report = Report([section], ARM, {}, "", causes)
    table.judge(judged_row, report, lost, Reference(reference, "a.xml"))
    return judged_row


@pytest.mark.parametrize("verdict, checks, more, named", [
    (AGREE, [good(1.0)], {}, ""), (ITSELF, [good()], {"reference": "model"}, ""),
    (AGREE, [good(), OWN], {}, "2 ms"),  # its own step is not stable: the reason says so
    (NOT_JUDGED, [good(), STILL], {}, "nothing moves"), (DIFFER, [good(2.0), STILL], {"causes": CAUSES}, "mass of upper"),
    (DIFFER, [good(1.0 + 1e-9), OWN, OFF], {"causes": CAUSES}, "mass of upper"),
    (DIFFER, [good(1.0 + 1e-9), BROKEN], {"causes": CAUSES, "lost": ["the table"]}, "SIGKILL, 4 times, and 1 more"),
    (BROKE, [good(), BROKEN, OWN, OFF], {}, "SIGKILL, 4 times"), (BROKE, [good()], {"lost": ["the table"]}, "the table"),
    (UNCONFIRMED, [good(), OFF, OWN], {}, "0.01"), (REFUSED, [], {}, "no comparison"),
])  # fmt: skip
def test_a_file_agrees_differs_breaks_off_or_is_refused(verdict, checks, more, named):
    row = judged(*checks, **more)
    assert row.verdict == verdict and named in row.reason and bool(named) == bool(row.reason)


def limit(dt, stable, integrator="Euler", kind="finite"):
    of_file = {"file_integrator": "Euler", "stable_at_file_dt": stable}
    return SimpleNamespace(integrator=integrator, limit=kind, predicted_dt=dt, **of_file)


@pytest.mark.parametrize("limits, stable, least", [
    ([], None, None),
    ([limit(0.004, True), limit(0.001, False)], False, 0.001),
    ([limit(0.004, True), limit(0.001, None)], True, 0.001),  # at one posture it is not known
    ([limit(0.004, True), limit(0.001, False, integrator="RK4")], True, 0.004),  # another integrator
    ([limit(None, True, kind="always stable"), limit(None, None, kind="saddle")], True, None),
])  # fmt: skip
def test_the_own_step_is_that_of_the_own_integrator_at_all_postures(limits, stable, least):
    row = judged(good(), limits=limits)
    assert (row.stable_at_file_dt, row.limit) == (stable, least)
    for outcome, is_stable in {"calm": True, "alike": True, "worse": False, "fails": False}.items():
        runs = [SimpleNamespace(outcome=run) for run in ("calm", outcome)]
        row = judged(good(), limits=limits, runs=runs)
        assert row.stable_at_file_dt is (is_stable and stable is not False)


def test_what_needs_a_look_comes_first():
    right = [
        (DIFFER, None, 1e9, "a"), (DIFFER, True, 2.0, "a"), (BROKE, None, None, "a"), (NOT_JUDGED, None, 0.5, "a"),
        (UNCONFIRMED, None, 0.5, "a"),
        (REFUSED, None, None, "a"), (ITSELF, False, 0.1, "a"), (ITSELF, True, 0.9, "a"), (AGREE, False, 0.1, "a"),
        (AGREE, None, 0.9, "a"), (AGREE, True, 0.9, "b"), (AGREE, True, 0.0, "c"), (AGREE, None, None, "d"),
    ]  # fmt: skip
    fields = "verdict", "stable_at_file_dt", "worst_ratio", "file"
    rows = [row(**dict(zip(fields, values))) for values in right]
    for seed in range(20):
        assert sorted(random.Random(seed).sample(rows, len(rows)), key=lambda row: row.order) == rows


@pytest.mark.parametrize("before, now, named", [
    ({}, {"seconds": 99.0, "worst_ratio": 0.9, "sha256": "2", "reason": "other"}, None),
    ({}, {"verdict": DIFFER, "reason": "mass of x"}, ["agree", "differ"]),
    ({"stable_at_file_dt": None}, {"stable_at_file_dt": False}, ["stable unknown", "false"]),
    ({}, {"limit": 0.010099}, None),
    ({}, {"limit": 0.010101}, ["0.01 ", "0.010101"]),
    ({"limit": None}, {}, ["unknown", "0.01"]),
    ({}, {"file": "new.xml", "verdict": REFUSED}, ["a b.xml", "agree", "new.xml", "refused"]),  # and one is gone
])  # fmt: skip
def test_a_verdict_a_step_or_a_limit_that_is_another_is_told(before, now, named, tmp_path):
    (tmp_path / "fleet.csv").write_text(table.table_of([row(**before)]), encoding="utf-8")
    found = table.changes(table.earlier(tmp_path), [row(**now)])
    places = [" ".join(found).index(name) for name in named or ()]
    assert bool(found) == bool(named) and places == sorted(places)


def page_of(rows, **more):
    given = {"summary": [], "left_out": (), "changed": None, "origin": {}, "most_points": None}
    return table.fleet_page(rows=rows, **given | more)


def test_a_row_is_marked_by_its_verdict_and_nothing_that_is_said_is_taken_for_html():
    rows = [ROW, row(stable_at_file_dt=False), FileRow(file="a b.xml", verdict=REFUSED), row(verdict=ITSELF)]
    text = page_of(rows)
    assert re.findall(r'<td class="limit_s">(.*?)</td>', text) == ["10", "10", "", "10"]
    assert re.findall(r'<tr class="(\w+)">', text) == ["good", "bad", "none", "none"]
    assert '<th scope="row">a b.xml</th>' in text and '<div class="verdict good">' in text
    text = page_of([row(verdict=UNCONFIRMED)])
    assert '<div class="verdict bad">' in text and '<tr class="bad">' in text
    said, name, value, why, reason, change = words = [f'<w{k}>&"' for k in range(6)]
    more = {"left_out": [("a", why)], "changed": [change], "origin": {name: value}}
    text = page_of([row(reason=reason)], summary=[said], **more)
    for k in range(len(words)):
        assert f"<w{k}>" not in text and f"&lt;w{k}&gt;&amp;" in text


def test_rows_are_in_their_order_in_the_csv_and_in_the_page(tmp_path):
    rows = [ROW, row(file="b.xml", verdict=DIFFER), row(file="c.xml", stable_at_file_dt=False),
            row(file="d.xml", same_as="c.xml", verdict=REFUSED)]  # fmt: skip
    summary = table.write_table(tmp_path, rows, [("early.xml", "because")], None, "the command")
    assert all(part in summary[0] for part in ("4 files", "1 copy", "1 was refused"))
    with (tmp_path / "fleet.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    assert [row["file"] for row in found] == ["b.xml", "d.xml", "c.xml", "a b.xml"]
    assert tuple(found[0]) == table.FLEET_COLUMNS and found[0]["worst_ratio"] == "0.123456"
    text = (tmp_path / "index.html").read_text()
    assert all(part in text for part in ("early.xml", "the command", '"files/c.xml/index.html">d.xml</a>'))
    assert text.index(">b.xml<") < text.index(">c.xml<") < text.index(">a b.xml<")


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
