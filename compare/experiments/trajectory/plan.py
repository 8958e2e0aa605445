"""Which runs of which scenes there is time for; the long work is started here."""

from collections.abc import Sequence
from functools import partial

from ...engines import one_of_each_scheme
from ...judge.finding import Finding
from ...robots.case import Case
from ...truth.reference import reference
from ..setup import Setup
from . import drift, many_digits, true_motion
from .runs import FEW_ENTRIES, MOST_ENTRIES, STEPS_AT_MOST, follow_and_draw, recorded, step_counts, steps_afforded

FEW_EXACT_STEPS = 8  # with many digits, in a small run
SECONDS_OF_OWN = {"full": 20.0, "quick": 4.0, "small": 2.0}  # of all runs of a user's own equations together, about
OVERHEAD_OF_OWN = 1e-4  # s of an evaluation in a run, about, beyond the equations themselves
STAGES_OF_RK4 = 4  # evaluations in a step of RK4


def begin(setup: Setup) -> None:
    """Start the long work, in parallel, while other experiments compute.

    A quick run takes fewer scenes and no run with many digits.
    """
    robot, engines = setup.robot, setup.engines
    entries = setup.of(MOST_ENTRIES, MOST_ENTRIES, FEW_ENTRIES)
    cases = [case for case in robot.cases if not (setup.is_quick and "full only" in case.scene.tags)]
    exact = [case for case in cases if "digits" in case.scene.tags]
    exact = setup.of(exact, [], exact[-1:])
    spread, finer, left_out = setup.map, setup.finer, []
    if robot.own:  # whose equations stay in this process
        spread, exact = map, []
        cases, finer, left_out = within_time(setup, cases, entries)
    schemes = [method.scheme for method in one_of_each_scheme(engines["mujoco"])]
    exact_steps = setup.of(many_digits.MOST_EXACT_STEPS, 0, FEW_EXACT_STEPS)
    true = [case for case in cases if true_motion.has_reference(case)]
    drift_steps = setup.of(drift.DRIFT_STEPS, drift.DRIFT_STEPS, drift.FEW_DRIFT_STEPS)
    setup.background["trajectory"] = {
        "runs": spread(partial(follow_and_draw, engines=engines, finer=finer, entries=entries), cases),
        "drift": spread(partial(drift.measure_drift, engines=engines, steps=drift_steps), [robot]),
        "true": ([case.name for case in true], spread(reference, true)),
        "left_out": left_out + shortened(cases, finer, entries),
        "exact": (exact, setup.map(partial(many_digits.exact_runs, schemes=schemes, most=exact_steps), exact)),
    }


def within_time(setup: Setup, cases: Sequence[Case], entries: int) -> tuple[list[Case], tuple[int, ...], list[Finding]]:
    """The scenes that a user's own equations can follow in time, the multiples of their steps, and what is left out.

    entries: of the Jacobians of a run, see `steps_afforded`.
    """
    left_out, able = [], cases
    for kind, unable in (
        ("own_without_actuators", [case for case in cases if case.controller]),
        ("own_with_gravity", [case for case in cases if not case.scene.gravity]),
    ):
        names = [case.name for case in unable if case in able]
        able = [case for case in able if case not in unable]
        if names:
            left_out.append(Finding("trajectory", kind, {"scenes": names}))
    seconds, equations = SECONDS_OF_OWN[setup.size], setup.engines["own"].equations
    parts = ("acceleration",) if equations.has("acceleration") else ("mass_matrix", "bias")
    each = OVERHEAD_OF_OWN + sum(equations.times[part][0] for part in parts)

    def takes(count: int, finer: Sequence[int]) -> float:
        """How long the first scenes take with these multiples of their steps, s."""
        runs = [(case, steps) for case in able[:count] for steps in step_counts(case, finer, entries)]
        return each * sum(evaluations(*run) for run in runs)

    count = max(k for k in range(len(able) + 1) if takes(k, setup.finer[:1]) <= seconds)
    few = max(k for k in range(1, len(setup.finer) + 1) if k == 1 or takes(count, setup.finer[:k]) <= seconds)
    if count < len(able):
        values = {"seconds": seconds, "scenes": [case.name for case in able[count:]]}
        left_out.append(Finding("trajectory", "own_too_slow", values))
    if few < len(setup.finer):
        values = {"seconds": seconds, "multiples": setup.finer[few:]}
        left_out.append(Finding("trajectory", "own_too_slow_for_finer_steps", values))
    return able[:count], setup.finer[:few], left_out


def evaluations(case: Case, steps: int) -> int:
    """Of the accelerations, for the run, the one from a perturbed start, and the recorded states."""
    return 2 * STAGES_OF_RK4 * steps + (STAGES_OF_RK4 + 1) * (recorded(case) + 1)


def shortened(cases: Sequence[Case], finer: Sequence[int], entries: int = MOST_ENTRIES) -> list[Finding]:
    """Which scenes run with fewer step sizes than others, and which are judged for fewer steps than they have."""
    without, findings = {}, []
    for case in cases:
        if len(step_counts(case, finer, entries)) < len(finer):
            without.setdefault(min(STEPS_AT_MOST, steps_afforded(case, entries)), []).append(case.name)
    for most, names in without.items():
        findings.append(Finding("trajectory", "no_finer_steps", {"most": most, "scenes": names}))
    judged = {case.name: steps_afforded(case, entries) for case in cases if case.steps > steps_afforded(case, entries)}
    if judged:
        findings.append(Finding("trajectory", "judged_in_part", {"steps": judged}))
    return findings
