"""Failures that a linear limit does not foresee, or that an engine does not report."""

import dataclasses

import numpy as np

import tmt
from tmt.methods import METHODS

from .engine_linear import left_to_itself
from .limits import ALLOWED, growth, stiffest
from .linear import held
from .motion import diverged_at
from .parties import Party, finite
from .scenes import SCENES, posture

RESONANCE = np.sqrt(3.0)  # omega dt at which a swing takes three steps
EDGE = np.linspace(1.0, 2.03, 207)  # omega dt, across the linear limit of 2
NEAR = np.linspace(RESONANCE - 0.02, RESONANCE + 0.02, 41)
EDGE_SIZES = np.geomspace(1e-4, 3e-2, 16)  # rad
SMALL, LARGE = 1e-6, 1e-3  # rad, of the perturbations that are compared at the resonance
BENT = next(scene for scene in SCENES if scene.name == "bent, free")
COARSE, FINE = 5 / 64, 1e-3  # s
LONG = 60.0  # s
KEPT = 600  # points of a curve
NEWTON = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0)  # s
NEWTON_SIZES = {"held, 1e-6 rad off": 1e-6, "held, 0.01 rad off": 1e-2, "held, 0.1 rad off": 0.1, "free": None}


def edge(party, mujoco, sizes, swings) -> np.ndarray:
    """Growth in 2,000 steps at bent along the stiffest mode, (sizes, swings): size in rad, swing = omega dt."""
    at = held("bent", posture("bent"))
    omega, direction = stiffest(at)
    return np.array([[growth(party, mujoco, at, direction, swing / omega, size) for swing in swings] for size in sizes])


def own_reset(mujoco) -> dict:
    """Bent, free, by MuJoCo's Euler at 5/64 s with its automatic reset on: what a caller sees, and what gives it away."""
    steps = round(4 * BENT.duration / COARSE)
    run = left_to_itself(mujoco, *BENT.start, BENT.tau, COARSE, steps, "Euler")
    t = COARSE * np.arange(steps + 1)
    back = np.diff(run["time"]) <= 0.0
    first = int(np.argmax(back)) + 1 if back.any() else None
    _, *stopped = mujoco.trajectory(*BENT.start, BENT.tau, COARSE, steps, "Euler")
    return {
        "t": t, "energy": tmt.energy(run["q"], run["qd"]), "clock": run["time"], "warnings": run["warnings"],
        "resets": int(back.sum()), "first_reset_s": None if first is None else float(t[first]),
        "finite": bool(np.isfinite(run["q"]).all()), "after_q": None if first is None else run["q"][first],
        "caught_at_s": diverged_at(BENT, t, *stopped), "caught_in_it_s": caught(BENT, t, run),
    }  # fmt: skip


def caught(scene, t, run) -> float | None:
    """The first time at which MuJoCo's clock does not advance or the energy is beyond its physical bound, s."""
    back = np.append(False, np.diff(run["time"]) <= 0.0)
    times = [float(t[np.argmax(back)])] if back.any() else []
    beyond = diverged_at(scene, t, run["q"], run["qd"])
    return min(times + ([] if beyond is None else [beyond]), default=None)


def silent_gain(mujoco) -> dict:
    """Bent, free, by MuJoCo's `implicit` at 5/64 s: energy gained without a warning, and the matrix it solves with.

    definite: the smallest eigenvalue of the symmetric part of Mbar + dt D + dt dh/dqd along the run in kg m2, for
    64, 128 and 256 steps in 5 s.
    """
    definite = {}
    for count in (64, 128, 256):
        dt = BENT.duration / count
        run = left_to_itself(mujoco, *BENT.start, BENT.tau, dt, count, "implicit")
        rows = METHODS["implicit"].matrix(tmt.ARM, list(run["q"].T), list(run["qd"].T), dt)
        A = np.array([[np.broadcast_to(entry, count + 1) for entry in row] for row in rows]).transpose(2, 0, 1)
        smallest = np.linalg.eigvalsh(0.5 * (A + A.transpose(0, 2, 1)))[:, 0]
        definite[count] = float(smallest.min())
        if count == 64:
            t, energy = dt * np.arange(count + 1), tmt.energy(run["q"], run["qd"])
            kept = {"t": t, "energy": energy, "smallest": smallest, "warnings": run["warnings"]}
            kept |= {"caught_in_it_s": caught(BENT, t, run), "gain": float(energy.max() - energy[0])}
    heights = tmt.potential_energy([posture("upright"), posture("hanging")])
    return kept | {"definite": definite, "range": float(np.ptp(heights))}


