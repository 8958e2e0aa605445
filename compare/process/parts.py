"""The files that a model consists of, and whether they can be read.

mju_getXMLDependencies of MuJoCo 4.0.0 looks for height fields and stripped paths where the compiler does not.
`needed_by` searches every folder that the compiler may use, and takes what exists.
"""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path, PureWindowsPath
from xml.etree import ElementTree

DIRECTORIES = ("assetdir", "meshdir", "texturedir")


def is_pipe(path: Path) -> bool:
    """Whether a path is a pipe, a device or a socket, which may be waited for without end."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def elements_of(path: Path) -> Iterator[ElementTree.Element]:
    """The elements of a file, up to the first error."""
    if is_pipe(path):
        return
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            yield element
    except (ElementTree.ParseError, LookupError, OSError, ValueError):
        return


def needed_by(path: Path) -> tuple[Path, ...]:
    """An MJCF file and the existing files that it includes, attaches and loads; itself first."""
    return path, *filter(os.path.isfile, named_by(path)[1:])


def named_by(path: Path) -> tuple[Path, ...]:
    """As needed_by, with pipes and devices."""
    waiting, parts, folders = [path], {os.path.abspath(path): path}, {path.parent}
    names: set[str] = set()
    directories = {""}  # one that a file states applies to all files
    while waiting:
        for element in elements_of(waiting.pop()):
            stated = {value for key, value in element.attrib.items() if key.startswith("file") and value}
            names |= stated | {PureWindowsPath(name).name for name in stated}  # the last part: strippath
            directories |= {element.get(name, "") for name in DIRECTORIES}
            models = existing(stated, folders, {""}) if element.tag in ("include", "model") else ()
            for part in models:
                place = os.path.abspath(part)
                waiting += [] if place in parts else [part]
                parts.setdefault(place, part)
        folders |= {part.parent for part in waiting}
    for part in existing(names, folders, directories):
        parts.setdefault(os.path.abspath(part), part)
    return path, *sorted(part for part in parts.values() if part is not path)


def existing(names: Iterable[str], folders: Iterable[Path], directories: Iterable[str]) -> Iterator[Path]:
    paths = (folder / directory / name for name in names for folder in folders for directory in directories)
    return (path for path in paths if os.path.exists(path) and not os.path.isdir(path))
