"""The outcome of a report: its sections, which checks fail, what explains that, what could not be made."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..core.cause import Cause
from ..core.check import About, Check, Result
from ..core.finding import Finding
from ..core.records import Experiment
from ..core.rows import Row
from ..core.text import block, parts, say, screen
from ..core.words import capital
from ..robots import Robot

UNKNOWN = Experiment()
MOST_FIGURES, FIRST_FIGURES = 4, 2  # of a section that are not folded; the first, where there are more
# kinds of checks that fail, by what they are about; only the first say that the two models differ
KINDS = {"differing": About.MODELS, "broke": About.PROGRAM, "unstable": About.STEP}
KINDS |= {"unconfirmed": About.PREDICTION, "of_engines": About.ENGINE}
OVERVIEW = "overview_"  # how the files of the pictures of the first screen begin


class Figure(NamedTuple):
    file: str  # its name, without .png; of an animation with .gif
    caption: str

    @property
    def moves(self) -> bool:
        return self.file.endswith(".gif")

    @property
    def path(self) -> str:
        return self.file if self.moves else f"{self.file}.png"

    @property
    def is_overview(self) -> bool:
        """Whether it is a picture of the first screen."""
        return self.file.startswith(OVERVIEW)


@dataclass
class Section:
    """An experiment in a report, with what the report has to know of it.

    tolerance: in words, and after an empty line its formulas.
    """

    name: str
    title: str
    claim: str
    tolerance: str
    result: Result
    figures: list[Figure] = field(default_factory=list)
    record: Experiment = UNKNOWN  # what the program knows of it

    @property
    def tables(self) -> dict[str, list[Row]]:
        """Its tables that have rows, by their names; its own first."""
        tables = {self.name: self.result.rows} | self.result.tables
        return {name: rows for name, rows in tables.items() if rows}

    @property
    def filed(self) -> dict[str, list[Row]]:
        """The tables of which a report has only the files."""
        names = {*self.result.filed, *([self.name] if self.result.shown == [] else [])}
        return {name: rows for name, rows in self.tables.items() if name in names}

    @property
    def shown(self) -> dict[str, list[Row]]:
        return {name: rows for name, rows in self.tables.items() if name not in self.filed}

    @property
    def judged(self) -> list[Check]:
        return [check for check in self.result.checks if check.judged]

    @property
    def open(self) -> list[Check]:
        return [check for check in self.result.checks if not check.judged]

    @property
    def failed(self) -> list[Check]:
        return [check for check in self.result.checks if check.failed]

    @property
    def own_figures(self) -> list[Figure]:
        return [figure for figure in self.figures if not figure.is_overview]

    @property
    def folding(self) -> tuple[list[Figure], list[Figure]]:
        """Its own figures that are not folded, and the others."""
        most = MOST_FIGURES if len(self.own_figures) <= MOST_FIGURES else FIRST_FIGURES
        first = [figure for k, figure in enumerate(self.own_figures) if k < most or figure.moves]
        return first, [figure for figure in self.own_figures if figure not in first]


Sections = Sequence[Section]


class Report(NamedTuple):
    sections: Sections
    robot: Robot
    origin: dict[str, Any]  # see provenance
    verdict: str  # in words, a sentence in each line
    causes: Sequence[Cause] = ()  # of the failures, lowest rank first
    skipped: Sequence[tuple[str, str]] = ()  # experiments, and why
    reference: Mapping[str, str] | None = None  # kind and name of what MuJoCo is compared with
    first_lines: Sequence[str] = ()  # what is said of it
    plain: Mapping[str, Any] | None = None  # how plain MuJoCo evaluates states, see Mujoco.plain
    is_complete: bool = True  # an interrupt ends a run before all experiments are finished

    @property
    def passed(self) -> bool:
        return self.is_complete and passed(self.sections)

    @property
    def top(self) -> list[str]:
        """What is said of the robot below the verdict, in sentences."""
        texts = [text for section in self.sections for text in section.result.top]
        if len(self.sections) > 1:
            return list(map(say, texts))
        return [line for before, _, after in map(parts, texts) for line in (before, after) if line]

    @property
    def tables(self) -> list[list[list[str]]]:
        """The tables that the answer to one question has, each the cells of its rows, the head first."""
        texts = self.sections[0].result.top if len(self.sections) == 1 else []
        return [rows for _, rows, _ in map(parts, texts) if rows]

    @property
    def runs_file(self) -> bool:
        """Whether it only asks about the file as it is, with contacts and actuators: nothing is switched off."""
        return all(section.record.runs_file for section in self.sections)

    @property
    def answers_first(self) -> bool:
        """Whether it answers one question about the robot: the answer comes before how many checks pass."""
        return len(self.sections) == 1 and not self.sections[0].record.serves_own and bool(self.top)

    @property
    def answer(self) -> list[str]:
        """The lines of a run of one experiment: what is said of the robot, else its number."""
        numbers = [headline(section) for section in self.sections if section.result.checks]
        lines = [line for section in self.sections for text in section.result.top for line in screen(text)]
        return lines or [f"{capital(number)}." for number in numbers if number]


def failures(sections: Sections) -> dict[str, list[Check]]:
    """The checks that fail, by their KINDS, and those that were not judged."""
    checks = [check for section in sections for check in section.result.checks]
    failed = [check for check in checks if check.failed]
    failing = {kind: [check for check in failed if check.about == about] for kind, about in KINDS.items()}
    return failing | {"not_judged": [check for check in checks if not check.judged]}


def has_failed(sections: Sections) -> bool:
    """Whether a check fails, or was not judged."""
    return any(failures(sections).values())


def passed(sections: Sections) -> bool:
    """Whether something was compared, no check fails, and all were judged."""
    return any(section.judged for section in sections) and not has_failed(sections)


def worst(sections: Sections) -> Check | None:
    """The check that uses most of a tolerance of rounding, or None."""
    checks = [check for section in sections for check in section.result.checks]
    of_rounding = [check for check in checks if check.over_tolerance is not None]
    return max(of_rounding, key=lambda check: check.over_tolerance or 0.0, default=None)


def verdict(
    sections: Sections, experiments: int, causes: Sequence[Cause] = (), subject: str = "", robot: str = ""
) -> str:
    """The outcome, a sentence in each line, with its cause or its largest share of a tolerance.

    experiments: how many there are in all; subject: what agrees or differs; robot: its name.
    """
    checked = [section for section in sections if section.result.checks]
    checks = [check for section in checked for check in section.judged]
    failing, top = failures(checked), worst(checked)
    differing = [
        section for section in checked if section.record.compares and failures([section])["differing"]
    ]
    lines = block(
        "verdict", "verdict", compared=subject or "The two models", robot=robot or "the robot",
        experiments=experiments, sections=sections, checked=checked, checks=checks, causes=causes,
        names=[section.name for section in differing or checked], differ=bool(differing), failing=failing,
        top=top if top and top.value and not has_failed(checked) else None,
    )  # fmt: skip
    return "\n".join(filter(None, map(str.strip, lines.split("\n"))))


def standing(section: Section) -> tuple[bool | None, str]:
    """Whether a section passes, also in words; None: not all was judged, or nothing compared."""
    failing = failures([section])
    words = block("verdict", "standing", checks=len(section.judged), failing=failing)
    if section.failed:
        return False, words
    return (None if failing["not_judged"] or not section.judged else True), words


def headline(section: Section) -> str:
    """The number of a section for the first screen; how many checks pass where it has none."""
    if section.result.headline:
        return say(section.result.headline)
    if not section.judged:
        return ""
    passing = [check for check in section.judged if check.passed]
    shares = [check.over_tolerance for check in passing if check.over_tolerance is not None]
    numbers = {"passed": len(passing), "checks": len(section.judged), "share": max(shares, default=None)}
    return say(Finding("verdict", "checks_passed", numbers))
