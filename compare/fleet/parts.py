"""What an MJCF file needs beside itself: what it includes, attaches and loads.

mju_getXMLDependencies of MuJoCo 4.0.0 looks for height fields and stripped paths where the compiler does not, so this looks in
every folder that the compiler may, and takes what is there.
"""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree import ElementTree

WITH_MODELS = ("include", "model")  # elements whose file is MJCF again
DIRECTORIES = ("assetdir", "meshdir", "texturedir")


def needed_by(path: Path) -> tuple[Path, ...]:
    """The files that an MJCF file needs, itself first; those that are not there, or not in XML that can be read, are left out."""
    found, read, files, stated = {os.path.abspath(path): path}, set(), [], {""}
    waiting = [path]
    places = [path.parent]  # of files: what is relative is so to one of them
    while waiting:  # all XML first: a folder that one part states is that of all
        file = waiting.pop()
        if (whole := os.path.realpath(file)) in read:  # a file that includes itself
            continue
        read.add(whole)
        for element in elements_of(file):
            stated |= {element.get(name) for name in DIRECTORIES if element.get(name)}
            names = [value for key, value in element.attrib.items() if key.startswith("file") and value]
            files += names
            for part in there(names, places, [""]) if element.tag in WITH_MODELS else ():
                found.setdefault(os.path.abspath(part), part)
                waiting.append(part)
                places += [part.parent] * (part.parent not in places)
    files += [os.path.basename(name.replace("\\", "/")) for name in files]  # strippath
    for part in there(dict.fromkeys(files), places, sorted(stated)):
        found.setdefault(os.path.abspath(part), part)
    return path, *sorted(part for part in found.values() if part is not path)


def there(names: Iterable[str], places: Iterable[Path], folders: Iterable[str]) -> Iterator[Path]:
    """The files of these names that are in folders of places."""
    tried = (place / folder / name for name in names for place in places for folder in folders)
    return (part for part in tried if is_a_file(part))


def elements_of(path: Path) -> Iterator[ElementTree.Element]:
    """The elements of a file, as far as it is XML."""
    try:
        for _, element in ElementTree.iterparse(path, events=("start",)):
            yield element
    except (ElementTree.ParseError, LookupError, OSError, ValueError):
        return


def is_a_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False
