"""The answers to the questions of a robot's assignment, and to what a user of MuJoCo asks."""

from collections.abc import Mapping, Sequence

from ..judge import units
from ..judge.check import Result
from .methods_compared import ERROR_ASKED, engine_in_print, steps_in_words
from .overview import times_in_print
from .verdict import Section

NOTHING = "no result: the experiment broke off"


def answers(sections: Sequence[Section], robot) -> list[tuple[str, str, str, str]]:
    """For each part: its letter, what is asked, where it is answered, the answer."""
    results = {section.name: section.result for section in sections}
    parts = [(q.part, q.asked, q.answered_in, answer_in_words(results, *q.answer)) for q in robot.questions]
    return [*parts, *choice(results)]


def answer_in_words(results: Mapping[str, Result], kind: str, *of) -> str:
    """One answer: ("figure", name), ("printed", items ...) or ("largest", experiment, quantity, {column: value}, ...)."""
    if kind == "figure":
        return f"figure '{of[0]}'"
    if kind == "printed":
        return printed(results, of)
    texts = "; ".join(apart_in_words(results, *of[k : k + 3]) for k in range(0, len(of), 3))
    return texts + far_from_true(results) if "trajectory" in of else texts


def apart_in_words(results: Mapping[str, Result], name: str, quantity: str, where: Mapping[str, object]) -> str:
    """How far the engines are apart in an experiment at most: of the rows with these values, or of this quantity."""
    if name not in results:
        return "not run"
    where = where or {"quantity": quantity}
    rows = [row for row in results[name].rows if all(row.get(key) == value for key, value in where.items())]
    if not rows:
        return NOTHING
    if any(row["largest_difference"] is None for row in rows):
        return "diverged"
    top = max(rows, key=lambda row: row["largest_difference"])
    judged = ", while judged" if name == "trajectory" else ""
    return f"{quantity}: at most {top['largest_difference']:.1e} {top['unit']} apart ({top['scene']}{judged})"


def printed(results: Mapping[str, Result], items: Sequence[str]) -> str:
    """What is printed, beside what the engines find."""
    if "published" not in results:
        return "not run"
    texts = []
    for item in items:
        rows = [row for row in results["published"].rows if row["item"] == item]
        if not rows:
            return NOTHING
        values = {
            name: "(" + ", ".join(f"{row[name]:.6g}" for row in rows) + ")" for name in ("published", "tmt", "mujoco")
        }
        texts.append(
            f"{item}: printed {values['published']}, TMT {values['tmt']}, MuJoCo {values['mujoco']} {rows[0]['unit']}"
        )
    return "; ".join(texts)


def far_from_true(results: Mapping[str, Result]) -> str:
    """What the agreement of two runs with the coarse step does not say: how far both are from the true motion."""
    errors = results["trajectory"].curves.get("errors") if "trajectory" in results else None
    if not errors:
        return ""
    of_scenes = [
        f"{scene}: " + " and ".join("diverged" if error is None else f"{error:.2g}" for error in of_scene)
        for scene, of_scene in errors.items()
    ]
    runs = results["trajectory"].curves["runs"]
    counts = {min(steps for name, _, steps in runs if name == scene) for scene in errors}
    own = f"its {min(counts)} steps" if len(counts) == 1 else "the coarsest steps of each scene"
    return (
        f". Agreement is not truth: with {own} the runs of TMT and MuJoCo are at most so many rad from the true "
        f"motion: {'; '.join(of_scenes)}"
    )


def choice(results: Mapping[str, Result]) -> list[tuple]:
    """What a user of MuJoCo asks: which integrator, which step: a line of the table, of the caption's scene if it has one."""
    lines = results["speed"].tables.get("what_should_i_use", []) if "speed" in results else []
    named = [line for line in lines if units.value(line, "target") == ERROR_ASKED and line["mujoco"] and line["tmt"]]
    if not named:
        return []
    regular = results["speed"].curves.get("regular")
    line = next((line for line in named if line["scene"] == regular), named[0])
    theirs, ours = (steps_in_words(line[engine], line.get(f"{engine}_dt_s")) for engine in ("mujoco", "tmt"))
    theirs = theirs.replace("mujoco", engine_in_print("mujoco"), 1)
    of_scene = (
        row["dt_s"] * row["steps"] for row in results["speed"].rows if row["scene"] == line["scene"] and row["dt_s"]
    )
    error = f"{units.value(line, 'target'):.0e} {line.get('unit', 'rad')}"
    text = (
        f"What should I use? For {error} over {next(of_scene):.4g} s ({line['scene']}): {theirs}, "
        f"{times_in_print(line['mujoco_ms'])} ms, or {ours}, {times_in_print(line['tmt_ms'])} ms; more in the table of that name."
    )
    return [("", "which integrator and which step", "speed", text)]
