"""Sections of plain checks, for tests of what is said of them: test_references, and those of report."""

from dataclasses import make_dataclass

from compare.core.check import Result
from compare.core.rows import Row
from compare.experiments import EXPERIMENTS, Experiment
from compare.report.verdict import Figure, Section


def section(name="mass", *checks, rows=(), figures=(), kind=Result, **tables):
    """A section of plain checks (quantity, value, tolerance, rule, rounding), and what it is about if that is not the models."""
    tables = {table: typed(rows_of_table) for table, rows_of_table in tables.items()}
    result, record = kind(name, rows=typed(rows), tables=tables), EXPERIMENTS.get(name, Experiment())
    for quantity, value, tolerance, rule, rounding, *about in checks:
        result.check("zero", quantity, value, tolerance, "kg m2", "", rounding, rule, *about)
    drawn = [Figure(file, f"Caption of {file}.") for file in figures]
    return Section(name, name.capitalize(), "They agree.", "64 eps.", result, drawn, record=record)


def row_of(**values) -> Row:
    return make_dataclass("AnyRow", values, bases=(Row,), kw_only=True)(**values)


def typed(rows) -> list:
    return [row_of(**row) if isinstance(row, dict) else row for row in rows]


GOOD, BAD = ("Mbar", 0.5, 1.0, "at most", True), ("Mbar", 2.0, 1.0, "at most", True)
