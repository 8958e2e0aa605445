"""Which rows of a long table are shown, and how long report.md becomes."""

from sections import BAD, GOOD, section

from compare.experiments import EXPERIMENTS
from compare.report.document import Document
from compare.report.tables import shortened
from compare.report.verdict import Parts, Report
from compare.robots.arm import ARM


def runs(scenes, integrators, steps):
    """Rows of runs, of which the last step is the worst of each scene and integrator."""
    return [
        {"scene": f"s{i}", "engine_integrator": f"e{j}", "dt_s": k, "difference_over_band": 0.01 * k}
        for i in range(scenes)
        for j in range(integrators)
        for k in range(steps)
    ]


def test_of_runs_the_worst_of_each_scene_and_integrator_is_shown():
    rows = runs(1, 1, 12)
    assert shortened(rows, 12) == (rows, "") and len(shortened(rows, 11)[0]) < 12
    kept, which = shortened(runs(3, 4, 5), most=6, most_of_runs=12)
    found = [(row["scene"], row["engine_integrator"], row["dt_s"]) for row in kept]
    assert found == [(f"s{i}", f"e{j}", 4) for i in range(3) for j in range(4)] and "12 of 60" in which
    kept, _ = shortened(runs(4, 4, 5), most=6, most_of_runs=12)  # one scene too many: of each scene
    assert [row["scene"] for row in kept] == ["s0", "s1", "s2", "s3"]


def test_of_numbers_that_are_stated_those_that_differ_are_shown_and_without_groups_the_worst():
    rows = [{"quantity": f"q{k}", "stated": 1.0, "compiled": 1.0, "difference": 0.0} for k in range(20)]
    assert shortened(rows, 10)[0] == []
    rows[7] |= {"compiled": 1.1, "difference": 0.1}
    assert shortened(rows, 10)[0] == [rows[7]]
    rows = [{"at": k, "predicted_dt_s": 1.0, "observed_dt_s": 1.0 - 0.1 * (k % 7)} for k in range(21)]
    assert [row["at"] for row in shortened(rows, 3)[0]] == [6, 13, 20]
    number = {"stated": 0.1, "compiled": 0.1, "difference": 0.0}
    for compiled, is_hidden in ((0.1 + 1e-16, True), (0.101, False)):
        words = shortened([number, number, number | {"compiled": compiled, "difference": compiled - 0.1}], 2)[1]
        assert ("not shown" in words) is is_hidden
    assert [row["at"] for row in shortened([{"at": k} for k in range(21)], 3)[0]] == [0, 1, 2]


def text_of(*sections):
    report = Report(sections, ARM, {"command": "c"}, "Worst in <i>.", (), ())
    document = Document(report, Parts())
    return document.text(document.body())


def test_report_md_has_at_most_300_lines_whatever_there_is_to_say():
    sections = []
    for name in EXPERIMENTS:
        of = section(name, GOOD, *[BAD] * 50, rows=runs(9, 5, 9))
        of.result.notes = [f"Note {k} of {name}." for k in range(40)]
        of.figures = [(f"{name}_{k}", "A caption.") for k in range(10)]
        sections.append(of)
    text = text_of(*sections)
    assert len(text.splitlines()) <= 300
    for name in EXPERIMENTS:
        parts = (f"Note 0 of {name}.", f"(tables/{name}.csv)", f"(figures/{name}_9.png)", f"(index.html#{name})")
        assert all(part in text for part in parts) and f"Note 39 of {name}." not in text


def test_a_small_report_md_is_whole_and_names_are_no_markup_in_it():
    of = section("trajectory", GOOD, rows=runs(9, 5, 9), what_should_i_use=[{"b": 1.25, "of": "<script> | b"}])
    of.result.notes = [*(f"Note {k}." for k in range(30)), "In `<option>`, 1 < 2 and a<b."]
    text = text_of(of)
    assert "45 of 405" in text and text.count("| 8 | 0.08 |") == 45 and "| 1.25 |" in text
    assert all(f"- Note {k}." in text for k in range(30))
    assert "&lt;script&gt; &#124; b" in text and "**Worst in &lt;i&gt;.**" in text
    of.result.filed = ("what_should_i_use",)  # in its file alone
    assert "1.25" not in text_of(of) and "(tables/what_should_i_use.csv)" in text_of(of)
