"""Failures that MuJoCo does not report: a run that it resets, and `implicit` gaining energy."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

import tmt
from tmt import literal

from ...engines import LABELS, Engine
from ...engines.mujoco.linear import left_to_itself
from ...judge.check import About, Result
from ...judge.run import diverged_at, step_in_words
from ...judge.scale import gravity_scale
from ...robots.case import Case
from ...truth.postures import posture_names


def own_reset(case: Case, engines: Mapping[str, Engine]) -> dict:
    """A free motion by MuJoCo's Euler with its automatic reset on: what a caller sees, and what shows the failure."""
    dt, steps = case.scene.dt, 4 * case.steps
    dynamics = engines["mujoco"].of(case)
    run = left_to_itself(dynamics, *case.start, case.tau, dt, steps, "Euler")
    t = dt * np.arange(steps + 1)
    back = t[1:][np.diff(run["time"]) <= 0.0]
    stopped = dynamics.run(*case.start, case.tau, dt, steps, "Euler")
    return {
        **observed(case, t, run), "seconds": dt * steps,
        "resets": len(back), "first_reset_s": float(back[0]) if len(back) else None,
        "finite": bool(np.isfinite(run["q"]).all()), "caught_at_s": diverged_at(case, t, stopped.q, stopped.v),
    }  # fmt: skip


def observed(case: Case, t: np.ndarray, run: dict) -> dict:
    """A run of MuJoCo without this program's checks: its energy, J; when it fails and when that is detected, s.

    since_s: the first time at which it has gained more energy than the range of the potential, or its clock goes back.
    """
    fine = np.isfinite(np.concatenate([run["q"], run["qd"]], axis=1)).all(axis=1)
    energy = np.full(len(t), np.nan)
    energy[fine] = literal.energy(run["q"][fine], run["qd"][fine], case.tree)
    reach = potential_range(case)
    wrong = ~(energy - energy[0] <= reach) | np.append(False, np.diff(run["time"]) <= 0.0)
    return {
        "warnings": run["warnings"], "reach": reach, "gain": float(np.nanmax(energy) - energy[0]),
        "since_s": float(t[np.argmax(wrong)]) if wrong.any() else None, "caught_in_it_s": caught(case, t, run),
    }  # fmt: skip


@lru_cache(maxsize=16)
def potential_range(case: Case) -> float:
    """The highest less the lowest potential, J, found from the named postures, joint by joint."""
    starts = np.array([case.robot.posture(name) for name in posture_names(case.robot)])
    return highest_potential(case.tree, starts, 1.0) + highest_potential(case.tree, starts, -1.0)


def highest_potential(tree: tmt.Tree, q: np.ndarray, sign: float) -> float:
    """The highest value of sign x potential, J, that is reached from the postures q (k, n) by turning one joint after the other.

    V is a + b cos q_i + c sin q_i in each angle, so its derivatives there and a quarter of a turn on say where it is highest.
    """
    q, least, before = np.array(q), 1e-12 * gravity_scale(tree), -np.inf
    while ((now := sign * literal.potential_energy(q, tree)) > before + least).any():
        before = now
        for i, turn in enumerate(np.pi / 2 * np.eye(q.shape[1])):
            here, ahead = sign * literal.gravity_balance(np.array([q, q + turn]), tree)[..., i]
            q[:, i] += np.arctan2(here, -ahead)
    return float(now.max())


def caught(case: Case, t: np.ndarray, run: dict) -> float | None:
    """The first time at which MuJoCo's clock does not advance or the energy is beyond its physical bound, s."""
    back = np.append(False, np.diff(run["time"]) <= 0.0)
    times = [float(t[np.argmax(back)])] if back.any() else []
    beyond = diverged_at(case, t, run["q"], run["qd"])
    return min(times + ([] if beyond is None else [beyond]), default=None)


def silent_gain(case: Case, engines: Mapping[str, Engine]) -> dict:
    """A free motion by MuJoCo's `implicit`: whether it gains energy, and the matrix it solves with.

    definite: the smallest eigenvalue of the symmetric part of Mbar + dt D + dt dh/dqd along the run in kg m2, for the
    coarsest steps, twice and four times as many; None where the run is not finite.
    """
    definite, coarsest = {}, None
    for count in (case.steps, 2 * case.steps, 4 * case.steps):
        dt = case.duration / count
        run = left_to_itself(engines["mujoco"].of(case), *case.start, case.tau, dt, count, "implicit")
        coarsest = coarsest or observed(case, dt * np.arange(count + 1), run)
        if not np.isfinite([run["q"], run["qd"]]).all():
            definite[count] = None
            continue
        rows = tmt.METHODS["implicit"].matrix(case.tree, list(run["q"].T), list(run["qd"].T), dt)
        A = np.array([[np.broadcast_to(entry, count + 1) for entry in row] for row in rows]).transpose(2, 0, 1)
        definite[count] = float(np.linalg.eigvalsh(0.5 * (A + A.transpose(0, 2, 1)))[:, 0].min())
    least = definite[case.steps]
    return coarsest | {"seconds": case.duration, "definite": definite, "loses": None if least is None else least <= 0.0}


def check_silent(result: Result, case: Case, reset: dict, gain: dict) -> None:
    """Failures that MuJoCo does not report: where one occurs, it must be detected at once.

    Of a file's robot that is reported and not checked: the range of its potential is found by a search, and the bound of its
    energy by which a run is caught may be far above.
    """
    step = step_in_words(case, case.steps)
    for where, run in (("Euler, automatic reset on", reset), ("implicit", gain)):
        if run["since_s"] is not None and not case.robot.is_read:
            delay = None if run["caught_in_it_s"] is None else run["caught_in_it_s"] - run["since_s"]
            quantity, scene = (
                "time from a silent failure until it is caught",
                f"{case.name}, {LABELS['mujoco']} {where}, {step}",
            )
            result.check(scene, quantity, delay, case.scene.dt, "s", about=About.PREDICTION)
    result.find("automatic_reset", scene=case.name, step=step, run=reset)
    result.find("implicit_gain", scene=case.name, step=step, run=gain, noun=case.robot.noun)
