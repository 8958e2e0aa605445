"""What each held posture is, what one step of each method does there, and a run from it that MuJoCo resets without an error."""

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...engines import LABELS, Engine, one_of_each_scheme
from ...engines.mujoco.calls import NUDGE, left_to_itself, transition
from ...judge.run import diverged_at, step_in_words
from ...judge.scale import EPS, FACTOR
from ...robots.case import Case
from ...stability.held import held, is_runge_kutta, posture_names
from ..setup import Setup
from .subjects import DAMPINGS, coarsest_case, mujoco_of, subjects_of

FINE_STEP, FINE_DAMPED_STEP = 1e-2, 5e-4  # s: amplifications compared; the second with much damping
MOST_OF_A_STEP = 100.0  # fold: later stages are too far away for a difference quotient
SLOW = 1e-3  # 1/s: slower rates are not reported


def check_equilibria(result: Result, setup: Setup) -> None:
    """The kind of each held posture; TMT's amplification of a step compared with MuJoCo's."""
    mujoco, robot = setup.engines["mujoco"], subjects_of(setup.robot).robot
    usual = (FINE_STEP, coarsest_case(robot).scene.dt)
    for name in posture_names(robot):
        at = held(robot, name)
        values = at.modes[0]
        grows = [float(v.real) for v in values if v.real > SLOW and v.imag >= 0.0]
        swings = [float(v) for v in values.imag if v > SLOW]
        result.find("posture", name=name, equilibrium=at.kind, grows=grows, swings=swings)
        for damping, steps in zip(DAMPINGS, (usual, usual, (FINE_DAMPED_STEP,))):
            at = held(robot, name, damping)
            for method, dt in product(one_of_each_scheme(mujoco), steps):
                stepping = METHODS[method.scheme]
                if is_runge_kutta(stepping) and at.growth(method.scheme, dt) > MOST_OF_A_STEP:
                    continue
                theirs = transition(mujoco_of(setup.engines, at.case), at.q, at.tau, dt, method.name)
                where = f"{name}, {method.name}, dt = {dt:.4g} s, damping {damping:g}"
                check_amplification(result, where, at.sizes, at.step(method.scheme, dt), theirs)


def check_amplification(
    result: Result, where: str, q: np.ndarray, ours: np.ndarray, theirs: np.ndarray
) -> None:
    """The check of one amplification: within what rounding does to a difference quotient."""
    allowed = FACTOR * EPS * (1.0 + np.abs(q).max()) * np.abs(ours).max() / NUDGE
    quantity = "amplification of one step, TMT to MuJoCo"
    result.check(where, quantity, np.abs(ours - theirs).max(), allowed, "", rounding=True)


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
