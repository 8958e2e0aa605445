"""The answers to the questions of a robot's assignment."""

from collections.abc import Mapping, Sequence

import pandas as pd

from ..core.check import Result
from ..core.finding import Finding
from ..core.text import say
from .verdict import Section, as_records


def answers(sections: Sequence[Section], robot) -> pd.DataFrame:
    """For each part that a run has answered: its letter, the question, where it is answered, the answer."""
    results = {section.name: section.result for section in sections}
    asked = [q for q in robot.questions if results.keys() & set(q.answered_in.split(", "))]
    rows = [(q.part, q.question, q.answered_in, say(answer(results, *q.answer))) for q in asked]
    return pd.DataFrame(rows, columns=["part", "question", "answered in", "answer"])


def answer(results: Mapping[str, Result], kind: str, *about) -> Finding:
    """One answer: ("figure", name), ("printed", items ...) or ("largest", experiment, quantity, {column: value}, ...)."""
    if kind == "figure":
        return Finding("questions", "figure", {"name": about[0]})
    if kind == "printed":
        if "published" not in results:
            return Finding("questions", "not_run")
        return Finding(
            "questions", "printed", {"items": [printed(results["published"], item) for item in about]}
        )
    found = [largest(results, *about[k : k + 3]) for k in range(0, len(about), 3)]
    is_of_runs = "trajectory" in about and "trajectory" in results
    errors, steps = true_errors(results["trajectory"]) if is_of_runs else ({}, None)
    return Finding("questions", "largest", {"answers": found, "errors": errors, "steps": steps})


def largest(
    results: Mapping[str, Result], experiment: str, quantity: str, where: Mapping[str, object]
) -> dict:
    """The largest difference of the engines in an experiment: of the rows with these values, or of this quantity."""
    about = {"experiment": experiment, "quantity": quantity}
    if experiment not in results:
        return about | {"state": "absent"}
    where = where or {"quantity": quantity}
    rows = [
        row
        for row in as_records(results[experiment].rows)
        if all(row.get(key) == value for key, value in where.items())
    ]
    if not rows or any(row["largest_difference"] is None for row in rows):
        return about | {"state": "diverged" if rows else "empty"}
    top = max(rows, key=lambda row: row["largest_difference"])
    numbers = {"difference": float(top["largest_difference"]), "unit": top["unit"], "scene": top["scene"]}
    return about | numbers | {"state": "known"}


def printed(result: Result, item: str) -> dict:
    """A printed item, with the numbers of both engines; its unit is None where there is no result."""
    rows = [row for row in as_records(result.rows) if row["item"] == item]
    values = {name: [row[name] for row in rows] for name in ("published", "tmt", "mujoco")}
    return {"item": item, "unit": rows[0]["unit"] if rows else None, **values}


def true_errors(result: Result) -> tuple[dict, int | None]:
    """Errors of both engines against the true motion with the coarsest steps of each scene, and their number if it is one."""
    errors = getattr(result, "errors", {})
    counts = {min(run.steps for run in result.runs if run.case.name == scene) for scene in errors}
    return errors, min(counts) if len(counts) == 1 else None
