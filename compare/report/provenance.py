"""The provenance of a report: what a reader needs to repeat it."""

import hashlib
import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ..core.errors import ROOT
from ..core.timing import vectors
from ..core.words import readable
from ..process.workers import Clock

OURS = "arm-tmt-mujoco"
# those that are installed
PACKAGES = ["mujoco", "numpy", "scipy", "pandas", "matplotlib", "llvmlite", "mpmath", "rich", "heyoka"]
PACKAGES += ["drake", "pin", "mujoco-mjx", "jax", "mujoco-warp", "newton"]  # of engines
# changes elsewhere do not change the program
PROGRAM_FILES = [":/compare", ":/mjcf", ":/tmt", ":/pyproject.toml"]


def provenance(command: str, model: str | Path, shown: str, seed: int) -> dict[str, Any]:
    """Command, model (a file, shown by this name), versions, machine, commit and seed; `seconds` follow."""
    versions = {package: number for package in (OURS, *PACKAGES) if (number := installed(package))}
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
    } | versions


def durations(clock: Clock) -> dict[str, dict[str, float]]:
    """CPU seconds of each task, and when it ended, wall-clock seconds from the start."""
    seconds = {task: round(time, 2) for task in clock.ended if (time := clock.seconds_of(task))}
    return {"seconds_of": seconds, "ended_after_s": {task: round(at, 2) for task, at in clock.ended.items()}}


def commit() -> str | None:
    """The commit of the program, and whether it was changed since; None outside of a repository."""
    if not (ROOT / ".git").exists():
        return None
    try:
        head = git("rev-parse", "HEAD")
        changed = git("status", "--porcelain", "--", *PROGRAM_FILES)
    except (OSError, ValueError, subprocess.CalledProcessError):
        return None
    return head + (" with uncommitted changes" if changed else "")


def git(*words: str) -> str:
    run = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, check=True)
    return run.stdout.decode().strip()


def installed(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
