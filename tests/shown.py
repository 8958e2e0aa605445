"""What the README and the help of the experiments show: their blocks of code, commands and output."""

import re
from pathlib import Path
from textwrap import dedent

import tmt
from compare.command_line import help_of
from compare.experiments import EXPERIMENTS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(.*)\n((?:.*\n)*?)```$", README, re.MULTILINE)  # of the README: language, text


def language(text: str) -> str:
    """What an indented block of a help is."""
    first = text.splitlines()[0]
    known = {"python -m ": "sh", "[[": "toml", "import ": "python"}
    return next((name for start, name in known.items() if first.startswith(start)), "text")


def indented(text: str) -> list[tuple[str, str]]:
    """The indented blocks of a docstring: language, text."""
    found = re.findall(r"(?:^ {4}.*\n|^\n(?=\n* {4}))+", text + "\n", re.MULTILINE)
    texts = [dedent(text).strip("\n") + "\n" for text in found]
    return [(language(text), text) for text in texts]


def blocks(of: str) -> list[str]:
    """All blocks of a language: of the README, of the experiments' help and of tmt's."""
    helps = [block for text in [*map(help_of, EXPERIMENTS), tmt.__doc__] for block in indented(text)]
    return [text for name, text in [*BLOCKS, *helps] if name == of]


def commands() -> list[str]:
    """All command lines; those of a help as the README would have them."""
    lines = [line for text in blocks("sh") for line in text.splitlines() if line.strip()]
    return [re.sub("^python ", ".venv/bin/python ", line) for line in lines]
