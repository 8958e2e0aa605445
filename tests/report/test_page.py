"""The files of a report: the first screen of the page, what all files have, what breaks; pictures and provenance."""

import json
import re
import subprocess
from dataclasses import replace

import pandas as pd
import pytest
from helpers.sections import BAD, GOOD, section
from jinja2 import ChoiceLoader, DictLoader
from models import PATHS
from PIL import Image

from compare.core.cause import Cause
from compare.core.check import About
from compare.core.finding import Finding
from compare.core.text import environment
from compare.report import provenance
from compare.report.document import Document
from compare.report.files import write
from compare.report.verdict import OVERVIEW, Report, verdict
from compare.robots.arm import ARM
from compare.run.reference import compared_with

ROW = '<span class="mark {}" aria-hidden="true">✓</span></td>\n<td><a href="#{}">'
CAUSE = Cause(rank=2, place="mass of forearm", stated=1.5, explains=1.6, text="forearm: 1.6 kg")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "figures").mkdir()
    return tmp_path


def report_of(folder, sections, causes=(), skipped=(), robot=ARM):
    for path in (figure.path for one in sections for figure in one.figures):
        Image.new("RGB", (1, 1)).save(folder / "figures" / path)
    words = verdict(sections, len(sections), causes)
    return Report(sections, robot, {"command": "c"}, words, causes, skipped)


def page_of(folder, sections, causes=(), skipped=()):
    """The first screen of a page of these sections, and what comes below it."""
    page = Document(report_of(folder, sections, causes, skipped)).page(folder)
    top, mark, rest = page.partition("<section")
    return top, mark + rest


def test_the_verdict_a_line_for_each_experiment_and_the_pictures_come_before_all_sections(folder):
    figures = {"parameters": [], "mass": ["mass_distances"]}
    figures["acceleration"] = ["acceleration_distances", f"{OVERVIEW}agreement"]
    figures["trajectory"] = ["trajectory_a", f"{OVERVIEW}scenes"]
    sections = [section(name, GOOD, figures=figures[name]) for name in figures]
    top, rest = page_of(folder, sections, skipped=[("speed", "<too slow>")])
    places = [top.index(f'class="{name}"') for name in ("verdict good", "experiments", "pictures")]
    assert places == sorted(places)
    assert 'class="causes"' not in top and '<main id="main" class="good">' in top
    for name in figures:
        assert ROW.format("good", name) in top and f'<section id="{name}"' in rest
    assert "<td>skipped</td>\n<td>&lt;too slow&gt;</td>" in top
    pictures = re.findall(r'<figure class="good"><a href="#([^"]+)"><img alt="[^"]+"', top)
    assert pictures == ["acceleration", "trajectory"]


def test_a_failing_report_shows_stated_beside_found_and_first_the_picture_that_shows_it(folder):
    sections = [
        section("mass", GOOD, figures=["mass_distances"]), section("acceleration", GOOD, figures=[f"{OVERVIEW}agreement"]),
        section("trajectory", GOOD, BAD, figures=[f"{OVERVIEW}scenes"]), section("speed"),
    ]  # fmt: skip
    top, rest = page_of(folder, sections, causes=[CAUSE])
    assert re.search(r"<td>mass of forearm</td>\s<td>1\.5</td>\s<td>1\.6</td>", top)
    assert 'class="verdict bad"' in top and '<main id="main" class="bad">' in top
    assert re.findall(r'<figure class="(\w+)"><a href="#([^"]+)"', top) == [
        ("bad", "trajectory"), ("good", "acceleration"),
    ]  # fmt: skip
    for name, kind in (("mass", "good"), ("trajectory", "bad"), ("speed", "none")):
        assert {"good": "✓", "bad": "✗", "none": "–"}[kind] == re.search(
            rf'<span class="mark {kind}" aria-hidden="true">(.)</span></td>\n<td><a href="#{name}">', top
        )[1]
        assert f'<p class="outcome {kind}">' in rest
    top, rest = page_of(folder, [section("kinematics", *[BAD] * 5, figures=["kinematics_distances"])])
    failing = "<tr>\n<td>kinematics</td>\n<td>zero</td>\n<td>Mbar</td>\n<td>2</td>\n<td>1</td>"
    assert (top.count(failing), rest.count(failing)) == (4, 5)
    assert '<div class="pictures">\n<figure class="bad"><a href="#kinematics">' in top


