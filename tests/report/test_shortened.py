"""Which rows of a long table are shown, and how long report.md becomes."""

import numpy as np
import pytest
from sections import BAD, GOOD, section

from compare.report import markdown
from compare.report.parts import Parts
from compare.report.shortened import shortened
from compare.report.verdict import Report
from compare.robots.arm import ARM


def runs(scenes, integrators, steps):
    """Rows of runs, of which the last step is the worst of each scene and integrator."""
    return [
        {"scene": f"s{i}", "engine_integrator": f"e{j}", "dt_s": k, "difference_over_band": 0.01 * k}
        for i in range(scenes)
        for j in range(integrators)
        for k in range(steps)
    ]


def test_a_short_table_is_whole():
    rows = runs(1, 1, 12)
    assert shortened(rows, 12) == (rows, "")
    assert len(shortened(rows, 11)[0]) < 12


def test_of_runs_the_worst_of_each_scene_and_integrator_is_shown():
    kept, which = shortened(runs(3, 4, 5), most=6, most_of_runs=12)
    assert [(row["scene"], row["engine_integrator"]) for row in kept] == [
        (f"s{i}", f"e{j}") for i in range(3) for j in range(4)
    ]
    assert {row["dt_s"] for row in kept} == {4}
    assert which == "the worst of each scene and engine integrator, 12 of 60 rows"
    kept, which = shortened(runs(4, 4, 5), most=6, most_of_runs=12)  # one scene too many: of each scene
    assert [row["scene"] for row in kept] == ["s0", "s1", "s2", "s3"] and "each scene, 4 of 80" in which


def test_a_row_without_a_number_that_fails_is_the_worst():
    rows = [{"quantity": name, "difference_over_bar": 0.5, "passed": True} for name in "abcd" for _ in range(3)]
    rows[4] = {"quantity": "b", "difference_over_bar": None, "passed": False}
    kept, _ = shortened(rows, 4)
    assert rows[4] in kept and len(kept) == 4


def test_a_row_where_nothing_was_measured_is_not_the_worst():
    rows = [{"quantity": name, "difference_over_band": value} for name in "abcd" for value in (None, 0.1, np.nan)]
    kept, _ = shortened(rows, 4)
    assert all(np.isnan(row["difference_over_band"]) for row in kept)
    kept, _ = shortened(
        [row for row in rows if row["difference_over_band"] is None or row["difference_over_band"] < 1], 4
    )
    assert [row["difference_over_band"] for row in kept] == [0.1] * 4


def test_of_stated_numbers_those_that_differ_are_shown():
    rows = [{"of": str(k), "stated": 1.0, "compiled": 1.0, "difference": 0.0} for k in range(20)]
    assert shortened(rows, 10) == ([], "none of 20 rows differs")
    rows[7] |= {"compiled": 1.1, "difference": 0.1}
    assert shortened(rows, 10) == ([rows[7]], "1 of 20 rows differ")


def test_without_groups_the_worst_rows_are_shown_in_their_order_and_the_first_where_nothing_is_measured():
    rows = [{"at": k, "predicted_dt_s": 1.0, "observed_dt_s": 1.0 + 0.1 * (k % 7)} for k in range(21)]
    kept, which = shortened(rows, 3)
    assert [row["at"] for row in kept] == [6, 13, 20] and which == "the worst 3 of 21 rows"
    rows = [row | {"observed_dt_s": 2.0 - row["observed_dt_s"]} for row in rows]  # as far below what is predicted
    assert [row["at"] for row in shortened(rows, 3)[0]] == [6, 13, 20]
    kept, which = shortened([{"at": k} for k in range(21)], 3)
    assert [row["at"] for row in kept] == [0, 1, 2] and which == "the first 3 of 21 rows"


NAMES = ("parameters", "published", "kinematics", "mass", "gravity", "acceleration", "trajectory", "diagnosis", "speed",
         "stability", "reduction")  # fmt: skip


@pytest.mark.parametrize("checks, scenes, notes", [((GOOD,), 1, 3), ((GOOD,), 9, 40), ((GOOD, *[BAD] * 50), 9, 40)])
def test_report_md_has_at_most_300_lines_whatever_there_is_to_say(checks, scenes, notes):
    sections = []
    for name in NAMES:
        of = section(name, *checks, rows=runs(scenes, 1 if scenes == 1 else 5, 9))
        of.result.notes = [f"Note {k} of {name}." for k in range(notes)]
        of.figures = [(f"{name}_{k}", "A caption.") for k in range(10)]
        sections.append(of)
    report = Report(sections, ARM, {"command": "c"}, "words")
    body = markdown.markdown_body(report, Parts())
    text = markdown.markdown(report, body, Parts())
    assert len(text.splitlines()) <= 300
    for name in NAMES:
        assert f"## {name.capitalize()}\n" in text and f"Note 0 of {name}." in text
        assert f"(tables/{name}.csv)" in text and f"(figures/{name}_9.png)" in text
        assert (f"Note {notes - 1} of {name}." in text) == (notes == 3)
        assert (f"further findings: [index.html](index.html#{name})" in text) == (notes == 40)


def test_a_small_report_md_is_whole_and_has_the_worst_row_of_each_scene_and_integrator():
    of = section("trajectory", GOOD, rows=runs(9, 5, 9))
    of.result.notes = [f"Note {k}." for k in range(30)]
    text = "\n".join(markdown.markdown_body(Report([of], ARM, {"command": "c"}, "words"), Parts()))
    assert "the worst of each scene and engine integrator, 45 of 405 rows" in text and text.count("| 8 | 0.08 |") == 45
    assert all(f"- Note {k}." in text for k in range(30))


def test_a_table_that_stands_in_its_file_alone_is_linked():
    of = section("trajectory", GOOD, what_should_i_use=[{"b": 1.25}])
    report = Report([of], ARM, {"command": "c"}, "words")
    assert "| 1.25 |" in "\n".join(markdown.markdown_body(report, Parts()))
    of.result.filed = ("what_should_i_use",)
    text = "\n".join(markdown.markdown_body(report, Parts()))
    assert "1.25" not in text and "(tables/what_should_i_use.csv)" in text


def test_names_are_no_markup_in_report_md():
    of = section("mass", GOOD, rows=[{"scene": "<script>a</script> | b", "x": 1.5}])
    of.result.notes, of.figures = ["In `<option>`, 1 < 2 and a<b.", "<img src=x>"], [("a", "At <b>.")]
    report = Report([of], ARM, {"command": "c"}, "Worst in <i>.")
    text = markdown.markdown(report, markdown.markdown_body(report, Parts()), Parts())
    assert r"\<script>a\</script> \| b" in text and r"In `<option>`, 1 < 2 and a\<b." in text
    assert r"- \<img src=x>" in text and r"At \<b>." in text and r"**Worst in \<i>.**" in text


def test_report_md_says_how_each_experiment_stands():
    sections = [section("mass", GOOD), section("gravity", GOOD, BAD), section("speed")]
    report = Report(sections, ARM, {"command": "c"}, "words", (), [("published", "nothing is printed")])
    text = "\n".join(markdown.markdown_body(report, Parts()))
    for row in (
        "| mass | Mass | pass | 1 of 1 checks pass, at most 50 % of a tolerance |",
        "| gravity | Gravity | 1 of 2 fail | 1 of 2 checks pass, at most 50 % of a tolerance |",
        "| speed | Speed | nothing compared |  |",
        "| published |  | skipped | nothing is printed |",
    ):
        assert row in text
