"""The options of a command as fields of a dataclass, and the types of their values."""

import argparse
import dataclasses
from collections.abc import Callable, Iterable
from contextlib import suppress
from difflib import get_close_matches
from functools import partial
from typing import Any, NamedTuple

ROBOT = " --mjcf robot.xml"  # of an example


def not_empty(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("the name is empty")
    return text


def number(noun: str, least: float, most: float, kind: type[int | float] = float) -> Callable[[str], float]:
    """A type of options: a number from `least` to `most`."""

    def in_range(text: str) -> float:
        with suppress(ValueError):
            if least <= kind(text) <= most:
                return kind(text)
        wrong = f"{text!r}: expected a number from {least:g} to {most:g} ({noun})"
        raise argparse.ArgumentTypeError(wrong)

    return in_range


seconds = partial(number, "time in s", 1e-6)  # to be called with the longest time
process_count = number("number of processes", 1, 1024, int)


def expected(word: str, known: Iterable[str], choices: str) -> str:
    """A hint for an unknown word: the nearest known word, or all choices."""
    near = get_close_matches(word.casefold(), list(known), 1)
    return f"did you mean {near[0]}?" if near else f"expected one of {choices}"


class Option(NamedTuple):
    """An option of the command line."""

    type: Callable[[str], Any] | None = not_empty  # None: it takes no value
    metavar: str | None = None
    default: Any = None
    text: str = ""  # the macro of its help; "": that of its name
    example: str = ""  # of its use, in the help of an experiment
    of_file: bool = False  # it asks about a robot's file, and not of one whose numbers are stated


def option(kind: Callable[[str], Any] | None = not_empty, metavar: str | None = None, **more: Any) -> Any:
    """A field of a dataclass of options. more: further fields of Option."""
    made = Option(kind, metavar, **more)
    default = made.default if kind else False
    return dataclasses.field(default=default, metadata={"option": made})


def options_in(kind: type) -> dict[str, Option]:
    """The options of a dataclass by their words: --control-period of control_period."""
    made = [field for field in dataclasses.fields(kind) if "option" in field.metadata]
    return {f"--{field.name.replace('_', '-')}": field.metadata["option"] for field in made}


def name_of(word: str) -> str:
    """Of --control-period: control_period."""
    return word.strip("-").replace("-", "_")
