"""Other engines that read the robot's file: what each has read, its equations, its integrators."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ...core.check import ENDS, About, Result
from ...core.finding import Finding
from ...core.rows import Row, column
from ...core.words import some_of
from ...diagnosis import Values, diagnose
from ...engines import LABELS, RECORDS, EngineRecord
from ...engines.outside import Outside, OutsideDynamics
from ...engines.outside.model import EngineError, Reading, TooLong, Unread, size_of
from ...judge.agree import closest, over
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.states import Sample
from .. import Experiment
from ..quantities import QUANTITIES
from ..setup import Setup
from . import integrators

EXPERIMENT = Experiment(order=65, serves_own=False, in_quick=False)
COMPARED = ("Mbar", "bias", "qdd")
UNITS = {"gravity": "m/s2", "mass": "kg", "moments": "kg m2", "com": "m", "inertia": "kg m2",
         "armature": "kg m2", "damping": "N m s/rad", "stiffness": "N m/rad"}  # fmt: skip
OF_BODIES = "mass", "moments"  # no convention makes these differ
ENTRIES = {"mass": 1, "moments": 3, "com": 3, "inertia": 9}  # of a joint
AS_READ = "as read"  # checks of numbers
SECONDS = 5.0  # of the search for the cause of a difference
SHOWN = ["engine", "quantity", "unit", "states", "worst_difference", "bar", "difference_over_bar",
         "difference_eps", "mujoco_eps"]  # fmt: skip


@dataclass
class EngineRow(Row):
    """A quantity of an engine compared with exact values."""

    SHARE = "difference_over_bar"
    engine: str
    precision: str
    quantity: str
    unit: str
    states: int
    worst_difference: float | None
    bar: float
    difference_over_bar: float | None = None
    difference_eps: float = np.inf  # the largest distance from the exact value
    mujoco_eps: float = np.inf
    worst_q: str = ""
    worst_qd: str = ""
    worst_tau: str = ""
    passed: bool = False


@dataclass
class ReadRow(Row):
    """A number that an engine has read differently, or why it cannot read the file."""

    engine: str
    number: str | None = column(optional=True)
    of: str | None = column(optional=True)
    read: float | None = column(optional=True)
    compared: float | None = column(optional=True)
    unit: str | None = column(optional=True)
    set_by_this_program: bool | None = column(optional=True)
    why_not: str | None = None


@dataclass
class EnginesResult(Result):
    mended: dict[str, list[str]] = field(default_factory=dict)  # the numbers of each engine that are set here


def skipped(robot: Robot) -> Finding | None:
    engines = [Outside(name) for name, record in RECORDS.items() if record.reads_file]
    if any(not engine.unavailable() for engine in engines):
        return None
    return Finding("engines", "none_installed", {"extras": [engine.record.extra for engine in engines]})


def rows(setup: Setup) -> EnginesResult:
    """What each installed engine has read, its M, h and accelerations, and its integrators."""
    result = EnginesResult("engines", shown=SHOWN, tables={"engines_read": [], "engines_methods": []})
    absent: dict[str, list[str]] = {}
    for engine in [engine for engine in setup.engines.values() if isinstance(engine, Outside)]:
        label = LABELS[engine.name]
        try:
            if reason := engine.unavailable():
                absent.setdefault(reason, []).append(label)
            else:
                compare_engine(result, setup, engine)
        except Unread as error:
            result.tables["engines_read"].append(ReadRow(label, why_not=str(error)))
            result.find("unread", engine=label, reason=str(error).rstrip("."))
        except TooLong as error:
            result.find("left_out", what=label, reason=str(error))
        except EngineError as error:
            result.check(label, ENDS, None, 0.0, "", str(error), rule="equal", about=About.ENGINE)
    for reason, labels in absent.items():
        result.find("absent", engines=labels, reason=reason)
    if result.rows:
        integrators.follow_known(result, setup)
        add_answer(result)
    return result


def add_answer(result: EnginesResult) -> None:
    """Which engines differ, which have read other numbers, and how far each is from the exact values."""
    largest: dict[str, float] = {}
    for row in result.rows:
        largest[row.engine] = max(row.difference_eps, largest.get(row.engine, 0.0))
    differing = dict.fromkeys(row.engine for row in result.rows if not row.passed)
    failed = {check.scene for check in result.checks if check.quantity.endswith(AS_READ) and check.failed}
    misread = [label for label in largest if label in failed]
    values: dict[str, Any] = {"engines": [*largest], "differing": [*differing], "misread": misread}
    values |= {"largest": largest, "mended": result.mended}
    result.headline = result.finding("headline", **values)
    result.top.append(result.finding("answer", **values))


def compare_engine(result: EnginesResult, setup: Setup, engine: Outside) -> None:
    setup.progress(f"engines: {engine.record.label}{' compiles' * engine.record.compiles}")
    dynamics = engine.of(setup.robot.case())
    compare_numbers(result, setup.robot, engine.record, dynamics.reading)
    compare_quantities(result, setup, engine.record, dynamics)
    if all(dynamics.reading["mended"].values()):
        integrators.compare_methods(result, setup, engine)


def compare_numbers(result: EnginesResult, robot: Robot, record: EngineRecord, reading: Reading) -> None:
    """Rows of what the engine has read differently, and checks of the masses and moments of inertia."""
    for number, values in reading["read"].items():
        stated = reading["stated"][number]
        tolerance = FACTOR * record.eps * size_of(reading["stated"], number)
        if number in OF_BODIES:
            what, most = f"{number} {AS_READ}", np.abs(values - stated).max(initial=0.0)
            result.check(record.label, what, most, tolerance, UNITS[number], "", True, about=About.ENGINE)
        if number not in reading["mended"] or (number == "inertia" and "moments" in reading["mended"]):
            continue
        is_set = bool(reading["mended"][number])
        differing = [
            ReadRow(record.label, number, name, float(read), float(compared), UNITS[number], is_set)
            for name, read, compared in zip(named_after(robot, number), np.ravel(values), np.ravel(stated))
            if not abs(read - compared) <= tolerance
        ]
        result.tables["engines_read"] += differing
        result.find("read_differently", engine=record.label, rows=differing, number=number, mended=is_set)
        if is_set:
            result.mended.setdefault(record.label, []).append(number)


def named_after(robot: Robot, number: str) -> list[str]:
    """What each entry of a number belongs to."""
    if number == "gravity":
        return list("xyz")
    tree, names = robot.tree, []
    if number not in ENTRIES:
        return list(robot.coordinates.speeds)
    for k, joint in enumerate(robot.joints):
        bodies = [body for body, of_joint in zip(tree.body_names, tree.body_joint) if of_joint == k]
        names += [some_of(bodies) or joint] * ENTRIES[number]
    return names


def compare_quantities(
    result: EnginesResult, setup: Setup, record: EngineRecord, dynamics: OutsideDynamics
) -> None:
    """Rows and checks of M, h and accelerations at the states that have exact values."""
    sample, mujoco = asked_at(setup, record.precision), setup.engines["mujoco"].of(setup.robot.case())
    computed = {}
    for name in COMPARED:
        function = QUANTITIES[name].function
        if not dynamics.has(function):
            result.find("no_function", engine=record.label, quantity=name)
            continue
        states = QUANTITIES[name].states(sample)
        computed[name] = getattr(dynamics, function)(*states)
        compare_quantity(result, sample, record, name, computed[name], getattr(mujoco, function)(*states))
    differs = any(row.engine == record.label and not row.passed for row in result.rows)
    if differs and {"Mbar", "bias"} <= computed.keys():
        tree, tolerance = sample.tree, FACTOR * record.eps
        values = Values.of(tree, sample.q, sample.qd, computed["Mbar"], computed["bias"], tolerance)
        result.find("cause", engine=record.label, text=diagnose(tree, values, SECONDS).sentence())


def compare_quantity(
    result: Result, sample: Sample, record: EngineRecord, name: str, values: np.ndarray, by_mujoco: np.ndarray
) -> None:
    """A check of the entry that is closest to its tolerance, and a row."""
    quantity, scale, eps = QUANTITIES[name], Entries(sample.tree, sample.q, sample.qd), record.eps
    exact = quantity.exact(sample)
    size = np.broadcast_to(quantity.size(scale, sample.tau, exact.high), values.shape)
    difference, tolerance = exact.distance(values), FACTOR * eps * size
    worst = closest(difference, tolerance)
    numbers = {name: [repr(float(x)) for x in getattr(sample, name)[worst[0]]] for name in ("q", "qd", "tau")}
    note = "; ".join(f"{argument} = ({', '.join(numbers[argument])})" for argument in quantity.arguments)
    units, pair = quantity.unit(sample.tree), (difference[worst], tolerance[worst])
    check = result.check(record.label, f"{name} to exact", *pair, units, note, True, about=About.ENGINE)
    row = EngineRow(record.label, record.precision, name, units, len(sample.q), check.value, check.tolerance)
    row.difference_over_bar, row.passed = check.over_tolerance, check.passed
    row.difference_eps = float(over(difference, eps * size).max())
    row.mujoco_eps = float(over(exact.distance(by_mujoco), EPS * size).max())
    row.worst_q, row.worst_qd, row.worst_tau = (" ".join(of_state) for of_state in numbers.values())
    result.rows.append(row)


def asked_at(setup: Setup, precision: str) -> Sample:
    """The random states that have exact values, and the Tree, with numbers that this precision has."""
    sample = setup.random
    states = (values[: sample.exact_states] for values in (sample.q, sample.qd, sample.tau))
    q, qd, tau = (values.astype(precision).astype(float) for values in states)
    return Sample(setup.robot.tree, sample.name, q, qd, tau, sample.exact_states)


def figures(result: EnginesResult, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_engines  # matplotlib is for the process that draws

    if result.rows:
        yield partial(figures_engines.draw_distances, result)
    if result.tables["engines_methods"]:
        yield partial(figures_engines.draw_errors, result)
