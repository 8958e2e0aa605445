"""The edits, by what they break."""

from . import rules

EDITS = (*rules.EDITS,)
