"""The help of an experiment, which is the docstring of its module: what it promises is there, and what it shows can be given."""

import ast
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from compare.__main__ import main
from compare.command_line import LINE_WIDTH, help_of
from compare.experiments import EXPERIMENTS

ROOT = Path(__file__).resolve().parent.parent
PARTS = ["Asks", "Compares", "Tables", "Figures", "Tolerance", "Examples"]
EXAMPLE = ROOT / "reports" / "example"
OF_REPORT = ("overview_",)  # figures of the report itself


def part(name, of):
    """What the help of an experiment says under this word."""
    return re.search(rf"^{of}:(.*?)(?=\n\n[A-Z]\w+[:,]|\Z)", help_of(name), re.MULTILINE | re.DOTALL)[1]


@cache
def code(name):
    """All code of an experiment, without docstrings."""
    file = ROOT / "compare" / "experiments" / f"{name}.py"
    files = [file] if file.exists() else sorted(file.with_suffix("").rglob("*.py"))
    texts = [path.read_text(encoding="utf-8") for path in files]
    return "\n".join("\n".join(text.splitlines()[ast.parse(text).body[0].end_lineno :]) for text in texts)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_it_says_what_is_asked_compared_written_and_tolerated(name):
    text = help_of(name)
    assert [word for word in re.findall(r"^(\w+)[:,]", text, re.MULTILINE) if word in PARTS] == PARTS
    plain = [line for line in text.splitlines() if not line.startswith("    ")]
    assert max(map(len, plain)) <= LINE_WIDTH


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_its_examples_can_be_given(name, capsys):
    lines = [line.strip() for line in part(name, "Examples").splitlines() if line.strip()]
    assert lines
    for line in lines:
        words = shlex.split(line)
        assert words[:4] == ["python", "-m", "compare", name]
        with pytest.raises(SystemExit) as ended:
            main([*words[3:], "--help"])
        assert ended.value.code == 0, line
    capsys.readouterr()


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_its_tables_and_figures_are_made(name):
    tables = re.findall(r"(\w+)\.csv", part(name, "Tables"))
    assert tables
    for table in tables:
        assert table == name or f'"{table}"' in code(name), table
    for figure in re.findall(rf"\b({name}_[a-z_]+[a-z])\b", part(name, "Figures")):
        shared = (ROOT / "compare" / "experiments" / "figures.py").read_text(encoding="utf-8")
        assert re.search(rf'"{figure}["_]', code(name) + shared) or figure == f"{name}_distances", figure


def test_every_table_and_figure_of_the_example_is_named_in_one_help():
    tables = [table for name in EXPERIMENTS for table in re.findall(r"(\w+)\.csv", part(name, "Tables"))]
    assert len(set(tables)) == len(tables)
    assert {path.stem for path in (EXAMPLE / "tables").iterdir()} <= set(tables)
    said = [word for name in EXPERIMENTS for word in re.findall(r"\w+", part(name, "Figures"))]
    patterns = [
        re.compile(re.escape(word).replace("SCENE", r"\w+"))
        for word in said
        if "_" in word or word in ("arm", "motion")
    ]
    for figure in (path.stem for path in (EXAMPLE / "figures").iterdir() if not path.stem.startswith(OF_REPORT)):
        assert any(pattern.fullmatch(figure) for pattern in patterns), figure
