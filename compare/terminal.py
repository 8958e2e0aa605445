"""Printing on a terminal, in a pipe, and to a reader who has gone."""

import os
import sys

from rich.console import Console
from rich.markup import escape


class Terminal(Console):
    """Prints as rich does; if the reader has gone (| head -1) the work goes on in silence."""

    def on_broken_pipe(self):
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def line(self, text, style=""):
        self.print(escape(text), style=style, highlight=False, soft_wrap=True)
