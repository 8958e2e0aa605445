"""Tables of a report as text, and the rows of a long table that a reader needs."""

import math
from collections.abc import Mapping, Sequence

import pandas as pd

from ..core.check import Check
from .verdict import Section

DIGITS = dict.fromkeys(
    ("published", "exact", "tmt", "mujoco", "stated", "compiled", "found"), 7
)  # of a column; else 3
STEPS = "predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"
DIGITS |= dict.fromkeys(STEPS, 5)
TITLES = {"what_should_i_use": "What should I use?"}  # of tables whose name is not their title
IN_WORDS = {"seconds_of": "CPU seconds", "ended_after_s": "seconds from the start to the end"}
LISTS = ("names", "hinges", "locked")  # columns with many names of joints
LONGEST_LIST = 80  # characters of a list in a report; its file has all


def shown(table: pd.DataFrame, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """A table as text, with the digits that a reader needs."""
    table = table if columns is None else table[columns]

    def text(value, digits, is_list):
        if isinstance(value, float):
            if not math.isfinite(value):
                return ""
            return f"{value:.0f}" if value.is_integer() and 1.0 <= abs(value) < 1e7 else f"{value:.{digits}g}"
        whole = "" if value is None else str(value)
        return f"{whole[: LONGEST_LIST - 4]} ..." if is_list and len(whole) > LONGEST_LIST else whole

    columns = {
        c: [text(v, DIGITS.get(c, 3), c in LISTS) for v in table[c].astype(object)] for c in table.columns
    }
    return pd.DataFrame(columns).rename(columns=lambda c: c.replace("_", " "))


def of_causes(causes: Sequence[dict]) -> pd.DataFrame:
    columns = ["rank", "place", "stated", "found", "text"]
    return shown(pd.DataFrame(causes)[columns].rename(columns={"text": "cause"}))


def records(checks: Sequence[Check]) -> pd.DataFrame:
    names = [field for field in Check.__annotations__ if field not in ("rounding", "about", "judged")]
    found = [check.record() if check.judged else check.record() | {"value": "not judged"} for check in checks]
    return shown(pd.DataFrame(found, columns=names))


def closest_checks(section: Section, most: int) -> pd.DataFrame:
    """At most `most` checks of a section as text: those that do not pass, then the largest shares of a rounding tolerance."""
    checks = section.result.checks
    order = sorted(range(len(checks)), key=lambda k: (checks[k].passed, -(checks[k].over_tolerance or 0.0)))
    kept = [checks[k] for k in sorted(order[:most])]
    return records(kept).drop(columns="experiment")


def origins(origin: dict) -> pd.DataFrame:
    def in_one_cell(value) -> str:
        return (
            ", ".join(f"{name} {part}" for name, part in value.items())
            if isinstance(value, dict)
            else str(value)
        )

    rows = [(IN_WORDS.get(name, name), in_one_cell(value)) for name, value in origin.items()]
    return pd.DataFrame(rows, columns=["what", "value"])


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
