"""The models of a fleet: all MJCF files below the given paths, except files that only other files include.

mju_getXMLDependencies of MuJoCo 4.0.0 searches for height fields and stripped paths where the compiler does not. So
`needed_by` searches every folder that the compiler may use, and takes the files that exist.
"""

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from glob import glob, has_magic
from pathlib import Path
from xml.etree import ElementTree

from ..process.crash import Refused
from ..process.streams import in_one_line, readable

MODEL_ELEMENT, PART_ELEMENT = "mujoco", "mujocoinclude"  # root elements of MJCF
SUFFIXES = (".xml", ".mjcf")
MAX_NAME = 120  # characters of a folder of reports
WITH_MODELS = ("include", "model")  # elements that refer to further MJCF
DIRECTORIES = ("assetdir", "meshdir", "texturedir")


@dataclass(eq=False)
class Model:
    """One file."""

    path: Path
    parts: Sequence[Path]  # the file itself and the files that it includes or loads
    included_by: str = ""  # another model of the fleet

    @property
    def shown(self) -> str:
        """The path as given, printable."""
        return in_one_line(os.fspath(self.path))

    @cached_property
    def sha256(self) -> str:
        """Hash of the file alone; "" if it cannot be read."""
        with suppress(OSError):
            return hashlib.sha256(self.path.read_bytes()).hexdigest()
        return ""

    @cached_property
    def hash(self) -> str:
        """Hash of the file without its name, and of all files that it needs; "" if one cannot be read."""
        with suppress(OSError):
            return hash_of(bundle(self))
        return ""


def bundle(model: Model) -> dict[str, bytes]:
    """The files of a model for another machine: {path below a common folder: content}, the model first."""
    parts = [Path(os.path.abspath(part)) for part in model.parts]
    top = os.path.commonpath([part.parent for part in parts])
    return {os.path.relpath(part, top): part.read_bytes() for part in parts}


def hash_of(files: dict[str, bytes]) -> str:
    """Hash of a bundle, without the name of the model."""
    digest = hashlib.sha256()
    for k, (name, content) in enumerate(files.items()):
        digest.update(
            f"{name if k else os.path.dirname(name)}\0{len(content)}\0".encode("utf-8", "surrogateescape") + content
        )
    return digest.hexdigest()


def unpacked(files: dict[str, bytes], folder: Path) -> Path:
    """Write the files of a bundle to a folder; the path of the model."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder / next(iter(files))


def found_models(words: Sequence[str]) -> tuple[list[Model], list[tuple[str, str]]]:
    """The models of paths (folders, patterns, files, @list.txt), and files that are left out, with the reason.

    Refused: a path without files.
    """
    paths, left_out = {}, []
    for path, named in paths_of(words):
        first, before = paths.get(os.path.abspath(path), (path, False))
        paths[os.path.abspath(path)] = first, named or before
    files, models, parts = {}, [], []
    for path, named in sorted(paths.values(), key=lambda pair: (pair[0].is_symlink(), os.fspath(pair[0]))):
        shown = in_one_line(os.fspath(path))
        same = files.setdefault(os.path.realpath(path), shown)
        kind = MODEL_ELEMENT if named else root_element(path)
        if same != shown:
            left_out.append((shown, f"same file as {same}"))
        elif kind == PART_ELEMENT:
            parts.append(path)
        elif kind == MODEL_ELEMENT:
            models.append(Model(path, needed_by(path)))
        else:
            left_out.append((shown, f"not MJCF: {f'root element <{in_one_line(kind)}>' if kind else 'not XML'}"))
    if not models:
        raise Refused(f"no MJCF file in {', '.join(map(in_one_line, words))}")
    needed = {model.shown: {os.path.realpath(part) for part in model.parts[1:]} for model in models}
    for model in models:  # if two files include each other, neither is a part
        others = [other.shown for other in models if os.path.realpath(model.path) in needed[other.shown]
                  and os.path.realpath(other.path) not in needed[model.shown]]  # fmt: skip
        model.included_by = next(iter(others), "")
    for path in parts:
        others = [shown for shown, files in needed.items() if os.path.realpath(path) in files]
        left_out.append((in_one_line(os.fspath(path)), f"included by {others[0]}" if others else "a part of a model"))
    return sorted(models, key=lambda model: model.shown), sorted(left_out)


def paths_of(words: Iterable[str]) -> Iterator[tuple[Path, bool]]:
    """The files of paths, each with True if the path is that of the file, not of a folder or a pattern."""
    for word in words:
        path = Path(word)
        if word.startswith("@"):
            yield from paths_of(lines_of(word[1:]))
        elif is_a_file(path):
            yield path, True
        else:
            matches = [path] if os.path.isdir(path) else []
            if not matches and has_magic(word) and "\0" not in word:
                matches = [Path(match) for match in sorted(glob(word, recursive=True))]
            if not matches:
                raise Refused(f"no such file: {in_one_line(word)}; expected a file, a folder, a pattern or @LIST")
            for match in matches:
                files = files_in(match) if match.is_dir() else [match] * is_a_file(match)
                yield from ((file, False) for file in files)


def is_a_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # not a valid name
        return False


def files_in(folder: Path) -> Iterator[Path]:
    """The .xml and .mjcf files of a folder at any depth, without hidden files and folders."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.lower().endswith(SUFFIXES) and not name.startswith(".") and is_a_file(Path(place, name)):
                yield Path(place, name)


def lines_of(name: str) -> list[str]:
    """The paths in a list, one a line; empty lines and lines that begin with # or @ are ignored."""
    try:
        lines = Path(name).read_text(encoding="utf-8-sig", errors="surrogateescape").split("\n")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise Refused(f"cannot read the list {in_one_line(name)}: {why}") from None
    return [line.strip() for line in lines if line.strip() and line.lstrip()[0] not in "#@"]


def root_element(path: Path) -> str:
    """The name of the root element; "" for other formats.

    A file that is empty, broken or not readable counts as a model, so that the table shows it with the reason.
    """
    try:
        return next(element.tag for _, element in ElementTree.iterparse(path, events=("start",)))
    except (StopIteration, ElementTree.ParseError, LookupError, OSError, ValueError):
        return MODEL_ELEMENT


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


def place_of_report(shown: str) -> str:
    """The folder of a model's report, relative to that of the fleet; unique, and not inside that of another model."""
    parts = [part for part in Path(readable(shown)).parts if part not in (os.sep, os.curdir)]
    is_plain = not os.path.isabs(shown) and os.pardir not in parts and max(map(len, parts)) <= MAX_NAME
    if not is_plain:  # the shortened path may be that of another file
        parts = [part[-MAX_NAME:] for part in parts if part != os.pardir]
        parts[-1] += f"-{hashlib.sha256(shown.encode()).hexdigest()[:8]}"
    return "/".join(["files", *parts])
