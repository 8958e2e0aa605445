"""What diagnosis shows on the first screen."""

from ...judge.check import Result
from ...judge.finding import Finding


def headline(result: Result) -> Finding | None:
    """The first explanation; or how many of the made faults that can be seen are explained."""
    if not result.rows:
        return None
    if "place" in result.rows[0]:
        return result.finding("headline", place=result.rows[0]["place"], more=len(result.rows) - 1)
    visible = [row for row in result.rows if row["visible"]]
    explained = sum(row["faults"] for row in visible if row["outcome"] in ("right", "tied"))
    return result.finding("headline_of_faults", explained=explained, faults=sum(row["faults"] for row in visible))
