"""What an MJCF file needs beside itself: what it includes, attaches and loads.

mju_getXMLDependencies of MuJoCo 4.0.0 looks for height fields and stripped paths where the compiler does not, so this looks in
every folder that the compiler may, and takes what is there.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

MODELS = ("include", "model")  # elements whose file is MJCF again
DIRECTORIES = ("assetdir", "meshdir", "texturedir")


def parts_of(path: Path) -> tuple[Path, ...]:
    """The files that an MJCF file needs, itself first; those that are not there, or not in XML that can be read, are left out."""
    found, read, folders = {path.resolve(): path}, {}, {path.parent}
    waiting = [path]
    while waiting:  # all XML first: a folder that one part states is that of all
        file = waiting.pop()
        read[file.resolve()] = elements = list(elements_of(file))
        folders.add(file.parent)
        for element in elements:
            folders |= {base / element.get(name) for base in set(folders) for name in DIRECTORIES if element.get(name)}
            for part in files_of(element, folders) if element.tag in MODELS else ():
                if part.resolve() not in found:
                    found[part.resolve()] = part
                    waiting.append(part)
    for element in (element for elements in read.values() for element in elements):
        for part in files_of(element, folders):
            found.setdefault(part.resolve(), part)
    return path, *sorted(part for whole, part in found.items() if whole != path.resolve())


def elements_of(path: Path) -> Iterator[ElementTree.Element]:
    """The elements of a file, as far as it is XML."""
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            yield element
    except (ElementTree.ParseError, OSError, ValueError):
        return


def files_of(element: ElementTree.Element, folders: set[Path]) -> list[Path]:
    """The files that an element names, in each folder in which they are."""
    names = [value for key, value in element.attrib.items() if key.startswith("file") and value]
    names += [os.path.basename(name.replace("\\", "/")) for name in names]  # strippath
    tried = (folder / name for name in dict.fromkeys(names) for folder in sorted(folders))
    return [part for part in tried if is_file(part)]


def is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False
