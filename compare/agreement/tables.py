"""What is wrong with a table of values rather than with equations: some rows, their order, columns."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy import ndarray

from ..core.finding import Finding
from ..engines.own import QUANTITIES
from ..judge.scale import EPS
from .comparison import Comparison
from .values import OF_CORIOLIS, Compared

FEW = 0.15  # of the rows, at most
LEAST_ROWS = 8
SHOWN = 4
MOST_DECIMALS = 8
WHOLE = 1e-3  # of the last decimal: what is whole
SECOND_ORDER = 0.05  # of the change by rounding
MOST_COLUMNS = 400  # entries of a row whose exchanges are tried


def slips_of_tables(comparison: Comparison) -> list[Finding]:
    """What explains each table that differs; [] unless all that differs are tables, and each is explained."""
    failing = {name: compared for name, compared in comparison.compared.items() if compared.fails}
    equations = comparison.equations
    are_tables = not OF_CORIOLIS.keys() & failing.keys()
    are_tables &= equations is None or not any(map(equations.has, failing))
    if len(comparison.q) < LEAST_ROWS or not are_tables:
        return []
    findings = [next(slips_of_table(comparison, name, compared), None) for name, compared in failing.items()]
    return [finding for finding in findings if finding is not None] if None not in findings else []


def slips_of_table(comparison: Comparison, name: str, compared: Compared) -> Iterator[Finding]:
    """What explains the differences of one table."""
    count, names = len(compared.yours), list(comparison.entries(name).values())
    arrays = compared.yours, compared.right, compared.tolerance
    yours, right, tolerance = (part.reshape(count, -1) for part in arrays)
    wrong = np.abs(yours - right) > tolerance
    if not np.isfinite(yours).all():
        return

    def slip(kind: str, **values: object) -> Finding:
        return Finding("agreement", kind, {"quantity": name} | values)

    digits = decimals(yours)
    if digits and decimals(right) is None:
        rounded = 0.5 * 10.0**-digits + rounding_of_states(comparison, name).reshape(count, -1)
        if (np.abs(yours - right) <= rounded * (1.0 + SECOND_ORDER) + tolerance).all():
            of_states, rtol = bool((rounded > 10.0**-digits).any()), float(f"{2.0 * compared.least_rtol:.0e}")
            yield slip("rounded", decimals=digits, rtol=rtol, of_states=of_states)
    rows = np.flatnonzero(wrong.any(axis=1)).tolist()
    others = np.abs(yours - right)[~wrong.any(axis=1)]
    are_exact = bool((others <= compared.rounding.reshape(count, -1)[~wrong.any(axis=1)]).all())
    if len(rows) <= FEW * count and are_exact:
        at = np.argwhere(wrong)[:SHOWN].tolist()
        values = [(row, names[k], float(yours[row, k]), float(right[row, k])) for row, k in at]
        yield slip("wrong_rows", rows=rows, values=values, count=count)
    for shift in (1, -1):
        moved, allowed = np.roll(right, shift, axis=0), tolerance + np.roll(tolerance, shift, axis=0)
        inner = slice(max(shift, 0), count + min(shift, 0))
        if (np.abs(yours - moved) <= allowed)[inner].all():
            yield slip("shifted_rows", shift=shift)
    if exchanged := columns_exchanged(yours, right, tolerance, wrong):
        pairs = [(names[column], names[other]) for column, other in exchanged.items()]
        yield slip("exchanged_columns", pairs=pairs)


def decimals(values: ndarray) -> int | None:
    """The decimals to which all of some values are rounded; None: they are not."""
    for digits in range(MOST_DECIMALS + 1):
        scaled = values * 10.0**digits
        if np.abs(scaled - np.round(scaled)).max() <= WHOLE + 4.0 * EPS * np.abs(scaled).max():
            return digits
    return None


def rounding_of_states(comparison: Comparison, name: str) -> ndarray:
    """By how much a quantity changes within the rounding of a table's q and qd, (states, ...)."""
    joints, coordinates, right = comparison.joints, comparison.coordinates, comparison.compared[name].right
    total, rows = np.zeros_like(right), {"q": comparison.q, "qd": comparison.qd}
    own = {"q": joints.own_positions(comparison.q), "qd": joints.own_speeds(comparison.qd)}
    sizes = {key: decimals(values) for key, values in own.items() if key in QUANTITIES[name].state}
    for key, unit in product((key for key, digits in sizes.items() if digits), np.eye(coordinates.nv)):
        step = 0.5 * 10.0 ** -float(sizes[key] or 0) * unit
        moved = rows | {key: coordinates.move(comparison.q, step) if key == "q" else comparison.qd + step}
        value = comparison.asked(comparison.mujoco, name, moved["q"], moved["qd"])
        total += np.abs(comparison.own(name)(value) - right)
    return total


def columns_exchanged(yours: ndarray, right: ndarray, tolerance: ndarray, wrong: ndarray) -> dict[int, int]:
    """The columns that hold the values of others, with these; {} unless every wrong one does."""
    columns = np.flatnonzero(wrong.any(axis=0))
    if len(columns) > MOST_COLUMNS:
        return {}
    off = np.abs(yours[:, columns, None] - right[:, None, columns])
    same = (off <= tolerance[:, columns, None] + tolerance[:, None, columns]).all(axis=0)
    np.fill_diagonal(same, False)
    if not (len(columns) and same.any(axis=1).all()):
        return {}
    return dict(zip(columns.tolist(), columns[same.argmax(axis=1)].tolist()))
