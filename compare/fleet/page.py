"""The table of a fleet as a page: what needs a look first, each row with the way to the file's own report."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from string import Template
from urllib.parse import quote

from .models import place_of_report
from .row import BAD_VERDICTS, ITSELF, REFUSED

HEADS = {
    "file": "file",
    "verdict": "verdict",
    "reason": "reason or cause",
    "reference": "compared with",
    "joints": "joints",
    "worst_ratio": "share of tolerance",
    "file_integrator": "integrator",
    "file_dt_s": "step, ms",
    "stable_at_file_dt": "stable",
    "limit_s": "limit, ms",
    "seconds": "processor, s",
}
COMPARED_WITH = {"arm": "stated numbers", "solution": "the solution", "model": "itself"}
ROW_KINDS = dict.fromkeys(BAD_VERDICTS, "bad") | {REFUSED: "none", ITSELF: "none"}
WHAT_COMES_FIRST = "What needs a look comes first; each name leads to the file's own report. All digits are in"
MEANINGS = {
    "agree": "the file and the stated numbers, or the solution, that it is compared with differ by rounding alone",
    "self-consistent": "tmt and MuJoCo agree on the file as MuJoCo compiled it; its numbers are compared with no others, and may "
    "be wrong",
    "differ": "a check that compares them fails; the reason is the cause, where one is found",
    "broke": "something did not come to its end, so that nothing can be said",
    "unconfirmed": "the models agree; a prediction about the step is not confirmed by runs",
    "refused": "the file cannot be compared",
    "compared with": "what --reference says; without it the stated numbers of the arm, where a file has exactly its hinges, or "
    "itself as MuJoCo compiled it",
    "share of tolerance": "the largest difference, as a share of its tolerance of rounding; above 1 it is more than rounding",
    "step, integrator": "the file's own",
    "stable": "whether that step is, with that integrator under the file's own servos, at each posture "
    "where this is known; empty where no actuator feeds back or nothing rests",
    "limit": "the largest stable step with that integrator, at the posture where it is least",
    "processor": "what was computed for the file, on whatever machine",
}  # what is not known is left empty


def fleet_page(
    title: str,
    said: Sequence[str],
    rows: Sequence[dict],
    left_out: Sequence[tuple[str, str]],
    changed: Sequence[str] | None,
    origin: dict,
    picture: tuple[bytes, str, tuple[int, int]] | None = None,
) -> str:
    """The whole page. said: sentences below the title; changed: since an earlier fleet, None: that was not asked; picture: a PNG,
    its caption, width and height."""
    parts = []
    if changed is not None:
        parts.append("<h2>What has changed</h2>" + list_of(changed or ["Nothing."]))
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in HEADS.values())
    body = "\n".join(row_in_html(row) for row in rows)
    meanings = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in MEANINGS.items())
    parts.append(
        f'<h2 id="files">Files</h2>\n<p class="quiet">{html.escape(WHAT_COMES_FIRST)} <a href="fleet.csv">fleet.csv</a>.</p>'
    )
    parts.append(f"<details><summary>What the words mean</summary><dl>{meanings}</dl></details>")
    parts.append(f'<div class="scroll" role="region" tabindex="0" aria-labelledby="files"><table class="files"><thead><tr>{head}'
                 f"</tr></thead><tbody>\n{body}\n</tbody></table></div>")  # fmt: skip
    if picture:
        data, caption, (width, height) = picture
        source = f"data:image/png;base64,{base64.b64encode(data).decode()}"
        parts.append(f'<h2>Steps</h2>\n<figure><img src="{source}" width="{width // 2}" height="{height // 2}" '
                     f'alt="{html.escape(caption)}"><figcaption>{html.escape(caption)}</figcaption></figure>')  # fmt: skip
    if left_out:
        parts.append("<h2>Left out</h2>" + list_of([f"{name}: {why}." for name, why in left_out]))
    lines = "".join(
        f'<tr><th scope="row">{html.escape(name)}</th><td>{html.escape(str(value))}</td></tr>'
        for name, value in origin.items()
    )
    parts.append(f'<h2>Where this comes from</h2>\n<table class="origin">{lines}</table>')
    kind = "bad" if any(row["verdict"] in BAD_VERDICTS for row in rows) else "good"
    return Template((Path(__file__).parent / "fleet.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title), kind=kind, said="".join(f"<p>{html.escape(text)}</p>" for text in said), body="\n".join(parts)
    )  # fmt: skip


def list_of(texts: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{html.escape(text)}</li>' for text in texts)}</ul>"


def row_in_html(row: dict) -> str:
    """A row of the table, its file a link if there is a report."""
    cells = [cell_in_html(name, row[name]) for name in HEADS if name != "file"]
    name = html.escape(row["file"]).replace("/", "/<wbr>")
    if row["has_report"]:
        address = html.escape(quote(f"{place_of_report(row['report_of'])}/index.html"))
        name = f'<a href="{address}">{name}</a>'
    kind = "bad" if row["stable_at_file_dt"] is False else ROW_KINDS.get(row["verdict"], "good")
    return f'<tr class="{kind}"><th scope="row">{name}</th>{"".join(cells)}</tr>'


def cell_in_html(name: str, value: object) -> str:
    """A cell; steps are shown in ms."""
    value = COMPARED_WITH.get(value, value) if name == "reference" else value
    if isinstance(value, bool):
        text = "yes" if value else "no"
    elif isinstance(value, float):
        text = f"{value:.1f}" if name == "seconds" else f"{1e3 * value:.4g}" if name.endswith("_s") else f"{value:.2g}"
    else:
        text = "" if value is None else str(value)
    kind = "number" if isinstance(value, int | float) else "text"
    return f'<td class="{kind} {name}" data-name="{HEADS[name]}">{html.escape(text)}</td>'
