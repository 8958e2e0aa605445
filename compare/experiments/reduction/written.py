"""The smaller file: where it may be written, and how it replaces an earlier one."""

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ...core.text import block
from ...engines.mujoco.motion import Scene
from ...engines.mujoco.smaller import Smaller, assets_of, finished, is_written
from ...engines.mujoco.source import Source
from ...report.folder import OWN

TEXT = "reduction"  # the template


def written(scene: Scene, small: Smaller, path: Path, comment: str) -> Smaller:
    """Write a model with the starts of the scene's motions as its keyframes; what is read again."""
    finished(small, scene.starts(small)).write(path, comment)
    return Smaller.whole(Source(path))


def refusal(path: Path, needed: Iterable[Path], report: Path) -> str:
    """Why a smaller file cannot be written to a path, in one line; "" if it can.

    needed: the files that the model needs, which are never written to. report: the folder of the report, whose
    files the next report replaces. Only a file that this program wrote is replaced.
    """
    assets, of_report = assets_of(path), [report.resolve() / name for name in OWN]
    rules = {  # by the names that the template has
        "link": path.is_symlink,
        "folder": path.is_dir,
        "no_folder": lambda: not path.parent.is_dir(),
        "not_regular": lambda: path.exists() and not path.is_file(),
        "needed": lambda: path.exists() and any(file.exists() and path.samefile(file) for file in needed),
        "foreign": lambda: path.exists() and not is_written(path),
        "read_only": lambda: path.exists() and not os.access(path, os.W_OK),
        "report": lambda: any(path.resolve().is_relative_to(part) for part in of_report),
        "assets": lambda: os.path.lexists(assets) and not assets.is_dir(),
    }
    try:
        for why, applies in rules.items():
            if applies():
                return block(TEXT, "refusal", why=why, assets=assets.name)
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
