"""The result of a diagnosis, and causes of it that are put together. Their text is in causes.md.jinja."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import say

TEMPLATE = "causes"
LEAST_STATES = 4  # different positions: with fewer, wrong numbers explain by luck


class Detail(NamedTuple):
    """A coefficient that differs, with both numbers where they are furthest apart."""

    name: str
    yours: float
    right: float
    at: tuple[str, ...]  # "knee = 0.3"


class Diagnosis(NamedTuple):
    """What explains a difference."""

    differs: bool
    causes: tuple[Cause, ...] = ()  # of one rank, each explains everything; (): nothing does
    closest: Cause | None = None  # where nothing explains everything: the single change that leaves least
    details: tuple[Detail, ...] = ()  # coefficients that differ, with both numbers
    entries: tuple[str, ...] = ()  # of Mbar and h that differ, "M[hip][knee]"
    compared: int = 0  # entries in all
    parts: tuple[str, ...] = ()  # that differ: "M", "h", or its "velocity terms" and "gravity"
    known: tuple[str, ...] = ()  # parts that are compared
    is_symmetric: bool = True  # the given M
    is_large: bool = True  # beyond what rounded constants change
    is_of_forces: bool = False  # of accelerations, of which the forces are given
    too_few: int = 0  # states, if they are too few for a search
    seconds: float | None = None  # of a search that was not finished

    def sentence(self) -> str:
        """The result in words."""
        return say(Finding(TEMPLATE, "diagnosis", {"diagnosis": self, "least_states": LEAST_STATES}))


def together(causes: Sequence[Cause], left_over: float) -> Cause:
    """One cause alone, or several as one of rank 3, of which each field has all."""
    if len(causes) == 1:
        return replace(causes[0], left_over=left_over)

    def both(field: str) -> str:
        values = [getattr(cause, field) for cause in causes]
        return " and ".join(f"{x:.12g}" if isinstance(x, float) else x for x in values if x != "")

    return Cause(
        rank=3, kind=both("kind"), place=both("place"), stated=both("stated"), explains=both("explains"),
        unit=both("unit"), left_over=left_over, parts=tuple(causes),
    )  # fmt: skip


def ranked(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """The causes of one rank in words, each with the number of the others."""
    tied = [replace(cause, tied=len(causes) - 1) for cause in causes]
    return tuple(replace(cause, text=say(Finding(TEMPLATE, "cause", {"cause": cause}))) for cause in tied)


def distinct(causes: Iterable[Cause]) -> list[Cause]:
    """Each cause once; none of every body or joint where one of them suffices, no part of a term where a number does."""
    once: dict[frozenset[tuple[str, str]], Cause] = {}
    for cause in causes:
        parts = cause.parts if len(cause.parts) > 1 else (cause,)
        once.setdefault(frozenset((part.place, str(part.explains)) for part in parts), cause)
    kinds, fewest = {cause.kind for cause in once.values()}, dict[tuple[str, str], int]()
    for cause in once.values():
        key = cause.form, str(cause.explains)
        fewest[key] = min(cause.owners, fewest.get(key, cause.owners))
    return [
        cause for cause in once.values()
        if not (cause.form and cause.owners > fewest[cause.form, str(cause.explains)])
        and not (cause.kind == "part" and kinds & {"number", "body"})
    ]  # fmt: skip
