"""How far a run is, and how long still: an estimate that corrects itself.

What it begins with is the last run of the same kind, if its report is the one that is replaced; otherwise what such a run took on
some other machine. Either is then scaled by what the ended tasks took on this one.
"""

import json
import math
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..process.clock import Clock

START, END = "start", "figures"  # what comes before the first experiment and after the last
# s by a watch from the start until each ends, of the assignment's arm on two cores: where an estimate begins, no more
AFTER_FULL = {
    START: 2.0, "parameters": 2.5, "published": 2.6, "kinematics": 6.8, "mass": 7.3, "gravity": 8.9, "acceleration": 10.4,
    "trajectory": 14.7, "diagnosis": 14.7, "stability": 38.2, "speed": 61.7, "reduction": 63.0, END: 65.4,
}  # fmt: skip
AFTER_QUICK = {
    START: 1.9, "parameters": 2.0, "published": 2.0, "kinematics": 2.9, "mass": 3.0, "gravity": 3.2, "acceleration": 3.5,
    "trajectory": 4.3, "diagnosis": 4.3, "stability": 5.6, "speed": 8.2, "reduction": 9.2, END: 9.8,
}  # fmt: skip
TRUST = 0.1  # of the whole: what is planned weighs as much as so much of it that has been seen
WITHOUT_EFFECT = ("--out",)  # options that change nothing of what is computed


class Remaining:
    """How long a run takes still. names: its experiments; plan: seconds until each of these and START and END end."""

    def __init__(self, clock: Clock, names: Sequence[str], plan: dict[str, float]):
        self.clock, self.names, self.plan = clock, names, plan

    @property
    def seconds(self) -> float | None:
        """An estimate of the seconds that are left; None: there is none, because the last task takes longer than it should."""
        ended = [name for name in self.clock.ended if name in self.plan]
        planned = max((self.plan[name] for name in ended), default=0.0)
        really = max((self.clock.ended[name] for name in ended), default=0.0)
        coming = [at for name, at in self.plan.items() if name not in ended]
        if not coming:
            return None
        whole = max(self.plan.values())
        pace = (really + TRUST * whole) / (planned + TRUST * whole)
        left = (whole - planned) * pace - (self.clock.elapsed - really)
        least = (whole - min(coming)) * pace  # what comes after the task that is under way
        return max(left, least) or None

    def words(self) -> list[str]:
        """How far and how long still: "4 of 11", "acceleration", "about 35 s left"; what is not known is left out."""
        now, seconds = self.clock.under_way, self.seconds
        number = 1 + sum(name in self.clock.ended for name in self.names)
        parts = [f"{number} of {len(self.names)}", now] if now in self.names else []
        return parts + ([f"about {in_words(seconds)} left"] if seconds else [])


def in_words(seconds: float) -> str:
    """A duration as rough as an estimate is."""
    if seconds < 10.0:
        return f"{max(round(seconds), 1)} s"
    return f"{5 * round(seconds / 5)} s" if seconds < 117.5 else f"{round(seconds / 60)} min"


def plan(names: Sequence[str], quick: bool, command: str, out: str | Path) -> dict[str, float]:
    """What a run may take: seconds until each of its tasks ends, START and END among them.

    command: of this run; out: the folder of the report that it replaces, which says what the last run took.
    """
    try:
        origin = json.loads((Path(out) / "results.json").read_text(encoding="utf-8"))["provenance"]
        found = {str(name): float(at) for name, at in origin["ended_after_s"].items()}
        are_times = all(0.0 <= at <= found[END] < math.inf for at in found.values()) and found[END] > 0.0
        if are_times and same_kind(command, str(origin["command"])):
            return found
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass
    return without_others(AFTER_QUICK if quick else AFTER_FULL, names)


def without_others(whole: dict[str, float], names: Sequence[str]) -> dict[str, float]:
    """What a run of some experiments may take, from what one of all takes."""
    taken, at, before = {}, 0.0, 0.0
    for name, ended in sorted(whole.items(), key=lambda item: item[1]):
        if name in (START, *names, END):
            at += ended - before
            taken[name] = round(at, 2)
        before = ended
    return taken


def same_kind(one: str, other: str) -> bool:
    """Whether two commands ask for the same, wherever it is written."""
    return asked(one) == asked(other)


def asked(command: str) -> list[str]:
    """The words of a command except for those that change nothing of what is computed, in one order."""
    words = shlex.split(command)
    for name in WITHOUT_EFFECT:
        words = [word for word in words if not word.startswith(f"{name}=")]
        while name in words:
            k = words.index(name)
            del words[k : k + 2]
    return sorted(words)
