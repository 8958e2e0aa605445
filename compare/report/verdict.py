"""The outcome of a report in words: its sections, and whether all checks pass."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ..judge.check import ENDS, About, Check, Result
from ..judge.words import capital, listed
from .text import say

SEEKS_CAUSES = "diagnosis"  # the experiment in which nothing can agree or not: it says why others fail


@dataclass
class Section:
    """One experiment in the report."""

    name: str
    title: str
    claim: str
    tolerance: str
    result: Result
    figures: list = field(default_factory=list)  # (file name, caption)

    @property
    def notes(self) -> list[str]:
        """What was found, in sentences."""
        return [say(note) for note in self.result.notes]

    @property
    def tables(self) -> dict:
        """Its tables that have rows, by their names; its own first."""
        tables = {self.name: self.result.rows} | self.result.tables
        return {name: rows for name, rows in tables.items() if rows}


class Report(NamedTuple):
    """What a report is made of."""

    sections: Sequence[Section]
    robot: object  # a robots.Robot
    origin: dict  # see provenance
    verdict: str  # in words
    causes: Sequence[dict] = ()  # of what fails, the gravest first
    skipped: Sequence[tuple[str, str]] = ()  # experiments, and why
    reference: object | None = None  # a reference.Reference

    @property
    def top(self) -> list[str]:
        """What is said of the robot below the verdict, in sentences."""
        return [say(text) for section in self.sections for text in section.result.top]


class Failures(NamedTuple):
    """The checks that fail, by what they are about; only the first say that the two models differ."""

    differing: list[Check]
    broke: list[Check]
    unstable: list[Check]
    unconfirmed: list[Check]


def failures(sections: Sequence[Section]) -> Failures:
    """The checks that fail: of the models, of what broke off, of the step, of predictions that no run confirms."""
    failed = [check for section in sections for check in section.result.checks if not check.passed]
    kinds = About.MODELS, About.PROGRAM, About.STEP, About.PREDICTION
    return Failures(*([check for check in failed if check.about == kind] for kind in kinds))


def unstable_in_words(unstable: Sequence[Check]) -> str:
    """What step is not stable, at which postures."""
    worst = min(unstable, key=lambda check: check.tolerance)
    more = (
        f" and {len(unstable) - 1} more postures"
        if len(unstable) > 2
        else " and one more posture" * (len(unstable) > 1)
    )
    step, limit = (f"{1e3 * number:.4g} ms" for number in (worst.value, worst.tolerance))
    times = worst.value / worst.tolerance
    far = f", {times:.2g} times beyond the limit of {limit}" if times >= 10.0 else f": the limit is {limit}"
    return f"not stable at its own step of {step} at {worst.scene}{more}{far} {worst.note}".rstrip()


def unconfirmed_in_words(unconfirmed: Sequence[Check]) -> str:
    """How many predictions no run confirms, and the first."""
    if len(unconfirmed) == 1:
        return f"one prediction is not confirmed by the runs: {unconfirmed[0]}"
    return f"{len(unconfirmed)} predictions are not confirmed by the runs, first {unconfirmed[0]}"


def passed(sections: Sequence[Section]) -> bool:
    """Whether something was compared, and no check fails."""
    return any(section.result.checks for section in sections) and not any(failures(sections))


def worst(sections: Sequence[Section]) -> Check | None:
    """The check that uses most of a tolerance of rounding, or None."""
    checks = [check for section in sections for check in section.result.checks if check.over_tolerance is not None]
    return max(checks, key=lambda check: check.over_tolerance, default=None)


def verdict(
    sections: Sequence[Section],
    experiments: int,
    causes: Sequence[dict] = (),
    compared: str = "The two models",
    robot: str = "the robot",
) -> str:
    """The outcome in words, with its cause or its worst figure.

    experiments: how many there are in all; compared: what agrees or does not; robot: what it is called, whose own step may be
    unstable: that is no disagreement.
    """
    checks = [check for section in sections for check in section.result.checks]
    empty = listed([section.name for section in sections if not section.result.checks])
    if not checks:
        return f"Nothing was compared in {empty}: the notes there say why."
    sections = [section for section in sections if section.result.checks]
    differing, broke, unstable, unconfirmed = failures(sections)
    failing = {check.experiment for check in differing} - {SEEKS_CAUSES}
    names = ", ".join(section.name for section in sections if not differing or section.name in failing)
    is_whole, some = len(sections) == experiments, f"{len(sections)} of {experiments} experiments"
    where = f" in {names}" if names else ""
    ran = "" if is_whole else f"{where} ({some}{' ran' if differing else ''})"
    also = [f"Broken off: {'; '.join(f'{check.experiment}, {check.note}' for check in broke)}."] * bool(broke)
    also += [f"{capital(unconfirmed_in_words(unconfirmed))}."] if unconfirmed else []
    also += [f"But {robot} is {unstable_in_words(unstable)}."] if unstable else []
    which = "checks that compare them" if broke or unstable or unconfirmed else "checks"
    comparing = [check for check in checks if check.about == About.MODELS]
    counted = comparing if " " in which else checks
    if differing:
        text = f"{compared} do not agree{ran}: {len(differing)} of {len(counted)} {which} fail. "
        if causes:
            more = f", and {len(causes) - 1} more" if len(causes) > 1 else ""
            others = sum(check.experiment not in ("parameters", "diagnosis") for check in differing)
            further = "further " if len(differing) > others else ""
            follow = f" {others} {further}checks fail as a consequence." if others else ""
            text += f"Cause: {causes[0]['text']}{more}.{follow}"
        else:
            text += f"First: {differing[0]}."
        return " ".join([text, *also])
    if not comparing:
        return " ".join(["Nothing was compared.", *also])
    if broke:
        left = "" if is_whole else f" ({some})"
        return " ".join([f"Not everything could be compared{left}; all {len(comparing)} {which} pass.", *also])
    text = f"{compared} agree{ran}: all {len(counted)} {which} pass."
    text += f" In {empty} nothing was compared." * bool(empty)
    if also:
        return " ".join([text, *also])
    top = worst(sections)
    if top is None or top.value == 0.0:
        return text
    where = f"{top.quantity}, {top.scene}" + (f", {top.note}" if top.note else "")
    return (
        f"{text} The difference that comes closest to its rounding tolerance is {top.value:.2g} {top.unit}".rstrip()
        + f", {100 * top.over_tolerance:.2g} % of it ({top.experiment}: {where})."
    )


def outcome(section: Section) -> str:
    """Whether a section's claim holds, in words."""
    checks = section.result.checks
    differing, broke, unstable, unconfirmed = failures([section])
    if differing:
        return f"It does not hold: {sum(not check.passed for check in checks)} of {len(checks)} checks fail."
    if broke:
        return f"It is not decided: {broke[0].quantity} does not hold ({broke[0].note})."
    if unstable or unconfirmed:
        but = [unconfirmed_in_words(unconfirmed)] if unconfirmed else []
        but += [f"the robot is {unstable_in_words(unstable)}"] if unstable else []
        return f"{sum(check.passed for check in checks)} checks pass; but {'; and '.join(but)}."
    return f"It holds: all {len(checks)} checks pass." if checks else "It is not decided: nothing was compared."


def standing(section: Section) -> tuple[bool | None, str]:
    """Whether a section passes, and that in two or three words; None where nothing was compared."""
    checks = section.result.checks
    differing, broke, unstable, unconfirmed = failures([section])
    if differing:
        return False, f"{sum(not check.passed for check in checks)} of {len(checks)} fail"
    if broke:
        return False, "broke off" if any(check.quantity == ENDS for check in broke) else "not whole"
    if unconfirmed:
        return False, f"{len(unconfirmed)} not confirmed"
    if unstable:
        return False, "its step is not stable"
    return (True, "pass") if checks else (None, "nothing compared")
