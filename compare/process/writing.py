"""Where a file may be written, and how it replaces an earlier one that this program wrote."""

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

MOST = 1000  # bytes of a first line that are looked at


def has_mark(path: Path, mark: str) -> bool:
    """Whether this program wrote a file: a comment in its first line has this mark."""
    with open(path, "rb") as file:
        first = file.readline(MOST)
    return path.suffix == ".xml" and first.startswith(b"<!--") and mark.encode() in first


def assets_of(path: Path) -> Path:
    """The folder of the assets of a written file."""
    return path.with_name(f"{path.stem}_assets")


def why_not(path: Path, needed: Iterable[Path], reserved: Iterable[Path], mark: str) -> str:
    """Why a file cannot be written to a path, as a key or as the system says it; "" if it can.

    needed: files that are never written to. reserved: files and folders that something else replaces. mark: in the
    first line of what may be replaced.
    """
    rules = {
        "link": path.is_symlink,
        "folder": path.is_dir,
        "no_folder": lambda: not path.parent.is_dir(),
        "not_regular": lambda: path.exists() and not path.is_file(),
        "needed": lambda: path.exists() and any(file.exists() and path.samefile(file) for file in needed),
        "foreign": lambda: path.exists() and not has_mark(path, mark),
        "read_only": lambda: path.exists() and not os.access(path, os.W_OK),
        "report": lambda: any(path.resolve().is_relative_to(part.resolve()) for part in reserved),
        "assets": lambda: os.path.lexists(assets_of(path)) and not assets_of(path).is_dir(),
    }
    try:
        for why, applies in rules.items():
            if applies():
                return why
        with tempfile.TemporaryFile(dir=path.parent):
            return ""
    except (OSError, ValueError) as error:  # a name that is too long, a folder that is read-only
        return getattr(error, "strerror", None) or str(error)


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
