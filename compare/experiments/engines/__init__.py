"""Other engines that read the robot's file: what each has read, its equations, its integrators, and which to use."""

import os
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from tmt.compiled.cores import cores

from ...core.check import ENDS, About, Result
from ...core.finding import Finding
from ...engines import LABELS, RECORDS, EngineRecord
from ...engines.outside import Outside, OutsideDynamics
from ...engines.outside.file import EngineError, OtherJoints, OtherNames, TooLong, Unread, Unwritten
from ...engines.outside.model import FROM_FILE, FROM_URDF
from ...judge.agree import closest, over
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.coordinates import free_joints
from ...robots.states import Sample
from .. import Experiment
from ..quantities import QUANTITIES
from ..setup import Setup
from . import answer, batches, integrators, servos
from .causes import joints_lost
from .motion import free_scene
from .readings import compare_numbers, file_of
from .tables import EngineRow, EnginesResult, ReadRow

EXPERIMENT = Experiment(
    order=65, serves_own=False, quick_speeds=0, options=("--engines",), first_screen=("answer", "cheapest")
)
BUSY = 1.5  # load of a core above which other processes take turns
COMPARED = ("Mbar", "bias", "qdd")
TABLES = "answer", "read", "methods", "servos", "batches"
# their names are kinds in the template
NOT_ASKED = Unread, OtherJoints, OtherNames, Unwritten, TooLong


def skipped(robot: Robot) -> Finding | None:
    engines = [Outside(name) for name, record in RECORDS.items() if record.reads_file]
    extras = [engine.record.extra for engine in engines if engine.unavailable()]
    return Finding("engines", "none_installed", {"extras": extras}) if len(extras) == len(engines) else None


def rows(setup: Setup) -> EnginesResult:
    """What each installed engine has read, its M, h and accelerations, its integrators, servos and batches."""
    result = EnginesResult("engines", tables={f"engines_{name}": [] for name in TABLES})
    absent: dict[str, list[str]] = {}
    others = [engine for engine in setup.engines.values() if isinstance(engine, Outside)]
    for engine in others:
        label = LABELS[engine.name]
        try:
            if reason := engine.unavailable():
                absent.setdefault(reason, []).append(label)
            else:
                compare_engine(result, setup, engine)
        except NOT_ASKED as error:
            add_not_asked(result, setup.robot, engine.name, error)
        except EngineError as error:
            result.check(label, ENDS, None, 0.0, "", str(error), rule="equal", about=About.ENGINE)
    for reason, labels in absent.items():
        result.find("absent", engines=labels, reason=reason)
    for label in result.labels(FROM_URDF):
        result.find("urdf", engine=label, numbers=list(result.readers[label].unwritten))
    mujoco = setup.engines["mujoco"]
    for method in () if others else mujoco.methods.values():
        integrators.compare_steps(result, setup, mujoco, method)
    if result.rows or not others:
        integrators.follow_known(result, setup)
        for known in (mujoco, setup.engines["tmt"]):
            servos.follow_step(result, setup, known)
            batches.time_batches(result, setup, known)
        servos.add_sentences(result)
        add_load(result)
        answer.add_answer(result, free_scene(setup))
    return result


