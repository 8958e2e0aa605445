"""Rows that are still dictionaries, as Rows.

Only until every table has typed rows: delete this file, and its use in report/verdict.py.
"""

import math
from collections.abc import Sequence
from typing import Any

from ..core.rows import Column, Row

EVERY_DIGIT = "published", "exact", "tmt", "mujoco", "stated", "compiled", "found"
STEPS = "predicted_dt_s", "observed_dt_s", "dt_s", "mujoco_dt_s", "tmt_dt_s", "from_dt_s", "to_dt_s"
COLUMNS = {name: Column(digits=7) for name in EVERY_DIGIT} | {name: Column(digits=5) for name in STEPS}
COLUMNS |= {name: Column(names=True) for name in ("names", "hinges", "locked")}


class PlainRow(Row):
    """A dictionary as a Row; what is said of a column follows from its name."""

    def __init__(self, values: dict[str, Any]):
        self.values = values

    def columns(self) -> dict[str, tuple[str, Column]]:
        return {name: (name, COLUMNS.get(name, Column())) for name in self.values}

    def record(self) -> dict[str, Any]:
        return dict(self.values)

    @property
    def urgency(self) -> tuple[bool, bool, float]:
        share = self.values.get("difference_over_band", self.values.get("difference_over_bar"))
        is_equal = not self.values.get("difference")
        return self.values.get("passed") is not False, is_equal, math.inf if share is None else -share


def in_rows(rows: Sequence[Row | dict[str, Any]]) -> list[Row]:
    return [row if isinstance(row, Row) else PlainRow(row) for row in rows]
