"""The message of an AssertionError, in the manner of numpy.testing."""

import numpy as np

from ..engines.own import ARGUMENTS, state_in_words
from ..judge.check import over
from ..report.text import block
from .given import Compared, Given
from .why import Why

LEAST_DIGITS = 2  # in common: then the constants may be rounded
MOST_LISTED = 8  # joints


def message(given: Given, why: Why) -> str:
    """Which entries of which quantity are off, the worst of them, the probable cause, and what can be stated."""
    quantities = [
        worst_of(given, name, comparison)
        for name, comparison in given.compared.items()
        if (comparison.ratio > 1.0).any()
    ]
    joints, kinds = given.joints.joints, dict(zip(given.coordinates.names, given.coordinates.all_kinds))
    straight = [joint for joint in joints if kinds[joint.name] != "ball"]
    text = block(
        "agreement",
        "message",
        given=given,
        quantities=quantities,
        why=why.text,
        rounded=rounded(given) if why.may_be_rounded else None,
        joints=None if len(joints) > MOST_LISTED and not given.are_stated else list(map(str, joints)),
        first=None if given.are_stated or not straight else straight[0],
        is_hinge=bool(straight) and kinds[straight[0].name] == "hinge",
    )
    return "\n".join(line.rstrip() for line in text.splitlines() if line.strip())


def worst_of(given: Given, name: str, comparison: Compared) -> dict:
    """How many entries of one quantity are off, and the worst of them."""
    ratio = comparison.ratio
    count, worst = int((ratio > 1.0).sum()), np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    state = given.states[worst[0]]
    return {
        "name": name,
        "count": count,
        "of": ratio.size,
        "states": (int((ratio > 1.0).reshape(len(ratio), -1).any(axis=1).sum()), len(ratio)),
        "entry": given.entries(name)[tuple(map(int, worst[1:]))],
        "state": state.number,
        "at": state_in_words(list(map(np.array, state[1 : 1 + ARGUMENTS[name]]))),
        "yours": float(comparison.own[worst]),
        "right": float(comparison.right[worst]),
        "ratio": float(ratio[worst]),
        "tolerance": float(comparison.tolerance[worst]),
    }


def rounded(given: Given) -> tuple[int, float] | None:
    """To how many digits of their terms all agree, and the rtol to state if the constants are rounded.

    None where a quantity is off by more than that of its own largest entry: terms far from the origin are large, and a slip is
    small compared with them.
    """
    off = {name: np.abs(comparison.own - comparison.right) for name, comparison in given.compared.items()}
    worst = max(float(over(off[name], comparison.scale).max()) for name, comparison in given.compared.items())
    of_largest = max(
        float(over(off[name].max(), np.abs(comparison.right).max())) for name, comparison in given.compared.items()
    )
    if not 0.0 < worst <= 10.0**-LEAST_DIGITS or not of_largest <= 10.0**-LEAST_DIGITS:
        return None
    exponent = int(np.floor(np.log10(worst)))
    return int(-np.log10(worst)), float(f"{np.ceil(worst / 10.0**exponent):.0f}e{exponent}")
