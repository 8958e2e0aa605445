"""The models of a fleet: all MJCF files below the given paths, except files that only other files include.

mju_getXMLDependencies of MuJoCo 4.0.0 searches for height fields and stripped paths where the compiler does not. So
`needed_by` searches every folder that the compiler may use, and takes the files that exist.
"""

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from glob import glob, has_magic
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..process.streams import in_one_line, readable
from .tasks import FleetError

MODEL_ELEMENT, PART_ELEMENT = "mujoco", "mujocoinclude"  # root elements of MJCF
SUFFIXES = (".xml", ".mjcf")
MAX_NAME = 120  # characters of a folder of reports
WITH_MODELS = ("include", "model")  # elements that refer to further MJCF
DIRECTORIES = ("assetdir", "meshdir", "texturedir")


class Model:
    """One file. parts: the file itself and the files that it includes or loads; included_by: another model of the fleet."""

    def __init__(self, path: Path, parts: Sequence[Path], included_by: str = ""):
        self.path, self.parts, self.included_by = path, parts, included_by

    @property
    def shown(self) -> str:
        """The path as given, printable."""
        return in_one_line(os.fspath(self.path))

    @cached_property
    def sha256(self) -> str:
        """Hash of the file alone; "" if it cannot be read."""
        try:
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        except OSError:
            return ""

    @cached_property
    def hash(self) -> str:
        """Hash of the file and all files that it includes and loads, with their relative paths. OSError: not readable."""
        return hash_of(self.contents())

    def is_copy_of(self, other: "Model") -> bool:
        """Whether both files have the same content, and load files of the same content. OSError: not readable."""

        def needs(model: Model) -> dict[str, bytes]:
            return {name: content for name, content in model.contents().items() if name != os.path.basename(model.path)}

        return self.sha256 == other.sha256 and needs(self) == needs(other)

    def contents(self) -> dict[str, bytes]:
        """Content of the file and of the files that it needs, by paths relative to its folder."""
        folder = os.path.dirname(os.path.abspath(self.path))
        return {os.path.relpath(os.path.abspath(part), folder): part.read_bytes() for part in self.parts}


class Models(NamedTuple):
    models: list[Model]
    left_out: list[tuple[str, str]]


