"""Names are text, whatever they hold: in report.md, the page, a table, on the terminal, in a figure."""

import html
import math
import random
import re
from dataclasses import make_dataclass

from in_process import without_workers
from markdown_it import MarkdownIt
from matplotlib.figure import Figure
from matplotlib.text import Text

from compare.__main__ import main
from compare.core.rows import Row
from compare.core.text import cell, escaped
from compare.core.words import in_one_line
from compare.report import files, style
from compare.report.terminal import Terminal

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
        assert not re.search(r'(href|src)="(?!#|data:image/|tables/|figures/|index.html)', of)
    out = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in page + out)
    assert out.startswith("reference: model; ") and f"{ATTACK}\\nb.xml" in out.splitlines()[0]
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
