"""The outcome of a report in words: sections, verdict, the answers to the assignment's questions."""

from dataclasses import dataclass, field

import pandas as pd

from . import motion
from .agreement import DRAWN, ENDS, LOCKABLE


@dataclass
class Section:
    """One experiment in the report."""

    name: str
    title: str
    claim: str
    bar: str
    result: object
    figures: list = field(default_factory=list)  # (file name, caption)

    @property
    def tables(self) -> dict:
        """Its tables that have rows, by their names; its own first."""
        tables = {self.name: self.result.rows} | self.result.tables
        return {name: rows for name, rows in tables.items() if rows}


def failures(sections) -> tuple[list, list]:
    """The checks that fail: those that compare, and those that say that something broke off."""
    failed = [check for section in sections for check in section.result.checks if not check.passed]
    broke = [check for check in failed if check.quantity in (ENDS, LOCKABLE) or check.quantity.startswith(f"{DRAWN} ")]
    return [check for check in failed if check not in broke], broke


def passed(sections) -> bool:
    return not any(failures(sections))


def worst(sections):
    """The check that uses most of a tolerance of rounding, or None."""
    checks = [check for section in sections for check in section.result.checks if check.over_bar is not None]
    return max(checks, key=lambda check: check.over_bar, default=None)


def verdict(sections, experiments, causes=()) -> str:
    """The outcome in words, with its cause or its worst figure; `experiments`: how many there are in all."""
    checks = [check for section in sections for check in section.result.checks]
    names = ", ".join(section.name for section in sections)
    ran = "" if len(sections) == experiments else f" in {names} ({len(sections)} of {experiments} experiments)"
    differing, broke = failures(sections)
    stopped = f"Broken off: {'; '.join(f'{check.experiment}, {check.note}' for check in broke)}."
    if differing:
        text = f"The two models do not agree{ran}: {len(differing)} of {len(checks)} checks fail. "
        if causes:
            more = f", and {len(causes) - 1} more" if len(causes) > 1 else ""
            others = sum(check.experiment != "parameters" for check in differing)
            further = "further " if len(differing) > others else ""
            follow = f" {others} {further}checks fail as a consequence." if others else ""
            text += f"Cause: {causes[0]['text']}{more}.{follow}"
        else:
            text += f"First: {differing[0]}."
        return f"{text} {stopped}" if broke else text
    if broke:
        return f"Not everything could be compared{ran}; the other {len(checks) - len(broke)} checks pass. {stopped}"
    text = f"The two models agree{ran}: all {len(checks)} checks pass."
    top = worst(sections)
    if top is None or top.value == 0.0:
        return text
    where = f"{top.quantity}, {top.scene}" + (f", {top.note}" if top.note else "")
    return (
        f"{text} The difference that comes closest to its rounding tolerance is {top.value:.2g} {top.unit}".rstrip()
        + f", {100 * top.over_bar:.2g} % of it ({top.experiment}: {where})."
    )


def outcome(section) -> str:
    """Whether a section's claim holds, in words."""
    checks = section.result.checks
    differing, broke = failures([section])
    if differing:
        return f"It does not hold: {len(differing)} of {len(checks)} checks fail."
    if broke:
        return f"It is not decided: {broke[0].quantity} does not hold ({broke[0].note})."
    return f"It holds: all {len(checks)} checks pass."


def answers(sections) -> pd.DataFrame:
    """The assignment's parts (a) to (i): what is asked, where it is answered, the answer."""
    results = {section.name: section.result for section in sections}
    nothing = "no result: the experiment broke off"

    def apart(name, quantity, **where):
        if name not in results:
            return "not run"
        where = where or {"quantity": quantity}
        rows = [row for row in results[name].rows if all(row.get(key) == value for key, value in where.items())]
        if not rows:
            return nothing
        if any(row["largest_difference"] is None for row in rows):
            return "diverged"
        top = max(rows, key=lambda row: row["largest_difference"])
        judged = ", while judged" if name == "trajectory" else ""
        return f"{quantity}: at most {top['largest_difference']:.1e} {top['unit']} apart ({top['scene']}{judged})"

    def printed(*items):
        if "published" not in results:
            return "not run"
        texts = []
        for item in items:
            rows = [row for row in results["published"].rows if row["item"] == item]
            if not rows:
                return nothing
            values = {
                party: "(" + ", ".join(f"{row[party]:.6g}" for row in rows) + ")"
                for party in ("published", "tmt", "mujoco")
            }
            unit = rows[0]["unit"]
            texts.append(
                f"{item}: printed {values['published']}, TMT {values['tmt']}, MuJoCo {values['mujoco']} {unit}"
            )
        return "; ".join(texts)

    parts = (
        ("a", "sketch of the arm with its hinges", "parameters", "figure 'arm'"),
        ("b", "positions of the centres of mass", "kinematics", apart("kinematics", "x_b")),
        ("c", "torques that hold the zero posture", "published, gravity", printed("c")),
        ("d", "angular velocities in body axes", "kinematics", apart("kinematics", "omega_b")),
        (
            "e",
            "equations of motion by TMT",
            "mass, acceleration",
            apart("mass", "Mbar") + "; " + apart("acceleration", "bias"),
        ),
        ("f", "accelerations from rest that can be foreseen", "published", printed("f1", "f2", "f3", "f4")),
        ("g", "Mbar at the zero posture, by rows", "published, mass", printed("g")),
        ("h", "torques that hold ball catch", "published, gravity", printed("h")),
        (
            "i",
            "five seconds of motion by RK4",
            "trajectory",
            apart("trajectory", "RK4, angles", level="open loop", twin="rk4") + far_from_true(results),
        ),
    )
    return pd.DataFrame([*parts, *choice(results)], columns=["part", "asked", "answered in", "answer"])


def far_from_true(results) -> str:
    """What the agreement of two runs with the assignment's step does not say: how far both are from the true motion."""
    if "trajectory" not in results or not results["trajectory"].curves.get("runs"):
        return ""
    errors = motion.held_errors(results["trajectory"]) | motion.free_errors(results["trajectory"])
    told = [
        f"{scene}: " + " and ".join("diverged" if error is None else f"{error:.2g}" for error in of_scene)
        for scene, of_scene in errors.items()
    ]
    return (
        f". Agreement is not truth: with its 64 steps the runs of TMT and MuJoCo are at most so many rad from the true "
        f"motion: {'; '.join(told)}"
    )


def choice(results) -> list[tuple]:
    """What a user of MuJoCo asks: which integrator, which step; one line of the table that answers it."""
    lines = results["speed"].tables.get("what_should_i_use", []) if "speed" in results else []
    line = next((line for line in lines if line["target_rad"] == 1e-6 and line["mujoco"] and line["tmt"]), None)
    if line is None:
        return []
    answer = (
        f"What should I use? For {line['target_rad']:.0e} rad over five seconds ({line['scene']}): {line['mujoco']} "
        f"({line['mujoco_ms']:.2g} ms), or {line['tmt']} ({line['tmt_ms']:.2g} ms); more in the table of that name."
    )
    return [("", "which integrator and which step", "speed", answer)]
