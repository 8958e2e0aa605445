"""Names are text, whatever they hold: in report.md, the page, a table, on the terminal, in a figure."""

import html
import random
import shutil
import subprocess
from html.parser import HTMLParser

import pytest
from in_process import without_workers
from markdown_it import MarkdownIt
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.text import Text

from compare.__main__ import main
from compare.process.streams import in_one_line
from compare.report import files, style
from compare.report.terminal import Terminal
from compare.report.text import cell, environment, escaped

MARKDOWN = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
ATTACK = "<img src=x onerror=document.documentElement.id='run'>"
NAMES = (f"`{ATTACK}``", "*/ [x](http://x.y) | a | __b__ &lt; \\", '=$\\frac{1}$"""', f"\u202e\n\n# {ATTACK}\x1b[31m")
SIGNS = [*"`*_[](){}<>#|~!\\+-=.:;&$%'\"@ab1é \t\n\r\u202e", "**", "](u)", "[a]: /u", ATTACK, "&lt;", "---", "- ", "1. ",
         "# ", "> ", "```", "![", "<!--", "    "]  # fmt: skip
PLACES = ("- {}\n- c\n", "# {}\n\np", "**w** {} {}\n", "**{}.** z {}\n", "| a | b |\n| - | - |\n| {} | {} |\n", "{}\n",
          "p\n\n{}: t\n", "![f](f.png) {} ", "<p>{}</p>", "x: {}; y: {}.", '<p title="{}">{}</p>\n\n{}\n')  # fmt: skip


class Read(HTMLParser):
    """The text and the elements of a page."""

    def __init__(self, page):
        super().__init__()
        self.text, self.elements = "", []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize("seed", range(3))
def test_no_text_is_markup_at_any_place(seed):
    rng = random.Random(seed)
    for _ in range(600):
        text, place = "".join(rng.choices(SIGNS, k=rng.randint(1, 7))), rng.choice(PLACES)
        value = cell(text) if place.startswith("|") else escaped(text)
        found, right = (Read(MARKDOWN.render(place.replace("{}", of))) for of in (value, "Q"))
        words = right.text.split("Q")
        assert found.text.split() == in_one_line(text).join(words).split(), (text, place)
        assert [tag for tag, _ in found.elements] == [tag for tag, _ in right.elements], (text, place)


def model() -> str:
    first, second, third, last = ("".join(f"&#{ord(c)};" for c in name) for name in NAMES)
    return f"""<mujoco model="{last}"><worldbody><body name="{first}b"><joint name="{first}" axis="0 1 0" damping="1"/>
    <inertial pos="0 0 -.5" mass="1" diaginertia=".1 .1 .01"/><body name="{second}b" pos="0 0 -1"><joint name="{second}"
    axis="0 1 0"/><inertial pos="0 0 -.5" mass="1" diaginertia=".1 .1 .01"/></body></body></worldbody>
    <actuator><position name="{first}a" joint="{second}" kp="20" kv="1"/></actuator>
    <keyframe><key name="{third}" qpos=".2 .3"/><key name="{last}" qpos=".1 0"/></keyframe></mujoco>"""


def test_a_report_of_a_robot_with_any_names(tmp_path, capsys):
    file = tmp_path / f"{ATTACK}.xml"
    file.write_text(model())
    with without_workers():
        assert main(["trajectory", "--quick", "--mjcf", str(file), "--out", str(tmp_path / "out")]) == 0
    shown, page = capsys.readouterr().out, Read((tmp_path / "out" / "index.html").read_text())
    read = Read(MARKDOWN.render((tmp_path / "out" / "report.md").read_text()))
    assert all(c.isprintable() or c == "\n" for c in shown + page.text) and NAMES[1] in page.text
    for of in (page, read):
        assert NAMES[2] in of.text and ATTACK in of.text
        assert not [name for _, attributes in of.elements for name in attributes if name.startswith("on")]
    assert {tag for tag, _ in read.elements} <= {*"h1 h2 p strong em ul li a img table thead tbody tr th td".split()}
    links = [attributes.get("href") or attributes.get("src") for tag, attributes in page.elements + read.elements
             if tag in ("a", "img")]  # fmt: skip
    assert links and all(link.startswith(("#", "data:image/png", "tables/", "figures/", "index.html")) for link in links)
    assert [attributes for tag, attributes in page.elements if tag == "script"] == [{"type": "application/json"}, {}]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="there is no Chromium")
def test_the_page_runs_its_own_script_alone(tmp_path):
    own = Markup("document.documentElement.lang = 'own';")
    body = Markup(f"{ATTACK}<script>document.documentElement.id = 'run'</script>")  # as if it were not escaped
    values = {"title": "", "good": True, "links": (), "script": own, "body": body}
    page = tmp_path / "page.html"
    page.write_text(environment().get_template("page.html.jinja").render(values))
    asked = ["--headless=new", "--no-sandbox", "--dump-dom", f"--user-data-dir={tmp_path / 'profile'}", page.as_uri()]
    run = subprocess.run(["chromium", *asked], capture_output=True, text=True, timeout=120)
    assert '<html lang="own">' in run.stdout and html.unescape(ATTACK)[:8] in run.stdout


def test_in_a_table_on_the_terminal_and_in_a_figure(capsys):
    rows = [{"text": "=1+1", "number": -1.5, "count": 2}, {"text": "-x", "number": float("nan"), "count": None}]
    assert files.csv(rows) == "text,number,count\n'=1+1,-1.5,2\n'-x,,\n"
    Terminal().say("a\x1b[31m\u202e[red]")
    assert capsys.readouterr().out == "a\\x1b[31m\\u202e[red]\n"
    figure = Figure()
    figure.subplots().set(title=NAMES[2], xlabel="$x$", yscale="log")
    style.pixels(figure)
    formulas = [of.get_text() for of in figure.findobj(Text) if "$" in of.get_text() and of.get_parse_math()]
    assert formulas and all("mathdefault" in text for text in formulas)
