"""Pieces of the page: sentences, tables and figures as HTML."""

import html
import re
from pathlib import Path

import pandas as pd

from .images import embedded
from .overview import BEGINNING
from .verdict import Section


def words(text: str) -> str:
    """A sentence in HTML; what stands between backticks is code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", html.escape(text))


def html_table(table: pd.DataFrame, label: str, kind: str = "data") -> str:
    """A table that scrolls sideways where it is too wide, by keyboard too. label: what it is, for who does not see it."""
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in table.columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
        for row in table.astype(str).to_numpy()
    )
    return (
        f'<div class="scroll" role="region" tabindex="0" aria-label="{html.escape(label)}"><table class="{kind}">'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def details(summary: str, text: str) -> str:
    """What is shown to who asks for it."""
    return f"<details><summary>{html.escape(summary)}</summary>{text}</details>"


def of_section(section: Section) -> list[tuple[str, str]]:
    """The figures of a section: names of files (.png is left out) and captions, except for the pictures of the first screen."""
    return [(file, caption) for file, caption in section.figures if not file.startswith(BEGINNING)]


def image(folder: Path, file: str, alternative: str) -> str:
    """A figure inside the page. alternative: what it shows, in words."""
    address, width, height = embedded(folder / "figures" / f"{file}.png")
    return f'<img alt="{html.escape(alternative)}" width="{width}" height="{height}" src="{address}">'


def figure(folder: Path, file: str, caption: str) -> str:
    """A figure of a section with its caption and its anchor; the first sentence of the caption says what it shows."""
    first = re.split(r"(?<=[a-z)°0-9])\. (?=[A-Z])", caption)[0]
    shows = f"{file.replace('_', ' ')}: {first}"
    return (
        f'<figure id="figure-{html.escape(file)}">{image(folder, file, shows)}'
        f"<figcaption>{words(caption)}</figcaption></figure>"
    )