def hash_of(contents: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name, content in sorted(contents.items()):
        digest.update(f"{name}\0{len(content)}\0".encode("utf-8", "surrogateescape") + content)
    return digest.hexdigest()


def found_models(words: Sequence[str]) -> Models:
    """The models of paths: folders, patterns, files, @list.txt. FleetError for a path without files."""
    paths, left_out = {}, []
    for path, named in paths_of(words, left_out):
        first, before = paths.setdefault(os.path.abspath(path), (path, named))
        paths[os.path.abspath(path)] = first, named or before
    files, models, parts = {}, {}, []
    for path, named in sorted(paths.values(), key=lambda pair: (os.path.islink(pair[0]), os.fspath(pair[0]))):
        shown = in_one_line(os.fspath(path))
        same = files.setdefault(os.path.realpath(path), shown)
        kind = MODEL_ELEMENT if named or same != shown else root_element(path)
        if same != shown:
            left_out.append((shown, f"same file as {same}"))
        elif shown in models:
            left_out.append((shown, "another file has the same printable name"))
        elif kind == PART_ELEMENT:
            parts.append(path)
        elif kind == MODEL_ELEMENT:
            models[shown] = Model(path, needed_by(path))
        else:
            left_out.append((shown, f"not MJCF: {f'root element <{in_one_line(kind)}>' if kind else 'not XML'}"))
    needed = {model.shown: {os.path.realpath(part) for part in model.parts[1:]} for model in models.values()}
    including = {}  # the models that include a file
    for model in models.values():
        for part in needed[model.shown]:
            including.setdefault(part, []).append(model)
    for model in models.values():  # if two files include each other, neither is a part
        others = [other.shown for other in including.get(os.path.realpath(model.path), ())
                  if os.path.realpath(other.path) not in needed[model.shown]]  # fmt: skip
        model.included_by = others[0] if others else ""
    for path in parts:
        others = including.get(os.path.realpath(path))
        why = f"included by {others[0].shown}" if others else "a part of a model"
        left_out.append((in_one_line(os.fspath(path)), why))
    if not models:
        raise FleetError(f"no MJCF file in {', '.join(map(in_one_line, words))}")
    return Models(sorted(models.values(), key=lambda model: model.shown), sorted(left_out))


def paths_of(words: Iterable[str], left_out: list, lists: tuple[str, ...] = ()) -> Iterator[tuple[Path, bool]]:
    """The files of paths, each with True if the path is that of the file, not of a folder or a pattern.

    left_out: receives folders that cannot be read; lists: the @LIST files that led here.
    """
    for word in words:
        path = Path(word)
        if word.startswith("@"):
            name = os.path.realpath(word[1:])
            if name not in lists:  # a list may contain itself
                yield from paths_of(lines_of(word[1:]), left_out, (*lists, name))
        elif is_a_file(path):
            yield path, True
        elif os.path.isdir(path):
            yield from ((file, False) for file in files_in(path, left_out))
        else:
            matches = sorted(glob(word, recursive=True)) if has_magic(word) and "\0" not in word else []
            if not matches:
                raise FleetError(f"no such file: {in_one_line(word)}; expected a file, a folder, a pattern or @LIST")
            for match in map(Path, matches):
                files = files_in(match, left_out) if match.is_dir() else [match] * is_a_file(match)
                yield from ((file, False) for file in files)


def is_a_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # not a valid name
        return False


def files_in(folder: Path, left_out: list) -> Iterator[Path]:
    """The .xml and .mjcf files of a folder at any depth, without hidden files and folders."""

    def cannot_be_read(error):
        left_out.append((in_one_line(os.fspath(error.filename)), f"not readable: {error.strerror}"))

    for place, folders, names in os.walk(folder, onerror=cannot_be_read):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith(SUFFIXES) and not name.startswith(".") and is_a_file(Path(place, name)):
                yield Path(place, name)


def lines_of(name: str) -> list[str]:
    """The paths in a list, one a line; empty lines and lines that begin with # are ignored."""
    try:
        lines = Path(name).read_text(encoding="utf-8-sig", errors="surrogateescape").split("\n")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FleetError(f"cannot read the list {in_one_line(name)}: {why}") from None
    return [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def root_element(path: Path) -> str:
    """The name of the root element; "" if the file is not XML.

    A file that is empty, broken or not readable counts as a model, so that the table shows it with the reason.
    """
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return element.tag
        return ""
    except PermissionError:
        return MODEL_ELEMENT
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


def needed_by(path: Path) -> tuple[Path, ...]:
    """An MJCF file and the existing files that it includes, attaches and loads; itself first."""
    parts, read, files, directories = {os.path.abspath(path): path}, set(), [], {""}
    waiting = [path]
    folders = [path.parent]  # relative paths may start at any of them
    while waiting:  # all XML first: a directory that one file states applies to all
        file = waiting.pop()
        if (whole := os.path.realpath(file)) in read:  # it may include itself
            continue
        read.add(whole)
        for element in elements_of(file):
            directories |= {element.get(name) for name in DIRECTORIES if element.get(name)}
            names = [value for key, value in element.attrib.items() if key.startswith("file") and value]
            files += names
            for part in existing(names, folders, [""]) if element.tag in WITH_MODELS else ():
                parts.setdefault(os.path.abspath(part), part)
                waiting.append(part)
                folders += [part.parent] * (part.parent not in folders)
    files += [os.path.basename(name.replace("\\", "/")) for name in files]  # strippath
    for part in existing(dict.fromkeys(files), folders, sorted(directories)):
        parts.setdefault(os.path.abspath(part), part)
    return path, *sorted(part for part in parts.values() if part is not path)


def existing(names: Iterable[str], folders: Iterable[Path], directories: Iterable[str]) -> Iterator[Path]:
    paths = (folder / directory / name for name in names for folder in folders for directory in directories)
    return (path for path in paths if is_a_file(path))


def elements_of(path: Path) -> Iterator[ElementTree.Element]:
    """The elements of a file, up to the first error."""
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            yield element
    except (ElementTree.ParseError, LookupError, OSError, ValueError):
        return


def bundle(model: Model) -> dict[str, bytes]:
    """The files of a model for another machine: {path below a common folder: content}, the model first.

    OSError: a file is gone or has changed.
    """
    contents = model.contents()
    if hash_of(contents) != model.hash:
        raise OSError(0, "the file, or a file that it needs, changed while the fleet was running")
    names = [os.path.basename(model.path), *(name for name in contents if name != os.path.basename(model.path))]
    up = max(name.split(os.sep).count(os.pardir) for name in names)
    below = os.path.join(*(f"up{k}" for k in range(up)), "") if up else ""
    return {os.path.normpath(below + name): contents[name] for name in names}


def unpacked(files: dict[str, bytes], folder: Path) -> Path:
    """Write the files of a bundle to an empty folder; the path of the model."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder / next(iter(files))


def place_of_report(shown: str) -> str:
    """The folder of a model's report, relative to that of the fleet; unique, and not inside that of another model."""
    parts = [part for part in Path(readable(shown)).parts if part not in (os.sep, os.curdir)]
    is_plain = not os.path.isabs(shown) and os.pardir not in parts and max(map(len, parts)) <= MAX_NAME
    if not is_plain:  # the shortened path may be that of another file
        parts = [part[-MAX_NAME:] for part in parts if part != os.pardir]
        parts[-1] += f"-{hashlib.sha256(shown.encode()).hexdigest()[:8]}"
    return "/".join(["files", *parts])