BROKEN = "runs to its end", None, 0.0, "equal", False, About.PROGRAM


@pytest.mark.parametrize("count, more", [(8, 0), (9, 1)])
def test_causes_are_said_once_and_those_of_a_long_list_are_in_a_file(count, more, folder):
    causes = [replace(CAUSE, text=f"cause {k} of all") for k in range(count)]
    text = Document(report_of(folder, [section("mass", BAD)], causes)).text()
    assert [text.count(cause.text) for cause in causes] == [1] * 8 + [0] * more
    assert (f"{more} more in [results.json]" in text) is bool(more)


@pytest.mark.parametrize("checks, what, label", [
    ([], None, ""), ([BROKEN], "runs to its end", "Failing checks"),
    ([BAD], "Mbar", "Failing checks"), (None, "torque", "Not judged"),
])  # fmt: skip
def test_what_fails_or_was_not_judged_is_on_the_first_screen_and_in_its_section(checks, what, label, folder):
    one = section("gravity", GOOD, *(checks or ()))
    if checks is None:
        one.result.not_judged("held", "torque", "nothing moves")
    top, rest = page_of(folder, [one])
    assert re.findall(r"<td>gravity</td>\s<td>\w*</td>\s<td>([^<]*)</td>", top) == [what] * bool(what)
    assert re.findall(r"<strong>([\w ]+):</strong>", rest) == [label] * bool(label)
    assert ("<td>not judged</td>" in top) == ("nothing moves" in rest) == (what == "torque")
    (mark,) = re.findall(r'<a href="#gravity">(<span class="mark bad"[^<]*✗</span>)?gravity</a>', top)
    assert bool(mark) is (label == "Failing checks")  # of the link


def test_what_was_interrupted_has_not_passed_whatever_its_checks_say(folder):
    report = report_of(folder, [section("mass", GOOD)])
    for is_complete, kind in ((True, "good"), (False, "bad")):
        one = report._replace(is_complete=is_complete)
        assert one.passed is is_complete and f'<main id="main" class="{kind}">' in Document(one).page(folder)


@pytest.mark.parametrize("failing, said", [(0, "9 of 9"), (1, "8 of 9")])
def test_the_number_of_an_experiment_counts_what_passes(failing, said, folder):
    top, _ = page_of(folder, [section("mass", *[GOOD] * (9 - failing), *[BAD] * failing)])
    assert f"<td>{said} checks passed; largest share of a tolerance: 50 %</td>" in top


def test_a_section_folds_its_details_and_all_but_the_first_figures(folder):
    names = [f"mass_{k}" for k in range(4)] + ["motion.gif"]  # which is never folded
    rows = [{"quantity": "other", "a": k} for k in range(50)]
    of = section("mass", GOOD, rows=rows, figures=names, extra=[{"b": 1.5}])
    of.result.notes, of.result.filed = [f"Note {k} < 9." for k in range(5)], ("extra",)
    text = page_of(folder, [of])[1].partition('<section id="mass"')[2]
    fold = text.index("<details>")
    assert text.index("Note 4 &lt; 9.") < fold
    assert "<table" not in text[:fold] and text.count("<td>other</td>") == 8
    assert '"tables/mass.csv">' in text and '"tables/extra.csv">' in text and "<td>1.5</td>" not in text
    above = [name for name in names if text.index(f'id="figure-{name}"') < fold]
    assert above == [*names[:2], names[-1]]


def text_of(path):
    return path.read_text(encoding="utf-8")


