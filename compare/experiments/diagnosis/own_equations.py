"""What is asked of equations of a user's own alone: conditions on Mbar and h, and how their joints are to be stated."""

import re

import numpy as np

import tmt

from ...diagnosis import Diagnosis, diagnose, packed
from ...diagnosis.consistency import Condition, conditions
from ...engines.own import OwnDynamics
from ...joint_map import JointMap

SECONDS_OF_CONDITIONS = 3.0
CALLS_OF_CONDITIONS, CALLS_FOR_A_JOINT = 30, 16  # of Mbar and h at each state, that the conditions take, about
HOW_STATED = re.compile(r" \(state it as (?:joints=\[([^\]]*)\]|('[^']*'))\)")


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


def diagnosed_as_stated(
    tree: tmt.Tree, names: tuple, joints: JointMap, q, qd, values: tuple, tolerances: tuple, seconds: float
) -> Diagnosis:
    """What explains Mbar and h, `values`, at states of the model's joints; tolerances: of both.

    Joints that are found to be otherwise are told as they are to be stated in place of what was stated.
    """

    def found(q, qd, values, tolerances) -> Diagnosis:
        both = (packed(*parts, tree.coordinates.nv, len(q)) for parts in (values, tolerances))
        return diagnose(tree, names, q, qd, *both, seconds)

    first = found(q, qd, values, tolerances)
    if joints.is_same or not any(HOW_STATED.search(cause.text) for cause in first.causes):
        return first
    own = [(joints.own_mass_matrix(M), joints.own_forces(h)) for M, h in (values, tolerances)]
    own[1] = tuple(np.abs(part) for part in own[1])
    anew = found(joints.own_positions(q), joints.own_speeds(qd), *own)
    if not anew.differs:  # they are the model's
        text = f"joints as they are stated: all agrees with those of the model (state it as joints={list(names)})"
        cause = first.causes[0]._replace(place="the joints", explains="as the model has them", text=text)
        return first._replace(causes=(cause,))
    return anew if anew.causes else first


def for_command_line(text: str, is_own: bool) -> str:
    """A cause as who calls the command line can use it: joints are stated by --joints, and those of a file by the file alone."""

    def stated(match: re.Match) -> str:
        names = re.findall(r"'([^']*)'", match[1] or match[2])
        return f" (state it by --joints={','.join(names)})" if match[1] else f" (state it so in --joints: {names[0]})"

    return HOW_STATED.sub(stated if is_own else "", text)
