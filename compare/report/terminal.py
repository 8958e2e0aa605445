"""The output of a run: lines on stdout, and on a terminal its progress on stderr."""

import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from textwrap import TextWrapper
from typing import IO, cast

from rich.console import Console
from rich.status import Status
from rich.text import Text

from ..core.words import in_one_line
from ..process import interrupt
from ..process.streams import Stream

WIDEST = 100  # columns of a line on a terminal, which may be wider
LONG = 5.0  # s, after which it is said for how long something has been going on


class Terminal:
    """Prints lines on stdout, and the progress on stderr if that is a terminal."""

    def __init__(self, is_silent: bool = False) -> None:
        self.out, self.err = Stream(None if is_silent else sys.stdout), Stream(sys.stderr)
        self.lines, self.screen = console(self.out), console(self.err)
        self.status: Status | None = None
        # what is before the text, the text, and since when: replaced at once, as another thread reads them
        self.shown: tuple[list[str], str, float] = [], "", time.monotonic()
        self.how_far: Callable[[], list[str]] = list  # before these, of a fleet; asked at every moment

    def say(self, text: str = "", style: str = "") -> None:
        """Print a line; on a narrower terminal without wide gaps if it fits then, else wrapped."""
        text, columns = in_one_line(text), min(self.out.columns() or 0, WIDEST)
        if columns and len(text) > columns:
            indent = " " * (len(text) - len(text.lstrip()))
            narrow = indent + re.sub(" {2,}", "  ", text.strip())
            wrapped = TextWrapper(max(columns, 20), break_long_words=False, break_on_hyphens=False)
            wrapped.subsequent_indent = f"{indent}  "
            text = narrow if len(narrow) <= columns else wrapped.fill(text)
        if self.status:
            self.status.stop()
        self.lines.print(Text(text, style=style), soft_wrap=True, highlight=False)
        if self.status:
            self.status.start()

    def say_lines(self, lines: Iterable[str], style: str = "") -> None:
        """Print lines, the first one in this style."""
        for line in lines:
            self.say(line, style)
            style = ""

    def show(self, text: str, before: Sequence[str] = ()) -> None:
        """Show the progress from now on. before: the number and the name of what is under way."""
        self.shown = list(before), text, time.monotonic()

    @contextmanager
    def progress(self, text: str) -> Iterator[None]:
        """Show the progress during this block, on a terminal that can overwrite a line."""
        self.show(text)
        if self.screen.is_terminal and not self.screen.is_dumb_terminal:
            spinner = "dots" if self.err.encoding.lower().startswith("utf") else "line"
            self.status = self.screen.status(self, spinner=spinner)
        try:
            with self.status or nullcontext():
                yield
        finally:
            self.status = None

    def line(self) -> str:
        """The progress, as far as there is room, no name twice; for how long, where it takes long."""
        self.screen.width = max(self.err.columns() or 80, 20)
        before, shown, since = self.shown
        parts, text = [*self.how_far(), *before], in_one_line(shown)
        for part in parts:
            text = text.removeprefix(f"{part}: ")
        name, seconds = interrupt.waited_for()
        if seconds > LONG:
            text = f"waiting for {name}"
        else:
            seconds = time.monotonic() - since
        for_long = f", {seconds:.0f} s" if seconds > LONG else ""
        room = self.screen.width - 6 - len(for_long)  # the spinner, and what a terminal shows of Ctrl-C
        line = ": ".join(filter(None, (", ".join(parts), text)))
        return (line if len(line) <= room else line[: room - 3] + "...") + for_long

    def __rich__(self) -> Text:
        return Text(self.line(), no_wrap=True)


def console(stream: Stream) -> Console:
    return Console(file=cast("IO[str]", stream), force_terminal=stream.isatty(), width=80, height=25)
