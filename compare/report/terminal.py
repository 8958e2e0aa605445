"""What a run says while it lasts: lines on stdout, and on a terminal what is under way."""

import os
import re
import sys
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager, suppress
from textwrap import fill

from rich.console import Console
from rich.text import Text

from ..process import interrupt
from ..process.streams import Stream, readable

EMPTY_LINE, SHOW_CURSOR = "\r\x1b[2K", "\x1b[?25h"  # empty the line, show the cursor that was hidden


SILENT_FOR = 25.0  # s, at most, of a run whose progress cannot be shown


class Terminal:
    """Says lines on stdout; where stderr is a terminal, shows there what is under way, else a line of it now and then."""

    def __init__(self):
        self.out, self.err = Stream(sys.stdout), Stream(sys.stderr)
        self.lines, self.beside = (
            Console(file=stream, force_terminal=stream.isatty(), width=80, height=25) for stream in (self.out, self.err)
        )
        self.status, self.text, self.how_far, self.spoke = None, "", list, time.monotonic()

    def say(self, text="", style="") -> None:
        """A line; on a terminal that is narrower: its columns closed up, and broken between words."""
        text, columns = readable(text), self.out.columns()
        if columns and len(text) > columns:
            indent = " " * (len(text) - len(text.lstrip()))
            text = indent + re.sub(" {2,}", "  ", text.strip())
            text = fill(
                text, max(columns, 20), subsequent_indent=indent + "  ", break_long_words=False, break_on_hyphens=False
            )
        self.spoke = time.monotonic()
        with self.paused():
            self.lines.print(Text(text, style=style), soft_wrap=True, highlight=False)

    def show(self, text: str) -> None:
        """What is under way, in one line behind how far the run is."""
        self.text = text

    def tell(self, how_far: Callable[[], list[str]]) -> None:
        """From now on, how far the run is (how many, which, how long still) stands before what is under way.

        It is asked anew at every moment."""
        self.how_far = how_far

    @contextmanager
    def progress(self, text: str):
        """The block's progress is shown, if that is possible; else a line says it after each 25 s without another."""
        self.show(text)
        if not self.beside.is_terminal or self.beside.is_dumb_terminal:
            ended = threading.Event()
            threading.Thread(target=self.speak_until, args=(ended,), daemon=True).start()
            try:
                yield
            finally:
                ended.set()
            return
        spinner = "dots" if self.err.encoding.lower().startswith("utf") else "line"
        interrupt.undo.append(wipe)
        self.status = self.beside.status(Moving(self), spinner=spinner)
        try:
            with self.status:
                yield
        finally:
            self.status = None
            interrupt.undo.remove(wipe)

    def speak_until(self, ended: threading.Event) -> None:
        """Say how far the run is and what is under way whenever no line was said for long."""
        while not ended.wait(min(1.0, SILENT_FOR)):
            if time.monotonic() - self.spoke >= SILENT_FOR:
                self.say("  " + ": ".join(filter(None, (", ".join(self.how_far()), self.text))))

    def line(self) -> str:
        """How far the run is and what is under way, as far as there is room; a name that would stand there twice is said once."""
        self.beside.width = max(self.err.columns() or 80, 20)
        space = self.beside.width - 6  # the spinner, and what a terminal shows of Ctrl-C
        parts, text = self.how_far(), self.text
        if len(parts) > 2 and len(", ".join(parts)) > space:
            parts = [parts[0], *parts[2:]]
        for part in parts:
            text = text.removeprefix(f"{part}: ")
        whole = ": ".join(filter(None, (", ".join(parts), text)))
        return whole if len(whole) <= space else whole[: space - 3] + "..."

    @contextmanager
    def paused(self):
        """In this block nothing moves on the terminal."""
        if self.status:
            self.status.stop()
        try:
            yield
        finally:
            if self.status:
                self.status.start()


class Moving:
    """A line that is made anew whenever it is drawn."""

    def __init__(self, terminal: Terminal):
        self.terminal = terminal

    def __rich__(self) -> Text:
        return Text(self.terminal.line(), no_wrap=True)


def wipe() -> None:
    """Take what is in progress from the terminal, at an early end."""
    Stream.silent = True
    with suppress(OSError):
        os.write(2, (EMPTY_LINE + SHOW_CURSOR).encode())
