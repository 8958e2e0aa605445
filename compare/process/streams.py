"""stdin, stdout and stderr, whatever they are: closed, a full disk, a reader who has gone, an encoding without umlauts."""

import os
import sys


class Stream:
    """A text stream that swallows what cannot be written."""

    silent = False  # all of them: the process is about to end

    def __init__(self, stream):
        self.stream = stream

    def write(self, text):
        if not Stream.silent:
            self.act("write", text)

    def flush(self):
        self.act("flush")

    def act(self, name, *arguments):
        try:
            getattr(self.stream, name)(*arguments)
        except (OSError, ValueError, AttributeError):  # full, gone, closed, or there was none
            self.stream = None

    def isatty(self) -> bool:
        return self.columns() is not None

    def columns(self) -> int | None:
        """The terminal's width; None if it is no terminal."""
        try:
            return os.get_terminal_size(self.stream.fileno()).columns or 80
        except (OSError, ValueError, AttributeError):
            return None

    @property
    def encoding(self):
        return getattr(self.stream, "encoding", None) or "utf-8"


def readable(text: str) -> str:
    """Text that can be written anywhere: what the locale could not read of a file's name is UTF-8, or is shown as numbers."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def in_one_line(text: str) -> str:
    """Readable text without line ends and other signs that a terminal would obey: these are shown as numbers."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in readable(text))


def prepare() -> None:
    """Make stdin, stdout and stderr such that they can be used: one that is closed leads nowhere, none refuses a letter."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # else the next file that is opened gets this number, and is written to
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        getattr(sys, name).reconfigure(errors="backslashreplace")
