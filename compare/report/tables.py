"""Tables of a report as text, and the rows of a long table that a reader needs."""

import math
from collections.abc import Iterable, Mapping, Sequence

from ..judge.check import Check
from .verdict import Section

DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled", "found"), 7)  # of a column; else 3
DIGITS |= dict.fromkeys(
    ("predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"), 5
)
TITLES = {"what_should_i_use": "What should I use?"}  # of tables whose name is not their title
IN_WORDS = {"seconds_of": "CPU seconds", "ended_after_s": "seconds from the start to the end"}
LISTS = ("names", "hinges", "locked")  # columns with many names of joints
CAUSES = ("place", "stated", "found", "cause")  # columns
CHECKS = [name for name in Check.__annotations__ if name not in ("experiment", "rounding", "about", "judged")]
LONGEST_LIST = 80  # characters of a list in a report; its file has all


def shown(rows: Sequence[Mapping], columns: Iterable[str] | None = None) -> dict:
    """The columns and the cells, a list for each row, as text. KeyError for a column that no row has."""
    known = dict.fromkeys(name for row in rows for name in row)
    names = list(known if columns is None else columns)
    if rows and (absent := [name for name in names if name not in known]):
        raise KeyError(absent[0])
    cells = [[text(name, row.get(name)) for name in names] for row in rows]
    return {"columns": [name.replace("_", " ") for name in names], "cells": cells}


def text(column: str, value: object) -> str:
    """A value in a cell; nothing for what is unknown or not finite."""
    if isinstance(value, float):
        if not math.isfinite(value):
            return ""
        digits = DIGITS.get(column, 3)
        return f"{value:.0f}" if value.is_integer() and 1.0 <= abs(value) < 1e7 else f"{value:.{digits}g}"
    whole = "" if value is None else str(value)
    return f"{whole[: LONGEST_LIST - 4]} ..." if column in LISTS and len(whole) > LONGEST_LIST else whole


def of_causes(causes: Sequence[dict], columns: Iterable[str] = ("rank", *CAUSES)) -> dict:
    return shown([cause | {"cause": cause["text"]} for cause in causes], columns)


def records(checks: Sequence[Check], columns: Iterable[str] = ("experiment", *CHECKS)) -> dict:
    values = [{} if check.judged else {"value": "not judged"} for check in checks]
    return shown([check.record() | value for check, value in zip(checks, values)], columns)


def closest_checks(section: Section, most: int) -> dict:
    """At most `most` checks of a section as text: those that do not pass, then the largest shares of a rounding tolerance."""
    checks = section.result.checks
    order = sorted(range(len(checks)), key=lambda k: (checks[k].passed, -(checks[k].over_tolerance or 0.0)))
    return records([checks[k] for k in sorted(order[:most])], CHECKS)


def origins(origin: dict) -> dict:
    rows = []
    for name, value in origin.items():
        if isinstance(value, dict):
            value = ", ".join(f"{key} {part}" for key, part in value.items())
        rows.append({"what": IN_WORDS.get(name, name), "value": str(value)})
    return shown(rows)


def shortened(rows: Sequence[dict], most: int) -> tuple[list[dict], str]:
    """The rows to show, in their order, at most `most`, and how many of how many these are ('' if all of them).

    Those that fail or differ come first, then those with the largest share of a tolerance.
    """
    rows = list(rows)
    if len(rows) <= most:
        return rows, ""
    nearest = sorted(range(len(rows)), key=lambda k: distance_from_failure(rows[k]))
    return [rows[k] for k in sorted(nearest[:most])], f"{most} of {len(rows):,} rows"


def distance_from_failure(row: Mapping) -> tuple[bool, bool, float]:
    """A key to sort rows: those that fail, that differ from a stated number, that use most of a tolerance."""
    share = row.get("difference_over_band", row.get("difference_over_bar"))
    return row.get("passed") is not False, not row.get("difference"), math.inf if share is None else -share
