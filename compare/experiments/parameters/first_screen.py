"""What parameters shows on the first screen."""

from collections import defaultdict

from ...judge.check import Result
from ...judge.finding import Finding


def headline(result: Result) -> Finding | None:
    """How many numbers are equal to the stated ones to the last bit, and the one with the largest relative difference."""
    rows = [row for row in result.rows if row.get("stated") is not None and not row.get("asked_by")]
    if not rows:
        return None
    off = [row for row in rows if row["difference"] != 0.0]
    sizes = defaultdict(
        float
    )  # of each kind of number, as for its tolerance: rounding of a stated zero is no large difference
    for row in rows:
        kind = row["of"], row["quantity"]
        sizes[kind] = max(sizes[kind], abs(row["stated"]))

    def relative(row):
        size = sizes[row["of"], row["quantity"]]
        return abs(row["difference"]) / size if size else float("inf")

    top = max(off, key=relative, default=None)
    return result.finding("headline", numbers=len(rows), off=len(off), top=top)