def test_results_have_every_check_cause_and_digit(folder):
    rows = [{"a": 0.12345678901234568, "b": k, "engine": "tmt", "ok": True} for k in range(3)]
    names = ("joint;" * 20)[:81]
    extra = [{"b": 1 / 3, "names": names}]
    of = section("mass", GOOD, BAD, rows=rows, figures=["mass_distances"], extra=extra)
    write(folder, report_of(folder, [of], [CAUSE]))
    results = json.loads(text_of(folder / "results.json"))
    assert results["passed"] is False and [check["passed"] for check in results["checks"]] == [True, False]
    assert results["causes"] == [CAUSE.record()] and CAUSE.record()["found"] == 1.6
    assert replace(CAUSE, explains=float("nan")).record()["found"] is None  # JSON has no other word for it
    lines = text_of(folder / "tables" / "mass.csv").splitlines()
    assert lines == ["a,b,engine,ok", *(f"{row['a']!r},{row['b']},tmt,true" for row in rows)]
    assert pd.read_csv(folder / "tables" / "extra.csv")["names"].tolist() == [names]
    html, text = (text_of(folder / name) for name in ("index.html", "report.md"))
    assert CAUSE.text in html and CAUSE.text in text
    assert html.count("<td>0.123</td>") == text.count("| 0.123 |") == 3
    assert [path.name for path in (folder / "figures").iterdir()] == ["mass_distances.png"]


def test_the_commit_is_said_and_whether_the_program_was_changed_since(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    assert provenance.commit() is None  # no repository
    (tmp_path / "tmt").mkdir()
    (tmp_path / "pyproject.toml").touch()
    git = "git", "-c", "user.name=a", "-c", "user.email=a@b"
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "a"]):
        subprocess.run([*git, *words], cwd=tmp_path, check=True)
    (tmp_path / "notes.md").touch()  # is not of the program
    head = subprocess.check_output([*git, "rev-parse", "HEAD"], cwd=tmp_path, text=True).strip()
    assert provenance.commit() == head
    (tmp_path / "tmt" / "b").touch()
    assert provenance.commit().startswith(head) and provenance.commit() != head


def test_a_tolerance_is_in_words_and_its_formulas_are_on_a_page_of_their_own(folder):
    of = section("mass", GOOD)
    of.tolerance = "Rounding of <each>\nentry.\n\n64 eps x L & more,\nof all."
    document = Document(report_of(folder, [of]))
    text, page = document.text(), document.tolerances()
    assert "Rounding of &lt;each&gt; entry. [Formulas](tolerances.html#mass)." in text
    assert "64 eps x L &amp; more, of all." in page and "64 eps x L" not in text and "Rounding" not in page


@pytest.mark.parametrize("name, is_said", [("mass", True), ("stability", False)])
def test_what_a_comparison_switches_off_is_said_where_something_is_compared(name, is_said, folder):
    robot = compared_with("model", str(PATHS["quadruped"])).robot
    report = report_of(folder, [section(name, GOOD)], robot=robot)._replace(first_lines=["reference: model"])
    text = Document(report).text()
    for words in (
        "Switched off in MuJoCo",
        "compared with MuJoCo's",
        "reference: model",
        "tolerance that was fixed",
    ):
        assert (words in text) == is_said
    assert (text.startswith("# quadruped.xml: stability")) != is_said


def test_the_answer_to_one_question_has_its_table(folder, monkeypatch):
    template = (
        "{% macro said() %}\nUse {{ 2 }}.\n| way | < what |\n| a | {{ '<b>' }} |\nAnd more.\n{% endmacro %}"
    )
    loaders = [DictLoader({"odd.md.jinja": template}), environment().loader]
    monkeypatch.setattr(environment(), "loader", ChoiceLoader(loaders))
    sections = [section("stability", GOOD), section("mass", GOOD)]
    sections[0].result.top = [Finding("odd", "said")]
    alone, both = (Document(report_of(folder, few)).text() for few in (sections[:1], sections))
    assert "| way | what |" in alone and "| a | &lt;b&gt; |" in alone
    assert alone.index("Use 2.") < alone.index("And more.")
    assert "| way |" not in both and "Use 2. And more." in both
