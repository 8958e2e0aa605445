"""Results to files: CSV, JSON, Markdown, HTML and PNG, with where they come from."""

import base64
import html
import json
import math
import os
import platform
import subprocess
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from string import Template

import pandas as pd

from .agreement import SEED

TITLE = "TMT and MuJoCo, held against each other on a human arm"
PACKAGES = ("mujoco", "numpy", "scipy", "pandas", "matplotlib", "numba", "mpmath", "rich")
DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled"), 7)  # of a column; else 3
LONG = 30  # rows: a longer table is folded in the HTML
INTRO = (
    "A human arm, two rigid bodies on three hinges, modelled twice: as MJCF, run by MuJoCo, and by the TMT method in a "
    "program that shares nothing with it. Each difference stands beside a bar that was fixed beforehand; 'exact' is "
    "the method in 50-digit arithmetic, and distances from it are in eps = 2.2e-16 of the quantity's scale."
)


@dataclass
class Section:
    """One experiment in the report."""

    name: str
    title: str
    claim: str
    bar: str
    result: object
    figures: list = field(default_factory=list)  # (file name, caption)


def passed(sections) -> bool:
    return all(check.passed for section in sections for check in section.result.checks)


def worst(sections):
    """The check that uses most of a bar of rounding, or None."""
    checks = [check for section in sections for check in section.result.checks if check.over_bar is not None]
    return max(checks, key=lambda check: check.over_bar, default=None)


def verdict(sections) -> str:
    """The outcome in words, with the worst figure."""
    checks = [check for section in sections for check in section.result.checks]
    failed = [check for check in checks if not check.passed]
    if failed:
        return f"The two models do not agree: {len(failed)} of {len(checks)} checks fail. First: {failed[0]}."
    text = f"The two models agree: all {len(checks)} checks pass."
    top = worst(sections)
    if top is None:
        return text
    where = f"{top.quantity}, {top.scene}" + (f", {top.note}" if top.note else "")
    return (
        f"{text} The difference that comes closest to its bar of rounding is {top.value:.2g} {top.unit}, "
        f"{100 * top.over_bar:.2g} % of the bar ({top.experiment}: {where})."
    )


def answers(sections) -> pd.DataFrame:
    """The assignment's parts (a) to (i): what is asked, where it is answered, the figure."""
    results = {section.name: section.result for section in sections}

    def far(name, quantities):
        if name not in results:
            return "not run"
        rows = [r for r in results[name].rows if r["quantity"] in quantities]
        values = [r["worst_difference"] for r in rows]
        if None in values:
            return "diverged"
        top = max(rows, key=lambda r: r["worst_difference"])
        return f"{top['quantity']}: at most {top['worst_difference']:.1e} {top['unit']} apart"

    def printed(item, column=None):
        if "published" not in results:
            return "not run"
        rows = [
            r for r in results["published"].rows if r["item"] == item and r["component"] in (column or r["component"])
        ]
        return f"TMT ({', '.join('{:.6g}'.format(r['tmt']) for r in rows)}) {rows[0]['unit']}"

    def run():
        if "trajectory" not in results:
            return "not run"
        curve = next(
            c for (s, n), c in results["trajectory"].curves.items() if s.name == "ball catch, held" and n == 64
        )
        left = [f"{t:.2f} s" if t else "never" for t in curve["left"]]
        return f"ball catch left by 0.1 rad: TMT {left[0]}, MuJoCo {left[1]}; " + far("trajectory", ["angles"])

    parts = (
        ("a", "sketch of the arm with its hinges", "parameters", "figures/arm.png"),
        ("b", "positions of the centres of mass", "kinematics", far("kinematics", ["x_b"])),
        ("c", "torques that hold the zero posture", "published, gravity", printed("c")),
        ("d", "angular velocities in body axes", "kinematics", far("kinematics", ["omega_b"])),
        ("e", "equations of motion by TMT", "mass, acceleration", far("acceleration", ["bias"])),
        ("f", "accelerations from rest that can be foreseen", "published", "f1: " + printed("f1")),
        ("g", "Mbar at the zero posture", "published, mass", printed("g", ("alpha alpha", "beta beta", "gamma gamma"))),
        ("h", "torques that hold ball catch", "published, gravity", printed("h")),
        ("i", "five seconds of motion by RK4", "trajectory", run()),
    )
    return pd.DataFrame(parts, columns=["part", "asked", "answered in", "figure"])


def provenance(command, seconds) -> dict:
    """What a reader needs to repeat the run: command, versions, machine, commit, seed."""
    return {
        "command": command,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(seconds, 1),
        "seed": SEED,
        "commit": commit(),
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    } | {package: version(package) for package in PACKAGES}


