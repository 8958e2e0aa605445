"""The kinds of hypotheses, each a function of the right equations that yields those of its kind.

Options and derivatives in variants.py, conventions in conventions.py, numbers in numbers.py, factors in
terms.py, numbers that change together in edits.py, other angles in angles.py; slips of positions and
velocities in slips.py, with what becomes of them in kinematics.py, and of the recursion of Newton and Euler
in recursion.py.
"""
