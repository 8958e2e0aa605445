"""The files of a report: what they say of plain checks, rows and causes."""

import json
from dataclasses import replace

import pandas as pd
import pytest
from sections import BAD, GOOD, section

from compare.report import page, tables, verdict
from compare.report.files import write
from compare.report.parts import Parts
from compare.robots import Question
from compare.robots.arm import ARM

CAUSE = {"rank": 2, "place": "mass", "stated": 1.0, "found": 2.0, "text": "mass of forearm: stated 1", "size": 9.0}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "figures").mkdir()
    return tmp_path


def report(sections, causes=(), robot=ARM):
    return verdict.Report(sections, robot, {"command": "c"}, "The verdict.", causes)


def text_of(path):
    return path.read_text(encoding="utf-8")


def test_results_have_every_check_cause_and_digit(folder):
    sections = [section("mass", GOOD, BAD, rows=[{"a": 1.25, "engine": "tmt", "ok": True}], extra=[{"b": 1 / 3}])]
    second = CAUSE | {"text": "com x of forearm: stated 3"}
    write(folder, report(sections, [CAUSE, second]))
    results = json.loads(text_of(folder / "results.json"))
    assert set(results) == {"passed", "reference", "checks", "causes", "skipped", "provenance"}
    assert results["passed"] is False and [check["passed"] for check in results["checks"]] == [True, False]
    assert set(results["checks"][0]) == {
        "experiment", "scene", "quantity", "rule", "value", "tolerance", "unit", "passed", "note",
    }  # fmt: skip
    fields = ("rank", "place", "stated", "found", "text")
    assert results["causes"] == [{name: cause[name] for name in fields} for cause in (CAUSE, second)]
    table = pd.read_csv(folder / "tables" / "mass.csv")
    assert table.to_dict("records") == [{"a": 1.25, "engine": "tmt", "ok": True}]
    assert pd.read_csv(folder / "tables" / "extra.csv")["b"][0] == pytest.approx(1 / 3, rel=1e-15)
    for name in ("report.md", "index.html"):
        assert all(cause["text"] in text_of(folder / name) for cause in (CAUSE, second))
    assert len(tables.failing(sections[0])) == 1


def test_the_page_is_red_if_a_check_fails_and_tables_are_whole(folder):
    rows = [{"a": 0.123456789012345678, "b": k} for k in range(3)]
    for checks, outcome in (((GOOD,), "good"), ((GOOD, BAD), "bad")):
        of, parts = report([section("mass", *checks, rows=rows)]), Parts()
        html = page.page(of, page.page_body(folder, of, parts), parts)
        assert f'<main id="main" class="{outcome}">' in html and f'<div class="verdict {outcome}">' in html
        assert html.count("<td>0.123</td>") == 3
    write(folder, report([section("mass", GOOD, rows=rows)]))
    lines = text_of(folder / "tables" / "mass.csv").split()
    assert lines == ["a,b", *(f"{row['a']!r},{row['b']}" for row in rows)]


def test_a_part_that_breaks_is_named_in_all_files_and_the_others_stay(folder):
    """A report of which the questions, a table, a check and a section cannot be made."""
    asks = replace(ARM, questions=(Question("a", "what", "mass", ("largest", "mass", "Mbar", None)),))
    other = {"quantity": "Mbar", "scene": "zero", "unit": "kg m2", "largest_difference": "far"}
    names = ("mass", other), ("gravity", {"a": 1.5}), ("speed", {})
    sections = [section(name, GOOD, rows=[row]) for name, row in names]
    sections[1].figures = [("nowhere", "A caption.")]
    sections[2].result.rows = 3
    parts = write(folder, report(sections, robot=asks))
    whys = {
        "tables/speed.csv": "ValueError", "the questions": "ValueError", "speed in report.md": "TypeError",
        "gravity in index.html": "FileNotFoundError", "speed in index.html": "TypeError",
    }  # fmt: skip
    assert {name: why.split(":")[0] for name, why in parts.broken.items()} == whys
    text, html = text_of(folder / "report.md"), text_of(folder / "index.html")
    assert all(name in text and name in html for name in whys)
    assert "## Gravity\n" in text and "![nowhere]" in text and "The verdict." in text and "A caption." not in html
    assert '<main id="main" class="bad">' in html
    assert sorted(path.name for path in (folder / "tables").iterdir()) == ["gravity.csv", "mass.csv"]
    results = json.loads(text_of(folder / "results.json"))
    failed = [check for check in results["checks"] if not check["passed"]]
    assert results["passed"] is False and {check["experiment"] for check in failed} == {"report"}
    assert all(check["quantity"].startswith(name) for check, name in zip(failed, whys, strict=True))


def test_a_number_that_json_does_not_know_costs_its_cause_alone(folder):
    parts = write(folder, report([section("mass", GOOD, BAD)], [CAUSE | {"found": float("nan")}, CAUSE]))
    results = json.loads(text_of(folder / "results.json"))
    assert len(parts.broken) == 1 and len(results["causes"]) == 1
    assert [check["passed"] for check in results["checks"]] == [True, False, False]


@pytest.mark.parametrize("length, cut", [(80, False), (81, True)])
def test_a_long_list_of_names_is_cut_in_the_report_and_whole_in_its_file(folder, length, cut):
    names = ("joint;" * 20)[:length]
    write(folder, report([section("mass", GOOD, rows=[{"names": names}])]))
    assert (f"| {names} |" in text_of(folder / "report.md")) == (not cut)
    assert pd.read_csv(folder / "tables" / "mass.csv")["names"].tolist() == [names]
