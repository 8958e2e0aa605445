"""The files of a model, whether they can be read, and where one may be written.

mju_getXMLDependencies of MuJoCo 4.0.0 looks for height fields and stripped paths where the compiler does not.
`needed_by` searches every folder that the compiler may use, and takes what exists.
"""

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PureWindowsPath
from xml.etree import ElementTree

DIRECTORIES = ("assetdir", "meshdir", "texturedir")
MOST = 1000  # bytes of a first line that are looked at


def is_pipe(path: Path) -> bool:
    """Whether a path is a pipe, a device or a socket, which may be waited for without end."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def elements_of(path: Path) -> Iterator[ElementTree.Element]:
    """The elements of a file, up to the first error."""
    with suppress(ElementTree.ParseError, LookupError, OSError, ValueError):
        if not is_pipe(path):
            yield from (element for _, element in ElementTree.iterparse(path, events=("start",)))


def needed_by(path: Path) -> tuple[Path, ...]:
    """An MJCF file and the existing files that it includes, attaches and loads; itself first."""
    return path, *filter(os.path.isfile, named_by(path)[1:])


def named_by(path: Path) -> tuple[Path, ...]:
    """As needed_by, with pipes and devices."""
    models, names = {os.path.abspath(path): path}, set[str]()
    directories = {""}  # one that a file states applies to all files
    waiting = [path]
    while waiting:
        for element in elements_of(waiting.pop()):
            stated = {value for key, value in element.attrib.items() if key.startswith("file") and value}
            names |= stated | {PureWindowsPath(name).name for name in stated}  # the last part: strippath
            directories |= {element.get(name, "") for name in DIRECTORIES}
            found = existing(stated, models, {""}) if element.tag in ("include", "model") else {}
            waiting += [part for place, part in found.items() if place not in models]
            models = found | models
    parts = existing(names, models, directories) | models
    return path, *sorted(part for part in parts.values() if part is not path)


def existing(names: Iterable[str], models: dict[str, Path], directories: Iterable[str]) -> dict[str, Path]:
    """The files of these names in folders of models, and in directories from there, by absolute paths."""
    folders = {model.parent for model in models.values()}
    paths = [folder / directory / name for name in names for folder in folders for directory in directories]
    return {os.path.abspath(path): path for path in paths if os.path.exists(path) and not os.path.isdir(path)}


def remove_empty(made: Iterable[Path]) -> None:
    """Delete folders that a run has made, the innermost first, if they are empty."""
    with suppress(OSError):
        for path in made:
            path.rmdir()


def assets_of(path: Path) -> Path:
    """The folder of the assets of a written file."""
    return path.with_name(f"{path.stem}_assets")


def has_mark(path: Path, mark: str) -> bool:
    """Whether this program wrote a file: a comment in its first line has this mark."""
    with open(path, "rb") as file:
        first = file.readline(MOST)
    return path.suffix == ".xml" and first.startswith(b"<!--") and mark.encode() in first


def why_not(path: Path, needed: Iterable[Path], reserved: Iterable[Path], mark: str) -> str:
    """Why a file cannot be written to a path, as a key or as the system says it; "" if it can.

    needed: files that are never written to. reserved: files and folders that something else replaces. mark:
    in the first line of what may be replaced.
    """
    assets = assets_of(path)
    try:
        is_there = path.is_symlink() or path.exists()
        if is_there and (path.is_symlink() or not path.is_file()):
            return "not_regular"
        if is_there and any(file.exists() and path.samefile(file) for file in needed):
            return "needed"
        if is_there and not has_mark(path, mark):
            return "foreign"
        if any(path.resolve().is_relative_to(part.resolve()) for part in reserved):
            return "report"
        if os.path.lexists(assets) and not assets.is_dir():
            return "assets"
        with tempfile.TemporaryFile(dir=path.parent):
            return ""
    except (OSError, ValueError) as error:  # no such folder, one that is read-only, a name that is too long
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
