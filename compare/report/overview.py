"""What the first screen draws, taken from results: agreement, scenes, time against error, limits of the step; and its captions.

Nothing here needs matplotlib: `figures_overview` draws what these functions return, in the process that draws.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..judge import units
from ..judge.check import Check, Result
from ..judge.scale import FACTOR
from ..judge.words import listed

PICTURES = {  # the pictures in their order, and the experiments whose results they need
    "agreement": ("mass", "acceleration"),
    "scenes": ("trajectory",),
    "times": ("speed",),
    "limits": ("stability",),
}
BEGINNING = "overview_"  # of the names of their files
QUANTITIES = {"Mbar": "mass matrix M", "bias": "bias h", "qdd": "accelerations"}
TARGET = 1e-6  # rad or m: the error for which the cheapest setting is named
NO_RESULT = 1.0  # rad or m: a run that is farther off is none


def needed(experiment: str, names: Sequence[str], results: Mapping[str, Result]) -> dict[str, Result]:
    """The results, rows alone, that pictures need which can be drawn once this experiment is done, its own among them.

    names: of the experiments that run, in their order; results: of those that are done. A picture of two experiments is drawn
    with the later one.
    """
    of_pictures = [[name for name in names if name in needs] for needs in PICTURES.values() if experiment in needs]
    others = [name for ran in of_pictures if ran[-1:] == [experiment] for name in ran if name in results]
    return {name: Result(name, rows=results[name].rows, label=results[name].label) for name in others}


def drawn_with(experiment: str, results: Mapping[str, Result]) -> list[str]:
    """The pictures that can be drawn of these results, the last of which is this experiment's."""
    return [name for name, needs in PICTURES.items() if experiment in needs and any(need in results for need in needs)]


def fold(ratio: float) -> str:
    """A ratio in print, without a power of ten where none is needed."""
    return f"{ratio:.2g}" if ratio < 10.0 or ratio >= 1e5 else f"{ratio:.0f}"


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
    for name, of in QUANTITIES.items():
        rows = [row for result in results.values() for row in result.rows if row.get("quantity") == name]
        if rows:
            label = next(iter(results.values())).label.lower()
            apart, ours, theirs = (
                largest([row.get(column) for row in rows])
                for column in ("difference_eps", f"{label}_from_exact_eps", "mujoco_from_exact_eps")
            )
            found.append(Agreement(of, apart, ours, theirs, all(row["passed"] for row in rows)))
    return found


def largest(values: Sequence[float | None]) -> float | None:
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
        return f"{label} and MuJoCo differ in {listed(wrong)}: up to {far} apart ({top.name})."
    alike = f"{label} and MuJoCo have the same {names}: at most {top.apart:.2g} eps apart ({top.name})"
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
    failing = [check.scene for check in result.checks if not check.passed]
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
                largest([row["difference_over_band"] for row in rows]),
                (min(until), max(until)),
                float(case.duration if case else max([*longest, *until])),
                min(diverged, default=None),
                tuple(held.values()) if held else None,
                not any(scene_of(where, names) == name for where in failing),
            )
        )
    return found


def scene_of(where: str, names: Sequence[str]) -> str | None:
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
        text = f"{label} and MuJoCo do not move alike in {'; '.join(wrong)}"
        text += f": up to {fold(max(shares))} times the rounding band apart." if shares else "."
    else:
        most = f"at most {100 * max(shares):.2g} % of the rounding band apart" if shares else "not measured"
        text = f"{label} and MuJoCo move alike in all {len(found)} scenes: {most}, "
        text += f"judged for {min(times):.2g} to {max(times):.2g} s."
    left = [one for one in found if one.left and (one.left[0] is None) != (one.left[1] is None)]
    for one in left:
        name, time = next((who, time) for who, time in zip((label, "MuJoCo"), one.left) if time is not None)
        text += f" In {one.name} the posture is left by {name} alone, at {time:.2g} s."
    return text


class Curve(NamedTuple):
    """The settings of one engine that nothing of the same engine beats in both error and time."""

    engine: str
    errors: list[float]  # rad or m, from coarse to fine
    milliseconds: list[float]
    cheapest: tuple[str, float] | None  # the method and the time, ms, of the first that is within TARGET


