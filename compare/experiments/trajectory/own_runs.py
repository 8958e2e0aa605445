"""The runs that there is time for with equations of a user's own, which may be slow."""

from collections.abc import Sequence

from ...judge.words import listed
from ...robots.case import Case
from ..setup import Setup
from .runs import counts, recorded

SECONDS_OF_RUNS = {"full": 20.0, "quick": 4.0, "small": 2.0}  # of all scenes together, about
BESIDE_THEM = 1e-4  # s of an evaluation in a run, about, beside what the equations take themselves
STAGES_OF_RK4 = 4  # evaluations in a step of RK4


def within_time(setup: Setup, cases: Sequence[Case], entries: int) -> tuple[list[Case], tuple[int, ...], list[str]]:
    """The scenes that one's own equations can follow in time, the multiples of their steps, and sentences on what is left out.

    entries: of the Jacobians of a run, see `counts`.
    """
    said, able = [], cases
    for left, why in (
        ([case for case in cases if case.controller], "Your equations have no actuators; scenes in which these act"),
        ([case for case in cases if not case.scene.gravity], "Your equations have gravity in them; scenes without it"),
    ):
        names = "; ".join(case.name for case in left if case in able)
        able = [case for case in able if case not in left]
        if names:
            said.append(f"{why} are left out: {names}.")
    seconds, equations = SECONDS_OF_RUNS[setup.size], setup.engines["own"].equations
    parts = ("acceleration",) if equations.has("acceleration") else ("mass_matrix", "bias")
    each = BESIDE_THEM + sum(equations.times[part][0] for part in parts)

    def takes(count: int, finer: Sequence[int]) -> float:
        """How long the first scenes take with these multiples of their steps, s."""
        runs = [(case, steps) for case in able[:count] for steps in counts(case, finer, entries)]
        return each * sum(evaluations(*run) for run in runs)

    count = max(k for k in range(len(able) + 1) if takes(k, setup.finer[:1]) <= seconds)
    few = max(k for k in range(1, len(setup.finer) + 1) if k == 1 or takes(count, setup.finer[:k]) <= seconds)
    if count < len(able):
        left = "; ".join(case.name for case in able[count:])
        said.append(f"Your equations are too slow for all scenes in {seconds:g} s; these are left out: {left}.")
    if few < len(setup.finer):
        left = listed([str(multiple) for multiple in setup.finer[few:]])
        said.append(
            f"Your equations are too slow for finer steps in {seconds:g} s: runs with {left} times the steps are left out."
        )
    return able[:count], setup.finer[:few], said


def evaluations(case: Case, steps: int) -> int:
    """Of the accelerations, for the run, the one that starts beside it, and the recorded states."""
    return 2 * STAGES_OF_RK4 * steps + (STAGES_OF_RK4 + 1) * (recorded(case) + 1)
