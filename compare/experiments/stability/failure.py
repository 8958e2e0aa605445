"""Failures that a linear limit does not foresee, or that an engine does not report."""

import numpy as np

import tmt
from tmt.methods import METHODS

from .engine_linear import left_to_itself
from .limits import ALLOWED, STEPS, growth, stiffest
from .linear import held
from .motion import diverged_at
from .parties import Party
from .scenes import SCENES, posture

RESONANCE = np.sqrt(3.0)  # omega dt at which a swing takes three steps
EDGE = np.linspace(1.0, 2.03, 207)  # omega dt, across the linear limit of 2
NEAR = np.linspace(RESONANCE - 0.02, RESONANCE + 0.02, 41)
EDGE_SIZES = np.geomspace(1e-4, 3e-2, 16)  # rad
MOST = 1e300  # stands for the growth of a run that has diverged
SMALL, LARGE = 1e-6, 1e-3  # rad, of the perturbations that are compared at the resonance
BENT = next(scene for scene in SCENES if scene.name == "bent, free")
COARSE = 5 / 64  # s


def edge(party, mujoco, sizes, swings, steps=STEPS) -> np.ndarray:
    """Growth in so many steps at bent along the stiffest mode, (sizes, swings): size in rad, swing = omega dt."""
    at = held("bent", posture("bent"))
    omega, direction = stiffest(at)
    return np.array([
        [growth(party, mujoco, at, direction, swing / omega, size, steps) for swing in swings] for size in sizes
    ])  # fmt: skip


def own_reset(mujoco) -> dict:
    """Bent, free, by MuJoCo's Euler at 5/64 s with its automatic reset on: what a caller sees, and what gives it away."""
    steps = round(4 * BENT.duration / COARSE)
    run = left_to_itself(mujoco, *BENT.start, BENT.tau, COARSE, steps, "Euler")
    t = COARSE * np.arange(steps + 1)
    back = np.diff(run["time"]) <= 0.0
    first = int(np.argmax(back)) + 1 if back.any() else None
    _, *stopped = mujoco.trajectory(*BENT.start, BENT.tau, COARSE, steps, "Euler")
    return {
        **observed(t, run), "resets": int(back.sum()), "first_reset_s": None if first is None else float(t[first]),
        "finite": bool(np.isfinite(run["q"]).all()), "after_q": None if first is None else run["q"][first],
        "caught_at_s": diverged_at(BENT, t, *stopped),
    }  # fmt: skip


def observed(t, run) -> dict:
    """A run that MuJoCo is left to itself with: its energy, J, since when it is wrong, and when that is noticed, s.

    since_s: the first time at which it has gained more energy than the range of the potential, or its clock goes back.
    """
    fine = np.isfinite(np.concatenate([run["q"], run["qd"]], axis=1)).all(axis=1)
    energy = np.full(len(t), np.nan)
    energy[fine] = tmt.energy(run["q"][fine], run["qd"][fine])
    reach = float(np.ptp(tmt.potential_energy([posture("upright"), posture("hanging")])))
    wrong = ~(energy - energy[0] <= reach) | np.append(False, np.diff(run["time"]) <= 0.0)
    return {
        "t": t, "energy": energy, "clock": run["time"], "warnings": run["warnings"], "range": reach,
        "gain": float(np.nanmax(energy) - energy[0]), "since_s": float(t[np.argmax(wrong)]) if wrong.any() else None,
        "caught_in_it_s": caught(BENT, t, run),
    }  # fmt: skip


def caught(scene, t, run) -> float | None:
    """The first time at which MuJoCo's clock does not advance or the energy is beyond its physical bound, s."""
    back = np.append(False, np.diff(run["time"]) <= 0.0)
    times = [float(t[np.argmax(back)])] if back.any() else []
    beyond = diverged_at(scene, t, run["q"], run["qd"])
    return min(times + ([] if beyond is None else [beyond]), default=None)


def silent_gain(mujoco) -> dict:
    """Bent, free, by MuJoCo's `implicit` at 5/64 s: whether it gains energy, and the matrix it solves with.

    definite: the smallest eigenvalue of the symmetric part of Mbar + dt D + dt dh/dqd along the run in kg m2, for
    64, 128 and 256 steps in 5 s; None where the run is not finite.
    """
    definite, kept = {}, {}
    for count in (64, 128, 256):
        dt = BENT.duration / count
        run = left_to_itself(mujoco, *BENT.start, BENT.tau, dt, count, "implicit")
        fine = np.isfinite(np.concatenate([run["q"], run["qd"]], axis=1)).all(axis=1)
        rows = METHODS["implicit"].matrix(tmt.ARM, list(run["q"][fine].T), list(run["qd"][fine].T), dt)
        A = np.array([[np.broadcast_to(entry, fine.sum()) for entry in row] for row in rows]).transpose(2, 0, 1)
        smallest = np.full(count + 1, np.nan)
        smallest[fine] = np.linalg.eigvalsh(0.5 * (A + A.transpose(0, 2, 1)))[:, 0]
        definite[count] = float(smallest.min()) if fine.all() else None
        kept = kept or {**observed(dt * np.arange(count + 1), run), "smallest": smallest}
    return kept | {"definite": definite}


