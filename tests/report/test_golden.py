"""The words of a small report on the arm are those that were last reviewed, in golden.md.

RENEW=1 python -m pytest -n 0 tests/report/test_golden.py writes them anew; the change is reviewed as a diff. Numbers are #, and
names of scenes, quantities and coordinates ~: which of them comes out worst depends on the machine. Timings are left out.
"""

import os
import re
from pathlib import Path

from compare.experiments import EXPERIMENTS
from compare.report import images, verdict
from compare.report.document import Document
from compare.robots.arm import ARM
from compare.run import drawing, examine

GOLDEN = Path(__file__).with_name("golden.md")
NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
TIMED = "_times", "_needs", "argest speedup", "times as fast", "Cheapest for"
NAMES = [name for name in EXPERIMENTS if name != "engines"]  # which depends on what is installed
DEPENDS = "smallest error of", "bent, held, locked:"  # on rounding: where it rules, which still joint goes
FIXED = "#", "- *Claim", "- *Tolerance"  # lines that no run changes


def words(text, names) -> str:
    """The sentences of a report without what depends on the machine, a figure in a line."""
    longest_first = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
    one_of = re.compile(rf"(?<![\w/])({longest_first})(?!\w)")
    sections = [part for part in re.split(r"(?m)^(?=## )", text) if not part.startswith("## Speed")]
    lines = "".join(sections).replace(" ![", "\n![").splitlines()
    kept = [line for line in lines if line and line[0] != "|" and not any(word in line for word in TIMED)]
    said = [line if line.startswith(FIXED) else one_of.sub("~", NUMBER.sub("#", line)) for line in kept]
    return "".join(f"{line}\n" for line in said)


def number_of_checks(name, result) -> str:
    """How many scenes, quantities and rules an experiment checks, without measured numbers."""
    named = {NUMBER.sub("#", f"{c.scene}, {c.quantity}, {c.rule}") for c in result.checks}
    return f"{name}: {sum(not any(word in check for word in DEPENDS) for check in named)} kinds of check"


def report_of_arm(small, folder) -> str:
    """report.md of all experiments on the arm, its figures not rendered."""
    sections = []
    for name in NAMES:
        section = examine.section_with(name, small(name), ARM)
        sections.append(section)
        others = drawing.results_needed(name, NAMES, sections)
        section.figures = drawing.draw(name, section.result, ARM, folder, others)
    report = verdict.Report(sections, ARM, {"command": "a small run"}, verdict.verdict(sections, len(NAMES)))
    return Document(report).text()


def test_the_words_of_a_small_report(small, tmp_path, monkeypatch):
    monkeypatch.setattr(images, "save_figure", lambda figure, path: path.touch())
    checks = [check for name in NAMES for check in small(name).checks]
    names = {name for check in checks for name in (check.quantity, check.scene) if len(name) > 2}
    names = {NUMBER.sub("#", name) for name in names} | set(ARM.coordinates.names)
    found = words(report_of_arm(small, tmp_path), names)
    found += "".join(f"{number_of_checks(name, small(name))}\n" for name in NAMES)
    if "RENEW" in os.environ:
        GOLDEN.write_text(found, encoding="utf-8")
    assert found.splitlines() == GOLDEN.read_text(encoding="utf-8").splitlines()