def commit() -> str | None:
    """The commit of the checkout that runs, if it is one."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return None
    try:
        told = [
            subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=True).stdout.strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain"])
        ]
    except (OSError, subprocess.CalledProcessError):
        return None
    return told[0] + (" with uncommitted changes" if told[1] else "")


def cpu() -> str:
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def write(folder, sections, origin) -> None:
    """All files of a report, the figures excepted, into an empty folder."""
    (folder / "tables").mkdir()
    for section in sections:
        section.result.table.to_csv(folder / "tables" / f"{section.name}.csv", index=False)
    checks = [check.record() for section in sections for check in section.result.checks]
    results = {"passed": passed(sections), "checks": checks, "provenance": origin}
    (folder / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    (folder / "report.md").write_text(markdown(sections, origin), encoding="utf-8")
    (folder / "index.html").write_text(page(folder, sections, origin), encoding="utf-8")


def shown(table, columns=None) -> pd.DataFrame:
    """A table as text, with the digits that a reader needs."""
    table = table[columns] if columns else table

    def text(value, digits):
        if isinstance(value, float):
            return f"{value:.{digits}g}" if math.isfinite(value) else ""
        return "" if value is None else str(value)

    columns = {c: [text(v, DIGITS.get(c, 3)) for v in table[c].astype(object)] for c in table.columns}
    return pd.DataFrame(columns).rename(columns=lambda c: c.replace("_", " "))


def tables(section) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The table of a section as text, and its checks that failed."""
    failed = [check.record() for check in section.result.checks if not check.passed]
    return shown(section.result.table, section.result.shown), shown(
        pd.DataFrame(failed).drop(columns="passed", errors="ignore")
    )


def markdown(sections, origin) -> str:
    lines = [
        f"# {TITLE}",
        f"**{verdict(sections)}**",
        INTRO,
        "## The assignment's questions",
        md_table(answers(sections)),
    ]
    for section in sections:
        table, failed = tables(section)
        lines += [f"## {section.title}", section.claim, f"*Bar:* {section.bar}"]
        if len(failed):
            lines += ["**Checks that fail:**", md_table(failed)]
        lines += [md_table(table), f"All columns: [tables/{section.name}.csv](tables/{section.name}.csv)"]
        lines += [f"- {note}" for note in section.result.notes]
        for name, caption in section.figures:
            lines += [f"![{name}](figures/{name}.png)", caption]
    lines += ["## Where this comes from", md_table(origins(origin))]
    return "\n\n".join(lines).replace("\n\n- ", "\n- ") + "\n"


def md_table(table) -> str:
    cells = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).values.tolist()]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells)


def origins(origin) -> pd.DataFrame:
    return pd.DataFrame([(name, str(value)) for name, value in origin.items()], columns=["what", "value"])


def page(folder, sections, origin) -> str:
    """The report as one HTML file with its figures inside."""
    body = [
        f"<p>{html.escape(INTRO)}</p>",
        '<h2 id="questions">The assignment\'s questions</h2>',
        html_table(answers(sections), "text"),
    ]
    for section in sections:
        table, failed = tables(section)
        body += [
            f'<h2 id="{section.name}">{html.escape(section.title)}</h2>',
            f"<p>{html.escape(section.claim)}</p>",
            f"<p><em>Bar:</em> {html.escape(section.bar)}</p>",
        ]
        if len(failed):
            body += ["<p><strong>Checks that fail:</strong></p>", html_table(failed)]
        for name, caption in section.figures:
            data = base64.b64encode((folder / "figures" / f"{name}.png").read_bytes()).decode()
            image = f'<img alt="{name}" src="data:image/png;base64,{data}">'
            body.append(f"<figure>{image}<figcaption>{html.escape(caption)}</figcaption></figure>")
        text = html_table(table)
        body.append(
            f"<details><summary>Table, {len(table)} rows</summary>{text}</details>" if len(table) > LONG else text
        )
        checks = shown(pd.DataFrame([check.record() for check in section.result.checks]))
        body.append(f"<details><summary>All {len(checks)} checks</summary>{html_table(checks)}</details>")
        if section.result.notes:
            body.append("<ul>" + "".join(f"<li>{html.escape(note)}</li>" for note in section.result.notes) + "</ul>")
    body += ['<h2 id="provenance">Where this comes from</h2>', html_table(origins(origin))]
    links = [("questions", "questions"), *((s.name, s.name) for s in sections), ("provenance", "provenance")]
    return Template((Path(__file__).parent / "report.html").read_text()).substitute(
        title=TITLE,
        colour="#009E73" if passed(sections) else "#D55E00",
        verdict=html.escape(verdict(sections)),
        contents="".join(f'<a href="#{anchor}">{text}</a>' for anchor, text in links),
        body="\n".join(body),
    )


def html_table(table, kind="data") -> str:
    return f'<div class="scroll">{table.to_html(index=False, border=0, classes=kind)}</div>'
