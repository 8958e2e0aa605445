"""What can happen to a piece, and what is to become of it: for test_pool.py and test_cluster.py alike."""

import signal
import sys
from types import ModuleType
from typing import NamedTuple

import toy_pieces as toy

from compare.fleet.piece import Piece, outcomes

LIMIT = 3.0  # s that a piece may take here
MEMORY = 10**9  # bytes that it may have
LARGE = b"x" * 3 * 10**7
GONE = ModuleType("gone")  # a module that no other process has
exec("def nowhere():\n    return 0\n", GONE.__dict__)


class Fault(NamedTuple):
    """A piece, and what becomes of it."""

    function: object
    arguments: tuple = ()
    value: object = None  # what it returns; None: it breaks
    words: tuple = ()  # of the reason why it breaks
    tries: int = 0  # how many times it begins, where it takes notes of that: its last argument is a folder
    more: dict = {}  # noqa: RUF012


FAULTS = {
    "for ever": Fault(toy.for_ever, words=("3 s",), tries=1),
    "returns": Fault(toy.twice, (21,), 42),
    "raises": Fault(toy.raises, ("it\nbroke",), words=("RuntimeError: it broke",)),
    "SIGKILL": Fault(toy.killed, (signal.SIGKILL, 9), words=("SIGKILL", "4 times"), tries=4),
    "SIGSEGV": Fault(toy.killed, (signal.SIGSEGV, 9), words=("SIGSEGV", "4 times"), tries=4),
    "SIGKILL once": Fault(toy.killed, (signal.SIGKILL, 1), "at last", tries=2),
    "exits": Fault(toy.exits, (3,), words=("status 3", "no hope", "4 times")),
    "leaves": Fault(toy.leaves, words=("SystemExit: 3",)),
    "eats": Fault(toy.eats, (4 * MEMORY,), words=("memory", "1 GB")),
    "prints": Fault(toy.prints, value=""),
    "unsendable": Fault(toy.unsendable, words=("TypeError", "lock")),
    "asked with a lock": Fault(toy.twice, (toy.unsendable(),), words=("TypeError", "lock")),
    "asked of nobody": Fault(GONE.nowhere, words=("ModuleNotFoundError", "gone")),
    "shares": Fault(toy.length, value=len(LARGE), more={"group": "big", "shared": LARGE}),
    "shares too": Fault(toy.length, ("first",), len(LARGE), more={"group": "big", "shared": LARGE}),
    "last": Fault(toy.twice, (4,), 8),
}


def check_all(door, folder, names=tuple(FAULTS)):
    """Whether through a door what is to become of each piece does. folder: where they take notes of when they begin."""
    sys.modules["gone"] = GONE
    asked = []
    for name in names:
        fault, place = FAULTS[name], folder / name
        place.mkdir()
        arguments = (*fault.arguments, str(place)) if fault.tries else fault.arguments
        asked.append(Piece(name, fault.function, arguments, **fault.more))
    for name, found in zip(names, outcomes(door, asked), strict=True):
        fault = FAULTS[name]
        if fault.value is None:
            assert all(word in found.broke for word in fault.words), f"{name}: {found.broke}"
        else:
            assert (found.broke, found.returned) == ("", fault.value), name
        assert len(list((folder / name).iterdir())) == fault.tries, name
        assert found.is_late == (name == "for ever")
