"""Results to files: CSV, JSON, Markdown, HTML and PNG, with where they come from."""

import hashlib
import json
import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pandas as pd

from .agreement import SEED
from .engine_file import ARM_XML
from .folder import files, save
from .machine import vectors
from .page import markdown, page
from .streams import readable
from .verdict import passed

OURS = "arm-tmt-mujoco"
PACKAGES = ("mujoco", "numpy", "scipy", "pandas", "matplotlib", "numba", "mpmath", "rich", "heyoka")


def provenance(command, model) -> dict:
    """What a reader needs to repeat the run: command, model, versions, machine, commit, seed; `seconds` come at its end."""
    return {
        "command": readable(command),
        "model": "mjcf/arm.xml" if model == ARM_XML else readable(str(model)),
        "model_sha256": hashlib.sha256(Path(model).read_bytes()).hexdigest(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": None,
        "seed": SEED,
        "commit": commit(),
        "cpu": vectors(),
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
            subprocess.run(["git", "-C", root, *words], capture_output=True, check=True).stdout.decode().strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", ":/", ":!/reports"])
        ]
    except (OSError, ValueError, subprocess.CalledProcessError):
        return None
    return told[0] + (" with uncommitted changes" if told[1] else "")


def write(folder, sections, origin, result, causes=()) -> None:
    """All files of a report, the figures excepted, into a folder that has those; `result`: the verdict in words."""
    (folder / "tables").mkdir()
    for section in sections:
        for name, rows in section.tables.items():
            save(folder / "tables" / f"{name}.csv", plain(pd.DataFrame(rows, dtype=object)).to_csv(index=False))
    checks = [check.record() for section in sections for check in section.result.checks]
    save(folder / "report.md", markdown(sections, origin, result, causes))
    save(folder / "index.html", page(folder, sections, origin, result, causes))
    origin = origin | {"files": [*files(folder), "results.json"]}  # what may be replaced by the next report
    results = {
        "passed": passed(sections),
        "checks": checks,
        "causes": [{name: cause[name] for name in ("rank", "place", "stated", "found", "text")} for cause in causes],
        "skipped": [],  # every experiment serves this arm
        "provenance": origin,
    }
    save(folder / "results.json", json.dumps(results, indent=1, allow_nan=False) + "\n")


def plain(table) -> pd.DataFrame:
    """A table of objects for a CSV file: engines, true and false in small letters, whole numbers beside empty cells."""
    if "engine" in table:
        table["engine"] = table["engine"].str.lower()
    return table.map(lambda value: str(value).lower() if isinstance(value, bool | np.bool_) else value)
