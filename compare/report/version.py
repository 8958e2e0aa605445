"""Versions: of the program itself, and of the packages that it takes."""

import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

OURS = "arm-tmt-mujoco"


def own_version() -> str | None:
    return of_checkout(Path(__file__).resolve().parents[2]) or installed(OURS)


def of_checkout(root: Path) -> str | None:
    """The version that a checkout states, which another one that is installed does not hide; None: it is none of this project."""
    try:
        project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        return str(project["version"]) if project["name"] == OURS else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def installed(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
