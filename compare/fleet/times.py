"""Where the time of a fleet goes, and how long it takes still."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from ..experiments import TIMED

# s that a piece takes of a robot with so many joints, before one of its kind has ended; other kinds
EXPECTED, FEW_SECONDS, JOINTS = (
    {"trajectory": 5.0, "stability": 3.0, "speed": 8.0, "reduction": 3.0, "report": 3.0},
    0.4,
    7,
)
AS_JOINTS = 3  # what a piece takes of any robot, as so many joints
Took = Mapping[str, Sequence[tuple[int, float]]]  # of the pieces that ended, by their kind: joints, s by a watch


class Spent(NamedTuple):
    """How the time of the workers was spent, of 1."""

    computing: float
    waiting: float  # while others measured time
    rest: float  # starting, handing out, waiting at the end

    def words(self, workers: int, took: float) -> str:
        of = f"{workers} x {took:.0f} s" if workers > 1 else f"{took:.0f} s"
        names = ("were computing", "were waiting while times were measured", "were neither")
        parts = [f"{percent} % {name}" for percent, name in zip(in_percent(self), names, strict=True) if percent]
        return f"Of {of} {', '.join(parts)}."


def time_of_workers(took_by_kind: Took, workers: int, took: float, times_alone: bool) -> Spent:
    """How the time of so many workers in so many seconds was spent; times_alone: all wait while a timed piece runs."""
    whole = workers * took
    timed = sum(wall for kind in TIMED for _, wall in took_by_kind.get(kind, ()))
    computing = min(sum(wall for each in took_by_kind.values() for _, wall in each) / whole, 1.0)
    waiting = min((workers - 1) * timed / whole if times_alone else 0.0, 1.0 - computing)
    return Spent(computing, waiting, 1.0 - computing - waiting)


def in_percent(parts: Sequence[float]) -> list[int]:
    """Shares of 1 in whole percent that add up to 100: those that lose most by it are rounded up."""
    found = [int(100.0 * part) for part in parts]
    by_loss = sorted(range(len(found)), key=lambda k: found[k] - 100.0 * parts[k])
    for k in by_loss[: 100 - sum(found)]:
        found[k] += 1
    return found


def seconds_left(
    took_by_kind: Took, still: Iterable[tuple[str, int | None]], workers: int, times_alone: bool
) -> float | None:
    """How long pieces take that have not ended, each with its kind and joints (None: not known); None before any has ended.

    What those of the same kind took so far is taken for as much as their joints; each kind begins with EXPECTED.
    """
    if not took_by_kind:
        return None
    rates, timed, others = {}, 0.0, 0.0
    for kind, joints in still:
        if kind not in rates:
            ended = [*took_by_kind.get(kind, ()), (JOINTS, EXPECTED.get(kind, FEW_SECONDS))]
            rates[kind] = sum(wall for _, wall in ended) / sum(AS_JOINTS + size for size, _ in ended)
        seconds = rates[kind] * (AS_JOINTS + (JOINTS if joints is None else joints))
        timed, others = (timed + seconds, others) if kind in TIMED else (timed, others + seconds / workers)
    return timed + others if times_alone else max(timed, others)
