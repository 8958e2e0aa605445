"""A user's equations from a Python file or a module: FILE.py:OBJECT or MODULE:OBJECT.

The last colon separates them, so that FILE may start with a Windows drive. OBJECT may be dotted; without it the object is the
module itself. While it is imported, print writes to stderr, and no compiled files are written.
"""

import difflib
import importlib
import importlib.machinery
import importlib.util
import inspect
import os
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from types import ModuleType

from ...judge.words import listed
from ...process.crash import described

FORMS_OF_REFERENCE = "FILE.py:OBJECT or MODULE:OBJECT"
SHOWN_NAMES = 6  # names in a message where none is close
SHOWN_LINE = 60  # characters of a line with a syntax error


class OwnFileError(ValueError):
    """Equations that cannot be loaded; the message is one line."""


def own_object(stated: str) -> object:
    """The object that FILE.py:OBJECT or MODULE:OBJECT names; a class is instantiated. OwnFileError, in one line."""
    place, _, name = stated.rpartition(":")
    if not place:
        raise OwnFileError(f"{stated!r} names neither a file nor a module; expected {FORMS_OF_REFERENCE}")
    with aside():
        module, folder = module_of(place, stated)
        with on_path(folder):
            return instance(part_of(module, place, name), stated, file_of(module, place))


def is_file(place: str) -> bool:
    """Whether a file is named, not a module."""
    return place.endswith(".py") or any(sign in place for sign in {os.sep, "/"}) or Path(place).is_file()


def module_of(place: str, stated: str) -> tuple[ModuleType, str]:
    """The module of a file or of that name, and the folder in which it finds others."""
    if not is_file(place):
        with on_path(os.getcwd()):
            return module_named(place), os.getcwd()
    path = Path(place)
    if path.is_dir():
        raise OwnFileError(f"{place} is a folder; expected a Python file")
    if not path.is_file():
        neighbours = path.parent.glob("*.py") if path.parent.is_dir() else ()
        raise OwnFileError(f"{place}: no such file{close_names(path.name, [other.name for other in neighbours])}")
    path = path.resolve()
    # a name that nothing else has: a file numpy.py shadows no package
    name = f"compare_own_{path.stem}"
    loader = importlib.machinery.SourceFileLoader(name, str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_file_location(name, path, loader=loader))
    sys.modules[name] = module  # dataclasses look for it there
    with on_path(str(path.parent)), raised_in(str(path), place):
        loader.exec_module(module)
    return module, str(path.parent)


def module_named(name: str) -> ModuleType:
    if not all(part.isidentifier() for part in name.split(".")):
        raise OwnFileError(f"{name!r} is not the name of a module; expected {FORMS_OF_REFERENCE}")
    try:
        spec = importlib.util.find_spec(name)
    except ModuleNotFoundError:
        spec = None
    except Exception as error:  # of a package that it is in
        raise OwnFileError(f"{name}: {described(error, with_place=False)}") from None
    if spec is None:
        names = [path.stem for path in Path().glob("*.py")]
        raise OwnFileError(f"{name}: no such module{close_names(name, names)}")
    with raised_in(spec.origin or name, name):
        return importlib.import_module(name)


def part_of(module: ModuleType, place: str, name: str) -> object:
    """The object of a dotted name in a module; without a name the module itself."""
    value, path = module, ""
    for part in filter(None, name.split(".")) if name else ():
        try:
            value = getattr(value, part)
        except AttributeError:
            names = [other for other in dir(value) if not other.startswith("_")]
            names = [other for other in names if not inspect.ismodule(getattr(value, other, None))]
            inside = f" in {path}" if path else ""
            raise OwnFileError(f"{place} has no {part!r}{inside}{close_names(part, names)}") from None
        path = f"{path}.{part}" if path else part
    return value


def instance(value: object, stated: str, file: str) -> object:
    """An object as it is, a class without arguments instantiated."""
    if not inspect.isclass(value):
        return value
    try:
        needed = [
            name
            for name, parameter in inspect.signature(value).parameters.items()
            if parameter.default is parameter.empty
            and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        ]
    except (TypeError, ValueError):  # a class without a signature
        needed = []
    if needed:
        raise OwnFileError(
            f"{stated}: the class {value.__name__} takes {', '.join(needed)}; expected an object, or a class without arguments"
        )
    with raised_in(file, stated):
        return value()


def file_of(module: ModuleType, place: str) -> str:
    return getattr(module, "__file__", None) or place


def close_names(name: str, known: Sequence[str]) -> str:
    """The names that are close to one, else all if they are few, for a message."""
    close = difflib.get_close_matches(name, known, 3, 0.6)
    if not close and len(known) <= SHOWN_NAMES:
        close = list(known)
    return f"; known: {listed(close)}" if close else ""


@contextmanager
def raised_in(file: str, place: str) -> Iterator[None]:
    """An error in this block becomes an OwnFileError of one line, with the line of the file."""
    try:
        yield
    except SyntaxError as error:
        where = place if error.filename == file else error.filename or place
        text = " ".join((error.text or "").split())[:SHOWN_LINE]
        line, text = f", line {error.lineno}" if error.lineno else "", f": {text}" if text else ""
        raise OwnFileError(f"{where}{line}: {type(error).__name__}, {error.msg}{text}") from None
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # also SystemExit: the file may be a script
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
        at = f", line {lines[-1]}" if lines else ""
        raise OwnFileError(f"{place}{at}: {described(error, with_place=False)}") from None


@contextmanager
def on_path(folder: str) -> Iterator[None]:
    """Imports look into a folder last, so that no file in it shadows a package."""
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.reverse()
        sys.path.remove(folder)
        sys.path.reverse()


@contextmanager
def aside() -> Iterator[None]:
    """A user's code in this block writes no compiled files, and prints to stderr."""
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        sys.dont_write_bytecode = before
