"""Tables of a report as text."""

import math
from collections.abc import Sequence

import pandas as pd

from ..judge.check import Check
from .verdict import Section

DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled", "found"), 7)  # of a column; else 3
DIGITS |= dict.fromkeys(
    ("predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"), 5
)

IN_WORDS = {
    "seconds_of": "CPU seconds",
    "ended_after_s": "seconds from the start to the end",
}
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

    columns = {c: [text(v, DIGITS.get(c, 3), c in LISTS) for v in table[c].astype(object)] for c in table.columns}
    return pd.DataFrame(columns).rename(columns=lambda c: c.replace("_", " "))


def of_causes(causes: Sequence[dict]) -> pd.DataFrame:
    rows = [(cause["rank"], cause["place"], cause["stated"], cause["found"], cause["text"]) for cause in causes]
    return shown(pd.DataFrame(rows, columns=["rank", "place", "stated", "found", "cause"]))


def records(checks: Sequence[Check]) -> pd.DataFrame:
    names = [field for field in Check.__annotations__ if field not in ("rounding", "about")]
    return shown(pd.DataFrame([check.record() for check in checks], columns=names))


def closest_checks(section: Section, most: int) -> pd.DataFrame:
    """The checks of a section that fail, then those with the largest share of a rounding tolerance, at most `most`, as text."""
    checks = section.result.checks
    order = sorted(range(len(checks)), key=lambda k: (checks[k].passed, -(checks[k].over_tolerance or 0.0)))
    kept = [checks[k] for k in sorted(order[:most])]
    return records(kept).drop(columns="experiment")


def heading(name: str) -> str:
    return {"what_should_i_use": "What should I use?"}.get(name, name.replace("_", " ").capitalize())


def origins(origin: dict) -> pd.DataFrame:
    rows = [(IN_WORDS.get(name, name), in_one_cell(value)) for name, value in origin.items()]
    return pd.DataFrame(rows, columns=["what", "value"])


def in_one_cell(value) -> str:
    return ", ".join(f"{name} {part}" for name, part in value.items()) if isinstance(value, dict) else str(value)
