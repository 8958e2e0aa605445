"""The files of a report: what they say of plain checks, rows and causes."""

import json
from dataclasses import replace

import pandas as pd
import pytest
from sections import BAD, GOOD, section

from compare.report import page, tables, verdict
from compare.report.files import write
from compare.report.parts import Parts
from compare.report.questions import answers
from compare.robots import Question
from compare.robots.arm import ARM

CAUSE = {"rank": 2, "place": "mass", "stated": 1.0, "found": 2.0, "text": "mass of forearm: stated 1", "size": 9.0}


def test_a_report_of_sections_without_rows_is_written_and_says_so(tmp_path):
    broken = [section(name) for name in ("published", "kinematics", "mass", "acceleration", "trajectory", "speed")]
    (tmp_path / "figures").mkdir()
    write(tmp_path, verdict.Report(broken, ARM, {"command": "c"}, "words"))
    found = [answer for *_, answer in answers(broken, ARM)]
    assert found.count("no result: the experiment broke off") >= 6
    assert list((tmp_path / "tables").iterdir()) == []
    assert "no result" in (tmp_path / "report.md").read_text(encoding="utf-8")


def test_results_say_what_was_found(tmp_path):
    (tmp_path / "figures").mkdir()
    sections = [section("mass", GOOD, BAD, rows=[{"a": 1.25, "engine": "tmt", "ok": True}], extra=[{"b": 1 / 3}])]
    text = verdict.verdict(sections, 1, [CAUSE])
    assert text == (
        "The two models do not agree: 1 of 2 checks fail. Cause: mass of forearm: stated 1. "
        "1 checks fail as a consequence."
    )
    second = CAUSE | {"text": "com x of forearm: stated 3"}
    write(tmp_path, verdict.Report(sections, ARM, {"command": "c"}, text, [CAUSE, second]))
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert set(results) == {"passed", "reference", "checks", "causes", "skipped", "provenance"}
    assert results["passed"] is False and results["skipped"] == []
    assert [check["passed"] for check in results["checks"]] == [True, False]
    assert set(results["checks"][0]) == {
        "experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "passed", "note",
    }  # fmt: skip
    fields = ("rank", "place", "stated", "found", "text")
    assert results["causes"] == [{name: cause[name] for name in fields} for cause in (CAUSE, second)]
    table = pd.read_csv(tmp_path / "tables" / "mass.csv")
    assert table.to_dict("records") == [{"a": 1.25, "engine": "tmt", "ok": True}]
    assert pd.read_csv(tmp_path / "tables" / "extra.csv")["b"][0] == pytest.approx(1 / 3, rel=1e-15)
    for name in ("report.md", "index.html"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert "mass of forearm: stated 1" in text and "com x of forearm: stated 3" in text
        assert "Checks that fail" in text and "must" not in text
    assert len(tables.failing(sections[0])) == 1


def test_each_section_says_what_became_of_its_own_claim(tmp_path):
    (tmp_path / "figures").mkdir()
    write(tmp_path, verdict.Report([section("mass", GOOD), section("gravity", BAD)], ARM, {"command": "c"}, "words"))
    for name in ("report.md", "index.html"):
        first, second = (tmp_path / name).read_text(encoding="utf-8").split("Gravity")[-2:]
        assert "It holds: all 1 checks pass." in first and "It does not hold: 1 of 1 checks fail." in second


def test_the_page_is_red_if_a_check_fails_and_tables_are_whole(tmp_path):
    (tmp_path / "figures").mkdir()
    rows = [{"a": 0.123456789012345678, "b": k} for k in range(3)]
    for checks, outcome in (((GOOD,), "good"), ((GOOD, BAD), "bad")):
        report, parts = verdict.Report([section("mass", *checks, rows=rows)], ARM, {"command": "c"}, "words"), Parts()
        html = page.page(report, page.page_body(tmp_path, report, parts), parts)
        assert f'<main id="main" class="{outcome}">' in html and f'<div class="verdict {outcome}">' in html
        assert html.count("<td>0.123</td>") == 3
        assert ("Checks that fail" in html) == (len(checks) == 2)
    write(tmp_path, verdict.Report([section("mass", GOOD, rows=rows)], ARM, {"command": "c"}, "words"))
    lines = (tmp_path / "tables" / "mass.csv").read_text(encoding="utf-8").split()
    assert lines == ["a,b", *(f"{row['a']!r},{row['b']}" for row in rows)]


def broken_report():
    """A report of which the questions, a table, a check and a section cannot be made."""
    asks = replace(ARM, questions=(Question("a", "what", "mass", ("largest", "mass", "Mbar", None)),))
    other = {"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": "far"}
    sections = [
        section("mass", GOOD, rows=[other]),
        section("gravity", GOOD, rows=[{"a": 1.5}]),
        section("speed", GOOD),
    ]
    sections[1].figures = [("nowhere", "A caption.")]
    sections[2].result.rows = 3
    return verdict.Report(sections, asks, {"command": "c"}, "The two models agree.")


def test_a_part_that_breaks_is_named_in_all_files_and_the_others_stay(tmp_path):
    (tmp_path / "figures").mkdir()
    parts = write(tmp_path, broken_report())
    whys = {
        "tables/speed.csv": "ValueError: DataFrame",
        "the questions": "ValueError: Unknown format code 'e'",
        "speed in report.md": "TypeError: 'int' object",
        "gravity in index.html": "FileNotFoundError",
        "speed in index.html": "TypeError: 'int' object",
    }
    assert list(parts.broken) == list(whys)
    assert all(parts.broken[name].startswith(why) for name, why in whys.items()), parts.broken
    text, html = ((tmp_path / name).read_text(encoding="utf-8") for name in ("report.md", "index.html"))
    for name in whys:
        assert f"This report is not complete: {name} could not be made, " in text
        assert f"This report is not complete: {name} could not be made, " in html
    assert "## Gravity\n\n**It holds: all 1 checks pass.**" in text and "![nowhere]" in text
    assert "## Speed\n\nThis section could not be made." in text and "The two models agree." in text
    assert '<main id="main" class="bad">' in html and "<em>Claim:</em> They agree." in html
    assert sorted(path.name for path in (tmp_path / "tables").iterdir()) == ["gravity.csv", "mass.csv"]
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert results["passed"] is False
    failed = [check for check in results["checks"] if not check["passed"]]
    assert [(check["experiment"], check["quantity"]) for check in failed] == [
        ("report", f"{name} can be made") for name in whys
    ]


@pytest.mark.parametrize("length, cut", [(80, False), (81, True)])
def test_a_long_list_of_names_is_cut_in_the_report_and_whole_in_its_file(tmp_path, length, cut):
    (tmp_path / "figures").mkdir()
    names = "joint;" * 20
    rows = [{"names": names[:length], "reason": names}]
    write(tmp_path, verdict.Report([section("mass", GOOD, rows=rows)], ARM, {"command": "c"}, "words"))
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert (f"| {names[:76]} ... |" in text) == cut and (f"| {names[:length]} |" in text) == (not cut)
    assert names in text and pd.read_csv(tmp_path / "tables" / "mass.csv")["names"].tolist() == [names[:length]]


def test_a_number_that_json_does_not_know_costs_its_check_alone(tmp_path):
    (tmp_path / "figures").mkdir()
    wrong = CAUSE | {"found": float("nan")}
    parts = write(
        tmp_path, verdict.Report([section("mass", GOOD, BAD)], ARM, {"command": "c"}, "words", [wrong, CAUSE])
    )
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert list(parts.broken) == ["cause 1 in results.json"] and len(results["causes"]) == 1
    assert [check["passed"] for check in results["checks"]] == [True, False, False]
