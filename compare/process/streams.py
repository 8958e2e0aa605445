"""stdin, stdout and stderr that never fail: closed, full disk, closed pipe, limited encoding."""

import os
import sys
from io import TextIOBase
from typing import TextIO

from ..core.words import in_one_line

PROGRAM = "python -m compare"
MOST_PRINTED = 20_000  # characters of a user's own code


class Stream:
    """A text stream that ignores errors of writing."""

    def __init__(self, stream: TextIO | None):
        self.stream = stream

    def write(self, text: str) -> None:
        self.act("write", text)

    def flush(self) -> None:
        self.act("flush")

    def act(self, name: str, *arguments: str) -> None:
        try:
            getattr(self.stream, name)(*arguments)
        except (OSError, ValueError, AttributeError):  # full, closed or missing
            self.stream = None

    def isatty(self) -> bool:
        return self.columns() is not None

    def columns(self) -> int | None:
        """The width of the terminal; None if the stream is not a terminal."""
        try:
            return os.get_terminal_size(self.stream.fileno()).columns or 80 if self.stream else None
        except (OSError, ValueError, AttributeError):
            return None

    @property
    def encoding(self) -> str:
        return getattr(self.stream, "encoding", None) or "utf-8"


class Capped(TextIOBase):
    """stderr for what a user's own code prints: so much, and then a line that says so."""

    printed = 0  # characters, of all code together

    def __init__(self) -> None:
        self.stream: TextIO = getattr(sys.stderr, "stream", sys.stderr)

    def write(self, text: str) -> int:
        room = MOST_PRINTED - Capped.printed
        Capped.printed += len(text)
        if room > 0:
            self.stream.write(text[:room])
            if len(text) > room:
                self.stream.write(
                    f"\n{PROGRAM}: your code has printed {MOST_PRINTED} characters; no more is shown\n"
                )
        return len(text)

    def flush(self) -> None:
        self.stream.flush()


def say_error(line: str) -> None:
    """One line on stderr, if it can be written."""
    stream = getattr(sys.stderr, "stream", sys.stderr)  # also while a user's own code prints
    print(in_one_line(" ".join(f"{PROGRAM}: {line}".split())), file=Stream(stream), flush=True)


def prepare() -> None:
    """Open closed standard streams on os.devnull, and let them accept every character."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # otherwise the next opened file gets this number
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        getattr(sys, name).reconfigure(errors="backslashreplace")
