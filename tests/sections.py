"""Sections of plain checks, for tests of what is said of them: test_references, and those of report."""

from compare.core.check import Result
from compare.experiments import EXPERIMENTS, Experiment
from compare.report.verdict import Figure, Section


def section(name="mass", *checks, rows=(), figures=(), kind=Result, **tables):
    """A section of plain checks (quantity, value, tolerance, rule, rounding), and what it is about if that is not the models."""
    result, record = kind(name, rows=list(rows), tables=tables), EXPERIMENTS.get(name, Experiment(0))
    for quantity, value, tolerance, rule, rounding, *about in checks:
        result.check("zero", quantity, value, tolerance, "kg m2", "", rounding, rule, *about)
    drawn = [Figure(file, f"Caption of {file}.") for file in figures]
    return Section(name, name.capitalize(), "They agree.", "64 eps.", result, drawn, record=record)


GOOD, BAD = ("Mbar", 0.5, 1.0, "at most", True), ("Mbar", 2.0, 1.0, "at most", True)
