"""The runs of each scene by each method and setting: their errors, their times, and the error that rounding leaves."""

import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

import tmt
from tmt.methods import METHODS

from ...core import timing
from ...engines import GRID, RECORDS, Dynamics, Engine, Method, Setting
from ...engines.outside.model import EngineError
from ...judge.rounding import growth
from ...judge.run import diverged_at
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import Reference, references
from ..setup import Setup
from . import accuracy
from .settings import MOST_SECONDS, coarsest_steps, estimated, methods, settings_of

GROWTH_STEPS = 16  # of the run whose growth is computed, between two recorded times
EACH_STEP = (
    12  # nv up to which the growth takes the Jacobian of every step; above, that of one in GROWTH_STEPS
)
FIRST_STEPS = 512  # a longer run of MuJoCo is timed over its first steps only


def measured(setup: Setup, cases: Sequence[Case]) -> tuple[Sequence[Case], Iterator[tuple]]:
    """The scenes, and `scene` of each. Different trees come first: their code compiles in parallel."""
    trees = [case.tree for case in cases]
    different_first = sorted(cases, key=lambda case: trees[: cases.index(case)].count(case.tree))
    return cases, setup.map(partial(scene, engines=setup.engines, size=setup.size), different_first)


def scene(case: Case, engines: Mapping[str, Engine], size: str) -> tuple:
    """Name, reference, error of rounding, rad, and rows of a scene, without times, by compiled methods."""
    reference = references([case])[case.name]
    left = max(floor(case, engines["tmt"].of(case)), reference.apart)
    return case.name, reference, left, rows_of_scene(case, engines, reference, left, size, "compiled")


def rows_of_scene(
    case: Case, engines: Mapping[str, Engine], reference: Reference, left: float, size: str, which: str
) -> list[dict]:
    """The rows of a scene, with times of what is called; left: the error that rounding or the reference leaves in it, rad."""
    rows, nq = [], case.coordinates.nq
    energy = tmt.energy(reference.high[:, :nq], reference.high[:, nq:], case.tree)
    for method in methods(engines, size, which, case.robot, case):
        best, last, of_precision = np.inf, 0, RECORDS[method.engine].eps / EPS
        for setting in settings_of(method, case, size):
            try:
                rows.append(row_of_run(case, engines, method, setting, reference, energy, left))
            except EngineError as failed:
                about = {"scene": case.name, "engine": method.engine, "method": method.name}
                rows.append(about | {"why_not": str(failed)})
                break
            error, work = (
                accuracy.error(rows[-1]),
                rows[-1]["evaluations"] or rows[-1]["steps"] or 2 * last + 1,
            )
            too_long = method.adaptive and work * estimated(method, case.tree) > MOST_SECONDS[size] / 2
            if RECORDS[method.engine].reads_file:
                too_long = rows[-1]["seconds"] > MOST_SECONDS[size]
            if too_long or accuracy.gained_nothing(error, work, best, last, left * of_precision):
                break
            best, last = min(best, error), work
    return rows if which == "called" else [row | {"seconds": None} for row in rows]


def row_of_run(
    case: Case, engines: Mapping, method: Method, setting: Setting, reference: Reference, energy, left=0.0
) -> dict:
    """The row of one run.

    energy: of the reference, J, (times,); left: the least error that a reference in doubles resolves, rad; smaller ones are
    set to it.
    """
    run, read = engines[method.engine].of(case).prepare(*case.start, case.tau, setting, method.name)
    with np.errstate(all="ignore"):
        begin = time.perf_counter()
        outcome = run()
        seconds = time.perf_counter() - begin
        motion = read(outcome)
        seconds = seconds if motion.seconds is None else motion.seconds
        ended = diverged_at(case, reference.t, motion.q, motion.v) is not None
        error = reference.error(motion.q, range(len(case.joints)))
        error = np.maximum(error, left) if reference.why else error
        off = 0.0 if ended else np.abs(tmt.energy(motion.q, motion.v, case.tree) - energy).max()
    return {
        "scene": case.name, "engine": method.engine, "method": method.name,
        "dt_s": setting.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
        "steps": motion.steps, "evaluations": motion.evaluations, "seconds": seconds, "timed_steps": motion.steps,
        "error_rad": None if ended else float(error[-1]), "worst_error_rad": None if ended else float(error.max()),
        "energy_error_J": None if ended else float(off), "diverged": ended,
        "early": float(error[reference.t <= accuracy.EARLY].max()), "run": (case, method, setting),
    }  # fmt: skip


def floor(case: Case, dynamics: Dynamics) -> float:
    """Error of the angles that rounding leaves: eps times the largest growth of a small difference up to each time, rad.

    dynamics: tmt's, run by RK4 with 1024 steps or as many as the scene needs; ValueError if the run diverges.
    """
    first = (
        GROWTH_STEPS
        * GRID
        * max(1, round(case.duration / 5.0), -(-coarsest_steps(case) // (GROWTH_STEPS * GRID)))
    )
    for steps in (first, 4 * first, 16 * first):
        dt = case.duration / steps
        motion = dynamics.run(*case.start, case.tau, dt, steps, "rk4")
        if np.isfinite(motion.q).all():
            stride = 1 if case.coordinates.nv <= EACH_STEP else GROWTH_STEPS
            grown = growth(METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, GROWTH_STEPS, stride)
            return float(EPS * 10.0 ** grown.max() * max(1.0, np.abs(motion.q).max()))
    raise ValueError(
        f"scene {case.name!r}: RK4 with {steps} steps does not reach its end; expected a shorter scene"
    )


def prepared(rows: list[dict], setup: Setup) -> list[tuple]:
    """(call, factor) of the rows of one scene: a run takes factor times as long as the call."""
    runs = []
    for case, method, setting in (row["run"] for row in rows):
        part = setting
        if method.engine == "mujoco" and setting.steps > FIRST_STEPS:  # each of its steps costs the same
            part = Setting(setting.duration * FIRST_STEPS / setting.steps, FIRST_STEPS)
        run, _ = setup.engines[method.engine].of(case).prepare(*case.start, case.tau, part, method.name)
        runs.append((run, setting.duration / part.duration))
    return runs


def take_times(rows: Sequence[dict], runs: Sequence[tuple], setup: Setup) -> None:
    """Set the seconds of the rows of one scene to the least of their times; runs: see `prepared`, timed in turns."""
    times = timing.in_turns([run for run, _ in runs], rounds=5)
    for row, (_, factor), of_row in zip(rows, runs, times):
        row["seconds"] = factor * min(of_row)
        row["timed_steps"] = row["steps"] and round(row["steps"] / factor)
