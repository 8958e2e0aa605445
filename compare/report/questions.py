"""The answers to the questions of a robot's assignment."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from ..core.finding import Finding
from ..core.text import say
from ..robots import Robot
from .verdict import Section

COLUMNS = ["part", "question", "answered in", "answer"]
Ran = Mapping[str, Section]  # by the names of the experiments


def answers(sections: Sequence[Section], robot: Robot) -> pd.DataFrame | None:
    """For each part that a run has answered: its letter, question, place and answer; None: there is none."""
    ran = {section.name: section for section in sections}
    asked = [q for q in robot.questions if ran.keys() & set(q.answered_in.split(", "))]
    cells = [[q.part, q.question, q.answered_in, say(answer(ran, *q.answer))] for q in asked]
    return pd.DataFrame(cells, columns=COLUMNS) if cells else None


def answer(ran: Ran, kind: str, *about: Any) -> Finding:
    """One answer; kind, about: see robots.Question."""
    if kind == "figure":
        return Finding("questions", kind, {"name": about[0]})
    if kind == "printed":
        rows = ran["published"].result.rows if "published" in ran else []
        items = {item: [row for row in rows if row.item == item] for item in about}
        return Finding("questions", kind, {"items": items, "is_run": "published" in ran})
    places = range(0, len(about), 3)
    found = [largest(ran, *about[place : place + 3]) for place in places]
    more = [ran[about[place]].result.answer for place in places if about[place] in ran]
    values = {"answers": found, "more": [say(finding) for finding in more if finding]}
    return Finding("questions", kind, values)


def largest(ran: Ran, experiment: str, quantity: str, where: Mapping[str, Any]) -> dict[str, Any]:
    """The largest difference in an experiment: of the rows with these values, or of this quantity."""
    where = where or {"quantity": quantity}
    records = [row.record() for row in ran[experiment].result.rows] if experiment in ran else []
    rows = [record for record in records if all(record.get(key) == value for key, value in where.items())]
    state = "absent" if experiment not in ran else "known" if rows else "empty"
    if any(row["largest_difference"] is None for row in rows):
        state, rows = "diverged", []
    top = max(rows, key=lambda row: row["largest_difference"], default=None)
    return {"experiment": experiment, "quantity": quantity, "state": state, "row": top}
