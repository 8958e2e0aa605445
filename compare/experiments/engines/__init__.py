"""Other engines that read the robot's file: what each has read, its equations at random states, and its integrators."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from ...core.check import ENDS, About, Result
from ...core.finding import Finding
from ...core.words import some_of
from ...diagnosis import Values, diagnose
from ...engines import LABELS, RECORDS, Engine, EngineRecord
from ...engines.outside import Outside, OutsideDynamics
from ...engines.outside.model import EngineError, TooLong, Unread, size_of
from ...judge.agree import closest, over
from ...judge.entries import Entries, unit
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.states import Sample
from .. import Experiment
from ..quantities import QUANTITIES
from ..setup import Setup
from . import integrators

EXPERIMENT = Experiment(order=65, serves_own=False, in_quick=False)
COMPARED = ("Mbar", "bias", "qdd")
UNITS = {"gravity": "m/s2", "mass": "kg", "moments": "kg m2", "com": "m", "inertia": "kg m2", "armature": "kg m2",
         "damping": "N m s/rad", "stiffness": "N m/rad"}  # fmt: skip
OF_BODIES = "mass", "moments"  # no convention makes these differ
ENTRIES = {"mass": 1, "moments": 3, "com": 3, "inertia": 9}  # of a joint
AS_READ = "as read"  # checks of numbers
SECONDS = 5.0  # of the search for the cause of a difference
SHOWN = ["engine", "quantity", "unit", "states", "worst_difference", "bar", "difference_over_bar", "difference_eps",
         "mujoco_eps"]  # fmt: skip


def skipped(robot: Robot) -> Finding | None:
    engines = [Outside(name) for name, record in RECORDS.items() if record.reads_file]
    if any(not engine.unavailable() for engine in engines):
        return None
    return Finding(
        "engines", "none_installed", {"extras": [RECORDS[engine.name].extra for engine in engines]}
    )


def rows(setup: Setup) -> Result:
    """For each installed engine: what it has read, M, h and accelerations compared with exact values, its integrators."""
    result = Result("engines", shown=SHOWN, curves={"mended": {}})
    result.tables["engines_read"], result.tables["engines_methods"] = [], []
    absent = {}
    for engine in setup.engines.values():
        if not isinstance(engine, Outside):
            continue
        if reason := engine.unavailable():
            absent[LABELS[engine.name]] = reason
            continue
        label = LABELS[engine.name]
        try:
            compare_engine(result, setup, engine, label)
        except Unread as error:
            result.tables["engines_read"].append({"engine": label, "why_not": str(error)})
            result.find("unread", engine=label, reason=str(error).rstrip("."))
        except TooLong as error:
            result.find("left_out", what=label, reason=str(error))
        except EngineError as error:
            result.check(label, ENDS, None, 0.0, "", str(error), rule="equal", about=About.ENGINE)
    for reason in dict.fromkeys(absent.values()):
        result.find(
            "absent", engines=[label for label, why in absent.items() if why == reason], reason=reason
        )
    if result.rows:
        integrators.follow_known(result, setup)
        names, largest = list(dict.fromkeys(row["engine"] for row in result.rows)), {}
        for name in names:
            largest[name] = max(row["difference_eps"] for row in result.rows if row["engine"] == name)
        differing = list(dict.fromkeys(row["engine"] for row in result.rows if not row["passed"]))
        failed = {check.scene for check in result.checks if check.quantity.endswith(AS_READ) and check.failed}
        values = {
            "engines": names,
            "differing": differing,
            "misread": [name for name in names if name in failed],
        }
        values |= {"largest": largest, "mended": result.curves["mended"]}
        result.headline = result.finding("headline", **values)
        result.top.append(result.finding("answer", **values))
    return result


def compare_engine(result: Result, setup: Setup, engine: Engine, label: str) -> None:
    record = RECORDS[engine.name]
    setup.progress(f"engines: {label}{' compiles' * record.compiles}")
    case = setup.robot.case()
    dynamics = engine.of(case)
    compare_numbers(result, setup.robot, label, dynamics.reading, record)
    compare_quantities(result, setup, label, dynamics, record)
    if all(dynamics.reading["mended"].values()):
        integrators.compare_methods(result, setup, engine)


def compare_numbers(result: Result, robot: Robot, label: str, reading: dict, record: EngineRecord) -> None:
    """A row for each number that the engine has read differently, and a check of the masses and moments of inertia."""
    for number, values in reading["read"].items():
        stated = reading["stated"][number]
        tolerance = FACTOR * record.eps * size_of(reading["stated"], number)
        if number in OF_BODIES:
            most = np.abs(values - stated).max(initial=0.0)
            result.check(
                label,
                f"{number} {AS_READ}",
                most,
                tolerance,
                UNITS[number],
                rounding=True,
                about=About.ENGINE,
            )
        if number not in reading["mended"] or (number == "inertia" and "moments" in reading["mended"]):
            continue
        names = named_after(robot, number)
        rows = [
            {"engine": label, "number": number, "of": name, "read": float(a), "compared": float(b), "unit": UNITS[number],
             "set_by_this_program": bool(reading["mended"][number]), "why_not": None}
            for name, a, b in zip(names, np.ravel(values), np.ravel(stated))
            if not abs(a - b) <= tolerance
        ]  # fmt: skip
        result.tables["engines_read"] += rows
        result.find(
            "read_differently", engine=label, rows=rows, number=number, mended=bool(reading["mended"][number])
        )
        if reading["mended"][number]:
            result.curves.setdefault("mended", {}).setdefault(label, []).append(number)


def named_after(robot: Robot, number: str) -> list[str]:
    """What each entry of a number belongs to."""
    if number == "gravity":
        return list("xyz")
    joints, tree = robot.joints, robot.tree
    if number in ENTRIES:
        names = [
            some_of([body for body, at in zip(tree.body_names, tree.body_joint) if at == k]) or joints[k]
            for k in range(len(joints))
        ]
        return [name for name in names for _ in range(ENTRIES[number])]
    return list(robot.coordinates.speeds)


def compare_quantities(
    result: Result, setup: Setup, label: str, dynamics: OutsideDynamics, record: EngineRecord
) -> None:
    """Rows and checks: M, h and accelerations at the states that have exact values, in eps of the engine's precision."""
    sample, eps = asked_at(setup, record.precision), record.eps
    scale, mujoco = Entries(sample.tree, sample.q, sample.qd), setup.engines["mujoco"].of(setup.robot.case())
    found = {}
    for name in COMPARED:
        quantity = QUANTITIES[name]
        if not dynamics.has(quantity.function):
            result.find("no_function", engine=label, quantity=name)
            continue
        states, exact = (
            [getattr(sample, argument) for argument in quantity.arguments],
            sample.exact(quantity.function),
        )
        values = found[name] = getattr(dynamics, quantity.function)(*states)
        size = getattr(scale, quantity.scale)
        if name == "qdd":
            size = size(scale.force(sample.tau), exact.high)
        size = np.broadcast_to(size, values.shape)
        difference, tolerance = exact.distance(values), FACTOR * eps * size
        worst = closest(difference, tolerance)
        units = unit(sample.tree, *quantity.units)
        in_full = {
            of: ", ".join(repr(float(x)) for x in getattr(sample, of)[worst[0]]) for of in quantity.arguments
        }
        note = "; ".join(f"{of} = ({numbers})" for of, numbers in in_full.items())
        check = result.check(
            label,
            f"{name} to exact",
            difference[worst],
            tolerance[worst],
            units,
            note,
            True,
            about=About.ENGINE,
        )
        theirs = exact.distance(getattr(mujoco, quantity.function)(*states))
        row = {"engine": label, "precision": record.precision, "quantity": name, "unit": units, "states": len(sample.q),
               "worst_difference": check.value, "bar": check.tolerance, "difference_over_bar": check.over_tolerance,
               "difference_eps": float(over(difference, eps * size).max()),
               "mujoco_eps": float(over(theirs, EPS * size).max())}  # fmt: skip
        for of in ("q", "qd", "tau"):
            row[f"worst_{of}"] = " ".join(repr(float(x)) for x in getattr(sample, of)[worst[0]])
        result.rows.append(row | {"passed": check.passed})
    if (
        not all(row["passed"] for row in result.rows if row["engine"] == label)
        and {"Mbar", "bias"} <= found.keys()
    ):
        values = Values.of(sample.tree, sample.q, sample.qd, found["Mbar"], found["bias"], FACTOR * eps)
        result.find("cause", engine=label, text=diagnose(sample.tree, values, SECONDS).sentence())


def asked_at(setup: Setup, precision: str) -> Sample:
    """The random states that have exact values, and the Tree, with numbers that this precision has."""
    whole, tree = setup.random, setup.robot.tree
    states = [values[: whole.exact_states] for values in (whole.q, whole.qd, whole.tau)]
    if precision == "float32":
        states = [values.astype(np.float32).astype(float) for values in states]
    return Sample(tree, whole.name, *states, whole.exact_states)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from . import figures_engines  # matplotlib is for the process that draws

    if result.rows:
        yield partial(figures_engines.draw_distances, result)
    if result.tables["engines_methods"]:
        yield partial(figures_engines.draw_errors, result)
