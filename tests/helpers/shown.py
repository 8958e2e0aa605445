"""What the README and the helps show: code, command lines and output. Used by test_readme, test_help and test_reduction."""

import re
import shlex
from pathlib import Path
from textwrap import dedent

import tmt
from compare.cli.command_line import EXAMPLES, help_of
from compare.core.text import block
from compare.experiments import EXPERIMENTS

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(.*)\n((?:.*\n)*?)```$", README, re.MULTILINE)  # of the README: language, text
COMPARE = re.compile(r"(?:\.venv/bin/)?python -m compare\b *([^`\n]*)")


def language(text: str) -> str:
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


def command_lines() -> list[str]:
    """All command lines of compare that are shown, without `python -m compare`; each once."""
    of_readme = [text for name, text in BLOCKS if name == "sh"] + re.findall(r"`[^`\n]+`", README)
    of_helps = [text for name in EXPERIMENTS for kind, text in indented(help_of(name)) if kind == "sh"]
    examples = [EXAMPLES, *(block(of, "examples") for of in ("fleet", "export"))]
    beside_text = "\n".join(re.findall(r"^  python.*", "\n".join(examples), re.MULTILINE))
    found = COMPARE.findall("\n".join([*of_readme, *of_helps, beside_text]))
    return list(dict.fromkeys(shlex.join(shlex.split(re.split(r" {2,}| &&", line)[0])) for line in found))
