"""The one number of each experiment, for its line on the first screen, computed from its result."""

import math
from collections.abc import Callable
from contextlib import suppress

from ..judge.check import Result
from .engines_apart import largest_known
from .methods_compared import best_curves, cheapest_of_curves, known_limits, limits_found
from .overview import times_in_print
from .text import say
from .verdict import Section


def one_number(section: Section) -> str:
    """The number of a section, with its unit; how many checks pass where its result has no such number."""
    if section.result.headline:
        return say(section.result.headline)
    find, found = FINDERS.get(section.name), ""
    if find and section.result.rows:
        with suppress(KeyError, TypeError):  # rows without the columns of which that number is
            found = find(section.result)
    return found or of_checks(section.result)


def of_checks(result: Result) -> str:
    """How many checks pass, and how much of a tolerance is used at most."""
    used = [check.over_tolerance for check in result.checks if check.over_tolerance is not None and check.passed]
    passing = sum(check.passed for check in result.checks)
    if not result.checks:
        return ""
    most = f", at most {share_in_words(max(used))} of a tolerance" if used else ""
    return f"{passing} of {len(result.checks)} checks pass{most}"


def share_in_words(share: float) -> str:
    """A share of a tolerance: in share_in_words, or as a multiple where it is more."""
    return f"{times_in_print(share)} times" if share > 1.0 else f"{100 * share:.2g} %"


def of_parameters(result: Result) -> str:
    """How many numbers are as stated to the last bit, and which is farthest off."""
    rows = [row for row in result.rows if row.get("stated") is not None and not row.get("asked_by")]
    if not rows:
        return ""
    off = [row for row in rows if row["difference"] != 0.0]
    same = f"{len(rows) - len(off)} of {len(rows)} numbers equal to the last bit"
    if not off:
        return f"{len(rows)} numbers equal to the last bit"
    # beside the largest of its kind, as its tolerance is: what rounding leaves of a stated zero is not the farthest
    size = {}
    for row in rows:
        kind = row["of"], row["quantity"]
        size[kind] = max(size.get(kind, 0.0), abs(row["stated"]))
    top = max(off, key=lambda row: over_size(abs(row["difference"]), size[row["of"], row["quantity"]]))
    where = " ".join(filter(None, (top["quantity"], top["component"])))
    return f"{same}; {where} of {top['of']} is {abs(top['difference']):.2g} {top['unit']}".rstrip() + " off"


def over_size(difference: float, size: float) -> float:
    """A difference beside its size; inf where nothing is stated."""
    return difference / size if size else math.inf


def of_published(result: Result) -> str:
    """How many of the printed numbers both engines meet."""
    met = sum(
        all(abs(row[name] - row["published"]) <= row["tolerance"] for name in ("tmt", "mujoco")) for row in result.rows
    )
    return f"{met} of {len(result.rows)} printed numbers met by both"


def of_agreement(result: Result) -> str:
    """The difference that comes closest to its tolerance, or is farthest beyond it."""
    missing = [row for row in result.rows if row["worst_difference"] is None]
    if missing:
        return f"{missing[0]['quantity']}: no number"
    known = [row for row in result.rows if row["difference_over_bar"] is not None]
    if not known:
        return ""
    top = max(known, key=lambda row: row["difference_over_bar"])
    share = top["difference_over_bar"]
    apart = f"{top['worst_difference']:.2g} {top['unit']}".rstrip()
    return f"{apart} apart in {top['quantity']}: {share_in_words(share)}{' of' if share <= 1.0 else ''} the tolerance"


def of_trajectory(result: Result) -> str:
    """How much of the band of rounding the runs use, of how many scenes."""
    share = largest_known([row["difference_over_band"] for row in result.rows])
    scenes = len({row["scene"] for row in result.rows})
    if share is None:
        return ""
    of = "" if share > 1.0 else "of "
    return (
        f"{scenes} {'scenes' if scenes > 1 else 'scene'}, {share_in_words(share)} {of}the rounding band apart at most"
    )


def of_diagnosis(result: Result) -> str:
    """The first explanation."""
    more = f" and {len(result.rows) - 1} more" if len(result.rows) > 1 else ""
    return f"explained by: {result.rows[0]['place']}{more}"


def of_speed(result: Result) -> str:
    """What is cheapest within the error asked for."""
    return cheapest_of_curves(best_curves(result), result.curves.get("unit", "rad"), result.curves.get("regular"))


def of_stability(result: Result) -> str:
    """How many limits of the step are as predicted, and how nearly."""
    found = limits_found(result)
    known, wrong = known_limits(found), [one for one in found if not one.passed]
    if wrong:
        return f"{len(wrong)} of {len(found)} step limits not as predicted"
    off = max((abs(one.observed / one.predicted - 1.0) for one in known), default=0.0)
    return f"{len(known)} step limits predicted within {100 * off:.2g} %" if known else ""


def of_reduction(result: Result) -> str:
    """How many times faster a step becomes at most without what a scene does not need."""
    rows = [row for row in result.rows if (row.get("speedup") or 0.0) >= 1.05]  # less is the clock's
    if not rows:
        return ""
    top = max(rows, key=lambda row: row["speedup"])
    return f"a step is up to {top['speedup']:.2g} times as fast with {top['hinges']} alone ({top['scene']})"


FINDERS: dict[str, Callable[[Result], str]] = {
    "parameters": of_parameters,
    "published": of_published,
    "kinematics": of_agreement,
    "mass": of_agreement,
    "gravity": of_agreement,
    "acceleration": of_agreement,
    "trajectory": of_trajectory,
    "diagnosis": of_diagnosis,
    "speed": of_speed,
    "stability": of_stability,
    "reduction": of_reduction,
}