def long_run(party, dt, mujoco) -> dict:
    """A minute of bent, free: the energy over time, and whether it stays bounded, drifts, or the run diverges.

    It drifts if its mean of the last fifth is off that of the first by more than three standard deviations of either.
    """
    steps = round(LONG / dt)
    with np.errstate(over="ignore", invalid="ignore"):
        q, qd = party.run(mujoco, tmt.ARM, *BENT.start, BENT.tau, dt, steps)
        t = dt * np.arange(steps + 1)
        ended = diverged_at(dataclasses.replace(BENT, duration=LONG), t, q, qd)
        off = np.full(steps + 1, np.nan)
        alive = t < (np.inf if ended is None else ended)
        off[alive] = tmt.energy(q[alive], qd[alive])
    off -= off[0]
    every = max(1, steps // KEPT)
    fifth = (steps + 1) // 5
    change = largest = None
    kind = "diverges"
    if ended is None:
        first, last = off[:fifth], off[-fifth:]
        change, largest = float(last.mean() - first.mean()), float(np.abs(off).max())
        kind = "drifts" if abs(change) > 3.0 * max(first.std(), last.std()) else "bounded"
    row = {
        "scene": BENT.name, "engine": party.engine, "method": party.method, "dt_s": dt, "energy": kind,
        "largest_j": largest, "change_j": change, "diverged_at_s": ended,
    }  # fmt: skip
    return {"row": row, "t": t[::every], "off": off[::every]}


def newton(name) -> list:
    """Steps of an implicit method that Newton's method finds, of 2,000, against dt, in small and in large motion."""
    at = held("bent", posture("bent"))
    direction = stiffest(at)[1]
    rows = []
    for motion, size in NEWTON_SIZES.items():
        start, tau = (at.q, np.zeros(3)) if size is None else (at.q + size * direction, at.tau)
        for dt in NEWTON:
            _, q, qd = tmt.simulate(start, np.zeros(3), tau, dt, 2000, name)
            found = int(np.isfinite(q).all(axis=1).sum()) - 1
            rows.append({
                "method": name, "motion": motion, "dt_s": dt, "steps_found": found,
                "last_rad_per_s": finite(np.abs(qd[found]).max()),
            })  # fmt: skip
    return rows


IMPLICIT = tuple(name for name, stepping in METHODS.items() if hasattr(stepping, "newton"))
EDGES = (Party("TMT", "implicit"), Party("TMT", "semi_implicit_euler"))


def judge(result, mujoco, near, minutes, found) -> None:
    """Checks, tables and sentences about the resonance, silent failure, a minute of motion and Newton's method."""
    worst = {}
    for party, grown in near.items():
        worst[party.label] = grown.max(axis=1)
        where = f"bent, {party.label}, omega dt near sqrt 3"
        result.check(where, f"growth in 2000 steps from {SMALL:g} rad", grown[0].max(), ALLOWED, "fold")
        if party.scheme == "implicit":
            missing = max(0.0, ALLOWED - min(grown[1].max(), 1e300))
            result.check(
                where, f"growth in 2000 steps from {LARGE:g} rad is less than 100-fold", missing, 0.0, "fold missing"
            )
    told = "; ".join(
        f"{label} {'diverges' if not np.isfinite(large) else f'grows {large:.1e}-fold'}"
        for label, (_, large) in worst.items()
    )
    result.notes.append(
        f"The nonlinear edge: at bent a perturbation of {LARGE:g} rad along the stiffest mode meets a 1:3 resonance at "
        f"omega dt = sqrt 3 = {RESONANCE:.4f} (a swing takes three steps), below the linear limit of 2. There {told}, "
        f"in 2000 steps; from {SMALL:g} rad all of them grow at most "
        f"{max(small for small, _ in worst.values()):.2f}-fold."
    )
    result.curves["near"] = {party.label: grown for party, grown in near.items()}

    reset, gain = own_reset(mujoco), silent_gain(mujoco)
    for where, run in (("Euler, automatic reset on", reset), ("implicit", gain)):
        missed = run["caught_in_it_s"] is None
        result.check(f"bent, free, MuJoCo {where}, dt = 5/64 s", "failure that is not caught", missed, 0.0, "runs")
    if reset["resets"]:
        alpha, beta, gamma = np.degrees(reset["after_q"])
        result.notes.append(
            "Silent failure, MuJoCo's default: bent, free, by Euler at 5/64 s with its automatic reset on. In "
            f"{reset['t'][-1]:.0f} s it starts again {reset['resets']} times, first at {reset['first_reset_s']:.2f} s, "
            f"from ({alpha:.1f}, {beta:.1f}, {gamma:.1f}) deg; "
            f"{'every number' if reset['finite'] else 'not every number'} is finite, and the counters of its warnings "
            f"stand at {reset['warnings']}. Caught at {at_time(reset['caught_in_it_s'])}, by the bound on the energy "
            "or its clock that goes back. With the reset off, as everywhere else in this report, the run is found to "
            f"have diverged at {at_time(reset['caught_at_s'])}."
        )
    least = ", ".join(f"{value:.4f} kg m2 at {count} steps" for count, value in gain["definite"].items())
    result.notes.append(
        f"Silent failure of `implicit`: the same at 5/64 s gains {gain['gain']:.0f} J in 5 s, on an arm whose whole "
        f"potential range is {gain['range']:.1f} J, with {gain['warnings']} warnings. Its matrix Mbar + dt dh/dqd "
        f"loses definiteness: the smallest eigenvalue of its symmetric part along 5 s is {least}. Caught at "
        f"{at_time(gain['caught_in_it_s'])} by the energy."
    )
    result.curves["silent"] = {"reset": reset, "gain": gain}

    table = [run["row"] for run in minutes]
    result.tables["stability_energy"] = table
    verdict = {(row["engine"], row["method"], row["dt_s"]): row["energy"] for row in table}
    for party, dt in {(Party(row["engine"], row["method"]), row["dt_s"]) for row in table if row["engine"] == "MuJoCo"}:
        other = verdict[("MuJoCo", party.method, dt)] != verdict[("TMT", party.scheme, dt)]
        where = f"bent, free, 60 s, {party.label}, dt = {dt:.4g} s"
        result.check(where, "energy does otherwise than its twin's", other, 0.0, "runs")
    for dt in sorted({row["dt_s"] for row in table}, reverse=True):
        mine = [row for row in table if row["dt_s"] == dt and row["engine"] == "TMT"]
        of_kind = {
            kind: [f"{row['method']} ({how_far(row)})" for row in mine if row["energy"] == kind]
            for kind in ("bounded", "drifts", "diverges")
        }
        told = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in of_kind.items() if names)
        result.notes.append(f"Energy over a minute of bent, free, at dt = {dt:.4g} s: {told}.")
    result.curves["minutes"] = minutes
    newton_table = [row for rows in found for row in rows]
    if newton_table:
        result.tables["stability_newton"] = newton_table
        result.notes.append(tell_newton(newton_table))


