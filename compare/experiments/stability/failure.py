"""Failures that a linear limit does not foresee, or that an engine does not report."""

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

import tmt
from tmt import literal

from ...engines import LABELS, Engine, Method
from ...engines.mujoco.linear import left_to_itself
from ...judge.check import About, Result
from ...judge.run import diverged_at, step_in_words
from ...judge.scale import gravity_scale
from ...robots import Robot
from ...robots.case import Case
from ...truth.linear import Held
from ...truth.postures import posture_names
from .choice import fraction
from .growth import GROWTH_STEPS, LINEAR_DEVIATION, growth_in_run, stiffest
from .limits import GROWTH_ALLOWED

RESONANCE = np.sqrt(3.0)  # omega dt at which a swing takes three steps
RESONANT_SWINGS = np.linspace(RESONANCE - 0.02, RESONANCE + 0.02, 41)
EDGE_SCHEMES = ("implicit", "semi_implicit_euler")  # whose linear limit is an omega dt of 2
EDGE_SWINGS = np.linspace(1.0, 2.03, 207)  # omega dt, across the linear limit of 2
EDGE_SIZES = np.geomspace(1e-4, 3e-2, 16)  # rad
LARGE_DEVIATION = 1e-3  # rad, with which a small one is compared at the resonance
DIVERGED_GROWTH = 1e300  # stands for the growth of a run that has diverged


def edge_growth(
    method: Method,
    at: Held,
    engines: Mapping[str, Engine],
    sizes: Sequence[float],
    swings: Sequence[float],
    steps: int = GROWTH_STEPS,
) -> np.ndarray:
    """Growth in so many steps along the stiffest mode of a posture, (sizes, swings): size in rad, swing = omega dt."""
    omega, direction = stiffest(at)
    return np.array([
        [growth_in_run(method, engines, at, direction, swing / omega, size, steps) for swing in swings] for size in sizes
    ])  # fmt: skip


def own_reset(case: Case, engines: Mapping[str, Engine]) -> dict:
    """A free motion by MuJoCo's Euler with its automatic reset on: what a caller sees, and what gives it away."""
    dt, steps = case.scene.dt, 4 * case.steps
    dynamics = engines["mujoco"].of(case)
    run = left_to_itself(dynamics, *case.start, case.tau, dt, steps, "Euler")
    t = dt * np.arange(steps + 1)
    back = np.diff(run["time"]) <= 0.0
    first = int(np.argmax(back)) + 1 if back.any() else None
    stopped = dynamics.run(*case.start, case.tau, dt, steps, "Euler")
    return {
        **observed(case, t, run), "resets": int(back.sum()), "first_reset_s": None if first is None else float(t[first]),
        "finite": bool(np.isfinite(run["q"]).all()), "after_q": None if first is None else run["q"][first],
        "caught_at_s": diverged_at(case, t, stopped.q, stopped.v),
    }  # fmt: skip


def observed(case: Case, t: np.ndarray, run: dict) -> dict:
    """A run that MuJoCo is left to itself with: its energy, J, since when it is wrong, and when that is noticed, s.

    since_s: the first time at which it has gained more energy than the range of the potential, or its clock goes back.
    """
    fine = np.isfinite(np.concatenate([run["q"], run["qd"]], axis=1)).all(axis=1)
    energy = np.full(len(t), np.nan)
    energy[fine] = literal.energy(run["q"][fine], run["qd"][fine], case.tree)
    reach = potential_range(case)
    wrong = ~(energy - energy[0] <= reach) | np.append(False, np.diff(run["time"]) <= 0.0)
    return {
        "case": case, "t": t, "energy": energy, "clock": run["time"], "warnings": run["warnings"], "range": reach,
        "gain": float(np.nanmax(energy) - energy[0]), "since_s": float(t[np.argmax(wrong)]) if wrong.any() else None,
        "caught_in_it_s": caught(case, t, run),
    }  # fmt: skip


@lru_cache(maxsize=16)
def potential_range(case: Case) -> float:
    """The highest less the lowest potential, J: what the named postures lead to, joint by joint to where it is extreme."""
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
        fine = np.isfinite(np.concatenate([run["q"], run["qd"]], axis=1)).all(axis=1)
        rows = tmt.METHODS["implicit"].matrix(case.tree, list(run["q"][fine].T), list(run["qd"][fine].T), dt)
        A = np.array([[np.broadcast_to(entry, fine.sum()) for entry in row] for row in rows]).transpose(2, 0, 1)
        smallest = np.full(count + 1, np.nan)
        smallest[fine] = np.linalg.eigvalsh(0.5 * (A + A.transpose(0, 2, 1)))[:, 0]
        definite[count] = float(smallest.min()) if fine.all() else None
        coarsest = coarsest or {**observed(case, dt * np.arange(count + 1), run), "smallest": smallest}
    return coarsest | {"definite": definite}


