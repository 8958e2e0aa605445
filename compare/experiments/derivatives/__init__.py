"""Derivatives: how exact is each way to them, and at what cost?"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import inf, isfinite
from typing import Any, NamedTuple, cast

from tmt.compiled.evaluator import Evaluator

from ...core import timing
from ...core.check import About
from ...core.finding import Finding
from ...engines import LABELS, RECORDS
from ...engines.mujoco import Mujoco
from ...judge.scale import FACTOR
from ...robots import Robot
from .. import Drawing, Experiment
from ..setup import Setup
from .contacts import contact_rows
from .subjects import Subject, all_subjects, dynamics_of
from .tables import CostRow, DerivativeRow, DerivativesResult, HardRow, errors_of
from .ways import (
    CENTRED,
    COMPILED,
    EXACT,
    FORWARD,
    INVERSE,
    NUMPY,
    ONE_SIDED,
    USUAL,
    Measured,
    Quantity,
    engines_of,
    measured,
    over,
    row_of,
)  # fmt: skip

EXPERIMENT = Experiment(order=105, serves_own=False, timed=True)
MOST_SPEEDS = 40  # of a robot whose exact derivatives are traced in less than a minute
FEW_SPEEDS = 8  # of a robot with all integrators: of others they take minutes
INTEGRATORS = "Euler", "implicitfast", "implicit", "discrete", "RK4"
FEW_INTEGRATORS = ("implicitfast",)  # of all subjects but the first, unless the experiment runs alone
Work = Iterable[list[Measured]]


def claim_values(robot: Robot) -> dict[str, Any]:
    return {"factor": FACTOR}


def skipped(robot: Robot) -> Finding | None:
    speeds = robot.coordinates.nv
    return (
        Finding("derivatives", "large", {"speeds": speeds, "most": MOST_SPEEDS})
        if speeds > MOST_SPEEDS
        else None
    )


class Task(NamedTuple):
    """The errors at one subject."""

    subject: Subject
    integrators: Sequence[str]
    compiles: bool


def begin(setup: Setup) -> Work:
    """Measure the errors at all subjects, in parallel with other work: of the first one those of all integrators.

    Of a robot with many speeds one integrator alone, at fewer states.
    """
    mujoco = cast(Mujoco, setup.engines["mujoco"])
    dt, tasks = float(mujoco.model.opt.timestep), list[Task]()
    is_small = setup.robot.coordinates.nv <= FEW_SPEEDS
    states = setup.of(4, 2, 2) if is_small else 1
    for subject in all_subjects(setup.robot, setup.random.first(200), dt, states):
        is_main = not tasks
        integrators = INTEGRATORS if is_small and (is_main or setup.alone) else FEW_INTEGRATORS
        tasks.append(Task(subject, integrators, is_main))
    return setup.map(partial(measure, mujoco=mujoco, dt=dt), tasks)


def measure(task: Task, mujoco: Mujoco, dt: float) -> list[Measured]:
    return measured(task.subject, mujoco, task.integrators, dt, task.compiles)


def rows(setup: Setup, work: Work | None = None) -> DerivativesResult:
    result = DerivativesResult("derivatives", shown=[])
    groups = list(begin(setup) if work is None else work)
    every = [one for group in groups for one in group]
    for one in every:
        result.rows += one.rows
        for way, share in one.shares.items():
            name = f"{one.quantity.name}: {way} to exact, over its tolerance"
            result.check(one.subject.name, name, share, 1.0, "", rounding=way in EXACT)
    main = groups[0]
    result.main = main[0].subject.name
    setup.quiet()  # nothing else may run while times are taken
    add_times(setup, result, main)
    if setup.alone:
        add_engines(setup, result, main[0])
        add_contacts(setup, result)
    scenes = [row for one in every if one.subject.kind == "scene" for row in one.rows]
    result.tables["derivative_costs"] = [
        cost(result, one.quantity, scenes, way) for one in main for way in ways_of(one)
    ]
    add_advice(result, scenes, every)
    return result


def ways_of(one: Measured) -> list[str]:
    return list(dict.fromkeys(row.way for row in one.rows))


def add_times(setup: Setup, result: DerivativesResult, main: Sequence[Measured]) -> None:
    """The seconds of one evaluation at the first state of the main subject."""
    mujoco, subject = cast(Mujoco, setup.engines["mujoco"]), main[0].subject
    dt, dynamics = float(mujoco.model.opt.timestep), dynamics_of(mujoco, subject)
    calls: dict[tuple[str, str], Callable[[], Any]] = {}
    for one in main:
        quantity = one.quantity
        for way in quantity.differences(dynamics, subject, dt, 0):
            calls[quantity.name, way.name] = way.call(USUAL)
        given = [values[0] for values in quantity.given(subject, dt)]
        calls[quantity.name, NUMPY] = partial(quantity.by_numpy, first(subject), dt)
        if COMPILED in one.shares:
            calls[quantity.name, COMPILED] = partial(Evaluator(subject.tree, quantity.exact).of_one, *given)
    result.times = timing.fastest(calls, setup.of(50, 20, 2))


def add_engines(setup: Setup, result: DerivativesResult, forward: Measured) -> None:
    """The rows, checks and times of other engines' derivatives of accelerations, of the main subject."""
    subject, quantity = forward.subject, forward.quantity
    for name, dynamics in engines_of(subject, setup.engines).items():
        setup.progress(f"derivatives: {LABELS[name]}")
        matrices = dynamics.derivatives(subject.q, subject.qd, subject.tau)
        values, exact = quantity.side_by_side(matrices), quantity.exact_values(subject, 0.0)
        share = over(exact.distance(values), FACTOR * RECORDS[name].eps * quantity.scale(subject, 0.0))
        what = f"{quantity.name}: {LABELS[name]} to exact, over its tolerance"
        result.check(subject.name, what, share, 1.0, "", about=About.ENGINE)
        row = row_of(subject, quantity, LABELS[name], None, values, exact)
        forward.rows.append(row)
        result.rows.append(row)
        state = subject.q[0], subject.qd[0], subject.tau[0]
        result.times[quantity.name, LABELS[name]] = dynamics.seconds("derivatives", *state)


