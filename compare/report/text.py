"""Sentences from templates: `say(finding)` is the text of a finding.

Templates are found by name, NAME.md.jinja, in the folders of compare. Each is a set of macros; numbers are formatted there, with
the filters below or Python's `format`.
"""

import html
import re
from functools import cache
from math import isfinite
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..judge.finding import Finding
from ..judge.words import capital, listed, milliseconds, some_of

MARKUP = re.compile(  # code, which stays; signs that Markdown would take for markup
    r"(`[^`\n]*`)|\\(?=[!-/:-@\[-`{-~])|\*|(?<![^\W_])_|_(?![^\W_])|\[(?=[^\n]*\]\()|&(?=#?\w+;)|<(?=[A-Za-z/!?])|~(?=~)"
)
ROOT = Path(__file__).resolve().parents[1]


def count(number: int, one: str, many: str = "") -> str:
    """A count with its noun: 1 check, 3 checks."""
    return f"{number:,} {one if number == 1 else many or f'{one}s'}"


def rounded(value: float) -> str:
    """A number with two digits, without an exponent where none is needed."""
    return f"{float(f'{value:.2g}'):g}"


def sentence(text: str) -> str:
    """A sentence in Markdown in which nothing is markup except code between backticks."""
    begins_block = "\\" if text[:1] in ("#", ">", "+", "-", "~") else ""
    return begins_block + inline(text)


def name(text: str) -> str:
    """A text in Markdown in which nothing is markup."""
    return "\\`".join(inline(part) for part in text.split("`"))


def inline(text: str) -> str:
    return MARKUP.sub(lambda match: match[1] or f"\\{match[0]}", text)


def words(text: str) -> str:
    """A sentence in HTML in which nothing is markup except code between backticks."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(text))


FILTERS = {
    "sentence": sentence,
    "words": words,
    "name": name,
    "cell": lambda text: inline(text).replace("|", "\\|"),
    "g": lambda value, digits=3: f"{value:.{digits}g}",
    "percent": lambda share, digits=2: f"{100.0 * share:.{digits}g} %",
    "degrees": lambda angle, digits=4: f"{angle * 57.29577951308232:.{digits}g} deg",
    "count": count,
    "rounded": rounded,
    "share_of": lambda share: f"{rounded(share)} times" if share > 1.0 else f"{100.0 * share:.2g} % of",
    "listed": lambda words: listed(list(words)),
    "some": lambda words: some_of(list(words)),
    "milliseconds": milliseconds,
    "capital": capital,
}


@cache
def environment() -> Environment:
    """Jinja2 with the folders of all templates."""
    folders = sorted({str(file.parent) for file in ROOT.rglob("*.jinja")})
    made = Environment(
        loader=FileSystemLoader(folders), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    made.filters |= FILTERS
    made.tests["finite"] = isfinite
    return made


def say(finding: Finding | str) -> str:
    """The text of a finding, in one line. What is text already stays as it is."""
    if isinstance(finding, str):
        return finding
    return " ".join(block(finding.of, finding.kind, **finding.values).split())


def block(of: str, kind: str, **values) -> str:
    """What the macro `kind` of a template gives, with its lines."""
    return str(getattr(environment().get_template(f"{of}.md.jinja").module, kind)(**values)).strip()
