"""Where a report comes from: what a reader needs to make it again."""

import hashlib
import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..judge.timing import vectors
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
    } | {package: installed(package) for package in (OURS, *PACKAGES)}


def installed(package: str) -> str | None:
    """The version of an installed package; None for this one where it runs from a checkout that is not installed."""
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
