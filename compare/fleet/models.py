"""The models of a fleet: the XML, MJCF and URDF files below the given paths that no other file includes.

A file that is no model is one of them too: the table says why it was refused.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from glob import glob, has_magic
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from ..core.errors import Refused
from ..core.words import in_one_line, readable
from ..process.files import elements_of, is_pipe, needed_by

PART = "mujocoinclude"  # root element of a file that is no model by itself


class Model(NamedTuple):
    path: Path
    parts: Sequence[Path]  # the file itself and the files that it includes or loads

    @property
    def contents(self) -> list[tuple[str, str]]:
        """The paths of the parts from the file's folder, and hashes of what is in them; the file first. OSError."""
        names = [os.path.relpath(part, self.path.parent) for part in self.parts]
        return [(name, sha256(part.read_bytes()).hexdigest()) for name, part in zip(names, self.parts)]

    @property
    def shown(self) -> str:
        """The path as given, printable, with the same separators on every system."""
        return in_one_line(self.path.as_posix())


def found_models(words: Sequence[str]) -> tuple[list[Model], list[tuple[str, str]]]:
    """The models of paths (folders, patterns, files, @list.txt), and the files that are left out, and why.

    A file that is named is a model. Refused: a path without files.
    """
    files: dict[str, tuple[Path, bool]] = {}  # by the real path: the same file may be found more than once
    for path, is_named in sorted(paths_of(words), key=lambda pair: (not pair[1], pair[0].is_symlink())):
        files.setdefault(os.path.realpath(path), (path, is_named))
    models = {}
    for file, (path, is_named) in files.items():
        root = next(elements_of(path), None)
        if is_named or root is None or root.tag != PART:
            models[file] = Model(path, needed_by(path))
    left_out = []
    users = {os.path.realpath(part): model.shown for model in models.values() for part in model.parts[1:]}
    for file, (path, is_named) in files.items():
        if file in users and not is_named:
            models.pop(file, None)
            left_out.append((in_one_line(path.as_posix()), f"included by {users[file]}"))
        elif file not in models:
            left_out.append((in_one_line(path.as_posix()), f"root element <{PART}>"))
    if not models:
        raise Refused(f"no MJCF or URDF file in {', '.join(map(in_one_line, words))}")
    return sorted(models.values(), key=lambda model: model.shown), sorted(left_out)


def paths_of(words: Iterable[str]) -> Iterator[tuple[Path, bool]]:
    """The files of paths, each with True if the path is that of the file, not of a folder or a pattern."""
    for word in words:
        path = Path(word)
        if word.startswith("@"):
            yield from paths_of(lines_of(word[1:]))
        elif os.path.isfile(path):
            yield path, True
        else:
            is_pattern = has_magic(word) and "\0" not in word and not os.path.isdir(word)
            matches = sorted(glob(word, recursive=True)) if is_pattern else [word] * os.path.isdir(word)
            if not matches:
                problem = "not a regular file" if os.path.exists(word) else "no such file"
                expected = "expected a file, a folder, a pattern or @LIST"
                raise Refused(f"{problem}: {in_one_line(word)}; {expected}")
            for match in map(Path, matches):
                files = files_in(match) if match.is_dir() else [match] * os.path.isfile(match)
                yield from ((file, False) for file in files)


def files_in(folder: Path) -> Iterator[Path]:
    """The .xml, .mjcf and .urdf files of a folder at any depth, without hidden files and folders."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            is_model = name.lower().endswith((".xml", ".mjcf", ".urdf")) and not name.startswith(".")
            if is_model and os.path.isfile(Path(place, name)):
                yield Path(place, name)


def lines_of(name: str) -> list[str]:
    """The paths in a list, one a line; empty lines and lines that begin with # or @ are ignored."""
    if is_pipe(Path(name)):
        raise Refused(f"the list {in_one_line(name)} is not a regular file")
    try:
        lines = Path(name).read_text(encoding="utf-8-sig", errors="surrogateescape").splitlines()
    except (OSError, ValueError) as error:
        raise Refused(f"cannot read the list {in_one_line(name)}: {error}") from None
    return [line.strip() for line in lines if line.strip() and line.lstrip()[0] not in "#@"]


def place_of_report(shown: str) -> str:
    """The folder of a model's report in that of the fleet; unique, and in that of no other model."""
    path = Path(readable(shown))
    parts = [part for part in path.parts if part not in (path.anchor, os.pardir)]
    if os.path.isabs(shown) or os.pardir in Path(shown).parts:
        # the shortened path may be that of another file
        parts[-1] += f"-{sha256(shown.encode()).hexdigest()[:8]}"
    return "/".join(["files", *parts])
