"""The numbers of a report that plain MuJoCo repeats, and the script in which they stand."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from ..core.text import environment
from .verdict import Report

# quantities of states, and on what each depends beside the positions
QUANTITIES = {"Mbar": (), "holding torque": (), "bias": ("qvel",), "qdd": ("qvel", "tau")}
RECORDED = "experiment", "scene", "quantity", "value", "tolerance"  # of a check


def script(report: Report) -> str:
    """reproduce.py: it repeats the numbers with MuJoCo and NumPy alone, and exits with 1 where one is not the same."""
    plain, said = report.plain or {"why": "no file"}, dict[str, Any](file=report.origin.get("model", ""))
    said |= {"states": [], "runs": [], "smaller": None, "checks": []}
    for section in report.sections if not plain["why"] else ():
        repeated = {part: value for part, value in section.result.repeated.items() if value}
        states = worst_states(section.result.rows, plain)
        numbers = {row["difference"] for row in states} | {run["dt"] for run in repeated.get("runs", ())}
        numbers |= {repeated["smaller"]["error"]} if "smaller" in repeated else set()
        records = [check.record() for check in section.result.checks if check.value]
        about = [record for record in records if numbers & {record["value"], record["tolerance"]}]
        said["checks"] += [{name: record[name] for name in RECORDED} for record in about]
        said["states"] += states
        said |= repeated
    facts = {"command": report.origin["command"], "mujoco": report.origin.get("mujoco"), "plain": plain}
    template = environment().get_template("reproduce.py.jinja")
    return template.render(said=said, lines=lines_of(said), **facts) + "\n"


def worst_states(rows: Sequence[Any], plain: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The worst state of each quantity of an experiment: fields of MjData, and the values of its worst entry."""
    compared = [row for row in rows if hasattr(row, "mujoco_value") and row.worst_difference is not None]
    states = []
    for quantity, asked in QUANTITIES.items():
        group = [row for row in compared if row.quantity == quantity]
        row = max(group, key=lambda row: row.difference_over_bar or 0.0, default=None)
        if row is None:
            continue
        still = [0.0] * len(plain["dofs"])
        fields = {"qpos": list(plain["first"]), "qvel": list(still), "tau": list(still)}
        written = {"qpos": row.worst_q, "qvel": row.worst_qd, "tau": row.worst_tau}
        for name in ("qpos", *asked):
            for place, number in zip(plain["qpos" if name == "qpos" else "dofs"], written[name].split()):
                fields[name][place] = float(number)
        entry = [plain["dofs"][int(k)] for k in row.worst_entry.split()]
        values = {"quantity": quantity, "entry": entry, "other": row.worst_value, "mujoco": row.mujoco_value}
        states.append(values | {"difference": row.worst_difference, "tolerance": row.bar} | fields)
    return states


def lines_of(said: Mapping[str, Any]) -> list[str]:
    """The numbers as JSON, a line for each state, run and check."""
    lines = []
    for name, value in said.items():
        rows = [json.dumps(row) for row in value] if isinstance(value, list) else []
        lines.append(f' "{name}": ' + ("[\n  " + ",\n  ".join(rows) + "]" if rows else json.dumps(value)))
    return lines
