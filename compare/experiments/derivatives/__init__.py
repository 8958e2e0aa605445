"""Derivatives: which eps for A and B of the file's own step?"""

from collections.abc import Iterator
from functools import partial
from typing import Any, cast

import numpy as np

import tmt
from tmt.compiled.evaluator import Evaluator

from ...core.check import Result
from ...core.finding import Finding
from ...core.timing import fastest
from ...engines.mujoco import Mujoco
from ...engines.mujoco.engine import methods_for
from ...engines.mujoco.names import INTEGRATORS
from ...judge.scale import FACTOR
from ...robots import Robot
from ...robots.states import singular_positions
from .. import Drawing
from ..setup import Setup
from . import standing, ways
from .ways import CENTRED, ONE_SIDED, DerivativeRow, Subject, WayRow, number

MOST_SPEEDS = 40  # of a robot whose exact derivatives are traced in less than a minute
FEW_SPEEDS = 8  # of a robot for which tmt's derivatives are compiled in a second
EXACT = "tmt, exact"


def claim_values(robot: Robot) -> dict[str, Any]:
    return {"factor": FACTOR}


def skipped(robot: Robot) -> Finding | None:
    values = {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS}
    return Finding("derivatives", "large", values) if robot.coordinates.nv > MOST_SPEEDS else None


def rows(setup: Setup) -> Result:
    """The errors of all ways at the states of a scene, the eps that serves best, and standing on contacts."""
    result, engine = Result("derivatives", shown=[]), cast(Mujoco, setup.engines["mujoco"])
    case, dt = ways.case_of(setup.robot), float(engine.model.opt.timestep)
    names = [name for name in INTEGRATORS if name in methods_for(case.tree)]
    integrator = next((name for name in names if INTEGRATORS[name] == engine.model.opt.integrator), "")
    if not integrator:
        result.not_judged("", "A and B of the file's step", "tmt has no step of its integrator")
        return result
    is_singular, why = singular_positions(case.tree, case.q[None])
    if is_singular.any():
        result.not_judged(case.name, "A and B of the file's step", f"Mbar is singular at its start: {why}")
        return result
    subject = Subject(engine, case, dt, integrator, setup.of(10, 4, 2))
    function = ways.TRANSITION if subject.stepper.takes_transition else ways.BY_STEPS
    error, share = subject.errors_of_tmt()
    result.check(case.name, f"{EXACT}, to 31 digits, over its tolerance", share, 1.0, "", rounding=True)
    exact, table = subject.exact, list[WayRow]()
    for side in (CENTRED, ONE_SIDED):
        way, errors = f"{function}, {side}", dict[float, float | None]()
        values = {eps: subject.by_differences(eps, side == CENTRED) for eps in ways.SIZES}
        for eps, value in values.items():
            size, block = ways.worst_block(value - exact, exact, subject.qd.shape[1], subject.tolerance)
            errors[eps] = number(size)
            result.rows.append(DerivativeRow(way, eps, errors[eps], block, len(exact)))
        table.append(ways.best_of(way, errors))
        if side == CENTRED:
            share = subject.share_of_differences(values)
            result.check(case.name, f"{way}, to exact, over its tolerance", share, 1.0, "")
    result.rows.append(DerivativeRow(EXACT, None, number(error), "", 1))
    table.append(WayRow(EXACT, error=number(error)))
    setup.quiet()  # nothing else may run while times are taken
    add_times(setup, subject, table)
    result.tables["derivative_costs"] = table
    place = None
    if setup.reading and (setup.alone or setup.size == "full"):
        place = standing.Standing(setup.reading)
        add_standing(result, place, function)
    if all(check.passed for check in result.checks):  # else the exact values are not of the file's equations
        about = {"integrator": integrator, "dt": dt, "scene": case.name, "states": len(exact)}
        about["acting"] = bool(place and place.acting)
        answer = result.finding("answer", about=about, rows=table, by=subject.by)
        result.headline = result.headline or result.finding("headline", row=table[0])
        result.top.insert(1 if place and place.stands else 0, answer)
    return result


def add_times(setup: Setup, subject: Subject, table: list[WayRow]) -> None:
    """The time of a call of each way at the first state."""
    start, state, tree = subject.starts[0], (subject.q[0], subject.qd[0], subject.tau[0]), subject.case.tree
    calls: dict[str, Any] = {}
    for row in table[:2]:
        how = row.eps or 0.0, row.way.endswith(CENTRED), subject.by
        calls[row.way] = partial(subject.stepper.derivative, start, *how)
    calls[EXACT] = partial(tmt.step_derivatives, tree, *state, subject.dt, subject.scheme)
    if len(subject.qd[0]) <= FEW_SPEEDS:
        table[-1].way = f"{EXACT}, compiled"
        evaluator = Evaluator(tree, f"step_derivatives:{subject.scheme}")
        calls[table[-1].way] = partial(evaluator.of_one, *state, np.array([subject.dt]))
        calls[table[-1].way]()  # compiles
    seconds = fastest(calls, setup.of(20, 10, 2))
    for row in table:
        row.time = 1e6 * seconds[row.way]


def add_standing(result: Result, place: standing.Standing, function: str) -> None:
    """Differences where the file stands, and the directions that no control moves there."""
    m, best, names = place.stepper.model, None, list[str]()
    rows, truth = place.rows()
    if truth is not None:
        best = ways.best_of(function, {row.eps: row.error for row in rows})
        if m.nu:
            units = np.repeat([1.0, place.stepper.dt, 1.0], [m.nv, m.nv, m.na])
            names = standing.directions(
                place.stepper, standing.not_moved(place.values(best.eps or 0.0), truth, units)
            )
    if place.acting:
        result.tables["contact_derivatives"] = rows
    limits = sorted(name for name in place.acting if name.startswith("limit of "))
    about = {"posture": place.name, "way": function, "contacts": len(place.acting) - len(limits)}
    about["limits"] = limits
    opened = next((row for row in reversed(rows) if row.changed), None)
    result.top.append(result.finding("standing", about=about, best=best, opened=opened, names=names))
    if place.stands and best:
        result.headline = result.finding("headline", row=best, posture=place.name)


def figures(result: Result, robot: Robot) -> Iterator[Drawing]:
    from .figures_derivatives import draw_errors  # matplotlib is for the process that draws

    if any(text.kind == "answer" for text in result.top):
        yield partial(draw_errors, result)
