"""A failure that MuJoCo does not report: a run that it resets."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...core.check import About, Result
from ...engines import LABELS, Engine
from ...engines.mujoco.differences import left_to_itself
from ...judge.run import diverged_at, step_in_words
from ...robots.case import Case
from .subjects import mujoco_of


class OwnReset(NamedTuple):
    """A run with the automatic reset on. first_reset, caught: s, when MuJoCo resets it, when its energy is impossible."""

    seconds: float
    resets: int
    first_reset: float | None
    finite: bool
    warnings: int
    caught: float | None


def own_reset(case: Case, engines: Mapping[str, Engine]) -> OwnReset:
    """A free motion by MuJoCo's Euler with its automatic reset on: when MuJoCo restarts it, and when its energy is impossible."""
    dt, steps = case.scene.dt, 4 * case.steps
    run = left_to_itself(mujoco_of(engines, case), *case.start, case.tau, dt, steps, "Euler")
    t = dt * np.arange(steps + 1)
    back = t[1:][np.diff(run["time"]) <= 0.0]
    return OwnReset(
        seconds=dt * steps, resets=len(back), first_reset=float(back[0]) if len(back) else None,
        finite=bool(np.isfinite(run["q"]).all()), warnings=run["warnings"],
        caught=diverged_at(case, t, run["q"], run["qd"]),
    )  # fmt: skip


def check_reset(result: Result, case: Case, run: OwnReset) -> None:
    """Where MuJoCo restarts a run, the bound on energy must have detected the failure."""
    step = step_in_words(case, case.steps)
    if run.first_reset is not None:
        delay = None if run.caught is None else run.caught - run.first_reset
        where = f"{case.name}, {LABELS['mujoco']} Euler, automatic reset on, {step}"
        quantity = "time from a silent failure until it is caught"
        result.check(where, quantity, delay, case.scene.dt, "s", about=About.PREDICTION)
    result.find("automatic_reset", scene=case.name, step=step, run=run)
