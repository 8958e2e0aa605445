"""Other engines: do they read the same numbers of the file, compute the same M, h and accelerations, and run it as it is?"""

from pathlib import Path
from typing import Any

import numpy as np

from ...core.check import ENDS, About, Result
from ...core.finding import Finding
from ...core.text import say
from ...engines import LABELS, RECORDS, EngineRecord
from ...engines.outside import Outside, OutsideDynamics, answers
from ...engines.outside.as_it_runs import Run
from ...engines.outside.file import EngineError, OtherJoints, OtherNames, TooLong, Unread
from ...judge.agree import closest, over
from ...judge.entries import Entries
from ...judge.run import movement_unit
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.coordinates import Coordinates
from ...robots.states import Sample
from ..quantities import QUANTITIES
from ..setup import Setup
from .features import feature_of_speeds
from .readings import compare_numbers
from .tables import AnswerRow, EngineRow, EnginesResult, ReadRow, RunRow

COMPARED = ("Mbar", "bias", "qdd")
MOST_SHOWN = 12  # speeds of a robot whose state stands in the note of a check
ITERATIONS = 2, 4, 100  # that are tried where a field differs
SLOW = 20.0  # s of the processor, of a run that is slow
TABLES = "answer", "read", "runs"
# of which nothing more is said; their names are kinds in the template
NOT_ASKED = Unread, OtherJoints, OtherNames, TooLong
# s, of the first calls of an engine that compiles: in all, per speed and pair of speeds; measured on two
# cores
COMPILATION = 15.0, 1.0, 0.05


def skipped(robot: Robot) -> Finding | None:
    engines = [Outside(name) for name, record in RECORDS.items() if record.reads_file]
    extras = [engine.record.extra for engine in engines if engine.unavailable()]
    return Finding("engines", "none_installed", {"extras": extras}) if len(extras) == len(engines) else None


def rows(setup: Setup) -> EnginesResult:
    """What each installed engine has read, its M, h and accelerations, and the file as it runs there.

    An engine that compiles, which may take minutes, comes last: what others have found is told before.
    """
    result = EnginesResult("engines", tables={f"engines_{name}": [] for name in TABLES})
    absent: dict[str, list[str]] = {}
    others = [engine for engine in setup.engines.values() if isinstance(engine, Outside)]
    for engine in others:
        if reason := engine.unavailable():
            absent.setdefault(reason, []).append(LABELS[engine.name])
    others = [engine for engine in others if not engine.unavailable()]
    others.sort(key=lambda engine: engine.record.compiles)
    for number, engine in enumerate(others, 1):
        result.answers[LABELS[engine.name]] = {}
        compare_engine(result, setup, engine)
        row = add_answer(result, engine.record)
        if any(other.record.compiles for other in others[number:]):
            setup.tell(say(result.finding("engine", row=row)))
    for reason, labels in absent.items():
        result.find("absent", engines=labels, reason=reason)
    verdicts = {label: is_same(answer) for label, answer in result.answers.items()}
    values: dict[str, Any] = {"name": Path(setup.robot.mjcf).name, "verdicts": verdicts, "absent": absent}
    values["rows"] = result.tables["engines_answer"]
    result.headline = result.finding("headline", **values)
    result.top.append(result.finding("answer", **values))
    return result


def is_same(answer: dict[str, Any]) -> bool | None:
    """Whether an engine computes what MuJoCo does; None: it was not judged."""
    if "why_not" in answer or "equations" not in answer:
        return None
    reads, runs = answer["reads"], answer.get("runs")
    is_run = not runs or "why_not" in runs or any(run.first is None for run in runs["runs"])
    return not reads["rows"] and not answer["equations"]["differ"] and is_run


def add_answer(result: EnginesResult, record: EngineRecord) -> AnswerRow:
    """The row of an engine."""
    answer, label = result.answers[record.label], record.label
    cells = [say(result.finding(f"cell_{cell}", answer=answer)) for cell in ("reads", "equations", "runs")]
    row = AnswerRow(label, record.precision, *cells)
    result.tables["engines_answer"].append(row)
    return row


def compare_engine(result: EnginesResult, setup: Setup, engine: Outside) -> None:
    """All that is asked of an engine, until it does not answer."""
    record, label, nv = engine.record, engine.record.label, setup.robot.coordinates.nv
    answer, (fixed, by_speed, by_pair) = result.answers[label], COMPILATION
    seconds = fixed + by_speed * nv + by_pair * nv**2 if record.compiles else None
    setup.progress(say(result.finding("asks", engine=label, seconds=seconds, speeds=nv)))
    dynamics = engine.of(setup.robot.case())
    try:
        compare_numbers(result, setup.robot, record, dynamics.file, dynamics.reading)
        compare_quantities(result, setup, record, dynamics)
        add_runs(result, setup, record, dynamics)
    except NOT_ASKED as error:
        kind, reason = type(error).__name__, str(error).rstrip(".")
        cause = feature_of_speeds(dynamics.file, error.speeds) if isinstance(error, OtherJoints) else None
        answer["why_not"] = {"kind": kind, "reason": reason}
        result.tables["engines_read"].append(ReadRow(label, cause=cause, why_not=str(error)))
        result.find("not_asked", why=kind, engine=label, reason=reason, cause=cause)
    except EngineError as error:
        answer["why_not"] = {"kind": "EngineError", "reason": str(error)}
        result.check(label, ENDS, None, 0.0, "", str(error), rule="equal", about=About.ENGINE)