def best_curves(result: Result, scene: str | None = None) -> list[Curve]:
    """A curve for each engine that followed the scene in time; the scene on which errors are regular if none is named."""
    scene = scene or result.curves.get("regular")
    rows = [
        row
        for row in result.rows
        if row["scene"] == scene and row["why_not"] is None and row["seconds"] and not row["diverged"]
    ]
    found = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        front, least = [], NO_RESULT
        own = [row for row in rows if row["engine"] == engine and units.value(row, "worst_error") is not None]
        for row in sorted(own, key=lambda r: (r["seconds"], units.value(r, "worst_error"))):
            if units.value(row, "worst_error") < least:
                front.append(row)
                least = units.value(row, "worst_error")
        if front:
            cheap = next((row for row in front if units.value(row, "worst_error") <= TARGET), None)
            found.append(
                Curve(
                    engine,
                    [float(units.value(row, "worst_error")) for row in front],
                    [1e3 * row["seconds"] for row in front],
                    (cheap["method"], 1e3 * cheap["seconds"]) if cheap else None,
                )
            )
    return found


def named(engine: str) -> str:
    """An engine as the report writes it where methods are compared: tmt's is the package's name."""
    return {"mujoco": "MuJoCo", "scipy": "SciPy"}.get(engine, engine)


def cheapest_in_words(curves: Sequence[Curve], unit: str) -> str:
    """Who is cheapest within the target, and how much longer MuJoCo takes; '' if nobody is."""
    reached = {curve.engine: curve.cheapest for curve in curves if curve.cheapest}
    if not reached:
        return ""
    first = min(reached, key=lambda engine: reached[engine][1])
    method, time = reached[first]
    text = f"to {TARGET:.0e} {unit}: {named(first)} {method} in {time:.2g} ms"
    other = "mujoco" if first != "mujoco" else "tmt"
    if other in reached:
        text += f"; {named(other)} {reached[other][0]} takes {fold(reached[other][1] / time)} times as long"
    return text


def times_in_words(result: Result) -> str:
    """The caption: what is cheapest within the target."""
    scene, unit = result.curves.get("regular"), result.curves.get("unit", "rad")
    found = cheapest_in_words(best_curves(result), unit)
    return f"The cheapest settings of each engine ({scene}). {found[:1].upper()}{found[1:]}." if found else (
        f"The cheapest settings of each engine ({scene}). None reaches {TARGET:.0e} {unit}."
    )  # fmt: skip


class Limit(NamedTuple):
    """A limit of the step of one method at one posture, s."""

    scheme: str
    engine: str
    scene: str
    damping: float
    kind: str  # finite, never_fails, always_fails
    predicted: float | None
    observed: float | None
    passed: bool


def limits_found(result: Result) -> list[Limit]:
    """The limits in the order of the table, at postures about which the exact motion swings, where there are such."""
    centres = result.curves.get("looked at", {}).get("centres")
    failing = [check for check in result.checks if not check.passed]
    schemes = result.curves.get("schemes", {})
    return [
        Limit(
            schemes.get((row["engine"], row["method"]), row["method"]),
            row["engine"],
            row["scene"],
            row["damping"],
            row["limit"],
            row["predicted_dt_s"],
            row["observed_dt_s"],
            not any(is_of(check, row) for check in failing),
        )
        for row in result.rows
        if "predicted_dt_s" in row and (not centres or row["scene"] in centres)
    ]


def is_of(check: Check, row: dict) -> bool:
    """Whether a check is of the limit of a row."""
    label = {"tmt": "TMT", "mujoco": "MuJoCo"}.get(row["engine"], row["engine"])
    begins = f"{row['scene']}, {label} {row['method']}, damping {row['damping']:g}"
    of_limit = check.quantity.startswith(("limit, ", "runs in which it "))
    return of_limit and (check.scene == begins or check.scene.startswith(f"{begins},"))


def both(found: Sequence[Limit]) -> list[Limit]:
    """Those that are predicted and observed."""
    return [one for one in found if one.predicted and one.observed]


def limits_in_words(found: Sequence[Limit]) -> str:
    """The caption: how far what is observed is from what is predicted."""
    known, wrong = both(found), [one for one in found if not one.passed]
    off = max((abs(one.observed / one.predicted - 1.0) for one in known), default=0.0)
    if wrong:
        return f"{len(wrong)} of {len(found)} step limits are not as predicted; of those found, up to {100 * off:.2g} % off."
    if not known:
        return "No step limit is both predicted and observed here."
    return f"{len(known)} step limits, predicted from one step of a method, are observed in runs within {100 * off:.2g} %."