def add_load(result: EnginesResult) -> None:
    """A finding where other processes take the cores, where the system tells."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    if load > BUSY * cores():
        result.find("busy", load=load, cores=cores())


def add_not_asked(result: EnginesResult, robot: Robot, engine: str, error: EngineError) -> None:
    """A row and a finding of an engine that takes no part: it refuses the file, or this program does not ask it."""
    label, reason = LABELS[engine], str(error).rstrip(".")
    cause = (
        joints_lost(RECORDS[engine], file_of(robot), error.speeds) if isinstance(error, OtherJoints) else None
    )
    result.tables["engines_read"].append(ReadRow(label, cause=cause and str(cause), why_not=str(error)))
    result.find("not_asked", why=type(error).__name__, engine=label, reason=reason, cause=cause)
    if label not in [row.engine for row in result.rows]:
        result.not_asked.append(label)


def compare_engine(result: EnginesResult, setup: Setup, engine: Outside) -> None:
    setup.progress(f"engines: {engine.record.label}{' compiles' * engine.record.compiles}")
    dynamics = engine.of(setup.robot.case())
    reading = dynamics.reading
    compare_numbers(result, setup.robot, engine.record, reading)
    reads_another = bool(reading["mended"] or reading["lacking"]) and reading["way"] != FROM_URDF
    as_read = engine.as_read(setup.robot.case()) if reads_another else None
    compare_quantities(result, setup, engine.record, dynamics, as_read)
    free = names_of_free(setup.robot)
    are_right = all(row.passed for row in result.rows if row.engine == engine.record.label)
    if free and reading["way"] == FROM_FILE and "armature" not in reading["mended"] and not are_right:
        result.find("armature_of_free", engine=engine.record.label, joints=free)
    if all(reading["mended"].values()):
        servos.follow_step(result, setup, engine, reads_another)  # soon compiled
        integrators.compare_methods(result, setup, engine)
        batches.time_batches(result, setup, engine)


def names_of_free(robot: Robot) -> list[str]:
    """The free joints that have armature."""
    armature, joints = np.array(robot.tree.armature), robot.coordinates.places.joints
    firsts = [first for first in free_joints(robot.tree) if armature[joints[first].qd.start :][:6].any()]
    return [robot.joints[first].removesuffix(" x") for first in firsts]


def compare_quantities(
    result: EnginesResult, setup: Setup, record: EngineRecord, dynamics: OutsideDynamics,
    as_read: OutsideDynamics | None = None,
) -> None:  # fmt: skip
    """Rows and checks of M, h and accelerations at the states that have exact values. as_read: None: as the others."""
    sample, mujoco = asked_at(setup, record.precision), setup.engines["mujoco"].of(setup.robot.case())
    for name in COMPARED:
        function = QUANTITIES[name].function
        if not dynamics.has(function):
            result.find("no_function", engine=record.label, quantity=name)
            continue
        states = QUANTITIES[name].states(sample)
        values = {"set": getattr(dynamics, function)(*states), "mujoco": getattr(mujoco, function)(*states)}
        try:
            values["read"] = getattr(as_read, function)(*states) if as_read else values["set"]
        except EngineError as error:  # with what it has read it may have no solution
            what = f"{name} of {record.label}, as read"
            result.find("left_out", what=what, reason=str(error).rstrip("."))
            values["read"] = np.full_like(values["set"], np.inf)
        compare_quantity(result, sample, record, name, values)


def compare_quantity(
    result: Result, sample: Sample, record: EngineRecord, name: str, values: dict[str, np.ndarray]
) -> None:
    """A check of the entry that is closest to its tolerance, and a row. values: with the numbers set, as read, MuJoCo's."""
    quantity, scale, eps = QUANTITIES[name], Entries(sample.tree, sample.q, sample.qd), record.eps
    exact = quantity.exact(sample)
    size = np.broadcast_to(quantity.size(scale, sample.tau, exact.high), values["set"].shape)
    distances, tolerance = (
        {which: exact.distance(array) for which, array in values.items()},
        FACTOR * eps * size,
    )
    worst = closest(distances["set"], tolerance)
    numbers = {name: [repr(float(x)) for x in getattr(sample, name)[worst[0]]] for name in ("q", "qd", "tau")}
    note = "; ".join(f"{argument} = ({', '.join(numbers[argument])})" for argument in quantity.arguments)
    unit, pair = quantity.unit(sample.tree), (distances["set"][worst], tolerance[worst])
    check = result.check(record.label, f"{name} to exact", *pair, unit, note, True, about=About.ENGINE)
    result.rows.append(EngineRow(
        engine=record.label, precision=record.precision, quantity=name, unit=unit, states=len(sample.q),
        as_read_over_bar=float(over(distances["read"], tolerance).max()), worst_difference=check.value,
        bar=check.tolerance, difference_over_bar=check.over_tolerance,
        difference_eps=float(over(distances["set"], eps * size).max()),
        mujoco_eps=float(over(distances["mujoco"], EPS * size).max()), passed=check.passed,
    ))  # fmt: skip


def asked_at(setup: Setup, precision: str) -> Sample:
    """The random states that have exact values, and the Tree, with numbers that this precision has."""
    sample = setup.random
    states = (values[: sample.exact_states] for values in (sample.q, sample.qd, sample.tau))
    q, qd, tau = (values.astype(precision).astype(float) for values in states)
    return Sample(setup.robot.tree, sample.name, q, qd, tau, sample.exact_states)


def figures(result: EnginesResult, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_engines as drawn  # matplotlib is for the process that draws

    has_errors = any(row.worst_error for row in result.tables["engines_methods"])
    drawings = {
        drawn.draw_errors: has_errors,
        drawn.draw_servos: result.tables["engines_servos"], drawn.draw_batches: result.tables["engines_batches"],
    }  # fmt: skip
    yield from (partial(draw, result) for draw, is_drawn in drawings.items() if is_drawn)
