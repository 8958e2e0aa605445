"""The first screen: every experiment has its line, what fails is marked by more than colour, causes and pictures stand there."""

import re

import pytest
from matplotlib.figure import Figure
from sections import BAD, GOOD, section

from compare.judge.check import About
from compare.report import images, page
from compare.report.files import write
from compare.report.first_screen import in_two
from compare.report.overview import BEGINNING
from compare.report.parts import Parts
from compare.report.verdict import Report, standing, verdict
from compare.robots.arm import ARM

CAUSE = {"rank": 2, "place": "mass of forearm", "stated": 1.5, "found": 1.6, "text": "mass of forearm: 1.6 kg"}


def written(folder, sections, causes=(), skipped=()):
    """The page of a report of these sections."""
    (folder / "figures").mkdir(exist_ok=True)
    for one in sections:
        for file, _ in one.figures:
            images.save_figure(Figure(figsize=(1, 1)), folder / "figures" / f"{file}.png")
    report = Report(sections, ARM, {"command": "c"}, verdict(sections, len(sections), causes), causes, skipped)
    parts = Parts()
    html = page.page(report, page.page_body(folder, report, parts), parts)
    assert not parts.broken
    return html


def first_screen(html):
    """What stands before the sections."""
    return html[: html.index("<section")]


def with_figures(of, *files):
    of.figures = [(file, f"Caption of {file}.") for file in files]
    return of


def test_the_verdict_a_line_for_each_experiment_and_the_pictures_come_before_all_sections(tmp_path):
    names = ("parameters", "mass", "acceleration", "trajectory")
    sections = [section(name, GOOD) for name in names]
    with_figures(sections[1], "mass_distances")
    with_figures(sections[2], "acceleration_distances", f"{BEGINNING}agreement")
    with_figures(sections[3], "trajectory_a", f"{BEGINNING}scenes")
    html = written(tmp_path, sections, skipped=[("speed", "too slow")])
    top = first_screen(html)
    assert top.index('class="verdict good"') < top.index('class="experiments"') < top.index('class="pictures"')
    for name in names:
        assert re.search(rf'<li class="good">.*?<a href="#{name}">{name.capitalize()}</a> <strong>pass</strong>', top)
        assert html.count(f'<section id="{name}"') == 1 and f'<a href="#{name}">{name}</a>' in html
    assert '<li class="skipped">' in top and "too slow" in top
    pictures = re.findall(r'<figure class="good"><a href="#([^"]+)"><img alt="([^"]+)"', top)
    assert [link for link, _ in pictures] == ["figure-mass_distances", "figure-trajectory_a"]
    assert all(alternative.startswith("Chart: ") for _, alternative in pictures)
    for link, _ in pictures:
        assert f'<figure id="{link}">' in html
    assert f'id="figure-{BEGINNING}agreement"' not in html and "Cause" not in top


def test_a_failing_report_shows_causes_stated_beside_found_and_first_the_picture_that_shows_it(tmp_path):
    sections = [
        with_figures(section("mass", GOOD), "mass_distances"),
        with_figures(section("acceleration", GOOD), f"{BEGINNING}agreement"),
        with_figures(section("trajectory", GOOD, BAD), f"{BEGINNING}scenes"),
    ]
    top = first_screen(written(tmp_path, sections, causes=[CAUSE]))
    assert re.search(r"<td>mass of forearm</td><td>1\.5</td><td>1\.6</td><td>mass of forearm: 1\.6 kg</td>", top)
    kinds = re.findall(r'<figure class="(\w+)">', top)
    assert kinds == ["bad", "good"] and top.index("The same motion?") < top.index("The same equations?")
    assert 'class="verdict bad"' in top and top.index('class="causes"') < top.index('class="experiments"')
    assert "<strong>1 of 2 fail</strong>" in top and top.count("✗") >= 3
    assert re.search(r'<a href="#trajectory"><span class="mark bad" aria-hidden="true">✗</span>trajectory</a>', top)