def how_far(row) -> str:
    """How the energy of a minute behaves, in words."""
    if row["energy"] == "diverges":
        return f"at {row['diverged_at_s']:.2f} s"
    return f"within {row['largest_j']:.2g} J" if row["energy"] == "bounded" else f"by {row['change_j']:+.2g} J"


def at_time(seconds) -> str:
    """A time in words."""
    return "no time" if seconds is None else f"{seconds:.2f} s"


def tell_newton(table) -> str:
    """Up to which step Newton's method finds all stages of 2,000 steps, method by method and motion by motion."""
    told = []
    for name in dict.fromkeys(row["method"] for row in table):
        limits = []
        for motion in NEWTON_SIZES:
            rows = [row for row in table if row["method"] == name and row["motion"] == motion]
            failing = [row["dt_s"] for row in rows if row["steps_found"] < 2000]
            limits.append(
                f"{motion}: fails from {min(failing):g} s" if failing else f"{motion}: never to {NEWTON[-1]:g} s"
            )
        told.append(f"{name} ({'; '.join(limits)})")
    fastest = max(row["last_rad_per_s"] for row in table)
    return (
        "The A-stable methods have no linear limit; what ends them is Newton's method, from the steps on at which it "
        f"does not find a stage of 2000 at bent: {', '.join(told)}. The run is NaN from there; its last rates are at "
        f"most {fastest:.1e} rad/s, so it has not overflowed."
    )
