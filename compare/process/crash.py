"""What is said of an exception that nobody foresaw: one line, in an experiment's check or on the terminal."""

import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 300  # characters of a message


def described(error: BaseException, with_place: bool = True) -> str:
    """An exception in one line: "ValueError: message (compare/mass.py:12)"."""
    message = " ".join(str(error).split())
    message = message if len(message) <= LONGEST else message[: LONGEST - 3] + "..."
    where = place(error) if with_place else ""
    return type(error).__name__ + (f": {message}" if message else "") + (f" ({where})" if where else "")


def place(error: BaseException) -> str:
    """The last line of this project that an exception came through, "compare/mass.py:12"; "" if there is none."""
    if getattr(error, "place", ""):  # it comes from another process, which knew
        return error.place
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if any(path.is_relative_to(ROOT / name) for name in ("compare", "tmt")):
            return f"{path.relative_to(ROOT).as_posix()}:{frame.lineno}"
    return ""
