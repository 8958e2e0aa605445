"""What reduction shows on the first screen."""

from ...judge.check import Result
from ...judge.finding import Finding

LEAST_SPEEDUP = 1.05  # less may be the clock's


def headline(result: Result) -> Finding | None:
    """The largest speedup of a step by a model without the joints that a scene does not need."""
    rows = [row for row in result.rows if (row.get("speedup") or 0.0) >= LEAST_SPEEDUP]
    top = max(rows, key=lambda row: row["speedup"], default=None)
    return result.finding("headline", speedup=top["speedup"], hinges=top["hinges"], scene=top["scene"]) if top else None
