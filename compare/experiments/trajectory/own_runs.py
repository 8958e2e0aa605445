"""The runs that there is time for with equations of a user's own, which may be slow."""

from collections.abc import Sequence

from ...case import Case
from ...setup import Setup
from .runs import recorded

SECONDS_OF_RUNS = {"full": 20.0, "quick": 4.0, "small": 2.0}  # of all scenes together, about
BESIDE_THEM = 1e-4  # s of an evaluation in a run, about, beside what the equations take themselves
STAGES_OF_RK4 = 4  # evaluations in a step of RK4


def within_time(setup: Setup, cases: Sequence[Case]) -> tuple[list[Case], tuple[int, ...], list[str]]:
    """The scenes that one's own equations can follow in time, the multiples of their steps, and sentences on what is left out."""
    said, able = [], [case for case in cases if case.scene.gravity]
    if len(able) < len(cases):
        names = "; ".join(case.name for case in cases if case not in able)
        said.append(f"Your equations have gravity in them; scenes without it are left out: {names}.")
    seconds, equations = SECONDS_OF_RUNS[setup.size], setup.engines["own"].equations
    parts = ("acceleration",) if equations.has("acceleration") else ("mass_matrix", "bias")
    each = BESIDE_THEM + sum(equations.times[part][0] for part in parts)

    def fits(count: int, finer: Sequence[int]) -> bool:
        """Whether there is time for the first scenes with these multiples of their steps."""
        return each * sum(evaluations(case, multiple) for case in able[:count] for multiple in finer) <= seconds

    count = max(k for k in range(len(able) + 1) if k == 0 or fits(k, setup.finer[:1]))
    finer = next(
        (setup.finer[:k] for k in range(len(setup.finer), 1, -1) if fits(count, setup.finer[:k])), setup.finer[:1]
    )
    if count < len(able):
        left = "; ".join(case.name for case in able[count:])
        said.append(f"Your equations are too slow for all scenes in {seconds:g} s; these are left out: {left}.")
    if len(finer) < len(setup.finer):
        left = ", ".join(f"{multiple}" for multiple in setup.finer[len(finer) :])
        said.append(
            f"Your equations are too slow for finer steps in {seconds:g} s: runs with {left} times the steps are left out."
        )
    return able[:count], finer, said


def evaluations(case: Case, multiple: int) -> int:
    """Of the accelerations, for the run, the one that starts beside it, and the recorded states."""
    return 2 * STAGES_OF_RK4 * case.steps * multiple + (STAGES_OF_RK4 + 1) * (recorded(case) + 1)