def add_contacts(setup: Setup, result: DerivativesResult) -> None:
    """What differences are worth where a robot of a file stands on its contacts."""
    if setup.reading is None or all(feature.feature != "contact" for feature in setup.reading.features):
        return
    setup.progress("derivatives: contacts")
    if rows := contact_rows(setup.reading):
        result.tables["contact_derivatives"] = rows
        result.find("contacts", rows=rows)


def first(subject: Subject) -> Subject:
    return subject._replace(q=subject.q[:1], qd=subject.qd[:1], tau=subject.tau[:1])


def cost(result: DerivativesResult, quantity: Quantity, scenes: Sequence[DerivativeRow], way: str) -> CostRow:
    """The error of a way at all scenes, with its best eps, and its time."""
    errors = errors_of(row for row in scenes if (row.quantity, row.way) == (quantity.name, way))
    best = min(errors, key=lambda eps: errors[eps])
    seconds = result.times.get((quantity.name, way))
    return CostRow(
        quantity=quantity.name,
        way=way,
        best_eps=best or None,
        error=known(errors[best]),
        error_at_usual=known(errors.get(USUAL, inf)),
        time=None if seconds is None else 1e6 * seconds,
    )


def add_advice(result: DerivativesResult, scenes: Sequence[DerivativeRow], every: Sequence[Measured]) -> None:
    """Which eps to use, what it costs, and where that fails."""
    steps = [row for row in scenes if row.eps and row.quantity != INVERSE]
    by_side = {
        side: errors_of(row for row in steps if row.way.endswith(side)) for side in (CENTRED, ONE_SIDED)
    }
    best = {side: min(errors, key=lambda eps: errors[eps]) for side, errors in by_side.items()}
    inverse = errors_of(row for row in scenes if row.quantity == INVERSE and row.eps)
    at = min(inverse, key=lambda eps: inverse[eps])
    exact = max(errors_of(row for row in scenes if row.way in EXACT).values())
    values: dict[str, Any] = {
        "eps": best[CENTRED], "error": by_side[CENTRED][best[CENTRED]], "usual": USUAL,
        "usual_error": by_side[ONE_SIDED][USUAL], "one_sided_eps": best[ONE_SIDED],
        "one_sided_error": by_side[ONE_SIDED][best[ONE_SIDED]], "inverse_eps": at, "inverse_error": inverse[at],
        "exact": exact,
    }  # fmt: skip
    result.headline = result.finding("headline", **values)
    result.top.append(result.finding("advice", **values))
    costs: list[CostRow] = [row for row in result.tables["derivative_costs"] if row.time]
    pairs = [(row, of_mujoco(costs, row.quantity)) for row in costs if row.way == COMPILED]
    others = [row for row in costs if row.way in LABELS.values()]
    result.find(
        "costs",
        engines=others,
        exact=[row for row in costs if row.quantity == FORWARD and row.way in EXACT],
        pairs=[(row, other) for row, other in pairs if other],
    )
    hard = [
        hard_row(one, scenes) for one in every if one.subject.kind != "scene" and one.quantity.name != FORWARD
    ]
    result.tables["hard_derivatives"] = hard
    result.find("hard", rows=hard)


def of_mujoco(costs: Sequence[CostRow], quantity: str) -> CostRow | None:
    """MuJoCo's way to a quantity: its own function, centred where it can be."""
    others = [row for row in costs if row.quantity == quantity and row.way not in EXACT]
    return max(others, key=lambda row: (row.way.endswith(CENTRED), row.way.startswith("mjd")), default=None)


def hard_row(one: Measured, scenes: Sequence[DerivativeRow]) -> HardRow:
    """What differences are worth at a hard subject with the eps that serves the scenes best; of steps centred ones."""
    of_quantity = [row for row in (*scenes, *one.rows) if row.quantity == one.quantity.name and row.eps]
    chosen = [row for row in of_quantity if not row.way.endswith(ONE_SIDED)]
    here, there = (
        errors_of(row for row in chosen if (row in one.rows) == is_here) for is_here in (True, False)
    )
    eps, best = min(there, key=lambda eps: there[eps]), min(here, key=lambda eps: here[eps])
    return HardRow(
        subject=one.subject.name,
        quantity=one.quantity.name,
        eps=eps,
        error=known(here[eps]),
        scenes_error=known(there[eps]),
        best_eps=best,
        best_error=known(here[best]),
    )


def known(error: float) -> float | None:
    return error if isfinite(error) else None


def figures(result: DerivativesResult, robot: Robot) -> Iterator[Drawing]:
    from .figures_derivatives import draw_errors, draw_times  # matplotlib is for the process that draws

    yield partial(draw_errors, result)
    yield partial(draw_times, result)
