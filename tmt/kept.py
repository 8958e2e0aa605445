"""Traced text in the cache folder of cache.py: not every process traces the same model anew."""

import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from functools import lru_cache, wraps
from pathlib import Path

from tmt.cache import check_own, own_folder, write_aside
from tmt.methods import METHODS
from tmt.model.tree import Tree

OF_TMT = dict(METHODS)  # the methods that are tmt's own, whatever is added later
DIGEST = 64  # characters of a SHA-256, before a text


def kept(make: Callable) -> Callable:
    """A function that makes the source for a tree and more, which is traced but once: then its text lies in the cache folder.

    Of what is the user's own (a class of trees, a method, a function) it is traced in each process, as it may have changed.
    """

    @wraps(make)
    def made(tree, *more, **named):
        of_own = [which_of_own(value) for value in (*more, *named.values())]
        if type(tree) is not Tree or None in of_own:
            return make(tree, *more, **named)
        what = repr([make.__name__, [getattr(tree, field.name) for field in fields(Tree)], of_own, list(named)])
        return kept_text(what, lambda: make(tree, *more, **named))

    return made


def which_of_own(value) -> str | None:
    """A name for a method, a function or a word of tmt's own, None if it is not."""
    if isinstance(value, str):
        return repr(value)
    name = next((name for name, method in OF_TMT.items() if method is value), None)
    if name is None and getattr(value, "__module__", "").split(".")[0] == "tmt":
        name = getattr(value, "__qualname__", None)
        name = name and f"{value.__module__}.{name}"
    return name


def kept_text(what: str, make: Callable[[], str]) -> str:
    """The text that `make` gives, from the cache folder if it lies there: it must follow from `what` and from tmt's own files."""
    name = hashlib.sha256(f"{own_sources()}\n{what}".encode()).hexdigest()[:16]
    try:
        path = own_folder() / f"source_{name}.txt"
        if os.path.lexists(path):
            check_own(path)
            content = path.read_text(encoding="utf-8")
            digest, text = content[:DIGEST], content[DIGEST:]
            if digest == hashlib.sha256(text.encode()).hexdigest():  # all of it, as it was written
                return text
    except Exception:  # whatever is wrong with it: it is made anew, and `load` says what is wrong with the folder
        return make()
    text = make()
    with suppress(Exception):
        write_aside(path, hashlib.sha256(text.encode()).hexdigest().encode() + text.encode())
    return text


@lru_cache(maxsize=1)
def own_sources() -> str:
    """A name for the contents of tmt's own files."""
    found = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        found.update(path.read_bytes())
    return found.hexdigest()
