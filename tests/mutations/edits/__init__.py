"""The edits, by what they break."""

from . import report, rules

EDITS = (*rules.EDITS, *report.EDITS)
