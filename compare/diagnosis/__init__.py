"""Why two sets of equations of motion differ, in the terms of the derivation.

The right equations are those of a tree, by the TMT method; of the others only values at some states are
known. Causes have ranks: 1 an option or a convention (order, senses, zeros, units, axes); 2 one number, term,
coefficient or slip of the derivation; 3 several of them. A Hypothesis has no number to fit: options and slips
of derivatives in variants.py, numbers that change together in edits.py, slips of positions and velocities in
slips.py, of the recursion of Newton and Euler in recursion.py, other angles in angles.py. A Place has one:
numbers in places.py, factors in terms.py; groups.py fits several. Conventions are in conventions.py. They are tried
on all values, then on Mbar, the velocity terms and gravity of h apart, then beside a convention and in
pairs, and ends after the first stage in which something natural explains the values down to their tolerance
(likelihood.py). All that explains them is listed, the likeliest first: M and h cannot distinguish them.
"""

from .cause import Diagnosis
from .model import Values
from .search import diagnose
from .statements import Stated

__all__ = ["STATES_ASKED", "Diagnosis", "Stated", "Values", "diagnose"]

STATES_ASKED = 24
