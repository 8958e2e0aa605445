"""The row of a file, the order of rows, the table as CSV and as a page, and what has changed since an earlier fleet."""

import csv
import dataclasses
import html
import random
import re
from functools import partial
from types import SimpleNamespace

import pytest

from compare.core.cause import Cause
from compare.core.check import AT_OWN_STEP, ENDS, About, Result
from compare.fleet import table
from compare.fleet.table import AGREE, BROKE, DIFFER, ENGINE, ITSELF, REFUSED, FileRow
from compare.report.document import page_of
from compare.report.verdict import Report, Section
from compare.robots.arm import ARM
from compare.run.reference import Reference

CAUSE = Cause(rank=2, place="", stated=1.0, explains=2.0, text="mass of upper: stated 1 kg, compiled 2 kg")
CAUSES = [CAUSE, dataclasses.replace(CAUSE, text="another")]
BROKEN = ENDS, None, 0.0, "ended by SIGKILL, 4 times", "equal", About.PROGRAM
OFF = "limit, observed / predicted - 1", 0.01, 0.001, "", "at most", About.PREDICTION
STILL = "motion", None, 0.0, "nothing moves", "not judged", About.MODELS
OTHER = "M", 2.0, 1.0, "", "at most", About.ENGINE
OWN = AT_OWN_STEP, 0.002, 0.001, "with Euler", "at most", About.STEP


ROW = FileRow(file="a b.xml", sha256="1", verdict=AGREE, joints=3, worst_ratio=0.123456, file_integrator="Euler", file_dt=0.002,
              stable_at_file_dt=True, limit=0.01, seconds=1.26, has_report=True, reference="arm")  # fmt: skip


row = partial(dataclasses.replace, ROW)


def good(share=0.5):
    return "M", share, 1.0, "", "at most", About.MODELS


def judged(*checks, limits=(), causes=(), reference="arm"):
    """The row of one section with checks: (quantity, value, tolerance, note, rule, about)."""
    result = Result("stability", tables={"step_limits": list(limits)})
    for quantity, value, tolerance, note, rule, about in checks:
        if rule == "not judged":
            result.not_judged("home", quantity, note)
            continue
        result.check("home", quantity, value, tolerance, "s", note, about == About.MODELS, rule, about)
    section, judged_row = Section("stability", "", "", "", result), row()
    report = Report([section], ARM, {}, "", causes)
    table.judge(judged_row, report, Reference(reference, "a.xml"))
    return judged_row


@pytest.mark.parametrize("verdict, checks, more, named", [
    (AGREE, [good(1.0)], {}, ""), (ITSELF, [good()], {"reference": "model"}, ""),
    (AGREE, [good(), OWN], {}, "0.002 s, must be at most 0.001 s"),  # its own step is not stable: the reason says so
    (table.NOT_JUDGED, [good(), STILL], {}, "nothing moves"), (DIFFER, [good(2.0), STILL], {"causes": CAUSES}, "mass of upper"),
    (DIFFER, [good(1.0 + 1e-9), OWN, OFF], {"causes": CAUSES}, "mass of upper"),
    (DIFFER, [good(1.0 + 1e-9), BROKEN, BROKEN], {"causes": CAUSES}, "SIGKILL, 4 times; 1 more"),
    (BROKE, [good(), BROKEN, OWN, OFF], {}, "SIGKILL, 4 times"),
    (ENGINE, [good(), OTHER], {}, "Other engines: stability: M"), (DIFFER, [good(2.0), OTHER], {"causes": CAUSES}, "another"),
    (table.UNCONFIRMED, [good(), OFF, OWN], {}, "0.01"), (REFUSED, [], {}, "no comparison"),
])  # fmt: skip
def test_a_file_agrees_differs_breaks_off_or_is_refused(verdict, checks, more, named):
    row = judged(*checks, **more)
    assert row.verdict == verdict and named in row.reason and bool(named) == bool(row.reason)
    assert row.is_bad is (verdict not in (AGREE, ITSELF, REFUSED))  # the exit status


def test_the_largest_share_of_a_tolerance_of_the_models_is_in_the_row():
    small, large = (("M", value, 2.0, "", "at most", About.MODELS) for value in (0.3, 0.5))
    assert judged(small, large, OWN).worst_ratio == 0.25 and judged(STILL).worst_ratio is None


