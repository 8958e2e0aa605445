"""Tables of a report as text, and the rows of a long table that a reader needs."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from ..core.cause import Cause
from ..core.check import Check
from ..core.rows import Column, Row, columns_of

LONGEST_LIST = 80  # characters of a list in a report; its file has all
EVERY_DIGIT = Column(digits=7)
CAUSE = {"place": Column(), "stated": EVERY_DIGIT, "found": EVERY_DIGIT, "text": Column()}
CHECK = ["experiment", "scene", "quantity", "value", "tolerance", "unit", "note", "rule"]  # columns
IN_WORDS = {"seconds_of": "CPU seconds", "ended_after_s": "seconds from the start to the end"}


def of_records(records: Iterable[Mapping[str, Any]], columns: Mapping[str, Column]) -> pd.DataFrame:
    """These columns of records as text, with the digits that a reader needs."""
    table = pd.DataFrame(list(records), columns=list(columns), dtype=object)
    for name, column in columns.items():
        table[name] = [text_of(value, column) for value in table[name]]
    return table.rename(columns=lambda name: name.replace("_", " "))


def text_of(value: Any, column: Column) -> str:
    if isinstance(value, float):
        if not math.isfinite(value):
            return ""
        is_count = value.is_integer() and 1.0 <= abs(value) < 1e7
        return f"{value:.0f}" if is_count else f"{value:.{column.digits}g}"
    text = "" if value is None else str(value)
    is_long = column.names and len(text) > LONGEST_LIST
    return f"{text[: LONGEST_LIST - 4]} ..." if is_long else text


def of_cells(cells: Sequence[Sequence[str]]) -> pd.DataFrame:
    """A table of texts, the head first, as a terminal has it."""
    columns = [name.removeprefix("<").strip() for name in cells[0]]
    return pd.DataFrame([[*row, *[""] * (len(columns) - len(row))] for row in cells[1:]], columns=columns)


def of_rows(rows: Sequence[Row], shown: Sequence[str] | None = None) -> pd.DataFrame:
    """The rows of a table. shown: the names of its columns, if not all."""
    columns = columns_of(rows)
    if shown is not None and rows:
        columns = {name: columns[name] for name in shown}
    return of_records([row.record() for row in rows], columns)


def of_causes(causes: Sequence[Cause]) -> pd.DataFrame:
    return of_records([cause.record() for cause in causes], CAUSE).rename(columns={"text": "cause"})


def of_checks(checks: Sequence[Check], columns: Sequence[str] = CHECK) -> pd.DataFrame:
    records = [check.record() for check in checks]
    records = [record if record["judged"] else record | {"value": "not judged"} for record in records]
    return of_records(records, dict.fromkeys(columns, Column()))


def of_origin(origin: Mapping[str, Any]) -> pd.DataFrame:
    rows = []
    for name, value in origin.items():
        parts = [f"{key} {part}" for key, part in value.items()] if isinstance(value, dict) else [str(value)]
        rows.append([IN_WORDS.get(name, name), ", ".join(parts)])
    return pd.DataFrame(rows, columns=["what", "value"])