@pytest.mark.parametrize("checks, kind, sign", [((GOOD,), "good", "✓"), ((GOOD, BAD), "bad", "✗"), ((), "none", "–")])
def test_a_line_and_a_section_stand_as_their_checks_do(tmp_path, checks, kind, sign):
    """By the class, which has the colour, and by the sign."""
    html = written(tmp_path, [section("mass", *checks), section("gravity", GOOD)])
    marked = f'<span class="mark {kind}" aria-hidden="true">{sign}</span>'
    assert f'<li class="{kind}">{marked}<div><a href="#mass">' in html
    assert f'<p class="outcome {kind}">{marked} <strong>' in html


def test_a_report_of_which_a_part_broke_is_not_shown_as_passing(tmp_path):
    (tmp_path / "figures").mkdir()
    report, parts = Report([section("mass", GOOD)], ARM, {"command": "c"}, "All agree."), Parts()
    for broken, kind in ((False, "good"), (True, "bad")):
        if broken:
            parts.made("a table", None, float, "no number")
        html = page.page(report, page.page_body(tmp_path, report, parts), parts)
        assert f'<div class="verdict {kind}">' in html and ("a table could not be made" in html) == broken
        assert f'<main id="main" class="{kind}">' in html


@pytest.mark.parametrize(
    "count, more", [(4, ""), (5, "and 1 more, in their sections"), (7, "and 3 more, in their sections")]
)
def test_checks_without_a_cause_are_counted(tmp_path, count, more):
    top = first_screen(written(tmp_path, [section("mass", GOOD, *[BAD] * count)]))
    assert top.count("<td>Mbar</td>") == 4 and (more in top if more else " more, in their" not in top)


def test_where_no_picture_shows_what_fails_a_figure_of_the_failing_experiment_does(tmp_path):
    sections = [
        with_figures(section("kinematics", BAD), "kinematics_distances"),
        with_figures(section("mass", GOOD), f"{BEGINNING}agreement"),
    ]
    top = first_screen(written(tmp_path, sections))
    assert re.search(r'<div class="pictures"><figure class="bad"><a href="#figure-kinematics_distances">', top)
    assert "Fails" in top and re.search(r"<td>kinematics</td><td>zero</td><td>Mbar</td><td>2</td><td>1</td>", top)


@pytest.mark.parametrize("count, more", [(4, ""), (5, "and 1 more")])
def test_a_few_causes_stand_on_the_first_screen_and_all_below_it(tmp_path, count, more):
    causes = [CAUSE | {"place": f"place {k}"} for k in range(count)]
    html = written(tmp_path, [section("mass", BAD)], causes=causes)
    top = first_screen(html)
    assert top.count("<td>place ") == 4 and (f'<a href="#causes">{more}</a>' in top) == bool(more)
    assert html[len(top) :].count("<td>place ") == count


def test_a_section_begins_with_what_was_found_and_folds_its_details(tmp_path):
    of = section("mass", GOOD, rows=[{"quantity": "other", "a": k} for k in range(50)], extra=[{"b": 1.5}])
    of.result.notes = [f"Note {k}." for k in range(5)]
    of.result.filed = ("extra",)
    html = written(tmp_path, [with_figures(of, "mass_distances")])
    text = html[html.index('<section id="mass"') :]
    order = ("It holds", "Claim:", "Note 2.", "figure-mass_distances", "What the tolerance is", "<details>", "Note 3.")
    places = [text.index(part) for part in order]
    assert places == sorted(places)
    tables = text[: text.index("</section>")].split("<details>")
    assert "<table" not in tables[0] and sum("<table" in part for part in tables) == 2
    assert text.count("<tr><td>other</td>") == 40 and '<a href="tables/mass.csv">' in text
    assert '<a href="tables/extra.csv">' in text and "<td>1.5</td>" not in text


