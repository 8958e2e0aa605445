"""Long runs: a minute of energy, and how far Newton's method carries the implicit methods."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt import literal

from ...engines import Engine, Method
from ...judge.check import Result
from ...judge.run import diverged_at, number_or_none
from ...robots.case import Case
from ...truth.linear import Held
from .choice import who
from .growth import stiffest

FINE_STEP = 1e-3  # s
MINUTE = 60.0  # s
CURVE_POINTS = 600
DRIFT_DEVIATIONS = 3.0  # standard deviations
NEWTON_STEPS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0)  # s
NEWTON_SIZES = {"held, 1e-6 rad off": 1e-6, "held, 0.01 rad off": 1e-2, "held, 0.1 rad off": 0.1, "free": None}
OVERFLOWN = 1e100  # rad/s: the square of a rate that is faster is soon no number


def long_run(method: Method, dt: float, case: Case, engines: Mapping[str, Engine], duration: float = MINUTE) -> dict:
    """A minute of a free motion: the energy over time, and whether it stays bounded, drifts, or the run diverges."""
    steps = round(duration / dt)
    with np.errstate(over="ignore", invalid="ignore"):
        t, q, qd, *_ = engines[method.engine].of(case).run(*case.start, case.tau, dt, steps, method.name)
        ended = diverged_at(case, t, q, qd)
        off = np.full(steps + 1, np.nan)
        alive = t < (np.inf if ended is None else ended)
        off[alive] = literal.energy(q[alive], qd[alive], case.tree)
    off -= off[0]
    every = max(1, steps // CURVE_POINTS)
    kind, change = ("diverges", None) if ended is not None else behaviour(off)
    row = {
        "scene": case.name, "engine": method.engine, "method": method.name, "dt_s": dt, "energy": kind,
        "largest_j": None if ended is not None else float(np.abs(off).max()), "change_j": change, "diverged_at_s": ended,
    }  # fmt: skip
    return {"row": row, "scheme": method.scheme, "t": t[::every], "off": off[::every], "seconds": duration}


def behaviour(off: np.ndarray) -> tuple[str, float]:
    """Whether an energy drifts or stays bounded, and its change, J, from the first fifth of a run to the last.

    It drifts if the means of the two are apart by more than three standard deviations of either.
    """
    fifth = len(off) // 5
    first, last = off[:fifth], off[-fifth:]
    change = float(last.mean() - first.mean())
    return "drifts" if abs(change) > DRIFT_DEVIATIONS * max(first.std(), last.std()) else "bounded", change


def newton(
    method: Method, at: Held, engines: Mapping[str, Engine], dts: Sequence[float] = NEWTON_STEPS, steps: int = 2000
) -> list[dict]:
    """Steps of an implicit method that Newton's method finds, of so many, against dt, in small and in large motion."""
    direction, rest, dynamics = stiffest(at)[1], np.zeros(at.nv), engines[method.engine].of(at.case)
    rows = []
    for motion, size in NEWTON_SIZES.items():
        start, tau = (at.q, rest) if size is None else (at.moved(size * direction), at.tau)
        for dt in dts:
            run = dynamics.run(start, rest, tau, dt, steps, method.name)
            found = int(np.isfinite(run.q).all(axis=1).sum()) - 1
            rows.append({
                "method": method.name, "motion": motion, "dt_s": dt, "steps_found": found,
                "last_rad_per_s": number_or_none(np.abs(run.v[found]).max()), "steps": steps,
            })  # fmt: skip
    return rows


def check_minutes(result: Result, minutes: Sequence[dict]) -> None:
    """The energy of a minute: an integrator of MuJoCo does as the same scheme in tmt does."""
    table = [run["row"] for run in minutes]
    result.tables["stability_energy"] = table
    result.curves["minutes"] = minutes
    kinds = {(row["engine"], row["method"], row["dt_s"]): row["energy"] for row in table}
    for row, scheme in ((run["row"], run["scheme"]) for run in minutes if run["row"]["engine"] == "mujoco"):
        ours = kinds[("tmt", scheme, row["dt_s"])]
        where = f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s"
        note = f"{row['energy']}, in TMT {ours}"
        quantity = "runs whose energy does as that of the same scheme in TMT"
        result.check(where, quantity, int(row["energy"] == ours), 1, "runs", note, rule="equal")
    for dt in sorted({row["dt_s"] for row in table}, reverse=True):
        mine = [row for row in table if row["dt_s"] == dt and row["engine"] == "tmt"]
        of_kind = {
            kind: [f"{row['method']} ({how_far(row)})" for row in mine if row["energy"] == kind]
            for kind in ("bounded", "drifts", "diverges")
        }
        by_kind = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in of_kind.items() if names)
        scene, seconds = mine[0]["scene"], minutes[0]["seconds"]
        result.notes.append(f"Energy over {seconds:g} s of {scene}, at dt = {dt:.4g} s: {by_kind}.")


def check_newton(result: Result, posture: str, found: Sequence[list[dict]]) -> None:
    """The table of the steps that Newton's method finds, and what it says; nothing where none was taken."""
    table = [row for rows in found for row in rows]
    if table:
        result.tables["stability_newton"] = table
        result.notes.append(newton_in_words(posture, table))


def how_far(row: dict) -> str:
    """How the energy of a minute behaves, in words."""
    if row["energy"] == "diverges":
        return f"at {row['diverged_at_s']:.2f} s"
    return f"within {row['largest_j']:.2g} J" if row["energy"] == "bounded" else f"by {row['change_j']:+.2g} J"


def newton_in_words(posture: str, table: list[dict]) -> str:
    """Up to which step Newton's method finds all stages, method by method and motion by motion, and why it fails."""
    methods = []
    for name in dict.fromkeys(row["method"] for row in table):
        limits = []
        for motion in dict.fromkeys(row["motion"] for row in table):
            rows = [row for row in table if (row["method"], row["motion"]) == (name, motion)]
            failing = [row["dt_s"] for row in rows if row["steps_found"] < row["steps"]]
            last = max(row["dt_s"] for row in rows)
            limits.append(
                f"{motion}: fails from {min(failing):g} s" if failing else f"{motion}: never up to {last:g} s"
            )
        methods.append(f"{name} ({'; '.join(limits)})")
    failed = [row for row in table if row["steps_found"] < row["steps"]]
    text = f"Newton's method in the implicit methods, {table[0]['steps']} steps at {posture}: {', '.join(methods)}. "
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
