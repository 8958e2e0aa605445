"""The rows of a long table that a reader needs: the worst of each group, by the columns that the table has."""

import math
from collections.abc import Mapping, Sequence

from ..judge.words import listed

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
SHARES = ("difference_over_band", "difference_over_bar")
PREDICTED = (
    ("predicted_dt_s", "observed_dt_s"),
    ("predicted_growth", "observed_growth"),
    ("predicted_s", "observed_s"),
)
RUNS = GROUPS[0]  # a row for each of these groups is shown even where other tables are cut shorter
FEWEST = 4  # groups: fewer say too little


def shortened(rows: Sequence[dict], most: int, most_of_runs: int | None = None) -> tuple[list[dict], str]:
    """The rows to show, in their order, at most `most`; and which these are, in words ('' if all of them).

    most_of_runs: the maximum where each row is for a scene and an integrator; None: `most`. Of a long table of stated and
    compiled numbers the rows that differ.
    """
    rows = list(rows)
    if len(rows) <= most:
        return rows, ""
    if "stated" in rows[0] and "compiled" in rows[0]:
        off = [row for row in rows if row.get("difference")]
        words = f"{len(off)} of {len(rows)} rows differ" if off else f"none of {len(rows)} rows differs"
        return off[:most], words + (f", the first {most}" if len(off) > most else "")
    size = next((size for size in MEASURES if any(size(row) is not None for row in rows)), None)
    for columns in GROUPS:
        if set(columns) <= set(rows[0]):
            kept = worst_of_groups(rows, columns, size)
            words = f"{'the worst' if size else 'the first'} of each {listed([c.replace('_', ' ') for c in columns])}"
            if FEWEST <= len(kept) <= (most_of_runs or most if columns == RUNS else most):
                return kept, f"{words}, {len(kept)} of {len(rows)} rows"
    if size is None:
        return rows[:most], f"the first {most} of {len(rows)} rows"
    worst = sorted(range(len(rows)), key=lambda k: -badness(rows[k], size))[:most]
    return [rows[k] for k in sorted(worst)], f"the worst {most} of {len(rows)} rows"


def worst_of_groups(rows: Sequence[dict], columns: Sequence[str], size) -> list[dict]:
    """The worst row of each group, or its first where nothing is measured, in their order."""
    best = {}
    for k, row in enumerate(rows):
        group = tuple(str(row[column]) for column in columns)
        if group not in best or (size and badness(row, size) > badness(rows[best[group]], size)):
            best[group] = k
    return [rows[k] for k in sorted(best.values())]


def badness(row: Mapping, size) -> float:
    """How bad a row is: inf for one that fails, or has no number where that fails; -1 where nothing was measured."""
    value = size(row)
    if row.get("passed") is False and (value is None or not math.isfinite(value)):
        return math.inf
    return -1.0 if value is None else math.inf if math.isnan(value) else float(value)


def share(row: Mapping) -> float | None:
    found = next((row[name] for name in SHARES if name in row), None)
    return None if found is None else abs(found)


def from_printed(row: Mapping) -> float | None:
    """How much of its tolerance the farther engine is from a printed number."""
    if not {"published", "tolerance", "tmt", "mujoco"} <= set(row) or not row["tolerance"]:
        return None
    return max(abs(row[name] - row["published"]) for name in ("tmt", "mujoco")) / row["tolerance"]


def from_predicted(row: Mapping) -> float | None:
    """How far, relative, what is observed is from what is predicted."""
    for predicted, observed in PREDICTED:
        if row.get(predicted) and row.get(observed) is not None:
            return abs(row[observed] / row[predicted] - 1.0)
    return None


MEASURES = (share, from_printed, from_predicted)
