"""Methods beside each other, at a glance: time against error, and limits of the step; and that in a sentence."""

from collections.abc import Sequence
from typing import NamedTuple

from ..judge import units
from ..judge.check import Check, Result
from .overview import times_in_print

ERROR_ASKED = 1e-6  # rad or m: for which the cheapest setting is named
NOT_SOLVED = 1.0  # rad or m: a run that is farther off is none


class Cheapest(NamedTuple):
    """The setting that takes least time within the error asked for."""

    method: str
    milliseconds: float
    setting: str = ""  # its steps and dt, or its tolerance, in words; "": not known


class Curve(NamedTuple):
    """The settings of one engine that nothing of the same engine beats in both error and time."""

    engine: str
    errors: list[float]  # rad or m, from coarse to fine
    milliseconds: list[float]
    cheapest: Cheapest | None  # the first that is within ERROR_ASKED


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
        front, least = [], NOT_SOLVED
        own = [row for row in rows if row["engine"] == engine and units.value(row, "worst_error") is not None]
        for row in sorted(own, key=lambda r: (r["seconds"], units.value(r, "worst_error"))):
            if units.value(row, "worst_error") < least:
                front.append(row)
                least = units.value(row, "worst_error")
        if front:
            cheap = next((row for row in front if units.value(row, "worst_error") <= ERROR_ASKED), None)
            found.append(
                Curve(
                    engine,
                    [float(units.value(row, "worst_error")) for row in front],
                    [1e3 * row["seconds"] for row in front],
                    Cheapest(cheap["method"], 1e3 * cheap["seconds"], steps_or_tolerance(cheap)) if cheap else None,
                )
            )
    return found


def engine_in_print(engine: str) -> str:
    """An engine as the report writes it where methods are compared: tmt's is the package's name."""
    return {"mujoco": "MuJoCo", "scipy": "SciPy"}.get(engine, engine)


def steps_or_tolerance(row: dict) -> str:
    """The steps and the dt of a run, or the tolerance with which it chose its steps."""
    if row.get("dt_s"):
        return steps_in_words(f"{row['steps']:.0f} steps", row["dt_s"])
    return f"tolerance {row['tolerance']:.0e}" if row.get("tolerance") else ""


def steps_in_words(steps: str, dt: float | None) -> str:
    """A number of steps with their dt, s, where they have the same."""
    return f"{steps} (dt {dt:.2g} s)" if dt else steps


def cheapest_of_curves(curves: Sequence[Curve], unit: str, scene: str | None) -> str:
    """Who is cheapest within the target in a scene, and the cheapest of MuJoCo (of tmt, if that is MuJoCo); '' if nobody is."""
    reached = {curve.engine: curve.cheapest for curve in curves if curve.cheapest}
    if not reached:
        return ""
    first = min(reached, key=lambda engine: reached[engine].milliseconds)
    other = "mujoco" if first != "mujoco" else "tmt"
    texts = []
    for engine in (first, *([other] if other in reached else [])):
        method, time, setting = reached[engine]
        words = (f"{engine_in_print(engine)} {method}", setting, f"{times_in_print(time)} ms")
        texts.append(", ".join(filter(None, words)))
    where = f" ({scene})" if scene else ""
    return f"to {ERROR_ASKED:.0e} {unit}{where}: {'; '.join(texts)}"


def times_in_words(result: Result) -> str:
    """The caption: what is cheapest within the target."""
    scene, unit = result.curves.get("regular"), result.curves.get("unit", "rad")
    found = cheapest_of_curves(best_curves(result), unit, scene)
    return f"The cheapest settings of each engine. {found[:1].upper()}{found[1:]}." if found else (
        f"The cheapest settings of each engine ({scene}). None reaches {ERROR_ASKED:.0e} {unit}."
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


def known_limits(found: Sequence[Limit]) -> list[Limit]:
    """Those that are predicted and observed."""
    return [one for one in found if one.predicted and one.observed]


def limits_at_a_glance(found: Sequence[Limit]) -> str:
    """The caption: how far what is observed is from what is predicted."""
    known, wrong = known_limits(found), [one for one in found if not one.passed]
    off = max((abs(one.observed / one.predicted - 1.0) for one in known), default=0.0)
    if wrong:
        return f"{len(wrong)} of {len(found)} step limits are not as predicted; of those found, up to {100 * off:.2g} % off."
    if not known:
        return "No step limit is both predicted and observed here."
    return (
        f"{len(known)} step limits, predicted from one step of a method, are observed in runs within {100 * off:.2g} %."
    )
