"""Why two sets of equations of motion differ, in the terms of the derivation.

The right equations are those of a tree, by the TMT method; of the others only values at some states are
known. Causes have ranks: 1 an option or a convention (order, senses, zeros, units, axes); 2 one number, term,
coefficient or slip of the derivation; 3 several of them. Each way to be wrong is a Hypothesis
(hypothesis.py): what it changes in Mbar and h, complete or with a number to fit (fit.py). Each kind of them
is a function (kinds). They are tried on all values, then on Mbar, the velocity terms and gravity of h apart,
several numbers by regression (regression.py), then beside a convention and in pairs (pairs.py); the search
ends after the first stage in which something natural explains the values down to their tolerance (search.py).
All that explains them is listed, the likeliest first: M and h cannot distinguish them.
"""

from .cause import Diagnosis
from .given import Stated
from .layout import Values
from .search import diagnose

__all__ = ["STATES_ASKED", "Diagnosis", "Stated", "Values", "diagnose"]

STATES_ASKED = 24
