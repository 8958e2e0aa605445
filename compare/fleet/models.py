"""Which models a fleet has: every MJCF that is found, except for files that are only parts of others."""

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from glob import glob, has_magic
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..process.streams import in_one_line, readable
from .parts import is_a_file, needed_by
from .piece import FleetError

MODEL_ELEMENT, PART_ELEMENT = "mujoco", "mujocoinclude"  # the outermost elements of MJCF
SUFFIXES = (".xml", ".mjcf")
LONGEST_NAME = 120  # characters of a folder of reports


class Model:
    """One file. path: as it was found; parts: what it includes or loads, itself among them; included_by: another of the fleet."""

    def __init__(self, path: Path, parts: Sequence[Path], included_by: str = ""):
        self.path, self.parts, self.included_by = path, parts, included_by

    @property
    def shown(self) -> str:
        """What it is called, as it was given."""
        return in_one_line(os.fspath(self.path))

    @cached_property
    def sha256(self) -> str:
        """Of the file alone; "" if it cannot be read."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except OSError:
            return ""

    @cached_property
    def hash(self) -> str:
        """Of the file with everything that it includes and loads, by their places relative to it. OSError: it cannot be read."""
        return hash_of(self.contents())

    def is_copy_of(self, other: "Model") -> bool:
        """Whether it has the same content under another name, and all that it includes and loads too. OSError: one is gone."""

        def needs(model: Model) -> dict[str, bytes]:
            return {name: content for name, content in model.contents().items() if name != os.path.basename(model.path)}

        return self.sha256 == other.sha256 and needs(self) == needs(other)

    def contents(self) -> dict[str, bytes]:
        """The files that it needs, by their paths relative to its folder."""
        folder = os.path.dirname(os.path.abspath(self.path))
        return {os.path.relpath(os.path.abspath(part), folder): part.read_bytes() for part in self.parts}


class Found(NamedTuple):
    """The models of a fleet, and what is left out, by name, with the reason."""

    models: list[Model]
    left_out: list[tuple[str, str]]


def hash_of(contents: dict[str, bytes]) -> str:
    """Of names and what is in the files."""
    found = hashlib.sha256()
    for name, content in sorted(contents.items()):
        found.update(f"{name}\0{len(content)}\0".encode("utf-8", "surrogateescape") + content)
    return found.hexdigest()


def found_models(asked: Sequence[str]) -> Found:
    """The models that paths name: folders, globs, files, @list.txt. FleetError for a path that names nothing."""
    paths, left_out = {}, []
    for path, named in paths_of(asked, left_out):
        first, before = paths.setdefault(os.path.abspath(path), (path, named))
        paths[os.path.abspath(path)] = first, named or before
    files, models, parts = {}, {}, []
    for path, named in sorted(paths.values(), key=lambda pair: (os.path.islink(pair[0]), os.fspath(pair[0]))):
        shown = in_one_line(os.fspath(path))
        same = files.setdefault(os.path.realpath(path), shown)
        kind = MODEL_ELEMENT if named or same != shown else outermost(path)
        if same != shown:
            left_out.append((shown, f"it is the same file as {same}"))
        elif shown in models:
            left_out.append((shown, "another file is shown by the same name"))
        elif kind == PART_ELEMENT:
            parts.append(path)
        elif kind == MODEL_ELEMENT:
            models[shown] = Model(path, needed_by(path))
        else:
            what = f"its outermost element is <{in_one_line(kind)}>" if kind else "it is no XML"
            left_out.append((shown, f"it is no MJCF, {what}"))
    needed = {model.shown: {os.path.realpath(part) for part in model.parts[1:]} for model in models.values()}
    by = {}  # who includes a file
    for model in models.values():
        for part in needed[model.shown]:
            by.setdefault(part, []).append(model)
    for model in models.values():  # of two that include each other none is a part
        others = [other.shown for other in by.get(os.path.realpath(model.path), ())
                  if os.path.realpath(other.path) not in needed[model.shown]]  # fmt: skip
        model.included_by = others[0] if others else ""
    for path in parts:
        others = by.get(os.path.realpath(path))
        why = f"included by {others[0].shown}" if others else "to be included by a model"
        left_out.append((in_one_line(os.fspath(path)), f"it is a part, {why}"))
    if not models:
        raise FleetError(f"no MJCF file is in {', '.join(map(in_one_line, asked))}")
    return Found(sorted(models.values(), key=lambda model: model.shown), sorted(left_out))


def paths_of(words: Iterable[str], left_out: list, lists: tuple[str, ...] = ()) -> Iterator[tuple[Path, bool]]:
    """The files that words name, and whether each is named itself, and not found in a folder or by a pattern.

    left_out: gets what cannot be read, with the reason; lists: those in which the words stand, each in the one before.
    """
    for word in words:
        path = Path(word)
        if word.startswith("@"):
            name = os.path.realpath(word[1:])
            if name not in lists:  # a list that names itself adds nothing
                yield from paths_of(lines_of(word[1:]), left_out, (*lists, name))
        elif is_a_file(path):
            yield path, True
        elif is_there(path):
            if not path.is_dir():
                raise FleetError(f"{in_one_line(word)} is neither a file nor a folder")
            yield from ((file, False) for file in files_in(path, left_out))
        else:
            matches = sorted(glob(word, recursive=True)) if has_magic(word) and "\0" not in word else []
            if not matches:
                raise FleetError(f"there is no {in_one_line(word)}; a file, a folder, a pattern or @LIST is expected")
            for match in map(Path, matches):
                files = files_in(match, left_out) if match.is_dir() else [match] * is_a_file(match)
                yield from ((file, False) for file in files)


def is_there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that no file can have
        return False


def files_in(folder: Path, left_out: list) -> Iterator[Path]:
    """The files of a folder, at any depth, that may be MJCF; hidden ones, and those of hidden folders, are passed over."""

    def cannot_be_read(error):
        left_out.append((in_one_line(os.fspath(error.filename)), f"it cannot be read: {error.strerror}"))

    for place, folders, names in os.walk(folder, onerror=cannot_be_read):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith(SUFFIXES) and not name.startswith(".") and is_a_file(Path(place, name)):
                yield Path(place, name)


def lines_of(name: str) -> list[str]:
    """The lines of a list, each a path as seen from here; empty ones and those that begin with # say nothing."""
    try:
        lines = Path(name).read_text(encoding="utf-8-sig", errors="surrogateescape").split("\n")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FleetError(f"cannot read the list {in_one_line(name)}: {why}") from None
    return [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def outermost(path: Path) -> str:
    """The name of the outermost element of a file; of broken XML, or what cannot be read, that it seems to have, or "".

    A file without any element, an empty one, is taken for a model: it is refused with this reason, and not passed over.
    """
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return element.tag
        return ""
    except PermissionError:
        return MODEL_ELEMENT  # nobody knows: it is refused with this reason
    except (ElementTree.ParseError, LookupError, OSError, ValueError):
        pass
    try:
        with path.open("rb") as file:
            text = file.read(4096)
    except OSError:
        return MODEL_ELEMENT
    is_text = b"\0" not in text
    is_model = b"<mujoco" in text and b"<mujocoinclude" not in text
    return MODEL_ELEMENT if is_text and (is_model or b"<" not in text) else ""


def bundle(model: Model) -> dict[str, bytes]:
    """What a model needs, to be sent elsewhere: {path relative to a folder that all are below: content}, the model first.

    OSError: a file is gone, or another one than when the model's hash was made.
    """
    contents = model.contents()
    if hash_of(contents) != model.hash:
        raise OSError(0, "the file, or one that it needs, has changed since the fleet began")
    names = [os.path.basename(model.path), *(name for name in contents if name != os.path.basename(model.path))]
    up = max(name.split(os.sep).count(os.pardir) for name in names)
    below = os.path.join(*(f"up{k}" for k in range(up)), "") if up else ""
    return {os.path.normpath(below + name): contents[name] for name in names}


def unpacked(files: dict[str, bytes], folder: Path) -> Path:
    """The model of a bundle as a file, unpacked in an empty folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder / next(iter(files))


def place_of_report(shown: str) -> str:
    """The folder of a model's own report, relative to that of the fleet: no two models have the same, or one inside the other."""
    parts = [part for part in Path(readable(shown)).parts if part not in (os.sep, os.curdir)]
    is_plain = not os.path.isabs(shown) and os.pardir not in parts and max(map(len, parts)) <= LONGEST_NAME
    if not is_plain:  # such a path, shortened, may be that of another file
        parts = [part[-LONGEST_NAME:] for part in parts if part != os.pardir]
        parts[-1] += f"-{hashlib.sha256(shown.encode()).hexdigest()[:8]}"
    return "/".join(["files", *parts])
