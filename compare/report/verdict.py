"""The outcome of a report: its sections, which checks fail, what explains that, and which parts could not be made."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

from ..core.check import ENDS, About, Check, Result
from ..core.errors import described
from ..core.finding import Finding
from ..core.rows import Row
from ..core.text import block, say
from ..core.words import capital

Value = TypeVar("Value")

SEEKS_CAUSES = "diagnosis"  # it compares nothing of its own: it says why others fail
STATES_CAUSES = "parameters", SEEKS_CAUSES  # experiments whose failing checks are the causes


@dataclass
class Section:
    name: str
    title: str
    claim: str
    tolerance: str
    result: Result
    figures: list = field(default_factory=list)  # (file name, caption)
    explained: list = field(default_factory=list)  # failing checks that are gone when the causes are mended

    @property
    def notes(self) -> list[str]:
        return [say(note) for note in self.result.notes]

    @property
    def tables(self) -> dict:
        """Its tables that have rows, by their names; its own first."""
        tables = {self.name: self.result.rows} | self.result.tables
        return {name: as_records(rows) for name, rows in tables.items() if rows}


def as_records(rows: list) -> list[dict]:
    is_typed = isinstance(rows, list) and rows and isinstance(rows[0], Row)
    return [row.record() for row in rows] if is_typed else rows


class Report(NamedTuple):
    sections: Sequence[Section]
    robot: object  # a robots.Robot
    origin: dict  # see provenance
    verdict: str  # in words, a sentence in each line
    causes: Sequence[dict] = ()  # of the failures, lowest rank first
    skipped: Sequence[tuple[str, str]] = ()  # experiments, and why
    reference: object | None = None  # a reference.Reference

    @property
    def top(self) -> list[str]:
        """What is said of the robot below the verdict, in sentences."""
        return [say(text) for section in self.sections for text in section.result.top]

    @property
    def answer(self) -> list[str]:
        """The last lines of a run of one experiment: what is said of the robot, else its number."""
        return self.top or [
            f"{capital(headline(section))}." for section in self.sections if section.result.checks
        ]


class Failures(NamedTuple):
    """The checks that fail, by what they are about; only the first say that the two models differ."""

    differing: list[Check]
    broke: list[Check]
    unstable: list[Check]
    unconfirmed: list[Check]
    of_engines: list[Check]
    not_judged: list[Check]


def failures(sections: Sequence[Section]) -> Failures:
    """The failed checks: of the models, of broken experiments, the step, predictions that no run confirms, other engines.

    And the checks that were not judged.
    """
    checks = [check for section in sections for check in section.result.checks]
    kinds = About.MODELS, About.PROGRAM, About.STEP, About.PREDICTION, About.ENGINE
    failed = ([check for check in checks if check.failed and check.about == kind] for kind in kinds)
    return Failures(*failed, [check for check in checks if not check.judged])


def passed(sections: Sequence[Section]) -> bool:
    """Whether something was compared, no check fails, and all were judged."""
    is_compared = any(check.judged for section in sections for check in section.result.checks)
    return is_compared and not any(failures(sections))


def worst(sections: Sequence[Section]) -> Check | None:
    """The check that uses most of a tolerance of rounding, or None."""
    checks = [
        check for section in sections for check in section.result.checks if check.over_tolerance is not None
    ]
    return max(checks, key=lambda check: check.over_tolerance, default=None)


def verdict(
    sections: Sequence[Section],
    experiments: int,
    causes: Sequence[dict] = (),
    compared: str = "The two models",
    robot: str = "the robot",
) -> str:
    """The outcome, a sentence in each line, with its cause or its largest share of a tolerance.

    experiments: how many there are in all; compared: what agrees or differs; robot: its name.
    """
    checked = [section for section in sections if section.result.checks]
    consequences = [check for section in sections for check in section.explained]
    also = failures(checked)
    checks = [check for section in checked for check in section.result.checks if check.judged]
    failed = sum(check.failed for check in checks)
    also = also._replace(unconfirmed=[check for check in also.unconfirmed if check not in consequences])
    top = worst(checked)
    named = {check.experiment for check in also.differing} - {SEEKS_CAUSES}
    names = [section.name for section in checked if not named or section.name in named]
    lines = block(
        "verdict",
        "verdict",
        compared=compared,
        robot=robot,
        ran={"names": names, "differ": bool(named), "checked": len(checked), "all": experiments},
        alone=len(sections) == 1,
        models=sum(check.about == About.MODELS for check in checks),
        engines=sum(check.about == About.ENGINE for check in checks),
        failed=failed,
        checks=len(checks),
        empty=[section.name for section in sections if not section.result.checks],
        also=also,
        top=top if top and top.value and not any(also) else None,
        causes=causes,
        consequences={
            "explained": len(consequences),
            "stating": sum(check.experiment in STATES_CAUSES for check in checks if check.failed),
            "first": next((check for check in checks if stands(check, consequences)), None),
        },
        first=also.differing[0] if also.differing else None,
    )
    return "\n".join(filter(None, map(str.strip, lines.split("\n"))))


def stands(check: Check, consequences: Sequence[Check]) -> bool:
    """Whether a check fails, states no cause, and no cause explains it."""
    return check.failed and check.experiment not in STATES_CAUSES and check not in consequences


def outcome(section: Section) -> str:
    """Whether a section passes, in a sentence."""
    checks = [check for check in section.result.checks if check.judged]
    numbers = {"checks": len(checks), "failed": sum(check.failed for check in checks)}
    numbers["explained"] = len(section.explained)
    return say(Finding("verdict", "outcome", {**numbers, "also": failures([section])}))


def standing(section: Section) -> tuple[bool | None, str]:
    """Whether a section passes, and that in two or three words; None where something was not judged."""
    checks = [check for check in section.result.checks if check.judged]
    differing, broke, unstable, unconfirmed, of_engines, not_judged = failures([section])
    if differing:
        return False, f"{sum(check.failed for check in checks)} of {len(checks)} fail"
    if broke:
        return False, "broke off" if any(check.quantity == ENDS for check in broke) else "incomplete"
    if of_engines:
        return False, f"{len(of_engines)} of {len(checks)} fail"
    if unconfirmed:
        return False, f"{len(unconfirmed)} not confirmed"
    if unstable:
        return False, "unstable step"
    if not_judged:
        return None, f"{len(not_judged)} not judged"
    return (True, "pass") if checks else (None, "nothing compared")


def headline(section: Section) -> str:
    """The number of a section for the first screen; how many checks pass where it has none."""
    if section.result.headline:
        return say(section.result.headline)
    checks = [check for check in section.result.checks if check.judged]
    shares = [check.over_tolerance for check in checks if check.over_tolerance is not None and check.passed]
    numbers = {"passed": sum(check.passed for check in checks), "checks": len(checks)}
    return (
        say(Finding("verdict", "checks_passed", {**numbers, "share": max(shares, default=None)}))
        if checks
        else ""
    )


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
        return [
            say(Finding("verdict", "incomplete", {"name": name, "why": why}))
            for name, why in self.broken.items()
        ]

    @property
    def checks(self) -> list[Check]:
        return [
            Check("report", "", f"{name} is complete", None, 0.0, "", why, rule="equal", about=About.PROGRAM)
            for name, why in self.broken.items()
        ]
