"""Text of a report and on the terminal: tables, the length of report.md, names that are no markup, any locale."""

import html
import json
import math
import os
import random
import re
import shutil
from dataclasses import dataclass, make_dataclass

import pytest
from helpers.in_process import without_workers
from helpers.runs import ROOT, compare, in_shell
from markdown_it import MarkdownIt
from matplotlib.figure import Figure
from matplotlib.text import Text

from compare.__main__ import main
from compare.core.rows import Row, column
from compare.core.text import aligned, cell, escaped
from compare.core.words import in_one_line
from compare.report import files, style, tables
from compare.report.terminal import Terminal
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


def test_a_table_has_the_digits_of_its_columns_and_lists_are_cut():
    rows = [Compared(at=2, share=1.23456789), Compared(at=3, share=math.inf, unknown=2.0)]
    table = tables.of_rows(rows)
    columns, (first, second) = list(table.columns), table.to_numpy().tolist()
    assert columns == ["at", "share", "passed", "difference", "printed", "names", "unknown"]
    assert first == ["2", "1.23", "True", "0", "1.234568", f"{76 * 'x'} ...", ""]
    assert second[1] == "" and second[6] == "2"
    assert tables.of_rows(rows, ["share"]).to_dict("list") == {"share": ["1.23", ""]}


MARKDOWN = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
ATTACK = "<img src=x onerror=document.documentElement.id='run'>"
NAMES = [f"`{ATTACK}``", "*/ [x](http://x.y) | a | __b__ &lt; \\", '=$\\frac{1}$"""']
NAMES.append(f"\u202e\n\n# {ATTACK}\x1b[31m")
SIGNS = [*"`*_[](){}<>#|~!\\+-=.:;&$%'\"@ab1é \t\n\r\u202e", *["**", "](u)", "&lt;", "---"]]
SIGNS += ["[a]: /u", ATTACK, "- ", "1. "]
PLACES = ("- {}\n- c\n", "# {}\n\np", "**w** {} {}\n", "**{}.** z {}\n", "| a | b |\n| - | - |\n| {} | {} |\n", "{}\n",
          "p\n\n{}: t\n", "![f](f.png) {} ", "x: {}; y: {}.", '<p title="{}">{}</p>\n\n{}\n')  # fmt: skip
ROBOT = """<mujoco model="{3}"><worldbody><body name="{0}b"><joint name="{0}" axis="0 1 0" damping="1"/><inertial mass="1"
pos="0 0 -.5" diaginertia=".1 .1 .01"/><body name="{1}b" pos="0 0 -1"><joint name="{1}" axis="0 1 0"/><inertial mass="1"
pos="0 0 -.5" diaginertia=".1 .1 .01"/></body></body></worldbody><actuator><position name="{0}" joint="{1}" kp="20" kv="1"/>
</actuator><keyframe><key name="{2}" qpos=".2 .3"/><key name="{3}" qpos=".1 0"/></keyframe></mujoco>"""


def test_no_text_is_markup_at_any_place():
    rng = random.Random(1)
    for _ in range(2000):
        text, place = "".join(rng.choices(SIGNS, k=rng.randint(1, 7))), rng.choice(PLACES)
        value = cell(text) if place.startswith("|") else escaped(text)
        found, right = (MARKDOWN.render(place.replace("{}", of)) for of in (value, "Q"))
        said, meant = html.unescape(found), right.replace("Q", in_one_line(text))
        assert "".join(said.split()) == "".join(meant.split()), (text, place)
        assert found.count("<") == right.count("<"), (text, place)


def test_a_report_of_a_robot_with_any_names(tmp_path, capsys):
    file = tmp_path / f"{ATTACK}\nb.xml"
    file.write_text(ROBOT.format(*("".join(f"&#{ord(c)};" for c in name) for name in NAMES)))
    with without_workers():
        assert main(["trajectory", "--quick", f"--mjcf={file}", f"--out={tmp_path / 'out'}"]) == 0
    paths = (tmp_path / "out" / name for name in ("index.html", "report.md"))
    page, text = (path.read_text(encoding="utf-8") for path in paths)
    for of in (page, MARKDOWN.render(text)):
        assert NAMES[2] in html.unescape(of) and ATTACK in html.unescape(of) and "<img src=x" not in of
        own = "#|data:image/|tables/|figures/|index.html|tolerances.html|reproduce.py|results.json"
        assert not re.search(rf'(href|src)="(?!{own})', of)
    out = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in page + out)
    assert (
        out.startswith("\n") and f"{ATTACK}\\nb.xml and tmt's equations for it agree" in out.splitlines()[1]
    )
    assert "<script" not in page
    policy = re.search(r'-Policy" content="([^"]+)"', page)[1]
    # nothing is loaded or run
    assert policy.startswith("default-src 'none'; ") and "script-src" not in policy


