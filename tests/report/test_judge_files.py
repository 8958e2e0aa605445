"""The files of a report: what they say of plain checks, rows and causes."""

import json

import pandas as pd
import pytest
from sections import BAD, GOOD, section

from compare.report import page, verdict
from compare.report.files import write
from compare.report.questions import answers
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
    assert len(page.failing(sections[0])) == 1


def test_each_section_says_what_became_of_its_own_claim(tmp_path):
    (tmp_path / "figures").mkdir()
    write(tmp_path, verdict.Report([section("mass", GOOD), section("gravity", BAD)], ARM, {"command": "c"}, "words"))
    for name in ("report.md", "index.html"):
        first, second = (tmp_path / name).read_text(encoding="utf-8").split("Gravity")[-2:]
        assert "It holds: all 1 checks pass." in first and "It does not hold: 1 of 1 checks fail." in second


def test_the_page_is_red_if_a_check_fails_and_tables_are_whole(tmp_path):
    (tmp_path / "figures").mkdir()
    rows = [{"a": 0.123456789012345678, "b": k} for k in range(3)]
    for checks, colour in (((GOOD,), "#009E73"), ((GOOD, BAD), "#D55E00")):
        html = page.page(
            tmp_path, verdict.Report([section("mass", *checks, rows=rows)], ARM, {"command": "c"}, "words")
        )
        assert colour in html and html.count("<td>0.123</td>") == 3
        assert ("Checks that fail" in html) == (len(checks) == 2)
    write(tmp_path, verdict.Report([section("mass", GOOD, rows=rows)], ARM, {"command": "c"}, "words"))
    lines = (tmp_path / "tables" / "mass.csv").read_text(encoding="utf-8").split()
    assert lines == ["a,b", *(f"{row['a']!r},{row['b']}" for row in rows)]
