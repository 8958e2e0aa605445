"""The page of a report: what stands on its first screen and how it is marked, and what is folded below it."""

import re

import pytest
from matplotlib.figure import Figure
from sections import BAD, GOOD, section

from compare.judge.check import About
from compare.report import images, page
from compare.report.files import write
from compare.report.first_screen import LONG_SENTENCE, in_two
from compare.report.overview import BEGINNING
from compare.report.parts import Parts
from compare.report.verdict import Report, standing, verdict
from compare.robots.arm import ARM

CAUSE = {"rank": 2, "place": "mass of forearm", "stated": 1.5, "found": 1.6, "text": "mass of forearm: 1.6 kg"}


def with_figures(of, *files):
    of.figures = [(file, f"Caption of {file}.") for file in files]
    return of


def written(folder, sections, causes=(), skipped=(), parts=None):
    """The page of a report of these sections."""
    (folder / "figures").mkdir(exist_ok=True)
    for file in (file for one in sections for file, _ in one.figures):
        images.save_figure(Figure(figsize=(1, 1)), folder / "figures" / f"{file}.png")
    words = verdict(sections, len(sections), causes)
    report, parts = Report(sections, ARM, {"command": "c"}, words, causes, skipped), parts or Parts()
    return page.page(report, page.page_body(folder, report, parts), parts)


def first_screen(html):
    """What stands before the sections."""
    return html[: html.index("<section")]


def test_the_verdict_a_line_for_each_experiment_and_the_pictures_come_before_all_sections(tmp_path):
    names = ("parameters", "mass", "acceleration", "trajectory")
    sections = [section(name, GOOD) for name in names]
    with_figures(sections[1], "mass_distances")
    with_figures(sections[2], "acceleration_distances", f"{BEGINNING}agreement")
    with_figures(sections[3], "trajectory_a", f"{BEGINNING}scenes")
    html = written(tmp_path, sections, skipped=[("speed", "<too slow>")])
    top = first_screen(html)
    assert top.index('class="verdict good"') < top.index('class="experiments"') < top.index('class="pictures"')
    for name in names:
        assert re.search(rf'<li class="good">.*?<a href="#{name}">', top) and f'<section id="{name}"' in html
    assert '<li class="skipped">' in top and "&lt;too slow&gt;" in top and 'class="causes"' not in top
    pictures = re.findall(r'<figure class="good"><a href="#([^"]+)"><img alt="([^"]+)"', top)
    assert [link for link, _ in pictures] == ["figure-mass_distances", "figure-trajectory_a"]
    assert all(f'<figure id="{link}">' in html for link, _ in pictures)
    regions = re.findall(r'<div class="scroll" role="region" tabindex="0" aria-label="([^"]+)">', html)
    assert len(regions) == html.count("<table") and all(regions) and "<script" not in html


def test_a_failing_report_shows_stated_beside_found_and_first_the_picture_that_shows_it(tmp_path):
    sections = [
        with_figures(section("mass", GOOD), "mass_distances"),
        with_figures(section("acceleration", GOOD), f"{BEGINNING}agreement"),
        with_figures(section("trajectory", GOOD, BAD), f"{BEGINNING}scenes"),
    ]
    top = first_screen(written(tmp_path, sections, causes=[CAUSE]))
    assert re.search(r"<td>mass of forearm</td><td>1\.5</td><td>1\.6</td>", top)
    assert re.findall(r'<figure class="(\w+)"><a href="#([^"]+)"', top) == [
        ("bad", "trajectory"), ("good", "figure-mass_distances"),
    ]  # fmt: skip
    assert 'class="verdict bad"' in top and top.index('class="causes"') < top.index('class="experiments"')
    assert re.search(r'<a href="#trajectory"><span class="mark bad" aria-hidden="true">✗</span>trajectory</a>', top)


def test_where_no_picture_shows_what_fails_a_figure_of_the_failing_experiment_does(tmp_path):
    sections = [
        with_figures(section("kinematics", BAD), "kinematics_distances"),
        with_figures(section("mass", GOOD), f"{BEGINNING}agreement"),
    ]
    top = first_screen(written(tmp_path, sections))
    assert re.search(r'<div class="pictures"><figure class="bad"><a href="#figure-kinematics_distances">', top)
    assert re.search(r"<td>kinematics</td><td>zero</td><td>Mbar</td><td>2</td><td>1</td>", top)


