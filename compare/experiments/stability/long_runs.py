"""Long runs: a minute of energy, and how far Newton's method carries the implicit methods."""

import numpy as np

import tmt
from tmt.methods import METHODS

from .failure import BENT
from .limits import stiffest
from .linear import held
from .motion import diverged_at
from .parties import Party, finite
from .scenes import posture

FINE = 1e-3  # s
LONG = 60.0  # s
KEPT = 600  # points of a curve
DRIFTS = 3.0  # standard deviations
NEWTON = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0)  # s
NEWTON_SIZES = {"held, 1e-6 rad off": 1e-6, "held, 0.01 rad off": 1e-2, "held, 0.1 rad off": 0.1, "free": None}
OVERFLOWN = 1e100  # rad/s: the square of a rate that is faster is soon no number
IMPLICIT = tuple(name for name, stepping in METHODS.items() if hasattr(stepping, "newton"))


def long_run(party, dt, mujoco, duration=LONG) -> dict:
    """A minute of bent, free: the energy over time, and whether it stays bounded, drifts, or the run diverges."""
    steps = round(duration / dt)
    with np.errstate(over="ignore", invalid="ignore"):
        q, qd = party.run(mujoco, tmt.ARM, *BENT.start, BENT.tau, dt, steps)
        t = dt * np.arange(steps + 1)
        ended = diverged_at(BENT, t, q, qd)
        off = np.full(steps + 1, np.nan)
        alive = t < (np.inf if ended is None else ended)
        off[alive] = tmt.energy(q[alive], qd[alive])
    off -= off[0]
    every = max(1, steps // KEPT)
    kind, change = ("diverges", None) if ended is not None else behaviour(off)
    row = {
        "scene": BENT.name, "engine": party.engine, "method": party.method, "dt_s": dt, "energy": kind,
        "largest_j": None if ended is not None else float(np.abs(off).max()), "change_j": change, "diverged_at_s": ended,
    }  # fmt: skip
    return {"row": row, "t": t[::every], "off": off[::every], "seconds": duration}


def behaviour(off) -> tuple[str, float]:
    """Whether an energy drifts or stays bounded, and its change, J, from the first fifth of a run to the last.

    It drifts if the means of the two are apart by more than three standard deviations of either.
    """
    fifth = len(off) // 5
    first, last = off[:fifth], off[-fifth:]
    change = float(last.mean() - first.mean())
    return "drifts" if abs(change) > DRIFTS * max(first.std(), last.std()) else "bounded", change


def newton(name, dts=NEWTON, steps=2000) -> list:
    """Steps of an implicit method that Newton's method finds, of so many, against dt, in small and in large motion."""
    at = held("bent", posture("bent"))
    direction = stiffest(at)[1]
    rows = []
    for motion, size in NEWTON_SIZES.items():
        start, tau = (at.q, np.zeros(3)) if size is None else (at.q + size * direction, at.tau)
        for dt in dts:
            _, q, qd = tmt.simulate(start, np.zeros(3), tau, dt, steps, name)
            found = int(np.isfinite(q).all(axis=1).sum()) - 1
            rows.append({
                "method": name, "motion": motion, "dt_s": dt, "steps_found": found,
                "last_rad_per_s": finite(np.abs(qd[found]).max()), "steps": steps,
            })  # fmt: skip
    return rows


def judge_minutes(result, minutes) -> None:
    """The energy of a minute: an integrator of MuJoCo does as the same scheme in tmt does."""
    table = [run["row"] for run in minutes]
    result.tables["stability_energy"] = table
    result.curves["minutes"] = minutes
    kinds = {(row["engine"], row["method"], row["dt_s"]): row["energy"] for row in table}
    for row in (row for row in table if row["engine"] == "MuJoCo"):
        ours = kinds[("TMT", Party("MuJoCo", row["method"]).scheme, row["dt_s"])]
        where = f"{row['scene']}, MuJoCo {row['method']}, dt = {row['dt_s']:.4g} s"
        note = f"{row['energy']}, in TMT {ours}"
        quantity = "runs whose energy does as that of the same scheme in TMT"
        result.check(where, quantity, int(row["energy"] == ours), 1, "runs", note, rule="equal")
    for dt in sorted({row["dt_s"] for row in table}, reverse=True):
        mine = [row for row in table if row["dt_s"] == dt and row["engine"] == "TMT"]
        of_kind = {
            kind: [f"{row['method']} ({how_far(row)})" for row in mine if row["energy"] == kind]
            for kind in ("bounded", "drifts", "diverges")
        }
        told = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in of_kind.items() if names)
        result.notes.append(f"Energy over {minutes[0]['seconds']:g} s of {BENT.name}, at dt = {dt:.4g} s: {told}.")


def judge_newton(result, found) -> None:
    """The table of the steps that Newton's method finds, and what it says; nothing where none was taken."""
    table = [row for rows in found for row in rows]
    if table:
        result.tables["stability_newton"] = table
        result.notes.append(tell_newton(table))


def how_far(row) -> str:
    """How the energy of a minute behaves, in words."""
    if row["energy"] == "diverges":
        return f"at {row['diverged_at_s']:.2f} s"
    return f"within {row['largest_j']:.2g} J" if row["energy"] == "bounded" else f"by {row['change_j']:+.2g} J"


def tell_newton(table) -> str:
    """Up to which step Newton's method finds all stages, method by method and motion by motion, and why it fails."""
    told = []
    for name in dict.fromkeys(row["method"] for row in table):
        limits = []
        for motion in dict.fromkeys(row["motion"] for row in table):
            rows = [row for row in table if (row["method"], row["motion"]) == (name, motion)]
            failing = [row["dt_s"] for row in rows if row["steps_found"] < row["steps"]]
            last = max(row["dt_s"] for row in rows)
            limits.append(
                f"{motion}: fails from {min(failing):g} s" if failing else f"{motion}: never up to {last:g} s"
            )
        told.append(f"{name} ({'; '.join(limits)})")
    failed = [row for row in table if row["steps_found"] < row["steps"]]
    text = f"Newton's method in the implicit methods, {table[0]['steps']} steps at bent: {', '.join(told)}. "
    if not failed:
        return text + "It finds every stage."
    rates = [row["last_rad_per_s"] for row in failed if row["last_rad_per_s"] is not None]
    fast = sum(rate > OVERFLOWN for rate in rates)
    cause = (
        f"before it, the rates are beyond {OVERFLOWN:g} rad/s in {fast}"
        if fast
        else "before none of them do rates overflow"
    )
    return text + (
        f"It fails in {len(failed)} of {len(table)} runs, which are NaN from there; {cause}"
        + (f" (the fastest: {max(rates):.1e} rad/s)." if rates else ".")
    )
