"""Where a report comes from: what a reader needs to make it again."""

import hashlib
import os
import platform
import subprocess
import tomllib
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..judge.timing import vectors
from ..process.clock import Clock
from ..process.streams import readable

OURS = "arm-tmt-mujoco"
PACKAGES = ("mujoco", "numpy", "scipy", "pandas", "matplotlib", "numba", "mpmath", "rich", "heyoka")


def provenance(command: str, model: str | Path, shown: str, seed: int) -> dict:
    """What a reader needs to repeat the run: command, model, versions, machine, commit, seed; `seconds` come at its end.

    model: the file; shown: how the report calls it.
    """
    return {
        "command": readable(command),
        "model": readable(shown),
        "model_sha256": hashlib.sha256(Path(model).read_bytes()).hexdigest(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": None,
        "seed": seed,
        "commit": commit(),
        "cpu": vectors(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        OURS: own_version(),
    } | {package: installed(package) for package in PACKAGES}


def durations(clock: Clock) -> dict:
    """What each task took itself, seconds of the processor; and when it had ended, seconds from the start by a watch."""
    return {
        "seconds_of": {task: round(clock.seconds_of(task), 2) for task in clock.ended if clock.seconds_of(task)},
        "ended_after_s": {task: round(at, 2) for task, at in clock.ended.items()},
    }


def own_version() -> str | None:
    """The version of the program that runs."""
    return of_checkout(Path(__file__).resolve().parents[2]) or installed(OURS)


def of_checkout(root: Path) -> str | None:
    """The version that a checkout states, which another one that is installed does not hide; None: it is none of this project."""
    try:
        project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        return str(project["version"]) if project["name"] == OURS else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def installed(package: str) -> str | None:
    """The version of an installed package; None where it is not."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def commit() -> str | None:
    """The commit of the checkout that runs, if it is one."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        said = [
            subprocess.run(["git", "-C", root, *words], capture_output=True, check=True).stdout.decode().strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", ":/", ":!/reports"])
        ]
    except (OSError, ValueError, subprocess.CalledProcessError):
        return None
    return said[0] + (" with uncommitted changes" if said[1] else "")
