"""Results to files: CSV, JSON, Markdown, HTML and PNG, with where they come from."""

import base64
import hashlib
import html
import json
import math
import os
import platform
import subprocess
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from string import Template

import pandas as pd

from .agreement import SEED
from .engine import ARM_XML
from .folder import files

TITLE = "TMT and MuJoCo, held against each other on a human arm"
OURS = "arm-tmt-mujoco"
PACKAGES = ("mujoco", "numpy", "scipy", "pandas", "matplotlib", "numba", "mpmath", "rich")
DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled"), 7)  # of a column; else 3
LONG = 30  # rows: a longer table is folded in the HTML
INTRO = (
    "A human arm, two rigid bodies on three hinges, modelled twice: as MJCF, run by MuJoCo, and by the TMT method in a "
    "program that shares nothing with it. Each difference stands beside a bar that was fixed beforehand; 'exact' is "
    "the method in 50-digit arithmetic, and distances from it are in eps = 2.2e-16 of the quantity's scale. Of the states "
    "in a row, the largest difference is the largest of all; the worst is the one that comes closest to its own bar."
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


def verdict(sections, experiments) -> str:
    """The outcome in words, with the worst figure; `experiments`: how many there are in all."""
    checks = [check for section in sections for check in section.result.checks]
    failed = [check for check in checks if not check.passed]
    names = ", ".join(section.name for section in sections)
    ran = "" if len(sections) == experiments else f" in {names} ({len(sections)} of {experiments} experiments)"
    if failed:
        return f"The two models do not agree{ran}: {len(failed)} of {len(checks)} checks fail. First: {failed[0]}."
    text = f"The two models agree{ran}: all {len(checks)} checks pass."
    top = worst(sections)
    if top is None or top.value == 0.0:
        return text
    where = f"{top.quantity}, {top.scene}" + (f", {top.note}" if top.note else "")
    return (
        f"{text} The difference that comes closest to its bar of rounding is {top.value:.2g} {top.unit}, "
        f"{100 * top.over_bar:.2g} % of the bar ({top.experiment}: {where})."
    )


def outcome(section) -> str:
    """Whether a section's claim holds, in words."""
    checks = section.result.checks
    failed = sum(not check.passed for check in checks)
    return (
        f"It does not hold: {failed} of {len(checks)} checks fail."
        if failed
        else f"It holds: all {len(checks)} checks pass."
    )


def answers(sections) -> pd.DataFrame:
    """The assignment's parts (a) to (i): what is asked, where it is answered, the answer."""
    results = {section.name: section.result for section in sections}

    def apart(name, quantity, **where):
        if name not in results:
            return "not run"
        where = where or {"quantity": quantity}
        rows = [row for row in results[name].rows if all(row[key] == value for key, value in where.items())]
        if any(row["largest_difference"] is None for row in rows):
            return "diverged"
        top = max(rows, key=lambda row: row["largest_difference"])
        judged = ", while judged" if name == "trajectory" else ""
        return f"{quantity}: at most {top['largest_difference']:.1e} {top['unit']} apart ({top['scene']}{judged})"

    def printed(*items):
        if "published" not in results:
            return "not run"
        texts = []
        for item in items:
            rows = [row for row in results["published"].rows if row["item"] == item]
            values = {
                party: "(" + ", ".join(f"{row[party]:.6g}" for row in rows) + ")"
                for party in ("published", "tmt", "mujoco")
            }
            unit = rows[0]["unit"]
            texts.append(
                f"{item}: printed {values['published']}, TMT {values['tmt']}, MuJoCo {values['mujoco']} {unit}"
            )
        return "; ".join(texts)

    parts = (
        ("a", "sketch of the arm with its hinges", "parameters", "figure 'arm'"),
        ("b", "positions of the centres of mass", "kinematics", apart("kinematics", "x_b")),
        ("c", "torques that hold the zero posture", "published, gravity", printed("c")),
        ("d", "angular velocities in body axes", "kinematics", apart("kinematics", "omega_b")),
        (
            "e",
            "equations of motion by TMT",
            "mass, acceleration",
            apart("mass", "Mbar") + "; " + apart("acceleration", "bias"),
        ),
        ("f", "accelerations from rest that can be foreseen", "published", printed("f1", "f2", "f3", "f4")),
        ("g", "Mbar at the zero posture, by rows", "published, mass", printed("g")),
        ("h", "torques that hold ball catch", "published, gravity", printed("h")),
        (
            "i",
            "five seconds of motion by RK4",
            "trajectory",
            apart("trajectory", "RK4, angles", level="open loop", twin="rk4"),
        ),
    )
    return pd.DataFrame(parts, columns=["part", "asked", "answered in", "answer"])


def provenance(command, model, seconds) -> dict:
    """What a reader needs to repeat the run: command, model, versions, machine, commit, seed."""
    return {
        "command": command,
        "model": "mjcf/arm.xml" if model == ARM_XML else str(model),
        "model_sha256": hashlib.sha256(Path(model).read_bytes()).hexdigest(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(seconds, 1),
        "seed": SEED,
        "commit": commit(),
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    } | {package: installed(package) for package in (OURS, *PACKAGES)}


def installed(package) -> str | None:
    """The version of an installed package; None for this one where it runs from a checkout that is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def commit() -> str | None:
    """The commit of the checkout that runs, if it is one."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return None
    try:
        told = [
            subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=True).stdout.strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", ":/", ":!/reports"])
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


def write(folder, sections, origin, result) -> None:
    """All files of a report, the figures excepted, into a folder that has those."""
    (folder / "tables").mkdir()
    for section in sections:
        pd.DataFrame(section.result.rows).to_csv(folder / "tables" / f"{section.name}.csv", index=False)
    checks = [check.record() for section in sections for check in section.result.checks]
    (folder / "report.md").write_text(markdown(sections, origin, result), encoding="utf-8")
    (folder / "index.html").write_text(page(folder, sections, origin, result), encoding="utf-8")
    origin = origin | {"files": [*files(folder), "results.json"]}  # what may be replaced by the next report
    results = {"passed": passed(sections), "checks": checks, "provenance": origin}
    (folder / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")


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
    return shown(pd.DataFrame(section.result.rows), section.result.shown), shown(
        pd.DataFrame(failed).drop(columns="passed", errors="ignore")
    )


def markdown(sections, origin, result) -> str:
    """The report as Markdown; `result`: the verdict."""
    lines = [
        f"# {TITLE}",
        f"**{result}**",
        INTRO,
        "## The assignment's questions",
        md_table(answers(sections)),
    ]
    for section in sections:
        table, failed = tables(section)
        lines += [f"## {section.title}", f"*Claim:* {section.claim} **{outcome(section)}**", f"*Bar:* {section.bar}"]
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


def page(folder, sections, origin, result) -> str:
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
            f"<p><em>Claim:</em> {html.escape(section.claim)} <strong>{outcome(section)}</strong></p>",
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
        verdict=html.escape(result),
        contents="".join(f'<a href="#{anchor}">{text}</a>' for anchor, text in links),
        body="\n".join(body),
    )


def html_table(table, kind="data") -> str:
    return f'<div class="scroll">{table.to_html(index=False, border=0, classes=kind)}</div>'
