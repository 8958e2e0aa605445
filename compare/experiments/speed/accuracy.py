"""What is concluded from the errors of speed's runs, row by row: checks, and sentences that follow from these numbers."""

from collections.abc import Iterable, Mapping

import numpy as np

from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...truth.reference import DOUBLES, LOST, Reference

Floors = Mapping[str, float]  # {scene: rad}, what rounding leaves in each

NEAR_ROUNDING = 30  # times the error of rounding: an error below has come to it
SMALL_DEVIATION = 0.1  # rad: rounding changes an error below no more than the growth of a small difference says
ANOTHER_MOTION = 0.1  # rad: a run that is farther off is another motion
ALIKE = 0.01  # of an error: two that differ by less are the same in a sentence


def check_same_schemes(
    result: Result, floors: Floors, schemes: Mapping[str, Mapping[str, str]], unit: str = "rad"
) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, except for rounding.

    Judged where either error is below 0.1 rad: one that is not, or a run that has diverged, beside one that is, fails.
    schemes: of each scene {integrator of MuJoCo: the method of tmt}.
    """
    by_place = {(row["scene"], row["engine"], row["method"], row["dt_s"]): row for row in result.rows}
    for (scene, engine, method, dt), row in by_place.items():
        known = schemes[scene].get(method) if engine == "mujoco" and scene in floors else None
        ours = by_place.get((scene, "tmt", known, dt)) if known else None
        if ours and min(error(row), error(ours)) < SMALL_DEVIATION:
            difference = abs(error(row) - error(ours))
            where = f"{scene}, {method}, dt = {dt:.3g} s"
            quantity = f"the same error as tmt's {ours['method']}"
            result.check(where, quantity, difference, FACTOR * floors[scene], unit, rounding=True)


def check_smallest_errors(result: Result, floors: Floors, unit: str = "rad") -> None:
    """MuJoCo's RK4 comes as near to the reference as tmt's; and where errors stop falling, they are of the size of rounding.

    Where the steps of MuJoCo's end before its errors stop falling, tmt's is taken with steps no finer: it may afford more. Where
    with these both diverge, as with a stiff robot, or tmt's took none that is as coarse, there is nothing to compare.
    """
    for scene, left in floors.items():
        least, finest = {}, finest_while_falling(result.rows, scene, "mujoco", "RK4") or 0.0
        for engine, method in (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")):
            errors = errors_of(result.rows, scene, engine, method)
            least[method] = min(errors, default=np.inf)
            if stopped(errors):
                quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
                result.check(scene, quantity, least[method], FACTOR * left, unit, rounding=True)
        comparable = errors_of(result.rows, scene, "tmt", "rk4", finest)
        least["rk4"] = min(comparable, default=np.inf)
        if not comparable or not np.isfinite([least["RK4"], least["rk4"]]).any():
            continue
        tolerance = FACTOR * left + (2.0 * least["rk4"] if np.isfinite(least["rk4"]) else 0.0)
        result.check(scene, "smallest error of MuJoCo's RK4, beside that of tmt's rk4", least["RK4"], tolerance, unit)


def gained_nothing(found: float, work: int, best: float, last: int, left: float) -> bool:
    """Whether a run that cost more than the last one came no nearer, though the best error was near that of rounding."""
    return best < NEAR_ROUNDING * left and work > 1.2 * last and not found < 0.7 * best


def error(row: dict) -> float:
    """The worst error of a row on the way, rad; infinite if the run diverged."""
    return np.inf if row["diverged"] else row["worst_error_rad"]


def errors_of(rows: list[dict], scene: str, engine: str, method: str, finest: float = 0.0) -> list[float]:
    """The errors of a method in a scene, rad, in the order of its settings; finest: s, no step of a fixed one is shorter."""
    return [error(row) for row in rows_of_method(rows, scene, engine, method) if not (row["dt_s"] or np.inf) < finest]


def rows_of_method(rows: list[dict], scene: str, engine: str, method: str) -> list[dict]:
    """The rows of a method in a scene."""
    return [row for row in rows if (row["scene"], row["engine"], row["method"]) == (scene, engine, method)]


def finest_while_falling(rows: list[dict], scene: str, engine: str, method: str) -> float | None:
    """The finest step of a method of fixed step, s, if its errors fall up to there; None if finer ones gain nothing."""
    runs = rows_of_method(rows, scene, engine, method)
    falls = runs and not stopped([error(row) for row in runs])
    return min(row["dt_s"] for row in runs) if falls else None


def stopped(errors: list[float]) -> bool:
    """Whether the least of these errors is not the last: smaller steps gained nothing."""
    return bool(errors) and np.isfinite(min(errors)) and errors.index(min(errors)) < len(errors) - 1


def true_error(rows: list[dict], steps: Mapping[str, int]) -> dict[str, tuple[float | None, float | None]]:
    """{scene: (TMT's, MuJoCo's)}: the worst error of RK4 with the coarsest steps, rad; None: diverged, not run.

    steps: {scene: how many}.
    """
    found = {}
    for row in rows:
        of_rk4 = (row["engine"], row["method"]) in (("tmt", "rk4"), ("mujoco", "RK4"))
        if of_rk4 and row["steps"] == steps.get(row["scene"]):
            found.setdefault(row["scene"], {})[row["engine"]] = row["worst_error_rad"]
    return {scene: (pair.get("tmt"), pair.get("mujoco")) for scene, pair in found.items()}


def true_errors_in_words(rows: list[dict], steps: Mapping[str, int], robot: Robot) -> list[str]:
    """How far from the true motion the runs with the coarsest steps are, in words, for each number of them."""
    groups = {}
    for scene, count in steps.items():
        dt = {row["dt_s"] for row in rows if row["scene"] == scene and row["steps"] == count and row["dt_s"]}
        whose = "the assignment's" if robot.claims and dt == {robot.claims.dt} else "the coarsest"
        groups.setdefault((whose, count), {})[scene] = count
    sentences = []
    for (whose, count), of_group in groups.items():
        errors = true_error(rows, of_group)
        if not errors:
            continue
        pairs = "; ".join(f"{scene}: TMT {in_rad(a)}, MuJoCo {in_rad(b)}" for scene, (a, b) in errors.items())
        text = f"At {whose} step, {count} steps of RK4, the worst errors against the true motion are: {pairs}."
        far = {s: pair for s, pair in errors.items() if any(v is None or v > ANOTHER_MOTION for v in pair)}
        alike = [s for s, pair in far.items() if None not in pair and abs(pair[0] - pair[1]) < ALIKE * pair[0]]
        other = [s for s in far if s not in alike]
        if alike:
            text += f" {'; '.join(alike)}: both engines make this error. That they agree says nothing of the {robot.noun}'s "
            text += "motion there."
        if other:
            text += f" {'; '.join(other)}: the errors are not the same."
        sentences.append(text)
    return sentences


def in_rad(value: float | None) -> str:
    return "no number" if value is None else f"{value:.2g} rad"


def floors_in_words(rows: list[dict], floors: Floors) -> list[str]:
    """How large the error of rounding is, and how many methods come to it and stop there, in words."""
    sizes = "; ".join(f"{scene}: {left:.1e} rad" for scene, left in floors.items())
    came, stay, below = 0, 0, 0
    for scene, left in floors.items():
        for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in rows if row["scene"] == scene):
            errors = errors_of(rows, scene, engine, method)
            if min(errors) < NEAR_ROUNDING * left:
                came, stay, below = came + 1, stay + stopped(errors), below + (min(errors) < left)
    return [
        f"The size of what rounding leaves, eps times the growth of a small difference on the way: {sizes}. Of the curves of "
        f"all methods {came} {'comes' if came == 1 else 'come'} to within {NEAR_ROUNDING} times of it; in {stay} of these the "
        f"last setting is not the most exact, and {below} {'gets' if below == 1 else 'get'} below it."
    ]


def reference_in_words(robot: Robot) -> str:
    """What errors are measured against."""
    words = (
        f"Taylor's method in pairs of doubles, good to {LOST:g} times the growth of a small difference (a second run, in another "
        "form of the equations and of another order, shows it)"
    )
    if not robot.is_read:
        return words
    return (
        f"{words}, or, where that would take too long, a run in doubles by tmt's {DOUBLES}, whose digits are seen by halving "
        "its steps: smaller errors are then not known"
    )


def references_in_words(known: Mapping[str, Reference], floors: Floors) -> list[str]:
    """To how many digits the reference of each scene is known, in words.

    floors: {scene: what rounding leaves, or, where that is more, how far the reference is from its second run}.
    """
    words = []
    if pairs := [scene for scene in floors if not known[scene].why]:
        lost = {scene: LOST * floors[scene] / EPS for scene in pairs}
        sizes = "; ".join(f"{s}: {lost[s]:.0e} ({known[s].apart:.0e}, {known[s].steps} steps)" for s in pairs)
        beyond = [scene for scene in pairs if known[scene].apart > lost[scene]]
        what = f"more than that in {', '.join(beyond)}" if beyond else "no more"
        words.append(
            f"The reference is a Taylor series in pairs of doubles. {LOST:g} times the growth of a small difference, and in "
            f"brackets by how much it differs from its second run, rad or rad/s: {sizes}. They differ by {what}."
        )
    if doubles := [scene for scene in floors if known[scene].why]:
        runs = "; ".join(f"{s}: {known[s].apart:.0e} ({known[s].steps} steps; {known[s].why})" for s in doubles)
        words.append(
            "A series would take too long, or overflow, and the reference is a run in doubles, of order 8, in these scenes. It "
            f"differs from the one with half the steps by so many rad, or per s: {runs}. Smaller errors are not known, and have "
            "this size, or that of rounding, in tables and figures."
        )
    coarse = [s for s, left in floors.items() if not known[s].why and known[s].apart >= left]
    if coarse:
        sizes = "; ".join(f"{scene}: {known[scene].apart:.0e}" for scene in coarse)
        words.append(f"The reference is known to no more than so many rad or rad/s, in place of rounding: {sizes}.")
    return words


def first_order_in_words(rows: list[dict], scenes: Iterable[str]) -> list[str]:
    """How far MuJoCo's integrators of order 1 come, in words."""
    found = []
    for scene in scenes:
        runs = [row for row in rows if (row["scene"], row["engine"]) == (scene, "mujoco") and not row["diverged"]]
        first = [row for row in runs if row["method"] != "RK4"]
        if first:
            best = min(first, key=lambda row: row["worst_error_rad"])
            taken = "" if best["seconds"] is None else f" in {1e3 * best['seconds']:.3g} ms"
            found.append(f"{scene}: {best['worst_error_rad']:.1e} rad{taken} ({best['method']}, {best['steps']} steps)")
    return [f"The least errors of MuJoCo's integrators of order 1: {'; '.join(found)}."] if found else []


def smaller_models_in_words(rows: list[dict]) -> list[str]:
    """What the smaller model of a scene saves, in words; such a row says in `whole` of which scene it is."""
    sentences = []
    for row in (row for row in rows if row["whole"]):
        for whole in (other for other in rows if other["scene"] == row["whole"]):
            same = all(whole[key] == row[key] for key in ("engine", "method", "dt_s", "tolerance"))
            if same and whole["seconds"] and row["seconds"] and row["worst_error_rad"]:
                gain = whole["seconds"] / row["seconds"]
                sentences.append(
                    f"{row['scene']} ({row['engine']} {row['method']}, {row['steps']} steps): the whole model takes {gain:.2f} "
                    f"times as long; {row['worst_error_rad']:.2e} rad off where that is {error(whole):.2e}."
                )
    return sentences
