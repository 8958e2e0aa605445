"""How a table is shown, and how long report.md becomes."""

import math
from dataclasses import dataclass

from sections import BAD, GOOD, section

from compare.core.rows import Row, column
from compare.experiments import EXPERIMENTS
from compare.report import tables
from compare.report.document import Document
from compare.report.verdict import Parts, Report
from compare.robots.arm import ARM


@dataclass(kw_only=True)
class Compared(Row):
    """A row of a table."""

    at: int
    share: float = 0.0
    passed: bool = True
    difference: float = 0.0
    printed: float = column(digits=7, default=1.23456789)
    names: str = column(names=True, default="x" * 99)
    unknown: float | None = column(optional=True)


def runs(count):
    return [Compared(at=k, share=0.01 * k) for k in range(count)]


def test_a_table_has_the_digits_of_its_columns_and_lists_are_cut():
    rows = [Compared(at=2, share=1.23456789), Compared(at=3, share=math.inf, unknown=2.0)]
    table = tables.of_rows(rows)
    columns, (first, second) = list(table.columns), table.to_numpy().tolist()
    assert columns == ["at", "share", "passed", "difference", "printed", "names", "unknown"]
    assert first == ["2", "1.23", "True", "0", "1.234568", f"{76 * 'x'} ...", ""]
    assert second[1] == "" and second[6] == "2"
    assert tables.of_rows(rows, ["share"]).to_dict("list") == {"share": ["1.23", ""]}


def text_of(*sections):
    document = Document(Report(sections, ARM, {"command": "c"}, "Worst in <i>.", (), ()), Parts())
    return document.text(document.body())


def test_report_md_is_short_whatever_there_is_to_say():
    sections = []
    for name in EXPERIMENTS:
        of = section(name, GOOD, *[BAD] * 50, rows=runs(405), figures=[f"{name}_{k}" for k in range(10)])
        of.result.notes = [f"Note {k} of {name}." for k in range(12)]
        sections.append(of)
    text = text_of(*sections)
    assert len(text.splitlines()) <= 600
    for name in EXPERIMENTS:
        parts = f"Note 11 of {name}.", f"(tables/{name}.csv)", f"(figures/{name}_9.png)"
        assert all(part in text for part in parts)


def test_a_small_report_md_is_whole_and_names_are_no_markup_in_it():
    of = section("trajectory", GOOD, rows=runs(405), what_should_i_use=[{"b": 1.25, "of": "<script> | b"}])
    of.result.notes = [*(f"Note {k}." for k in range(11)), "In `<option>`, 1 < 2 and a<b."]
    text = text_of(of)
    assert "6 of 405" in text and "| 5 |" in text and "| 6 |" not in text and "| 1.25 |" in text
    assert all(f"- Note {k}." in text for k in range(11))
    assert "&lt;script&gt; &#124; b" in text and "**Worst in &lt;i&gt;.**" in text
    of.result.filed = ("what_should_i_use",)  # in its file alone
    assert "1.25" not in text_of(of) and "(tables/what_should_i_use.csv)" in text_of(of)
