"""An unexpected exception in one line, for a check or the terminal."""

import signal
import textwrap
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class Refused(ValueError):
    """A request that cannot be carried out; the message is one line."""


def described(error: BaseException, with_place: bool = True) -> str:
    """An exception in one line: "ValueError: message (compare/mass.py:12)"."""
    message = textwrap.shorten(str(error), 300, placeholder=" ...")
    where = place(error) if with_place else ""
    return type(error).__name__ + (f": {message}" if message else "") + (f" ({where})" if where else "")


def how_ended(code: int) -> str:
    """How a process ended, by its exit code: "exit status 1", "killed by SIGKILL"."""
    return f"exit status {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"


def place(error: BaseException) -> str:
    """The last line of this project in the traceback, "compare/mass.py:12"; "" if there is none."""
    place_elsewhere: str = getattr(error, "place", "")  # set by the process that raised it
    if place_elsewhere:
        return place_elsewhere
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if any(path.is_relative_to(ROOT / name) for name in ("compare", "tmt")):
            return f"{path.relative_to(ROOT).as_posix()}:{frame.lineno}"
    return ""
