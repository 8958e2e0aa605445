"""The smaller file: where it may be written, and how it replaces an earlier one."""

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.text import block
from ...engines.mujoco.smaller import MARK, assets_of
from ...engines.mujoco.source import Source
from ...process.parts import needed_by
from ...report.folder import OWN

TEXT = "reduction_of_file"


def needed_of(*sources: Source) -> list[Path]:
    """The files of models, and those that they include, attach and load."""
    files: list[Path] = []
    for source in sources:
        if isinstance(source.origin, Path) and source.spec:
            meshes = (Path(source.origin.parent, mesh.file) for mesh in source.spec.meshes)  # package:// too
            files += [*needed_by(source.origin), *meshes]
    return files


def refusal(path: Path, needed: Iterable[Path], report: Path) -> str:
    """Why a smaller file cannot be written to a path, in one line; "" if it can.

    needed: the files that the model needs, which are never written to. report: the folder of the report, whose
    files the next report replaces. Only a file that this program wrote is replaced.
    """
    try:
        return block(TEXT, "refusal", why=why_not(path, needed, report), assets=assets_of(path).name)
    except (OSError, ValueError) as error:  # a name that is too long, a folder that is read-only
        return getattr(error, "strerror", None) or str(error)


def why_not(path: Path, needed: Iterable[Path], report: Path) -> str:
    """The kind of refusal, as the template names it; OSError where the folder takes no file."""
    if path.is_symlink():
        return "link"
    if path.is_dir():
        return "folder"
    if not path.parent.is_dir():
        return "no_folder"
    if path.exists():
        if not path.is_file():
            return "not_regular"
        if any(file.exists() and path.samefile(file) for file in needed):
            return "needed"
        if not is_written(path):
            return "foreign"
        if not os.access(path, os.W_OK):
            return "read_only"
    if any(path.resolve().is_relative_to(report.resolve() / name) for name in OWN):
        return "report"
    if os.path.lexists(assets_of(path)) and not assets_of(path).is_dir():
        return "assets"
    with tempfile.TemporaryFile(dir=path.parent):
        return ""


def is_written(path: Path) -> bool:
    """Whether this program wrote a file: a comment in its first line says so."""
    with open(path, "rb") as file:
        first = file.readline(1000)
    return path.suffix == ".xml" and first.startswith(b"<!--") and MARK.encode() in first


@contextmanager
def draft_of(path: Path | None) -> Iterator[Path]:
    """A path beside `path` (None: in a folder for temporary files), which is gone at the end of the block."""
    folder = path.parent if path else None
    with tempfile.TemporaryDirectory(prefix=".smaller-", dir=folder) as place:
        yield Path(place, path.name if path else "smaller.xml")


def move(draft: Path, path: Path) -> None:
    """Move a file and its assets: an earlier file and its own assets are whole until the last moment."""
    if assets_of(draft).is_dir():
        assets_of(path).mkdir(exist_ok=True)
        for asset in assets_of(draft).iterdir():
            asset.replace(assets_of(path) / asset.name)
    draft.replace(path)
