"""Edits of the rules that turn a number into a verdict."""

from ..edit import Edit

EDITS = (
    Edit("agreement", "FACTOR", "64", "6400", "64 eps become 6400"),
    Edit("agreement", "RULES", "value <= tolerance", "True", "'at most' always passes"),
    Edit("agreement", "RULES", "value <= tolerance", "value < tolerance", "a value equal to its tolerance fails"),
    Edit("verdict", "answers.printed", '("published", "tmt", "mujoco")', '("published", "mujoco", "tmt")', "exchange"),
)
