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
        return Finding("questions", "figure", {"name": about[0]})
    if kind == "printed":
        if "published" not in ran:
            return Finding("questions", "not_run")
        items = [printed(ran["published"], item) for item in about]
        return Finding("questions", "printed", {"items": items})
    places = range(0, len(about), 3)
    found = [largest(ran, *about[place : place + 3]) for place in places]
    more = [ran[about[place]].result.answer for place in places if about[place] in ran]
    values = {"answers": found, "more": [say(finding) for finding in more if finding]}
    return Finding("questions", "largest", values)


def largest(ran: Ran, experiment: str, quantity: str, where: Mapping[str, Any]) -> dict[str, Any]:
    """The largest difference in an experiment: of the rows with these values, or of this quantity."""
    about = {"experiment": experiment, "quantity": quantity}
    if experiment not in ran:
        return about | {"state": "absent"}
    where = where or {"quantity": quantity}
    records = [row.record() for row in ran[experiment].result.rows]
    rows = [record for record in records if all(record.get(key) == value for key, value in where.items())]
    if not rows or any(row["largest_difference"] is None for row in rows):
        return about | {"state": "diverged" if rows else "empty"}
    top = max(rows, key=lambda row: row["largest_difference"])
    numbers = {"difference": float(top["largest_difference"]), "unit": top["unit"], "scene": top["scene"]}
    return about | numbers | {"state": "known"}


def printed(section: Section, item: str) -> dict[str, Any]:
    """A printed item, with the numbers of both engines; its unit is None where there is no result."""
    rows = [record for record in (row.record() for row in section.result.rows) if record["item"] == item]
    values = {name: [row[name] for row in rows] for name in ("published", "tmt", "mujoco")}
    return {"item": item, "unit": rows[0]["unit"] if rows else None, **values}
