"""Tables of a report as text, and the rows of a long table that a reader needs."""

import math
from collections.abc import Callable, Mapping, Sequence

import pandas as pd

from ..judge.check import Check
from ..judge.words import listed
from .verdict import Section

DIGITS = dict.fromkeys(("published", "exact", "tmt", "mujoco", "stated", "compiled", "found"), 7)  # of a column; else 3
DIGITS |= dict.fromkeys(
    ("predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"), 5
)
TITLES = {"what_should_i_use": "What should I use?"}  # of tables whose name is not their title
IN_WORDS = {"seconds_of": "CPU seconds", "ended_after_s": "seconds from the start to the end"}
LISTS = ("names", "hinges", "locked")  # columns with many names of joints
LONGEST_LIST = 80  # characters of a list in a report; its file has all
GROUPS = (  # columns by which rows are grouped: the first that a table has and that give few enough groups
    ("scene", "engine_integrator"),
    ("scene", "target_rad"),
    ("scene", "target"),
    ("scene", "engine", "method"),
    ("engine", "method"),
    ("scene", "integrator"),
    ("quantity",),
    ("item",),
    ("scene",),
)
RUNS = GROUPS[0]  # a row for each of these groups is shown even where other tables are cut shorter
FEWEST = 4  # groups: fewer say too little


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
        return ", ".join(f"{name} {part}" for name, part in value.items()) if isinstance(value, dict) else str(value)

    rows = [(IN_WORDS.get(name, name), in_one_cell(value)) for name, value in origin.items()]
    return pd.DataFrame(rows, columns=["what", "value"])


def shortened(rows: Sequence[dict], most: int, most_of_runs: int | None = None) -> tuple[list[dict], str]:
    """The rows to show, in their order, at most `most`; and which these are, in words ('' if all of them).

    The worst row of each group, by what the table measures. most_of_runs: the maximum where each row is for a scene and an
    integrator; None: `most`. Of a long table of stated and compiled numbers the rows that differ.
    """
    rows = list(rows)
    if len(rows) <= most:
        return rows, ""
    if {"stated", "compiled"} <= set(rows[0]):
        off = [row for row in rows if row.get("difference")]
        words = f"{len(off)} of {len(rows)} rows differ" if off else f"none of {len(rows)} rows differs"
        if off and all(
            f"{row['stated']:.{DIGITS['stated']}g}" == f"{row['compiled']:.{DIGITS['stated']}g}" for row in off
        ):
            words += ", in digits that are not shown"
        return off[:most], words + (f", the first {most}" if len(off) > most else "")
    measure = next((measure for measure in MEASURES if any(measure(row) is not None for row in rows)), None)
    size = pd.Series([badness(row, measure) if measure else 0.0 for row in rows])
    which = "worst" if measure else "first"
    for columns in GROUPS:
        if set(columns) <= set(rows[0]):
            kept = size.groupby([[str(row[column]) for row in rows] for column in columns], sort=False).idxmax()
            if FEWEST <= len(kept) <= (most_of_runs or most if columns == RUNS else most):
                names = listed([column.replace("_", " ") for column in columns])
                return [rows[k] for k in sorted(kept)], f"the {which} of each {names}, {len(kept)} of {len(rows)} rows"
    kept = sorted(size.nlargest(most).index)
    return [rows[k] for k in kept], f"the {which} {most} of {len(rows)} rows"


def badness(row: Mapping, measure: Callable) -> float:
    """How bad a row is: inf for one that fails, or has no number where that fails; -1 where nothing was measured."""
    value = measure(row)
    if row.get("passed") is False and (value is None or not math.isfinite(value)):
        return math.inf
    return -1.0 if value is None else math.inf if math.isnan(value) else float(value)


def share(row: Mapping) -> float | None:
    value = row.get("difference_over_band", row.get("difference_over_bar"))
    return None if value is None else abs(value)


def from_printed(row: Mapping) -> float | None:
    """How much of its tolerance the farther engine is from a printed number."""
    if not row.get("tolerance") or "published" not in row:
        return None
    return max(abs(row[name] - row["published"]) for name in ("tmt", "mujoco")) / row["tolerance"]


def from_predicted(row: Mapping) -> float | None:
    """How far, relative, what is observed is from what is predicted."""
    for unit in ("dt_s", "s"):
        predicted, observed = row.get(f"predicted_{unit}"), row.get(f"observed_{unit}")
        if predicted and observed is not None:
            return abs(observed / predicted - 1.0)
    return None


MEASURES = (share, from_printed, from_predicted)
