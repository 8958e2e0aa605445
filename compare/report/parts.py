"""The parts of a report, made one after the other: one that breaks is left out and named, and the others stay."""

from collections.abc import Callable
from typing import TypeVar

from ..judge.check import About, Check
from ..judge.finding import Finding
from ..process.crash import described
from .text import say

Made = TypeVar("Made")


class Parts:
    """What of a report could not be made: the parts by their names, each with why, in one line."""

    def __init__(self) -> None:
        self.broken: dict[str, str] = {}

    def made(self, name: str, otherwise: Made, make: Callable[..., Made], *arguments: object) -> Made:
        """What `make` returns of these arguments; if it raises, `otherwise`, and the part is named as broken."""
        try:
            return make(*arguments)
        except Exception as error:
            self.broken.setdefault(name, described(error))
            return otherwise

    @property
    def lines(self) -> list[str]:
        """A sentence for each broken part."""
        return [say(Finding("verdict", "incomplete", {"name": name, "why": why})) for name, why in self.broken.items()]

    @property
    def checks(self) -> list[Check]:
        """A failed check for each broken part."""
        return [
            Check("report", "", f"{name} can be made", None, 0.0, "", why, rule="equal", about=About.PROGRAM)
            for name, why in self.broken.items()
        ]
