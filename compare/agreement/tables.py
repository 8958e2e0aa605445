"""What is wrong with a table of values, rather than with equations: a few of its rows, their order, its columns."""

from collections.abc import Iterator

import numpy as np
from numpy import ndarray

from ..core.finding import Finding
from .comparison import Compared, Comparison

FEW = 0.15  # of the rows, at most
LEAST_ROWS = 8
SHOWN = 4
MOST_COLUMNS = 400  # entries of a row whose exchanges are tried


def slips_of_tables(comparison: Comparison) -> list[Finding]:
    """What explains each table that differs; [] unless all that differs are tables, and each is explained."""
    failing = {name: compared for name, compared in comparison.compared.items() if compared.fails}
    equations = comparison.equations
    if len(comparison.q) < LEAST_ROWS or any(
        equations is not None and equations.has(name) for name in failing
    ):
        return []
    findings = [next(slips_of_table(comparison, name, compared), None) for name, compared in failing.items()]
    return [finding for finding in findings if finding is not None] if None not in findings else []


def slips_of_table(comparison: Comparison, name: str, compared: Compared) -> Iterator[Finding]:
    """What explains the differences of one table."""
    count = len(compared.yours)
    yours, right, tolerance = (
        part.reshape(count, -1) for part in (compared.yours, compared.right, compared.tolerance)
    )
    wrong = np.abs(yours - right) > tolerance
    if not np.isfinite(yours).all():
        return
    rows = np.flatnonzero(wrong.any(axis=1))
    if len(rows) <= FEW * count:
        names = list(comparison.entries(name).values())
        at = [(int(row), int(column)) for row in rows for column in np.flatnonzero(wrong[row])]
        values = [
            (row, names[column], float(yours[row, column]), float(right[row, column]))
            for row, column in at[:SHOWN]
        ]
        yield Finding(
            "agreement",
            "wrong_rows",
            {"quantity": name, "rows": rows.tolist(), "values": values, "count": count},
        )
    for shift in (1, -1):
        moved = np.roll(right, shift, axis=0)
        inner = np.arange(count)[max(shift, 0) : count + min(shift, 0)]
        if (np.abs(yours - moved) <= tolerance + np.roll(tolerance, shift, axis=0))[inner].all():
            yield Finding("agreement", "shifted_rows", {"quantity": name, "shift": shift})
    if exchanged := columns_exchanged(yours, right, tolerance, wrong):
        names = list(comparison.entries(name).values())
        pairs = [(names[column], names[other]) for column, other in exchanged.items()]
        yield Finding("agreement", "exchanged_columns", {"quantity": name, "pairs": pairs})


def columns_exchanged(yours: ndarray, right: ndarray, tolerance: ndarray, wrong: ndarray) -> dict[int, int]:
    """The columns that hold the values of others, with these; {} unless every wrong one does."""
    columns = np.flatnonzero(wrong.any(axis=0)).tolist()
    if len(columns) > MOST_COLUMNS:
        return {}
    held = {}
    for column in columns:
        off = np.abs(yours[:, [column]] - right)
        same = np.flatnonzero((off <= tolerance + tolerance[:, [column]]).all(axis=0)).tolist()
        same = [other for other in same if other in columns]
        if not same:
            return {}
        held[column] = same[0]
    return held