EDGES = (Party("TMT", "implicit"), Party("TMT", "semi_implicit_euler"))


def judge_near(result, found) -> None:
    """The resonance. found: of each party the growth (2, swings) from a small and a large perturbation, in `steps`."""
    steps = found["steps"]
    worst = {party.label: np.minimum(grown.max(axis=1), MOST) for party, grown in found["grown"].items()}
    for label, (small, large) in worst.items():
        where, quantity = f"bent, {label}, omega dt near sqrt 3", f"growth in {steps} steps from"
        result.check(where, f"{quantity} {SMALL:g} rad", small, ALLOWED, "fold")
        note = "" if large < MOST else f"diverges, for which {MOST:g} stands"
        result.check(where, f"{quantity} {LARGE:g} rad", large, ALLOWED, "fold", note, rule="at least")
    told = "; ".join(f"{label} {fold(small)} and {fold(large)}" for label, (small, large) in worst.items())
    result.notes.append(
        f"The nonlinear edge, at bent: at omega dt = sqrt 3 = {RESONANCE:.4f}, below the linear limit of 2, a swing of the "
        f"stiffest mode takes three steps, a 1:3 resonance. The largest growth near it in {steps} steps, from {SMALL:g} and "
        f"from {LARGE:g} rad: {told}."
    )


def fold(grown) -> str:
    """A growth in words."""
    if not grown < MOST:
        return "diverges"
    return f"{grown:.2f}-fold" if grown < 1e3 else f"{grown:.1e}-fold"


def judge_silent(result, reset, gain) -> None:
    """Failures that MuJoCo does not report: where one occurs, it must be caught at once."""
    for where, run in (("Euler, automatic reset on", reset), ("implicit", gain)):
        if run["since_s"] is not None:
            delay = None if run["caught_in_it_s"] is None else run["caught_in_it_s"] - run["since_s"]
            quantity = "time from a silent failure until it is caught"
            result.check(f"bent, free, MuJoCo {where}, dt = 5/64 s", quantity, delay, COARSE, "s")
    result.notes += [tell_reset(reset), tell_gain(gain)]
    result.curves["silent"] = {"reset": reset, "gain": gain}


def tell_reset(reset) -> str:
    """Whether MuJoCo starts a run again by itself, and what gives that away."""
    text = f"MuJoCo's default, bent, free, by Euler at 5/64 s with its automatic reset on, {reset['t'][-1]:.0f} s: "
    if not reset["resets"]:
        text += "it never starts again, "
        text += (
            "and no failure is silent"
            if reset["since_s"] is None
            else f"but is wrong from {at_time(reset['since_s'])} on"
        )
    else:
        angles = ", ".join(f"{angle:.1f}" for angle in np.degrees(reset["after_q"]))
        text += f"a silent failure. It starts again {times(reset['resets'])}, first at {reset['first_reset_s']:.2f} s, from "
        text += f"({angles}) deg; {'every number' if reset['finite'] else 'not every number'} is finite"
    text += f"; the counters of its warnings stand at {reset['warnings']}. Energy or clock show it at "
    return text + (
        f"{at_time(reset['caught_in_it_s'])}. With the reset off, as everywhere else in this report, the run "
        + ("does not diverge." if reset["caught_at_s"] is None else f"diverges at {at_time(reset['caught_at_s'])}.")
    )


def tell_gain(gain) -> str:
    """Whether `implicit` gains energy that is not there, and whether its matrix is definite."""
    silent, coarse = gain["since_s"] is not None, gain["definite"][64]
    least = ", ".join(f"{'none' if v is None else f'{v:.4f} kg m2'} at {n} steps" for n, v in gain["definite"].items())
    text = (
        f"MuJoCo's `implicit`, bent, free, at 5/64 s: in 5 s the energy rises by {gain['gain']:.3g} J at most, with "
        f"{gain['warnings']} warnings; the range of the arm's potential is {gain['range']:.1f} J. "
    )
    text += (
        "A silent failure" if silent and not gain["warnings"] else "A failure with warnings" if silent else "No failure"
    )
    if coarse is not None:
        text += f": the symmetric part of its matrix Mbar + dt dh/dqd {'loses' if coarse <= 0.0 else 'stays'} "
        text += "definiteness" if coarse <= 0.0 else "definite"
    return (
        text
        + f" (smallest eigenvalue in 5 s: {least}). The energy shows a failure at {at_time(gain['caught_in_it_s'])}."
    )


def times(count) -> str:
    """How often, in words."""
    return "once" if count == 1 else f"{count} times"


def at_time(seconds) -> str:
    """A time in words."""
    return "no time" if seconds is None else f"{seconds:.2f} s"