@pytest.mark.parametrize("checks, kind, sign", [((GOOD,), "good", "✓"), ((GOOD, BAD), "bad", "✗"), ((), "none", "–")])
def test_a_line_and_a_section_are_marked_by_class_and_by_sign(tmp_path, checks, kind, sign):
    html = written(tmp_path, [section("mass", *checks), section("gravity", GOOD)])
    marked = f'<span class="mark {kind}" aria-hidden="true">{sign}</span>'
    assert f'<li class="{kind}">{marked}<div><a href="#mass">' in html and f'<p class="outcome {kind}">{marked}' in html


def test_a_report_of_which_a_part_broke_is_not_shown_as_passing(tmp_path):
    parts = Parts()
    for kind in ("good", "bad"):
        html = written(tmp_path, [section("mass", GOOD)], parts=parts)
        assert f'<div class="verdict {kind}">' in html and f'<main id="main" class="{kind}">' in html
        parts.made("a table", None, float, "no number")
    assert "a table" in html


def test_four_causes_or_failing_checks_stand_on_the_first_screen_and_all_below_it(tmp_path):
    for count in (4, 5):
        causes = [CAUSE | {"place": f"place {k}"} for k in range(count)]
        html = written(tmp_path, [section("mass", *[BAD] * count)], causes=causes)
        top = first_screen(html)
        assert top.count("<td>place ") == 4 and ('<a href="#causes">' in top) == (count == 5)
        assert html[len(top) :].count("<td>place ") == count
        top = first_screen(written(tmp_path, [section("mass", GOOD, *[BAD] * count)]))
        assert top.count("<td>Mbar</td>") == 4


def test_a_section_folds_its_details_and_all_but_the_first_figures(tmp_path):
    of = section("mass", GOOD, rows=[{"quantity": "other", "a": k} for k in range(50)], extra=[{"b": 1.5}])
    of.result.notes = [f"Note {k} < 9." for k in range(5)]
    of.result.filed = ("extra",)
    names = [f"mass_{k}" for k in range(4)] + ["mass_distances"]  # to the last one the first screen leads
    html = written(tmp_path, [with_figures(of, *names)])
    text = html[html.index('<section id="mass"') :]
    fold = text.index("<details>")
    assert text.index("Note 2 &lt; 9.") < fold < text.index("Note 3")
    assert "<table" not in text[:fold] and text.count("<tr><td>other</td>") == 40
    assert '<a href="tables/mass.csv">' in text and '<a href="tables/extra.csv">' in text and "<td>1.5</td>" not in text
    is_open = [text.index(f'id="figure-{name}"') < fold for name in names]
    assert is_open[:2] == [True, True] and is_open[-1] and sum(is_open) == 3


def test_the_large_sentence_is_short():
    names = ["parameters", "kinematics", "gravity", "acceleration"]
    for checks in ((GOOD,), (BAD,)):
        big, small = in_two(verdict([section(name, *checks) for name in names], 9))
        assert len(big) <= LONG_SENTENCE and not any(name in big for name in names)
        assert all(name in small for name in names)


def test_how_a_section_stands():
    broken, unstable = section("mass", GOOD), ("stable at its own step", 0.002, 0.001, "at most", False, About.STEP)
    broken.result.check("", "runs to its end", None, 0.0, "", "ValueError", rule="equal", about=About.PROGRAM)
    found = [standing(one) for one in (
        section("mass", GOOD), section("mass"), section("mass", GOOD, BAD), broken, section("mass", GOOD, unstable),
    )]  # fmt: skip
    assert [good for good, _ in found] == [True, None, False, False, False]
    assert "1 of 2" in found[2][1] and len({said for _, said in found}) == 5


def test_webp_is_for_the_page_alone(tmp_path):
    sections = [with_figures(section("mass", GOOD), "mass_distances")]
    written(tmp_path, sections)
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".png", ".webp"}
    write(tmp_path, Report(sections, ARM, {"command": "c"}, "words"))
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["mass_distances.png"]
    assert (tmp_path / "index.html").read_text(encoding="utf-8").count("data:image/") == 1