def check_near(result: Result, robot: Robot, posture: str, found: dict) -> None:
    """The resonance. found: of each method the growth (2, swings) from a small and a large deviation, in `steps`.

    That a large one grows is a property of the robot: a check where it is known to.
    """
    steps = found["steps"]
    worst = {method.label: np.minimum(grown.max(axis=1), DIVERGED_GROWTH) for method, grown in found["grown"].items()}
    for label, (small, large) in worst.items():
        where, quantity = f"{posture}, {label}, omega dt near sqrt 3", f"growth in {steps} steps from"
        result.check(
            where, f"{quantity} {LINEAR_DEVIATION:g} rad", small, GROWTH_ALLOWED, "fold", about=About.PREDICTION
        )
        if robot.kinds.get("resonant") == posture:
            note = "" if large < DIVERGED_GROWTH else f"diverges, for which {DIVERGED_GROWTH:g} stands"
            result.check(
                where, f"{quantity} {LARGE_DEVIATION:g} rad", large, GROWTH_ALLOWED, "fold", note, rule="at least",
                about=About.PREDICTION,
            )  # fmt: skip
    by_method = "; ".join(f"{label} {fold(small)} and {fold(large)}" for label, (small, large) in worst.items())
    result.notes.append(
        f"The nonlinear edge, at {posture}: at omega dt = sqrt 3 = {RESONANCE:.4f}, below the linear limit of 2, a swing of the "
        f"stiffest mode takes three steps, a 1:3 resonance. The largest growth near it in {steps} steps, from "
        f"{LINEAR_DEVIATION:g} and from {LARGE_DEVIATION:g} rad: {by_method}."
    )


def fold(grown: float) -> str:
    """A growth in words."""
    if not grown < DIVERGED_GROWTH:
        return "diverges"
    return f"{grown:.2f}-fold" if grown < 1e3 else f"{grown:.1e}-fold"


def check_silent(result: Result, reset: dict, gain: dict) -> None:
    """Failures that MuJoCo does not report: where one occurs, it must be caught at once.

    Of a robot of a file that is told and not checked: how far its potential reaches is found by a search, and the bound of its
    energy by which a run is caught may be far above.
    """
    for where, run in (("Euler, automatic reset on", reset), ("implicit", gain)):
        if run["since_s"] is not None and not run["case"].robot.is_read:
            case, delay = run["case"], None
            if run["caught_in_it_s"] is not None:
                delay = run["caught_in_it_s"] - run["since_s"]
            quantity = "time from a silent failure until it is caught"
            where = f"{case.name}, {LABELS['mujoco']} {where}, {step_in_words(case, case.steps)}"
            result.check(where, quantity, delay, case.scene.dt, "s", about=About.PREDICTION)
    result.notes += [reset_in_words(reset), gain_in_words(gain)]
    result.curves["silent"] = {"reset": reset, "gain": gain}


def is_silent(runs: Mapping[str, dict]) -> bool:
    """Whether one of the two runs fails."""
    return any(run["since_s"] is not None for run in runs.values())


def reset_in_words(reset: dict) -> str:
    """Whether MuJoCo starts a run again by itself, and what gives that away."""
    case = reset["case"]
    text = f"MuJoCo's default, {case.name}, by Euler at {fraction(case.duration, case.scene.dt)} s with its automatic reset "
    text += f"on, {reset['t'][-1]:.0f} s: "
    if not reset["resets"]:
        text += "it never starts again, "
        text += (
            "and no failure is silent"
            if reset["since_s"] is None
            else f"but is wrong from {at_time(reset['since_s'])} on"
        )
    else:
        angles = ", ".join(f"{angle:.1f}" for angle in np.degrees(reset["after_q"]))
        text += (
            f"a silent failure. It starts again {how_often(reset['resets'])}, first at {reset['first_reset_s']:.2f} s, "
        )
        text += f"from ({angles}) deg; {'every number' if reset['finite'] else 'not every number'} is finite"
    text += f"; the counters of its warnings stand at {reset['warnings']}. Energy or clock show it at "
    return text + (
        f"{at_time(reset['caught_in_it_s'])}. With the reset off, as everywhere else in this report, the run "
        + ("does not diverge." if reset["caught_at_s"] is None else f"diverges at {at_time(reset['caught_at_s'])}.")
    )


def gain_in_words(gain: dict) -> str:
    """Whether `implicit` gains energy that is not there, and whether its matrix is definite."""
    case, silent, coarse = gain["case"], gain["since_s"] is not None, gain["definite"][min(gain["definite"])]
    least = ", ".join(f"{'none' if v is None else f'{v:.4f} kg m2'} at {n} steps" for n, v in gain["definite"].items())
    text = (
        f"MuJoCo's `implicit`, {case.name}, at {fraction(case.duration, case.scene.dt)} s: in {case.duration:g} s the energy "
        f"rises by {gain['gain']:.3g} J at most, with {gain['warnings']} warnings; the range of the {case.robot.noun}'s "
        f"potential is {gain['range']:.1f} J. "
    )
    text += (
        "A silent failure" if silent and not gain["warnings"] else "A failure with warnings" if silent else "No failure"
    )
    if coarse is not None:
        text += f": the symmetric part of its matrix Mbar + dt dh/dqd {'loses' if coarse <= 0.0 else 'stays'} "
        text += "definiteness" if coarse <= 0.0 else "definite"
    return text + (
        f" (smallest eigenvalue in {case.duration:g} s: {least}). The energy shows a failure at "
        f"{at_time(gain['caught_in_it_s'])}."
    )


def how_often(count: int) -> str:
    """How often, in words."""
    return "once" if count == 1 else f"{count} times"


def at_time(seconds: float | None) -> str:
    """A time in words."""
    return "no time" if seconds is None else f"{seconds:.2f} s"
