"""What is concluded from the errors of speed's runs, row by row: checks, and sentences that follow from these numbers."""

import numpy as np

from .agreement import FACTOR
from .competitors import GRID
from .motion import TWINS

NEAR = 30  # times the error of rounding: an error below has come to it
NEAR_ENOUGH = 0.1  # rad: an error below is a small deviation, which rounding changes no more than the growth says
FAR = 0.1  # rad: a run that is farther off is another motion
ALIKE = 0.01  # of an error: two that differ by less are the same in a sentence


def same_schemes(result, floors) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, but for rounding.

    Judged where either error is below 0.1 rad: one that is not, or a run that has diverged, beside one that is, fails.
    floors: {scene: rad}, what rounding leaves in each.
    """
    by_place = {(row["scene"], row["engine"], row["method"], row["dt_s"]): row for row in result.rows}
    for (scene, engine, method, dt), row in by_place.items():
        ours = by_place.get((scene, "tmt", TWINS.get(method), dt)) if engine == "mujoco" and scene in floors else None
        if ours and min(error(row), error(ours)) < NEAR_ENOUGH:
            difference = abs(error(row) - error(ours))
            where = f"{scene}, {method}, dt = {dt:.3g} s"
            quantity = f"the same error as tmt's {ours['method']}"
            result.check(where, quantity, difference, FACTOR * floors[scene], "rad", rounding=True)


def smallest_errors(result, floors) -> None:
    """MuJoCo's RK4 comes as near to the reference as tmt's; and where errors stop falling, they are of the size of rounding."""
    for scene, left in floors.items():
        least = {}
        for engine, method in (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")):
            errors = errors_of(result.rows, scene, engine, method)
            least[method] = min(errors, default=np.inf)
            if stopped(errors):
                quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
                result.check(scene, quantity, least[method], FACTOR * left, "rad", rounding=True)
        bar = FACTOR * left + (2.0 * least["rk4"] if np.isfinite(least["rk4"]) else 0.0)
        result.check(scene, "smallest error of MuJoCo's RK4, beside that of tmt's rk4", least["RK4"], bar, "rad")


def gained_nothing(found, work, best, last, left) -> bool:
    """Whether a run that cost more than the last one came no nearer, though the best error was near that of rounding."""
    return best < NEAR * left and work > 1.2 * last and not found < 0.7 * best


def error(row) -> float:
    """The worst error of a row on the way, rad; infinite if the run diverged."""
    return np.inf if row["diverged"] else row["worst_error_rad"]


def errors_of(rows, scene, engine, method) -> list[float]:
    """The errors of a method in a scene, rad, in the order of its settings."""
    return [error(row) for row in rows if (row["scene"], row["engine"], row["method"]) == (scene, engine, method)]


def stopped(errors) -> bool:
    """Whether the least of these errors is not the last: smaller steps gained nothing."""
    return bool(errors) and np.isfinite(min(errors)) and errors.index(min(errors)) < len(errors) - 1


def true_error(rows) -> dict[str, tuple[float | None, float | None]]:
    """{scene: (TMT's, MuJoCo's)}: the worst error of RK4 at the assignment's step, 64 in 5 s, rad; None: diverged, not run."""
    found = {}
    for row in rows:
        if row["steps"] == GRID and (row["engine"], row["method"]) in (("tmt", "rk4"), ("mujoco", "RK4")):
            found.setdefault(row["scene"], {})[row["engine"]] = row["worst_error_rad"]
    return {scene: (pair.get("tmt"), pair.get("mujoco")) for scene, pair in found.items()}


def true_errors_told(rows) -> list[str]:
    """How far from the true motion the runs are at the assignment's step, in words."""
    errors = true_error(rows)
    if not errors:
        return []
    pairs = "; ".join(f"{scene}: TMT {in_rad(a)}, MuJoCo {in_rad(b)}" for scene, (a, b) in errors.items())
    text = f"At the assignment's step, {GRID} steps of RK4, the worst errors against the true motion are: {pairs}."
    far = {s: pair for s, pair in errors.items() if any(value is None or value > FAR for value in pair)}
    alike = [s for s, pair in far.items() if None not in pair and abs(pair[0] - pair[1]) < ALIKE * pair[0]]
    other = [s for s in far if s not in alike]
    if alike:
        text += f" {'; '.join(alike)}: both engines make this error. That they agree says nothing of the arm's motion there."
    if other:
        text += f" {'; '.join(other)}: the errors are not the same."
    return [text]


def in_rad(value) -> str:
    return "no number" if value is None else f"{value:.2g} rad"


def floors_told(rows, floors) -> list[str]:
    """How large the error of rounding is, and how many methods come to it and stop there, in words."""
    sizes = "; ".join(f"{scene}: {left:.1e} rad" for scene, left in floors.items())
    came, stay, below = 0, 0, 0
    for scene, left in floors.items():
        for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in rows if row["scene"] == scene):
            errors = errors_of(rows, scene, engine, method)
            if min(errors) < NEAR * left:
                came, stay, below = came + 1, stay + stopped(errors), below + (min(errors) < left)
    return [
        f"The size of what rounding leaves, eps times the growth of a small difference on the way: {sizes}. Of the curves of "
        f"all methods {came} come to within {NEAR} times of it; in {stay} of these the last setting is not the most exact, and "
        f"{below} get below it."
    ]


def first_order(rows, scenes) -> list[str]:
    """How far MuJoCo's integrators of order 1 come, in words."""
    told = []
    for scene in scenes:
        runs = [row for row in rows if (row["scene"], row["engine"]) == (scene, "mujoco") and not row["diverged"]]
        first = [row for row in runs if row["method"] != "RK4"]
        if first:
            best = min(first, key=lambda row: row["worst_error_rad"])
            taken = "" if best["seconds"] is None else f" in {1e3 * best['seconds']:.3g} ms"
            told.append(f"{scene}: {best['worst_error_rad']:.1e} rad{taken} ({best['method']}, {best['steps']} steps)")
    return [f"The least errors of MuJoCo's integrators of order 1: {'; '.join(told)}."] if told else []


def smaller_models(rows) -> list[str]:
    """What the smaller model of a scene saves, in words."""
    told = []
    for row in rows:
        name = row["scene"].rsplit(", ", 1)[0]
        for whole in rows:
            same = all(whole[key] == row[key] for key in ("engine", "method", "dt_s", "tolerance"))
            if whole["scene"] == name and same and whole["seconds"] and row["seconds"] and row["worst_error_rad"]:
                gain = whole["seconds"] / row["seconds"]
                told.append(
                    f"{row['scene']} ({row['engine']} {row['method']}, {row['steps']} steps): the whole model takes {gain:.2f} "
                    f"times as long; {row['worst_error_rad']:.2e} rad off where that is {error(whole):.2e}."
                )
    return told
