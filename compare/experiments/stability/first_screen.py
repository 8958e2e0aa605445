"""What stability shows on the first screen: the limits of the step, as predicted and as observed."""

from collections.abc import Sequence
from typing import NamedTuple

from ...judge.check import Check, Result
from ...judge.finding import Finding

ABOUT_LIMITS = ("limit, ", "runs in which it ")  # how the names of checks of a limit begin


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


def headline(result: Result) -> Finding | None:
    """How many limits of the step are as predicted, and the largest relative difference."""
    counts = summary(limits_of(result))
    return result.finding("headline", **counts) if counts["known"] or counts["wrong"] else None


def limits_of(result: Result) -> list[Limit]:
    """The limits in the order of the table, at stable equilibria if there are any."""
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
            not any(is_about(check, row) for check in failing),
        )
        for row in result.rows
        if "predicted_dt_s" in row and (not centres or row["scene"] in centres)
    ]


def is_about(check: Check, row: dict) -> bool:
    """Whether a check is about the limit of a row."""
    label = {"tmt": "TMT", "mujoco": "MuJoCo"}.get(row["engine"], row["engine"])
    place = f"{row['scene']}, {label} {row['method']}, damping {row['damping']:g}"
    return check.quantity.startswith(ABOUT_LIMITS) and f"{check.scene},".startswith(f"{place},")


def known(limits: Sequence[Limit]) -> list[Limit]:
    """Those that are predicted and observed."""
    return [limit for limit in limits if limit.predicted and limit.observed]


def summary(limits: Sequence[Limit]) -> dict:
    off = max((abs(limit.observed / limit.predicted - 1.0) for limit in known(limits)), default=0.0)
    wrong = sum(not limit.passed for limit in limits)
    return {"limits": len(limits), "known": len(known(limits)), "wrong": wrong, "off": off}
