"""The parts of a report: one that raises is left out and named, and the others stay."""

from collections.abc import Callable
from typing import TypeVar

from ..judge.check import About, Check
from ..judge.finding import Finding
from ..process.crash import described
from .text import say

Value = TypeVar("Value")


class Parts:
    """The parts of a report that raised, by name, each with its error in one line."""

    def __init__(self) -> None:
        self.broken: dict[str, str] = {}

    def attempt(self, name: str, otherwise: Value, make: Callable[..., Value], *arguments: object) -> Value:
        """make(*arguments); if it raises, `otherwise`, and the part is listed as broken."""
        try:
            return make(*arguments)
        except Exception as error:
            self.broken.setdefault(name, described(error))
            return otherwise

    @property
    def lines(self) -> list[str]:
        return [say(Finding("verdict", "incomplete", {"name": name, "why": why})) for name, why in self.broken.items()]

    @property
    def checks(self) -> list[Check]:
        return [
            Check("report", "", f"{name} is complete", None, 0.0, "", why, rule="equal", about=About.PROGRAM)
            for name, why in self.broken.items()
        ]
