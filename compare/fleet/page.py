"""The table of a fleet as a page: what needs a look first, each row with the way to the file's own report."""

import html
from collections.abc import Sequence
from pathlib import Path
from string import Template
from urllib.parse import quote

from .models import place_of
from .row import BROKE, DIFFER, REFUSED

HEADS = {
    "file": "file",
    "verdict": "verdict",
    "reason": "reason or cause",
    "joints": "joints",
    "worst_ratio": "largest share of a tolerance",
    "file_integrator": "integrator",
    "file_dt_s": "dt, s",
    "stable_at_file_dt": "stable at its own dt",
    "limit_s": "limit of dt, s",
    "seconds": "processor, s",
}
MARKS = {DIFFER: "bad", BROKE: "bad", REFUSED: "none"}


def page(
    title: str,
    said: Sequence[str],
    rows: Sequence[dict],
    left_out: Sequence[tuple[str, str]],
    changed: Sequence[str] | None,
    origin: dict,
) -> str:
    """The whole page. said: sentences below the title; changed: since an earlier fleet, None: that was not asked."""
    parts = []
    if changed is not None:
        texts = "".join(f"<li>{html.escape(text)}</li>" for text in changed) or "<li>Nothing.</li>"
        parts.append(f"<h2>What has changed</h2><ul>{texts}</ul>")
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in HEADS.values())
    body = "\n".join(row_in_html(row) for row in rows)
    parts.append(f'<h2>Files</h2><div class="scroll" role="region" tabindex="0" aria-label="Files"><table><thead><tr>{head}</tr>'
                 f"</thead><tbody>\n{body}\n</tbody></table></div>")  # fmt: skip
    parts.append('<p>The same with all digits: <a href="fleet.csv">fleet.csv</a>.</p>')
    if left_out:
        texts = "".join(f"<li>{html.escape(name)}: {html.escape(why)}.</li>" for name, why in left_out)
        parts.append(f"<h2>Left out</h2><ul>{texts}</ul>")
    lines = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(str(value))}</td></tr>" for name, value in origin.items()
    )
    parts.append(f"<h2>Where this comes from</h2><table class='text'>{lines}</table>")
    bad = any(row["verdict"] in (DIFFER, BROKE) for row in rows)
    return Template((Path(__file__).parent / "fleet.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title), kind="bad" if bad else "good",
        said="".join(f"<p>{html.escape(text)}</p>" for text in said), body="\n".join(parts),
    )  # fmt: skip


def row_in_html(row: dict) -> str:
    cells = [cell_in_html(name, row[name]) for name in HEADS if name != "file"]
    name = html.escape(row["file"])
    if row["has_report"]:
        address = html.escape(quote(f"{place_of(row['file'])}/index.html"))
        name = f'<a href="{address}">{name}</a>'
    kind = MARKS.get(row["verdict"], "bad" if row["stable_at_file_dt"] is False else "good")
    return f'<tr class="{kind}"><td>{name}</td>{"".join(cells)}</tr>'


def cell_in_html(name: str, value: object) -> str:
    if isinstance(value, bool):
        text = "yes" if value else "no"
    elif isinstance(value, float):
        text = f"{value:.3g}" if name != "seconds" else f"{value:.1f}"
    else:
        text = "" if value is None else str(value)
    return f'<td class="{"text" if isinstance(value, str) else "number"}">{html.escape(text)}</td>'
