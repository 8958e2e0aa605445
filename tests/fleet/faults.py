"""What can happen to a piece, and what is to become of it: the same for the pool and for a cluster."""

import re
import signal
import sys
from types import ModuleType

import toy_pieces as toy

from compare.fleet.piece import Piece, outcomes

LIMIT = 5.0  # s that a piece may take here
MEMORY = 10**9  # bytes that it may have
TIMES = {"SIGKILL": 4, "SIGSEGV": 4, "SIGKILL once": 2, "exits": 4, "for ever": 1}  # how many times each begins


def pieces(folder):
    """Pieces by name; each has a folder in which it notes that it began."""

    def made(name, function, *arguments, **more):
        return name, Piece(name, function, arguments, **more)

    def place(name):
        path = folder / name.replace(" ", "_")
        path.mkdir(exist_ok=True)
        return str(path)

    gone = ModuleType("gone")  # a module that no other process has
    exec("def nowhere():\n    return 0\n", gone.__dict__)
    sys.modules["gone"] = gone
    return dict(
        [
            made("for ever", toy.for_ever, place("for ever")),
            made("returns", toy.twice, 21),
            made("raises", toy.raises, "it\nbroke"),
            made("SIGKILL", toy.killed, signal.SIGKILL, place("SIGKILL")),
            made("SIGSEGV", toy.killed, signal.SIGSEGV, place("SIGSEGV")),
            made("SIGKILL once", toy.killed, signal.SIGKILL, place("SIGKILL once"), 1),
            made("exits", toy.exits, 3),
            made("leaves", toy.leaves),
            made("eats", toy.eats, 4 * MEMORY),
            made("eats little", toy.eats, 10**7),
            made("prints", toy.prints),
            made("unsendable", toy.unsendable),
            made("asked with a lock", toy.twice, toy.unsendable()),
            made("asked of nobody", gone.nowhere),
            made("shares", toy.length, group="big", shared=b"x" * 3 * 10**7),
            made("shares too", toy.length, "first", group="big", shared=b"x" * 3 * 10**7),
            made("last", toy.twice, 4),
        ]
    )


def tried(door, folder):
    """What becomes of all of them, by name."""
    asked = pieces(folder)
    return dict(zip(asked, outcomes(door, list(asked.values()))))


PLACE = r"\(compare/fleet/(piece|child)\.py:\d+\)"
VALUES = {
    "returns": 42,
    "SIGKILL once": "at last",
    "eats little": 10**7,
    "prints": "",
    "shares": 3 * 10**7,
    "shares too": 3 * 10**7,
    "last": 8,
}
ENDS = {
    "raises": rf"RuntimeError: it broke {PLACE}",
    "SIGKILL": "ended by SIGKILL, 4 times",
    "SIGSEGV": "ended by SIGSEGV, 4 times",
    "exits": "ended with status 3, no hope, 4 times",
    "leaves": rf"SystemExit: 3 {PLACE}",
    "for ever": "took longer than 5 s",
    "eats": "out of memory: more than the 1 GB that a piece may have",
    "unsendable": rf"TypeError: cannot pickle '_thread.lock' object {PLACE}",
    "asked with a lock": rf"TypeError: cannot pickle '_thread.lock' object {PLACE}",
    "asked of nobody": rf"ModuleNotFoundError: No module named 'gone' {PLACE}",
}


def check(outcome, name, folder):
    """Whether what has become of a piece is what is to become of it."""
    if name in VALUES:
        assert (outcome.broke, outcome.returned) == ("", VALUES[name])
    else:
        assert re.fullmatch(ENDS[name], outcome.broke), outcome.broke
    if name in TIMES and (folder / name.replace(" ", "_")).exists():
        assert len(list((folder / name.replace(" ", "_")).iterdir())) == TIMES[name]
    assert outcome.is_late == (name == "for ever")
