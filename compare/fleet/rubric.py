"""A rubric: points for experiments and checks, from a TOML file, and the points of a file by its report.

parameters = 4      # an experiment: all of its checks pass
[acceleration]
bias = 2            # a check of an experiment, of one place or scene: "mass, forearm" = 1
"""

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..core.errors import Refused
from ..core.words import in_one_line, listed, some_of
from ..robots.scene import is_number
from .cache import RESUME
from .models import place_of_report
from .table import FileRow

EXPECTED = "expected EXPERIMENT = POINTS, or a table [EXPERIMENT] with CHECK = POINTS"


class Entry(NamedTuple):
    """Points for all checks of an experiment, or for those of one name; all of them must pass."""

    experiment: str
    check: str  # "": all
    points: float

    def is_about(self, check: Mapping[str, Any]) -> bool:
        """Whether it is about a check of results.json."""
        names = "", check["quantity"], f"{check['quantity']}, {check['scene']}"
        return bool(check["experiment"] == self.experiment and self.check in names)


class Rubric(NamedTuple):
    path: str  # as given, in one line
    entries: tuple[Entry, ...]

    @property
    def total(self) -> float:
        return sum(entry.points for entry in self.entries)

    def award(self, rows: Iterable[FileRow], out: Path) -> None:
        """Set the points of each row by its report in the folder of the fleet; without a report 0.

        Refused: an entry is about no check of any report.
        """
        known: list[Mapping[str, Any]] = []
        for row in rows:
            checks = checks_of(out / place_of_report(row.same_as or row.file)) if row.has_report else []
            row.points = float(sum(entry.points for entry in self.entries if is_earned(entry, checks)))
            known += checks
        for entry in self.entries:
            if known and not any(map(entry.is_about, known)):
                names = {check["quantity"] for check in known if check["experiment"] == entry.experiment}
                where = f"{self.path}: {entry.experiment}: no file has a check {in_one_line(entry.check)!r}"
                raise Refused(f"{where}; known: {some_of(sorted(names)) or 'none'}; {RESUME}")


def is_earned(entry: Entry, checks: Sequence[Mapping[str, Any]]) -> bool:
    about = [check["passed"] for check in checks if entry.is_about(check)]
    return bool(about) and all(about)


def checks_of(report: Path) -> list[Mapping[str, Any]]:
    """The checks in results.json of a report."""
    return list(json.loads((report / "results.json").read_text(encoding="utf-8"))["checks"])


def read_rubric(path: str, experiments: Sequence[str]) -> Rubric:
    """The rubric of a file, for the experiments that are run. Refused, in one line: what is wrong in it."""
    shown, entries = in_one_line(path), []
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:  # TOML's and Unicode's errors are ValueErrors
        why = " ".join(str(error).split())
        raise Refused(f"--rubric: {shown} is not a TOML file that can be read: {why}") from None
    for experiment, value in content.items():
        if experiment not in experiments:
            known = listed(list(experiments))
            raise Refused(f"{shown}: {in_one_line(experiment)} is not an experiment of this fleet: {known}")
        points_of = value if isinstance(value, dict) else {"": value}
        for check, points in points_of.items():
            if not is_number(points) or points < 0.0:
                name = in_one_line(f"{experiment}: {check}" if check else experiment)
                raise Refused(f"{shown}: {name} is {points!r}; expected points, at least 0")
            entries.append(Entry(experiment, check, points))
    if not entries:
        raise Refused(f"{shown} has no entry; {EXPECTED}")
    return Rubric(shown, tuple(entries))
