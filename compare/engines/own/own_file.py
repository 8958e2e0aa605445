"""A user's equations from a Python file or a module: FILE.py:OBJECT or MODULE:OBJECT.

The last colon separates them, so that FILE may start with a Windows drive. OBJECT is a plain name; without
it the object is the module itself. While it is imported, print writes to stderr, and no compiled files are
written.
"""

import difflib
import importlib
import importlib.util
import inspect
import os
import sys
import time
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from types import ModuleType

from ...core.errors import described
from ...core.words import listed
from ...process.interrupt import Now, is_interrupt
from ...process.streams import Capped
from .functions import MODULE, OwnError

FORMS_OF_REFERENCE = "FILE.py:OBJECT or MODULE:OBJECT"
SHOWN_NAMES = 6  # names in a message where none is close


def own_object(stated: str) -> object:
    """The object that FILE.py:OBJECT or MODULE:OBJECT names; a class is instantiated. OwnError."""
    place, _, name = stated.rpartition(":")
    if not place:
        raise OwnError(f"{stated!r} names neither a file nor a module; expected {FORMS_OF_REFERENCE}")
    is_file = place.endswith(".py") or any(sign in place for sign in {os.sep, "/"}) or Path(place).is_file()
    folder = os.path.dirname(os.path.realpath(place)) if is_file else os.getcwd()
    sys.path.append(folder)  # last: no file in it shadows a package
    try:
        with aside(place), raised_in(place):
            module = module_of_file(Path(place), place) if is_file else module_named(place)
            if name and not hasattr(module, name):
                public = [other for other in dir(module) if other[0] != "_"]
                names = [other for other in public if not inspect.ismodule(getattr(module, other, None))]
                raise OwnError(f"{place} has no {name!r}{close_names(name, names)}")
            value = getattr(module, name) if name else module
            return value() if inspect.isclass(value) else value
    finally:
        del sys.path[-1 - sys.path[::-1].index(folder)]  # the last of its name, added above


def module_of_file(path: Path, place: str) -> ModuleType:
    if path.is_dir():
        raise OwnError(f"{place} is a folder; expected a Python file")
    if not path.is_file():
        neighbours = [file.name for file in path.parent.glob("*.py")]
        raise OwnError(f"{place}: no such file{close_names(path.name, neighbours)}")
    name = f"{MODULE}{path.stem}"  # a name that nothing else has: a file numpy.py shadows no package
    loader = importlib.machinery.SourceFileLoader(name, str(path.resolve()))
    spec = importlib.util.spec_from_loader(name, loader)
    assert spec is not None  # since there is a loader
    sys.modules[name] = module = importlib.util.module_from_spec(spec)  # dataclasses look for it there
    loader.exec_module(module)
    return module


def module_named(name: str) -> ModuleType:
    if not all(part.isidentifier() for part in name.split(".")):
        raise OwnError(f"{name!r} is not the name of a module; expected {FORMS_OF_REFERENCE}")
    try:
        is_there = importlib.util.find_spec(name) is not None  # which imports a package that it is in
    except ModuleNotFoundError:
        is_there = False
    if not is_there:
        neighbours = [file.stem for file in Path().glob("*.py")]
        raise OwnError(f"{name}: no such module{close_names(name, neighbours)}")
    return importlib.import_module(name)


def close_names(name: str, known: Sequence[str]) -> str:
    """The names that are close to one, else all if they are few, for a message."""
    few = list(known) if len(known) <= SHOWN_NAMES else []
    close = difflib.get_close_matches(name, known, 3, 0.6) or few
    return f"; known: {listed(close)}" if close else ""


@contextmanager
def raised_in(place: str) -> Iterator[None]:
    """Make an error of a user's code an OwnError, with its line in the user's file."""
    try:
        yield
    except OwnError:
        raise
    except SyntaxError as error:
        text = f": {' '.join(error.text.split())[:60]}" if error.text else ""
        where = place if Path(error.filename or place).stem == Path(place).stem else error.filename
        what = f"{type(error).__name__}, {error.msg}{text}"
        at = f", line {error.lineno}" if error.lineno else ""  # None: the file is not text
        raise OwnError(f"{where}{at}: {what}") from None
    except BaseException as error:  # also SystemExit: the file may be a script
        if is_interrupt(error):
            raise
        every = traceback.extract_tb(error.__traceback__)
        frames = [frame for frame in every if Path(frame.filename).stem == Path(place).stem]
        at = f", line {frames[-1].lineno}" if frames else ""
        raise OwnError(f"{place}{at}: {described(error, with_place=False)}") from None


@contextmanager
def aside(name: str) -> Iterator[None]:
    """A user's code in this block writes no compiled files, and prints to stderr, not without end.

    name: what is waited for meanwhile.
    """
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    waited, Now.waits = Now.waits, (name, time.monotonic())
    try:
        with redirect_stdout(Capped()), redirect_stderr(Capped()):
            yield
    finally:
        sys.dont_write_bytecode, Now.waits = before, waited