def compare_quantities(
    result: EnginesResult, setup: Setup, record: EngineRecord, dynamics: OutsideDynamics
) -> None:
    """Rows and checks of M, h and accelerations at the states that have exact values, with the numbers that can be set."""
    sample, mujoco = asked_at(setup, record.precision), setup.engines["mujoco"].of(setup.robot.case())
    made = []
    for name in COMPARED:
        quantity = QUANTITIES[name]
        states = quantity.states(sample)
        values, of_mujoco = (getattr(of, quantity.function)(*states) for of in (dynamics, mujoco))
        made.append(compare_quantity(result, sample, record, name, values, of_mujoco))
    differ = [row.worst_entry for row in made if not row.passed]
    eps = max(row.difference_eps for row in made)
    result.answers[record.label]["equations"] = {"differ": differ, "eps": eps}


def compare_quantity(
    result: Result, sample: Sample, record: EngineRecord, name: str, values: np.ndarray, of_mujoco: np.ndarray
) -> EngineRow:
    """A check of the entry that is closest to its tolerance, and a row."""
    quantity, scale, eps = QUANTITIES[name], Entries(sample.tree, sample.q, sample.qd), record.eps
    exact = quantity.exact(sample)
    size = np.broadcast_to(quantity.size(scale, sample.tau, exact.high), values.shape)
    distance, tolerance = exact.distance(values), FACTOR * eps * size
    state, *entry = worst = closest(distance, tolerance)
    at = {name: [repr(float(x)) for x in getattr(sample, name)[state]] for name in ("q", "qd", "tau")}
    note = "; ".join(f"{argument} = ({', '.join(at[argument])})" for argument in quantity.arguments)
    note = note if sample.tree.coordinates.nv <= MOST_SHOWN else sample.describe(state)
    unit = quantity.unit(sample.tree)
    numbers = distance[worst], tolerance[worst]
    check = result.check(record.label, f"{name} to exact", *numbers, unit, note, True, about=About.ENGINE)
    names = Coordinates(sample.tree.joint_names, sample.tree.kind).speeds
    result.rows.append(EngineRow(
        engine=record.label, precision=record.precision, quantity=name, unit=unit, states=len(sample.q),
        worst_difference=check.value, bar=check.tolerance, difference_over_bar=check.over_tolerance,
        difference_eps=float(over(distance, eps * size).max()),
        mujoco_eps=float(over(exact.distance(of_mujoco), EPS * size).max()),
        worst_entry=f"{name}[{', '.join(names[k] for k in entry)}]", passed=check.passed,
    ))  # fmt: skip
    return result.rows[-1]


def asked_at(setup: Setup, precision: str) -> Sample:
    """The random states that have exact values, and the Tree, with numbers that this precision has."""
    sample = setup.random
    states = (values[: sample.exact_states] for values in (sample.q, sample.qd, sample.tau))
    q, qd, tau = (values.astype(precision).astype(float) for values in states)
    return Sample(setup.robot.tree, sample.name, q, qd, tau, sample.exact_states)


def add_runs(result: EnginesResult, setup: Setup, record: EngineRecord, dynamics: OutsideDynamics) -> None:
    """Rows and a check of the file as it runs in an engine that steps MuJoCo's model.

    Where a field differs, it runs with more iterations too, until none does: what the solver has not
    converged to is not the engine's error. Where compilation is slow, with the most iterations alone.
    """
    answer, unit, runs = result.answers[record.label], movement_unit(setup.robot.coordinates), list[Run]()
    more: list[int | None] = [None, *ITERATIONS]
    while more and not (runs and runs[-1].first is None):
        iterations = more.pop(0)
        if iterations is not None and iterations <= runs[0].iterations:
            continue
        try:
            run = dynamics.ask(answers.run_as_it_is, iterations)
        except EngineError as error:
            if not runs:
                answer["runs"] = {"why_not": str(error).rstrip(".")}
                result.find("not_run", engine=record.label, reason=str(error).rstrip("."))
                return
            break
        if run is None:  # the engine has no model of MuJoCo's
            return
        runs.append(run)
        more = more[-1:] if run.seconds > SLOW else more
    answer["runs"] = {"runs": runs, "unit": unit}
    for run in runs:
        fields = run.first._asdict() if run.first else {}
        first: dict[str, Any] = {f"first_{name}": value for name, value in fields.items()}
        apart: dict[str, Any] = {f"apart_{steps}": run.apart.get(steps) for steps in (1, 10, 100)}
        result.tables["engines_runs"].append(RunRow(
            engine=record.label, iterations=run.iterations, ls_iterations=run.ls_iterations, own_settings=run is runs[0],
            unit=unit, **apart, **first,
        ))  # fmt: skip
    last, note = runs[-1], ""
    if last.first:
        note = f"{last.first.field}[{last.first.of}] at step {last.first.step}"
    what = f"a step from MuJoCo's own states, over its tolerance, {last.iterations} iterations"
    result.check(record.label, what, last.over, 1.0, "", note, True, about=About.ENGINE)
    result.find("runs", engine=record.label, runs=runs, unit=unit)
