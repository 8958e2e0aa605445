"""Why two sets of equations of motion differ, in the terms of the derivation.

The right equations are those of a tree, by the TMT method; of the others only values at some states are
known. Causes have ranks: 1 an option or a convention of a joint (order, sense, zero, unit); 2 one number, one
term or one coefficient; 3 two of them. The search ends after the first rank in which something explains the
values down to their tolerance, and lists all that does: M and h cannot distinguish them.
"""

from .cause import Diagnosis
from .model import Values
from .search import Stated, diagnose

__all__ = ["STATES_ASKED", "Diagnosis", "Stated", "Values", "diagnose"]

STATES_ASKED = 24
