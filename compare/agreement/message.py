"""What an AssertionError says, in the manner of numpy.testing."""

import numpy as np

from ..engines.own import ARGUMENTS, state_in_words
from .given import Compared, Given

LEAST_DIGITS = 2  # in common: then the constants may be rounded


def message(given: Given, cause: str) -> str:
    """How many entries of which quantity are off, the worst place, the probable cause, and what can be stated."""
    beside = f" + rtol={given.rtol:g}" if given.rtol else ""
    lines = ["", f"Not equal to MuJoCo to tolerance (64 eps{beside}) x the scale of each entry"]
    if not given.fails:
        lines = ["", "Equal to MuJoCo, but"]
    for name, one in given.compared.items():
        if (one.ratio > 1.0).any():
            lines += of_quantity(given, name, one)
    lines += given.problems
    if cause:
        lines.append(f"Probable cause: {cause}")
    if given.fails:
        lines += of_digits(given)
        lines.append(of_joints(given))
    return "\n".join(lines)


def of_quantity(given: Given, name: str, one: Compared) -> list[str]:
    """The entries of one quantity that are off."""
    ratio = one.ratio
    count, worst = int((ratio > 1.0).sum()), np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    own, right, off = one.own[worst], one.right[worst], abs(one.own[worst] - one.right[worst])
    entry, state = given.entries(name)[tuple(map(int, worst[1:]))], given.states[worst[0]]
    taken = ARGUMENTS[name]
    found = f"{ratio[worst]:.3g} times its tolerance of {one.tolerance[worst]:.2g}" if np.isfinite(off) else "no number"
    return [
        f"{name}: mismatched entries {count} / {ratio.size} ({100.0 * count / ratio.size:.3g} %), at "
        f"{int((ratio > 1.0).reshape(len(ratio), -1).any(axis=1).sum())} / {len(ratio)} states",
        f"  worst: {entry} at state {state.number}, {state_in_words(list(map(np.array, state[1 : 1 + taken])))}",
        f"    yours:  {float(own)!r}",
        f"    MuJoCo: {float(right)!r}",
        f"    difference: {off:.3g}, {found}",
    ]


def of_digits(given: Given) -> list[str]:
    """To how many digits all agree, and what to state if the constants are rounded."""
    worst = 0.0
    for one in given.compared.values():
        off = np.abs(one.own - one.right)
        worst = max(worst, float(np.divide(off, one.scale, out=np.where(off > 0, np.inf, 0.0), where=one.scale > 0).max()))
    digits = -np.log10(worst) if 0.0 < worst < np.inf else 0.0
    if digits < LEAST_DIGITS:
        return []
    exponent = int(np.floor(digits))
    first = np.ceil(worst * 10.0 ** (exponent + 1)) 
    rtol = float(f"{first:.0f}e-{exponent + 1}")
    return [f"Yours agree to {exponent} digits: if their constants are rounded so, state rtol={rtol:g}."]


def of_joints(given: Given) -> str:
    """In which joints it was compared, and how others are stated."""
    joints = [str(joint) for joint in given.joints.joints]
    if given.are_stated:
        return f"Compared with joints={joints}."
    first = given.joints.joints[0].name
    return f"Compared with joints={joints}; another order, sense, zero or unit is stated so: {'-' + first!r}, {first + '+90deg'!r}, {first + ' in deg'!r}."
