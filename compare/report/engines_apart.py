"""How far the engines are apart, at a glance: in M, h and accelerations, and scene by scene; and that in a sentence."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..judge.check import About, Result
from ..judge.words import capital, listed
from .overview import times_in_print

NAMES_OF_QUANTITIES = {"Mbar": "mass matrix M", "bias": "bias h", "qdd": "accelerations"}


class Agreement(NamedTuple):
    """How far apart one quantity is at most, in eps of its scale; None: not known, inf: somewhere no number."""

    name: str
    apart: float  # between the engines
    ours: float | None  # of the engine that MuJoCo is compared with, from the exact value
    theirs: float | None  # of MuJoCo
    passed: bool


def agreements(results: Mapping[str, Result]) -> list[Agreement]:
    """Mbar, h and accelerations over all states, as far as they were compared."""
    found = []
    for name, of in NAMES_OF_QUANTITIES.items():
        rows = [row for result in results.values() for row in result.rows if row.get("quantity") == name]
        if rows:
            label = next(iter(results.values())).label.lower()
            apart, ours, theirs = (
                largest_known([row.get(column) for row in rows])
                for column in ("difference_eps", f"{label}_from_exact_eps", "mujoco_from_exact_eps")
            )
            found.append(Agreement(of, apart, ours, theirs, all(row["passed"] for row in rows)))
    return found


def largest_known(values: Sequence[float | None]) -> float | None:
    """The largest of those that are known; inf where one is no number; None if none is known."""
    known = [float(value) for value in values if value is not None]
    return None if not known else math.inf if any(math.isnan(value) for value in known) else max(known)


def agreement_in_words(found: Sequence[Agreement], label: str) -> str:
    """The caption: what is farthest apart, beside the tolerance."""
    if not found:
        return ""
    top = max(found, key=lambda one: one.apart)
    wrong = [one.name for one in found if not one.passed]
    names = listed([one.name for one in found])
    if wrong:
        far = f"{top.apart:.2g} eps" if math.isfinite(top.apart) else "no number of eps"
        return f"{capital(label)} and MuJoCo differ in {listed(wrong)}: up to {far} apart ({top.name})."
    alike = f"{capital(label)} and MuJoCo have the same {names}: at most {top.apart:.2g} eps apart ({top.name})"
    exact = [value for one in found for value in (one.ours, one.theirs) if value is not None]
    return alike + (f", and {max(exact):.2g} eps from exact." if exact else ".")


class SceneRun(NamedTuple):
    """One scene at a glance: the runs of all integrators and steps together."""

    name: str
    share: float | None  # the largest difference over its band of rounding; None: no number
    judged: tuple[float, float]  # s, the shortest and the longest time to which a run is judged
    duration: float  # s
    diverged: float | None  # s, the earliest time at which a run of MuJoCo diverges
    left: tuple[float | None, float | None] | None  # s, when a held posture is left by each engine; None: not held
    passed: bool


def scene_runs(result: Result, robot: object) -> list[SceneRun]:
    """The scenes in their order, with what was found of each."""
    names = list(dict.fromkeys(row["scene"] for row in result.rows))
    failing = [check.scene for check in result.checks if not check.passed and check.about == About.MODELS]
    cases, runs = {case.name: case for case in robot.cases}, result.curves.get("runs", {})
    found = []
    for name in names:
        rows = [row for row in result.rows if row["scene"] == name]
        open_loop = [row for row in rows if row["level"] == "open loop"] or rows
        until = [row["judged_until_s"] for row in open_loop if row["judged_until_s"] is not None] or [0.0]
        diverged = [row["diverged_at_s"] for row in rows if row["diverged_at_s"] is not None]
        case = cases.get(name)
        longest = [curve["t"][-1] for (scene, *_), curve in runs.items() if scene == name]
        held = runs.get((name, "rk4", case.steps), {}).get("left") if case and case.is_held else None
        found.append(
            SceneRun(
                name,
                largest_known([row["difference_over_band"] for row in rows]),
                (min(until), max(until)),
                float(case.duration if case else max([*longest, *until])),
                min(diverged, default=None),
                tuple(held.values()) if held else None,
                not any(scene_named_in(where, names) == name for where in failing),
            )
        )
    return found


def scene_named_in(where: str, names: Sequence[str]) -> str | None:
    """Of which scene a check is: the longest name with which the place of the check begins."""
    return max((name for name in names if where == name or where.startswith(f"{name}, ")), key=len, default=None)


def scenes_in_words(found: Sequence[SceneRun], label: str) -> str:
    """The caption: the difference that comes closest to its band, for how long is judged, what leaves and diverges."""
    if not found:
        return ""
    shares = [one.share for one in found if one.share is not None]
    wrong = [one.name for one in found if not one.passed]
    times = [time for one in found for time in one.judged]
    if wrong:
        text = f"{capital(label)} and MuJoCo do not move alike in {'; '.join(wrong)}"
        text += f": up to {times_in_print(max(shares))} times the rounding band apart." if shares else "."
    else:
        most = f"at most {100 * max(shares):.2g} % of the rounding band apart" if shares else "not measured"
        text = f"{capital(label)} and MuJoCo move alike in all {len(found)} scenes: {most}, "
        text += f"judged for {min(times):.2g} to {max(times):.2g} s."
    left = [one for one in found if one.left and (one.left[0] is None) != (one.left[1] is None)]
    for one in left:
        name, time = next((who, time) for who, time in zip((label, "MuJoCo"), one.left) if time is not None)
        text += f" In {one.name} the posture is left by {name} alone within its {one.duration:.3g} s, at {time:.2g} s."
    return text