def test_in_a_table_on_the_terminal_and_in_a_figure(capsys):
    cells = make_dataclass("Cells", ["text", "number", "count"], bases=(Row,))
    rows = [cells("=1+1", -1.5, 2), cells("-x", math.nan, None)]
    assert files.csv(rows) == "text,number,count\n'=1+1,-1.5,2\n'-x,,\n"
    Terminal().say("a\x1b[31m\u202e[red]")
    assert capsys.readouterr().out == "a\\x1b[31m\\u202e[red]\n"
    figure = Figure()
    figure.subplots().set(title=NAMES[2], xlabel="$x$", yscale="log")
    style.pixels(figure)
    formulas = [of.get_text() for of in figure.findobj(Text) if "$" in of.get_text() and of.get_parse_math()]
    assert formulas and all("mathdefault" in text for text in formulas)


OLD = "LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0"


@pytest.mark.slow
@pytest.mark.parametrize("line, model, out, heard", [
    ("PYTHONIOENCODING=ascii compare published --quick --mjcf Käfer.xml --out Öl | head -1; exit ${PIPESTATUS[0]}",
     "Käfer.xml", "Öl", 1),
    (f"{OLD} compare mass --quick --mjcf $'\\xff.xml' --out $'\\xfe' >/dev/full 2>&1", "\\xff.xml", b"\xfe", 0),
    ("compare mass --quick --mjcf Käfer.xml --out closed <&- >&- 2>&-", "Käfer.xml", "closed", 0),
])  # fmt: skip
def test_any_name_of_a_file_in_any_locale_and_any_reader(tmp_path, line, model, out, heard):
    for name in ("Käfer.xml", b"\xff.xml"):
        shutil.copy(ARM.mjcf, tmp_path / os.fsdecode(name))
    run, report = in_shell(line, tmp_path), tmp_path / os.fsdecode(out)
    assert (run.returncode, run.stderr, len(run.stdout.splitlines())) == (0, "", heard)
    results = json.loads((report / "results.json").read_text(encoding="utf-8"))
    assert results["passed"] and results["provenance"]["model"] == model
    assert all(model in (report / file).read_text(encoding="utf-8") for file in ("report.md", "index.html"))


@pytest.mark.parametrize("columns, line", [(80, "9 of 11, speed: timing"), (26, "9 of 11, speed: t...")])
def test_the_line_of_progress_fits(columns, line):
    terminal = Terminal()
    terminal.err.columns = lambda: columns
    terminal.show("speed: timing", ["9 of 11", "speed"])
    assert terminal.line() == line and len(line) <= columns - 6


@pytest.mark.parametrize("line, status", [
    ("compare speed --help | head -1; exit ${PIPESTATUS[0]}", 0), ("compare >/dev/full", 0), ("compare --quick >&- 2>&-", 2),
])  # fmt: skip
def test_who_does_not_listen_changes_no_status(tmp_path, line, status):
    run = in_shell(line, tmp_path)
    assert run.returncode == status and "Traceback" not in run.stderr


def test_what_nobody_foresaw_is_one_line(tmp_path):
    (tmp_path / "rich.py").write_text("raise RuntimeError('two\\nlines')")  # found first: the current folder
    run = compare("mass", cwd=tmp_path)
    (line,) = run.stderr.splitlines()
    assert run.returncode == 2 and ROOT.as_posix() not in line
    assert re.search(r"RuntimeError: two lines \(compare/report/terminal.py:\d+\)$", line)


def test_rows_of_a_table_are_aligned_after_an_empty_line():
    rows = [["model", "error", "< remark"], ["the file", "-"], ["x", "0.28 mm", "the same bits"]]
    assert aligned(rows) == [
        "", " model        error   remark", " the file         -", " x          0.28 mm   the same bits"
    ]  # fmt: skip
