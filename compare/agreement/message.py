"""What an AssertionError says, in the manner of numpy.testing."""

import numpy as np

from ..engines.own import ARGUMENTS, state_in_words
from ..judge.check import over
from ..judge.words import listed
from .given import Compared, Given

LEAST_DIGITS = 2  # in common: then the constants may be rounded
MOST_LISTED = 8  # joints


def message(given: Given, cause: str, is_small: bool) -> str:
    """How many entries of which quantity are off, the worst place, the probable cause, and what can be stated."""
    beside = f" + rtol={given.rtol:g}" if given.rtol else ""
    lines = [f"Not equal to MuJoCo to tolerance (64 eps{beside}) x the scale of each entry"]
    if not given.fails:
        lines = ["Equal to MuJoCo, but"]
    for name, one in given.compared.items():
        if (one.ratio > 1.0).any():
            lines += lines_of_quantity(given, name, one)
    lines += given.problems
    if cause:
        lines.append(f"Probable cause: {cause}")
    if given.fails:
        lines += line_of_digits(given) * is_small
        lines.append(line_of_joints(given))
    return "\n".join(lines)


def lines_of_quantity(given: Given, name: str, one: Compared) -> list[str]:
    """The entries of one quantity that are off."""
    ratio = one.ratio
    count, worst = int((ratio > 1.0).sum()), np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    own, right, off = one.own[worst], one.right[worst], abs(one.own[worst] - one.right[worst])
    entry, state = given.entries(name)[tuple(map(int, worst[1:]))], given.states[worst[0]]
    taken = ARGUMENTS[name]
    allowed = f"{ratio[worst]:.3g} times its tolerance of {one.tolerance[worst]:.2g}"
    return [
        f"{name}: mismatched entries {count} / {ratio.size} ({100.0 * count / ratio.size:.3g} %), at "
        f"{int((ratio > 1.0).reshape(len(ratio), -1).any(axis=1).sum())} / {len(ratio)} states",
        f"  worst: {entry} at state {state.number}, {state_in_words(list(map(np.array, state[1 : 1 + taken])))}",
        f"    yours:  {float(own)!r}",
        f"    MuJoCo: {float(right)!r}",
        f"    difference: {off:.3g}, {allowed}" if np.isfinite(off) else "    yours is not a finite number",
    ]


def line_of_digits(given: Given) -> list[str]:
    """To how many digits all agree, and what to state if the constants are rounded.

    Not where a quantity is off by more than that of its own largest entry: terms far from the origin are large, and a slip is
    small beside them.
    """
    off = {name: np.abs(one.own - one.right) for name, one in given.compared.items()}
    worst = max(float(over(off[name], one.scale).max()) for name, one in given.compared.items())
    of_largest = max(float(over(off[name].max(), np.abs(one.right).max())) for name, one in given.compared.items())
    if not 0.0 < worst <= 10.0**-LEAST_DIGITS or not of_largest <= 10.0**-LEAST_DIGITS:
        return []
    exponent = int(np.floor(np.log10(worst)))
    rtol = float(f"{np.ceil(worst / 10.0**exponent):.0f}e{exponent}")
    digits = int(-np.log10(worst))
    return [f"Yours agree to {digits} digits of their terms: if your constants are rounded, state rtol={rtol:g}."]


def line_of_joints(given: Given) -> str:
    """In which joints it was compared, and how others are stated."""
    joints = given.joints.joints
    text = f"Compared with joints={[str(joint) for joint in joints]}"
    if len(joints) > MOST_LISTED and not given.are_stated:
        text = f"Compared with the {len(joints)} joints in the order of the model"
    kinds = dict(zip(given.coordinates.names, given.coordinates.all_kinds))
    straight = [joint for joint in joints if kinds[joint.name] != "ball"]
    if given.are_stated or not straight:
        return f"{text}."
    name, kind = straight[0].name, kinds[straight[0].name]
    forms = [f"-{name}", f"{name}+90deg", f"{name} in deg"] if kind == "hinge" else [f"-{name}", f"{name}+0.1m"]
    return f"{text}; another order, or {listed(list(map(repr, forms)))}, can be stated."