def limit(dt, stable, integrator="Euler"):
    of_file = {"file_integrator": "Euler", "stable_at_file_dt": stable}
    return SimpleNamespace(integrator=integrator, longest_s=dt, **of_file)


@pytest.mark.parametrize("limits, stable, least", [
    ([], None, None),
    ([limit(0.004, True), limit(0.001, False)], False, 0.001),
    ([limit(0.004, True), limit(0.0, None)], True, 0.004),  # at one posture it is not known
    ([limit(0.004, True), limit(0.001, False, integrator="RK4")], True, 0.004),  # another integrator
    ([limit(float("inf"), True)], True, None),
])  # fmt: skip
def test_the_own_step_is_that_of_the_own_integrator_at_all_postures(limits, stable, least):
    row = judged(good(), limits=limits)
    assert (row.stable_at_file_dt, row.limit) == (stable, least)


def test_what_needs_a_look_comes_first():
    right = [
        (DIFFER, None, 1e9, "a"), (DIFFER, True, 2.0, "a"), (BROKE, None, None, "a"), (table.NOT_JUDGED, None, 0.5, "a"),
        (table.UNCONFIRMED, None, 0.5, "a"),
        (REFUSED, None, None, "a"), (ITSELF, False, 0.1, "a"), (ITSELF, True, 0.9, "a"), (AGREE, False, 0.1, "a"),
        (AGREE, None, 0.9, "a"), (AGREE, True, 0.9, "b"), (AGREE, True, 0.0, "c"), (AGREE, None, None, "d"),
    ]  # fmt: skip
    fields = "verdict", "stable_at_file_dt", "worst_ratio", "file"
    rows = [row(**dict(zip(fields, values))) for values in right]
    for seed in range(20):
        assert sorted(random.Random(seed).sample(rows, len(rows)), key=lambda row: row.order) == rows


def cells_of(rows, **more):
    """report.md of a fleet, and the cells of its page."""
    text = table.document_of(
        rows, **{"summary": ["3 files"], "left_out": (), "origin": {"command": "c"}} | more
    )
    page = page_of("A fleet", text, True)
    return text, page, [re.findall("<td>(.*?)</td>", line) for line in page.split("<tr>")[2:]]


def test_a_row_is_marked_by_its_verdict_and_nothing_that_is_said_is_taken_for_markup():
    rows = [ROW, row(stable_at_file_dt=False), FileRow(file="a b.xml", verdict=REFUSED), row(verdict=ITSELF)]
    text, page, cells = cells_of(rows)
    assert [line[9] for line in cells] == ["10", "10", "", "10"]
    assert re.findall(r'<span class="mark (\w+)">', page) == ["good", "bad", "none", "none"]
    assert cells[2][0] == "a b.xml" and '<div class="verdict good">' in text
    assert '<div class="verdict bad">' in cells_of([row(verdict=table.UNCONFIRMED)])[0]
    said, name, value, why, reason, file = words = [f'<w{k}>&"|`*' for k in range(6)]
    more = {"left_out": [("a", why)], "origin": {name: value}, "summary": [said]}
    _, page, cells = cells_of([row(reason=reason, file=file)], **more)
    assert len(cells) == 1 and len(cells[0]) == 11
    assert "<w" not in page and all(word in html.unescape(page) for word in words)


def test_rows_are_in_their_order_in_the_csv_and_in_the_page(tmp_path):
    rows = [ROW, row(file="b.xml", verdict=DIFFER), row(file="c.xml", stable_at_file_dt=False),
            row(file="d.xml", same_as="c.xml", verdict=REFUSED)]  # fmt: skip
    summary = table.write_table(tmp_path, rows, [("early.xml", "because")], "the command")
    assert all(part in summary[0] for part in ("4 files", "1 copy", "1 was refused"))
    assert f"{summary[0]}</strong>" in (tmp_path / "index.html").read_text()
    with (tmp_path / "fleet.csv").open(newline="") as file:
        found = list(csv.DictReader(file))
    assert [row["file"] for row in found] == ["b.xml", "d.xml", "c.xml", "a b.xml"]
    assert tuple(found[0]) == table.FLEET_COLUMNS and found[0]["worst_ratio"] == "0.123456"
    for name in ("index.html", "report.md"):
        text = (tmp_path / name).read_text()
        assert all(
            part in text for part in ("early.xml", "the command", '"files/c.xml/index.html">d.xml</a>')
        )
        assert text.index(">b.xml<") < text.index(">c.xml<") < text.index(">a b.xml<")
