"""Which models a fleet has: every MJCF that is found, but for files that are only parts of others."""

import hashlib
import os
import tempfile
from collections.abc import Iterable, Sequence
from functools import cached_property
from glob import glob, has_magic
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..process.streams import in_one_line, readable
from .parts import parts_of
from .piece import FleetError

MODEL, PART = "mujoco", "mujocoinclude"  # the outermost elements of MJCF


class Model:
    """One file. path: as it was found; parts: what it includes or loads, itself among them."""

    def __init__(self, path: Path, named: bool, parts: Sequence[Path], included_by: str = ""):
        self.path, self.named, self.parts, self.included_by = path, named, parts, included_by

    @property
    def shown(self) -> str:
        """What it is called, as it was given."""
        return in_one_line(os.fspath(self.path))

    @cached_property
    def sha256(self) -> str:
        """Of the file alone."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    @cached_property
    def hash(self) -> str:
        """Of the file with everything that it includes and loads, by their places relative to it."""
        found = hashlib.sha256()
        for name, content in sorted(self.contents().items()):
            found.update(f"{name}\0{len(content)}\0".encode("utf-8", "surrogateescape") + content)
        return found.hexdigest()

    def contents(self) -> dict[str, bytes]:
        """The files that it needs, by their paths relative to its folder."""
        folder = os.path.dirname(os.path.abspath(self.path))
        return {os.path.relpath(os.path.abspath(part), folder): part.read_bytes() for part in self.parts}


class Found(NamedTuple):
    """The models of a fleet, and what is left out, by name, with the reason."""

    models: list[Model]
    left_out: list[tuple[str, str]]


def found_models(asked: Iterable[str]) -> Found:
    """The models that paths name: folders, globs, files, @list.txt. FleetError for a path that names nothing."""
    paths = {}
    for word in asked:
        for path, named in paths_of(word):
            paths.setdefault(Path(os.path.abspath(path)), (path, named))
    found, left_out = [], []
    for path, named in sorted(paths.values(), key=lambda pair: os.fspath(pair[0])):
        kind = outermost(path)
        if kind == PART and not named:
            left_out.append((in_one_line(os.fspath(path)), "it is a part, to be included by a model"))
        elif kind == MODEL or named:
            found.append(Model(path, named, parts_of(path)))
    for model in found:
        whole = model.path.resolve()
        others = [other.shown for other in found if other is not model and whole in map(Path.resolve, other.parts)]
        model.included_by = others[0] if others and not model.named else ""
    if not found:
        raise FleetError(f"no MJCF file is in {', '.join(map(in_one_line, asked))}")
    return Found(found, left_out)


def paths_of(word: str) -> list[tuple[Path, bool]]:
    """The XML files that one word names, and whether each is named itself, and not found in a folder."""
    if word.startswith("@"):
        return [pair for line in lines_of(word[1:]) for pair in paths_of(line)]
    path = Path(word)
    if path.is_dir():
        return [(file, False) for file in sorted(path.rglob("*.xml")) if file.is_file() and not hidden(file, path)]
    if path.exists():
        return [(path, True)]
    if has_magic(word):
        matches = sorted(glob(word, recursive=True))
        if matches:
            return [pair for match in matches for pair in paths_of_match(Path(match))]
    raise FleetError(f"there is no {in_one_line(word)}; a file, a folder, a pattern or @LIST is expected")


def paths_of_match(path: Path) -> list[tuple[Path, bool]]:
    return paths_of(os.fspath(path)) if path.is_dir() else [(path, False)]


def hidden(file: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in file.relative_to(folder).parts)


def lines_of(name: str) -> list[str]:
    """The lines of a list, each a path as seen from here; empty ones and those that begin with # say nothing."""
    try:
        lines = Path(name).read_text(encoding="utf-8", errors="surrogateescape").splitlines()
    except OSError as error:
        raise FleetError(f"cannot read the list {in_one_line(name)}: {error.strerror}") from None
    return [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def outermost(path: Path) -> str:
    """The name of the outermost element of a file; "" where it is no XML."""
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return element.tag
    except (ElementTree.ParseError, OSError, ValueError):
        text = path.read_bytes()[:4096] if path.is_file() else b""
        return MODEL if b"<mujoco" in text and b"<mujocoinclude" not in text else ""
    return ""


def bundle(model: Model) -> dict[str, bytes]:
    """What a model needs, to be sent elsewhere: {path relative to a folder that all are below: content}, the model first."""
    contents = model.contents()
    names = [os.path.basename(model.path), *(name for name in contents if name != os.path.basename(model.path))]
    up = max(name.split(os.sep).count(os.pardir) for name in names)
    below = os.path.join(*(f"up{k}" for k in range(up)), "") if up else ""
    return {os.path.normpath(below + name): contents[name] for name in names}


def unpacked(files: dict[str, bytes], folder: Path) -> Path:
    """The model of a bundle as a file, in a new folder inside one."""
    place = Path(tempfile.mkdtemp(dir=folder))
    for name, content in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content)
    return place / next(iter(files))


def place_of(shown: str) -> str:
    """The folder of a model's own report, relative to that of the fleet."""
    parts = [
        {os.pardir: "up"}.get(part, part) for part in Path(readable(shown)).parts if part not in (os.sep, os.curdir)
    ]
    return "/".join(["files", *parts])
