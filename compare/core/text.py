"""Sentences from templates: `say(finding)` is the text of a finding.

Templates are found by name, NAME.md.jinja, in the folders of compare. Each is a set of macros; numbers are
formatted there, with the filters below or Python's `format`.
"""

import re
from collections.abc import Sequence
from functools import cache
from html.entities import codepoint2name
from itertools import zip_longest
from math import isfinite
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, pass_eval_context
from jinja2.nodes import EvalContext
from markupsafe import Markup

from .finding import Finding
from .words import capital, in_one_line, listed, milliseconds, milliseconds_below, some_of

# markup of Markdown and HTML: anywhere, at the edge of a word, at the beginning of a text
MARKUP = re.compile(
    r"[`*<>&\"$~@]|\\(?![^\W_])|(?<![^\W_])_|_(?![^\W_])|\](?=\()|:(?=//)|(?<=www)\."
    r"|(?<!\S)#|\A[\[ ]|\A[-+=](?=[-=\s]*\Z|\s)|\A\d(?=\d*[.)](?:\s|\Z))"
)
DOCUMENTS = "document.md.jinja", ".html.jinja"  # how their names end; the other templates are text
ROW = "|"  # how the rows of a table of the first screen begin
ROOT = Path(__file__).resolve().parents[1]


@pass_eval_context
def markup(context: EvalContext, value: object) -> object:
    """A value in a template: in a document, whatever is not a piece of it is escaped."""
    return escaped(value) if context.autoescape and not isinstance(value, Markup) else value


def escaped(value: object) -> Markup:
    """A value in one line, whose signs that might be markup are character references."""
    return Markup(MARKUP.sub(reference, in_one_line(str(value))))


def reference(sign: re.Match[str]) -> str:
    number = ord(sign[0])
    return f"&{codepoint2name.get(number, f'#{number}')};"


def cell(value: object) -> Markup:
    """A value in a cell of a table in Markdown."""
    text = value if isinstance(value, Markup) else escaped(value)
    return Markup(str(text).replace("|", "&#124;"))


def count(number: int, noun: str, plural: str = "") -> str:
    """A count with its noun: 1 check, 3 checks."""
    return f"{number:,} {noun if number == 1 else plural or f'{noun}s'}"


def rounded(value: float) -> str:
    """A number with two digits, without an exponent where none is needed."""
    return f"{float(f'{value:.2g}'):g}"


def apart(value: float, other: float, digits: int = 6) -> str:
    """A number with as many digits, at least these, as tell it from another one."""
    if value != other:
        digits = next((n for n in range(digits, 17) if f"{value:.{n}g}" != f"{other:.{n}g}"), 17)
    return f"{value:.{digits}g}"


FILTERS = {
    "cell": cell,
    "g": lambda value, digits=3: f"{value:.{digits}g}",
    "apart": apart,
    "percent": lambda share, digits=2: f"{100.0 * share:.{digits}g} %",
    "count": count,
    "rounded": rounded,
    "share_of": lambda share: f"{rounded(share)} times" if share > 1.0 else f"{100.0 * share:.2g} % of",
    "listed": lambda words: listed(list(words)),
    "some": lambda words: some_of(list(words)),
    "milliseconds": milliseconds,
    "limit": milliseconds_below,
    "capital": capital,
    "say": lambda finding: say(finding),
}


@cache
def environment() -> Environment:
    """Jinja2 with the folders of all templates; no value that a document is given can be markup."""
    folders = sorted({str(file.parent) for file in ROOT.rglob("*.jinja")})
    made = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=markup)
    made.loader, made.autoescape = FileSystemLoader(folders), lambda name: str(name).endswith(DOCUMENTS)
    made.filters |= FILTERS
    made.tests["finite"] = isfinite
    return made


def say(finding: Finding | str) -> str:
    """The sentences of a finding, in one line. What is text already stays as it is."""
    before, _, after = parts(finding)
    return f"{before} {after}".strip()


def parts(finding: Finding | str) -> tuple[str, list[list[str]], str]:
    """The sentences of a finding before a table, the rows of the table, and the sentences after it.

    Lines of the template that begin with "|" are the rows, the first one the head: cells are separated by
    "|".
    """
    if isinstance(finding, str):
        return finding, [], ""
    lines = block(finding.of, finding.kind, **finding.values).splitlines()
    places = [number for number, line in enumerate(lines) if line.startswith(ROW)]
    first, end = (places[0], places[-1] + 1) if places else (len(lines), len(lines))
    before, after = (" ".join(" ".join(part).split()) for part in (lines[:first], lines[end:]))
    rows = [[cell.strip() for cell in lines[number].strip().strip(ROW).split(ROW)] for number in places]
    return before, rows, after


def screen(finding: Finding | str) -> list[str]:
    """The lines of a finding on a terminal: its sentences before a table, the table, the sentences after it.

    Columns are aligned to the right, the first one, and those whose head begins with "<", to the left.
    """
    before, rows, after = parts(finding)
    return [*filter(None, [before]), *aligned(rows), *filter(None, [after])]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """The lines of a table, after an empty one: see `screen`."""
    if not rows:
        return []
    columns = list(zip_longest(*rows, fillvalue=""))
    to_left = [number == 0 or column[0].startswith("<") for number, column in enumerate(columns)]
    columns = [(column[0].removeprefix("<").lstrip(), *column[1:]) for column in columns]
    widths = [max(map(len, column)) for column in columns]
    made = [""]
    for row in zip(*columns):
        texts = (cell.ljust(width) if left else cell.rjust(width)
                 for cell, width, left in zip(row, widths, to_left))  # fmt: skip
        made.append(f" {'   '.join(texts)}".rstrip())
    return made


def block(of: str, kind: str, /, **values: Any) -> str:
    """What the macro `kind` of a template gives, with its lines."""
    return str(getattr(environment().get_template(f"{of}.md.jinja").module, kind)(**values)).strip()