@pytest.mark.parametrize("count, folded", [(2, 0), (4, 0), (5, 3), (8, 6)])
def test_of_many_figures_the_first_two_stand_open(tmp_path, count, folded):
    html = written(tmp_path, [with_figures(section("trajectory", GOOD), *[f"trajectory_{k}" for k in range(count)])])
    text = html[html.index('<section id="trajectory"') :]
    places = [text.index(f'id="figure-trajectory_{k}"') for k in range(count)]
    assert places == sorted(places)
    if not folded:
        assert "more figure" not in text
        return
    fold = text.index(f"<details><summary>{folded} more figures</summary>")
    assert places[1] < fold < places[2] and places[-1] < text.index("</details>", fold) < text.index(
        "What the tolerance is"
    )


def test_a_figure_to_which_the_first_screen_leads_is_not_folded(tmp_path):
    names = [f"stability_{k}" for k in range(4)] + ["stability_limits"]
    html = written(tmp_path, [with_figures(section("stability", GOOD), *names)])
    text = html[html.index('<section id="stability"') :]
    assert text.index('id="figure-stability_limits"') < text.index("<summary>2 more figures</summary>")


def test_tables_can_be_reached_by_keyboard_and_the_page_needs_nothing_else(tmp_path):
    html = written(tmp_path, [section("mass", GOOD, rows=[{"a": 1.5}])])
    regions = re.findall(r'<div class="scroll" role="region" tabindex="0" aria-label="([^"]+)">', html)
    assert len(regions) == html.count("<table") and all(regions)
    assert '<a class="skip" href="#main">' in html and "<script" not in html and 'tabindex="1"' not in html
    assert "prefers-color-scheme: dark" in html and "@media print" in html


def test_the_page_and_report_name_what_is_no_markup(tmp_path):
    of = section("mass", GOOD)
    of.result.notes = ["a <b> & c"]
    html = written(tmp_path, [of], skipped=[("<i>", "<u>")])
    assert "a &lt;b&gt; &amp; c" in html and "<i>" not in html and "<u>" not in html


@pytest.mark.parametrize("verdict, big, small", [
    ("The two models agree: all 9 checks pass. The rest.", "The two models agree: all 9 checks pass.", "The rest."),
    ("A and B agree in mass (1 of 9 experiments): all 2 checks pass.",
     "A and B agree in mass (1 of 9 experiments): all 2 checks pass.", ""),
    ("A and B agree in mass, gravity, kinematics, acceleration (4 of 9 experiments): all 2 checks pass. More.",
     "A and B agree: all 2 checks pass.", "4 of 9 experiments: mass, gravity, kinematics, acceleration. More."),
    ("A and B do not agree in mass, gravity, kinematics, acceleration (4 of 9 experiments ran): 1 of 2 checks fail.",
     "A and B do not agree: 1 of 2 checks fail.", "4 of 9 experiments: mass, gravity, kinematics, acceleration."),
])  # fmt: skip
def test_the_large_sentence_is_short(verdict, big, small):
    assert in_two(verdict) == (big, small)


def test_how_a_section_stands():
    assert standing(section("mass", GOOD)) == (True, "pass")
    assert standing(section("mass", GOOD, BAD)) == (False, "1 of 2 fail")
    assert standing(section("mass")) == (None, "nothing compared")
    broken = section("mass", GOOD)
    broken.result.check("", "runs to its end", None, 0.0, "", "ValueError", rule="equal", about=About.PROGRAM)
    assert standing(broken) == (False, "broke off")
    unstable = section("stability", GOOD, ("stable at its own step", 0.002, 0.001, "at most", False, About.STEP))
    assert standing(unstable) == (False, "its step is not stable")


def test_webp_is_for_the_page_alone(tmp_path):
    sections = [with_figures(section("mass", GOOD), "mass_distances")]
    written(tmp_path, sections)
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".png", ".webp"}
    write(tmp_path, Report(sections, ARM, {"command": "c"}, "words"))
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["mass_distances.png"]
    html = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert html.count("data:image/") == 1
