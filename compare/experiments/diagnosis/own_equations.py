"""What is asked of equations of a user's own alone: conditions on Mbar and h, and how to state their joints."""

import re

import numpy as np

from ...diagnosis.consistency import Condition, conditions
from ...diagnosis.finding import OTHERWISE
from ...engines.own import OwnDynamics

SECONDS_OF_CONDITIONS = 3.0
CALLS_OF_CONDITIONS, CALLS_FOR_A_JOINT = 30, 16  # of Mbar and h at each state, that the conditions take, about
QUOTED = r"'([^']*)'"
STATED_JOINTS = re.compile(r"joints=\[([^\]]*)\]")
HOW_STATED = re.compile(r" \(state it as joints=\[([^\]]*)\]\)")


def asked_conditions(
    given: OwnDynamics, q: np.ndarray, qd: np.ndarray, M: np.ndarray, h: np.ndarray
) -> tuple[list[Condition], str]:
    """The conditions at as many of the states as there is time for, and a sentence if that is none.

    Where Mbar or h is no number nothing is asked: that is said elsewhere.
    """
    if not (np.isfinite(M).all() and np.isfinite(h).all()):
        return [], ""
    calls = CALLS_OF_CONDITIONS + CALLS_FOR_A_JOINT * given.coordinates.nv
    count = given.equations.affordable(calls * len(q), SECONDS_OF_CONDITIONS) // calls
    if count == 0:
        return [], "Whether your h belongs to your M is not asked: your equations are too slow for that."
    found = conditions(given.mass_matrix, given.bias, given.coordinates, q[:count], qd[:count])
    return [condition for condition in found if np.isfinite(condition.tolerance)], ""


def for_command_line(text: str, is_own: bool) -> str:
    """A cause as who calls the command line can use it: joints are stated by --joints, and those of a file by the file alone."""

    def stated(match: re.Match) -> str:
        return f"--joints={','.join(re.findall(QUOTED, match[1]))}"

    text = text if is_own else text.replace(OTHERWISE, "")
    text = HOW_STATED.sub(lambda match: f" (state it by {stated(match)})" if is_own else "", text)
    return STATED_JOINTS.sub(stated, text)
