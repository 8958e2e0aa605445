"""Which rows of a long table are shown, and how long report.md becomes."""

import pandas as pd
from sections import BAD, GOOD, section

from compare.experiments import EXPERIMENTS
from compare.report.document import Document
from compare.report.tables import closest_checks, shortened, shown
from compare.report.verdict import Parts, Report
from compare.robots.arm import ARM


def runs(count):
    return [{"at": k, "difference_over_band": 0.01 * k, "passed": True} for k in range(count)]


def test_rows_that_fail_or_differ_are_shown_then_the_largest_shares_of_a_tolerance_in_their_order():
    rows = runs(12)
    assert shortened(rows, 12) == (rows, "")
    rows[3]["passed"], rows[5]["difference_over_band"] = False, None
    kept, which = shortened(rows, 3)
    assert [row["at"] for row in kept] == [3, 10, 11] and which == "3 of 12 rows"
    rows = [{"at": k, "stated": 1.0, "difference": 1e-9 * (k == 7)} for k in range(20)]
    assert [row["at"] for row in shortened(rows, 3)[0]] == [0, 1, 7]
    rows = [{"at": k, "difference_over_bar": share} for k, share in enumerate((0.1, None, 0.9, 0.5))]
    assert [row["at"] for row in shortened(rows, 2)[0]] == [2, 3]


def test_the_checks_that_fail_are_listed_first_then_those_closest_to_their_tolerance():
    checks = [(f"n{k}", 0.01 * k, 1.0, "at most", True) for k in range(9)]
    checks[2] = ("n2", 2.0, 1.0, "at most", True)
    assert closest_checks(section("mass", *checks), 3)["quantity"].tolist() == ["n2", "n7", "n8"]


def test_printed_numbers_have_seven_digits_and_others_three():
    table = shown(
        pd.DataFrame([{"published": 1.23456789, "other": 1.23456789, "names": "x" * 99, "no": None}])
    )
    assert (
        table.iloc[0].tolist()[:2] == ["1.234568", "1.23"]
        and len(table["names"][0]) == 80
        and table["no"][0] == ""
    )


def text_of(*sections):
    report = Report(sections, ARM, {"command": "c"}, "Worst in <i>.", (), ())
    document = Document(report, Parts())
    return document.text(document.body())


def test_report_md_is_short_whatever_there_is_to_say():
    sections = []
    for name in EXPERIMENTS:
        of = section(name, GOOD, *[BAD] * 50, rows=runs(405))
        of.result.notes = [f"Note {k} of {name}." for k in range(40)]
        of.figures = [(f"{name}_{k}", "A caption.") for k in range(10)]
        sections.append(of)
    text = text_of(*sections)
    assert len(text.splitlines()) <= 600
    for name in EXPERIMENTS:
        parts = (
            f"Note 0 of {name}.",
            f"(tables/{name}.csv)",
            f"(figures/{name}_9.png)",
            f"(index.html#{name})",
        )
        assert all(part in text for part in parts) and f"Note 39 of {name}." not in text


def test_a_small_report_md_is_whole_and_names_are_no_markup_in_it():
    of = section("trajectory", GOOD, rows=runs(405), what_should_i_use=[{"b": 1.25, "of": "<script> | b"}])
    of.result.notes = [*(f"Note {k}." for k in range(11)), "In `<option>`, 1 < 2 and a<b."]
    text = text_of(of)
    assert "6 of 405" in text and "| 404 |" in text and "| 398 |" not in text and "| 1.25 |" in text
    assert all(f"- Note {k}." in text for k in range(11))
    assert "&lt;script&gt; &#124; b" in text and "**Worst in &lt;i&gt;.**" in text
    of.result.filed = ("what_should_i_use",)  # in its file alone
    assert "1.25" not in text_of(of) and "(tables/what_should_i_use.csv)" in text_of(of)
