"""Derivatives: how exact is each way to them, and at what cost?"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, cast

import numpy as np

from tmt.compiled.evaluator import Evaluator

from ...core import timing
from ...core.finding import Finding
from ...engines import LABELS
from ...engines.mujoco import Mujoco
from ...engines.mujoco.engine import methods_for
from ...engines.mujoco.names import INTEGRATORS as MEMBERS
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.stepper import Stepper, touching
from ...judge.scale import FACTOR
from ...robots import Robot
from ...stability.motion import postures_of
from .. import Drawing, Experiment
from ..setup import Setup
from . import ways
from .subjects import Subject, all_subjects, dynamics_of
from .ways import EXACT, FORWARD, ContactRow, CostRow, DerivativeRow, DerivativesResult, Measured, Task

EXPERIMENT = Experiment(order=105, serves_own=False, timed=True, quick_speeds=8)
MOST_SPEEDS = 40  # of a robot whose exact derivatives are traced in less than a minute
FEW_SPEEDS = 8  # of a robot with all integrators: of others they take minutes
INTEGRATORS = "Euler", "implicitfast", "implicit", "discrete", "RK4"
USUAL_INTEGRATOR = "implicitfast"  # of robots whose file's own is none of these
SETTLED = 3.0  # s, of the run to where a robot stands
Work = Iterable[list[Measured]]


def claim_values(robot: Robot) -> dict[str, Any]:
    return {"factor": FACTOR}


def skipped(robot: Robot) -> Finding | None:
    values = {"speeds": robot.coordinates.nv, "most": MOST_SPEEDS}
    return Finding("derivatives", "large", values) if robot.coordinates.nv > MOST_SPEEDS else None


def begin(setup: Setup) -> Work:
    """Measure the errors at all subjects, in parallel with other work."""
    mujoco, is_small = cast(Mujoco, setup.engines["mujoco"]), setup.robot.coordinates.nv <= FEW_SPEEDS
    dt, states = float(mujoco.model.opt.timestep), setup.of(4, 2, 2) if is_small else 1
    tasks: list[Task] = []
    for subject in all_subjects(setup.robot, setup.random.first(200), dt, states):
        has_all = is_small and (setup.alone or not tasks)
        # of all subjects but the first the file's integrator only, unless the experiment runs alone
        names = INTEGRATORS if has_all else (integrator_of(setup, subject),)
        tasks.append(Task(subject, names, compiles=not tasks))
    return setup.map(partial(ways.measured, mujoco=mujoco, dt=dt), tasks)


def integrator_of(setup: Setup, subject: Subject) -> str:
    """The model's integrator, for whose steps an eps is advised; implicitfast where it is not compared."""
    model = cast(Mujoco, setup.engines["mujoco"]).model
    compared = [name for name in INTEGRATORS if name in methods_for(subject.tree)]
    same = (name for name in compared if MEMBERS[name] == model.opt.integrator)
    return next(same, USUAL_INTEGRATOR)


def rows(setup: Setup, work: Work | None = None) -> DerivativesResult:
    result = DerivativesResult("derivatives", shown=[])
    groups = list(begin(setup) if work is None else work)
    every, main = [measured for group in groups for measured in group], groups[0]
    for measured in every:
        result.rows += measured.rows
        for way, share in measured.shares.items():
            name = f"{measured.quantity.name}: {way} to exact, over its tolerance"
            result.check(measured.subject.name, name, share, 1.0, "", rounding=way in EXACT)
    result.main = main[0].subject.name
    setup.quiet()  # nothing else may run while times are taken
    add_times(setup, result, main)
    scenes = [row for measured in every if measured.subject.kind == "scene" for row in measured.rows]
    add_costs(result, scenes, main)
    hard = [measured for measured in every if measured.subject.kind != "scene"]
    in_air = any(feature.feature == "contact" for feature in setup.robot.features)
    integrator = integrator_of(setup, main[0].subject)
    add_advice(result, scenes, hard, integrator, in_air)
    if setup.alone and in_air:
        setup.progress("derivatives: contacts")
        if setup.reading and (rows := contact_rows(setup.reading)):
            result.tables["contact_derivatives"] = rows
            result.top.append(result.finding("contacts", rows=rows))
    return result


def add_times(setup: Setup, result: DerivativesResult, main: Sequence[Measured]) -> None:
    """The seconds of one evaluation at the first state of the main subject."""
    mujoco, subject = cast(Mujoco, setup.engines["mujoco"]), main[0].subject
    dt, dynamics = float(mujoco.model.opt.timestep), dynamics_of(mujoco, subject)
    calls: dict[tuple[str, str], Callable[[], Any]] = {}
    first = subject._replace(q=subject.q[:1], qd=subject.qd[:1], tau=subject.tau[:1])
    for measured in main:
        quantity = measured.quantity
        for way in quantity.differences(dynamics, subject, dt, 0):
            calls[quantity.name, way.name] = way.call(ways.USUAL)
        calls[quantity.name, ways.NUMPY] = partial(quantity.by_numpy, first, dt)
        if ways.COMPILED in measured.shares:
            state = [values[0] for values in quantity.arguments(subject, dt)]
            evaluator = Evaluator(subject.tree, quantity.function)
            calls[quantity.name, ways.COMPILED] = partial(evaluator.of_one, *state)
    result.times = timing.fastest(calls, setup.of(50, 20, 2))


def contact_rows(reading: Reading) -> list[ContactRow]:
    """Differences of the step where a run of 3 s from the file's first posture ends.

    The reference is the eps that agrees best with the next one.
    """
    posture, model = postures_of(reading)[0], reading.model
    stepper = Stepper(model, reading.dt, reading.integrator)
    rest = stepper.roll(stepper.start(posture.key), round(SETTLED / reading.dt)).states[0]
    states = 2 * model.nv
    base = touching(stepper, rest, np.zeros(states + model.na))
    if not base:
        return []
    units = ways.units_of(reading.tree, ways.STATE)
    matrices = [stepper.derivative(rest, eps)[0][:states, :states] for eps in ways.SIZES]
    steps = [np.abs(A - finer).max() for A, finer in pairwise(matrices)]
    truth = matrices[int(np.argmin(steps))]
    rows = []
    for eps, A in zip(ways.SIZES, matrices):
        changed: set[str] = set()
        for nudge in eps * np.eye(states + model.na):
            for by in (nudge, -nudge):
                changed |= base ^ touching(stepper, rest, by)
        error, *_ = ways.relative(A - truth, truth, (units, units))
        rows.append(ContactRow(
            posture=posture.name, integrator=reading.integrator, contacts=len(base), eps=eps,
            difference=error if np.isfinite(error) else None, changed="; ".join(sorted(changed)),
        ))  # fmt: skip
    return rows


def add_costs(result: DerivativesResult, scenes: Sequence[DerivativeRow], main: Sequence[Measured]) -> None:
    """The error of each way at all scenes, with its best eps, and its time."""
    costs: list[CostRow] = []
    for quantity, way in dict.fromkeys((row.quantity, row.way) for measured in main for row in measured.rows):
        same = [row for row in scenes if (row.quantity, row.way) == (quantity, way)]
        best, seconds = ways.best_of(same), result.times.get((quantity, way))
        time = None if seconds is None else 1e6 * seconds
        costs.append(CostRow(quantity=quantity, way=way, best_eps=best.eps, error=best.error, time=time))
    result.tables["derivative_costs"] = costs
    timed = [row for row in costs if row.time]
    pairs = [(row, of_mujoco(timed, row.quantity)) for row in timed if row.way == ways.COMPILED]
    result.find(
        "costs",
        engines=[row for row in timed if row.way in LABELS.values()],
        exact=[row for row in timed if row.quantity == FORWARD and row.way in EXACT],
        pairs=[(row, other) for row, other in pairs if other],
    )


def of_mujoco(costs: Sequence[CostRow], quantity: str) -> CostRow | None:
    """MuJoCo's way to a quantity: its own function, centred where it can be."""
    others = [row for row in costs if row.quantity == quantity and row.way not in EXACT]
    others.sort(key=lambda row: (row.way.endswith(ways.CENTRED), row.way.startswith("mjd")))
    return others[-1] if others else None


def add_advice(
    result: DerivativesResult, scenes: Sequence[DerivativeRow], hard: Sequence[Measured], integrator: str,
    in_air: bool,
) -> None:  # fmt: skip
    """Which eps to use, by MuJoCo's function where it takes the integrator; where that fails."""
    by_eps = [row for row in scenes if row.eps]
    step = [row for row in by_eps if row.quantity == ways.step_name(integrator)]
    inverse = [row for row in by_eps if row.quantity == ways.INVERSE]
    centred = [row for row in step if row.way.endswith(ways.CENTRED)]
    by_function = [row for row in centred if row.way.startswith(ways.TRANSITION)]
    way = ways.TRANSITION if by_function else ways.BY_STEPS
    one_sided = [row for row in step if row.way == f"{way}, {ways.ONE_SIDED}"]
    result.drawn, result.integrator = step + inverse, integrator
    values: dict[str, Any] = {
        "way": way,
        "integrator": integrator,
        "centred": ways.best_of(by_function or centred),
        "by_steps": ways.best_of(row for row in centred if row not in by_function) if by_function else None,
        "one_sided": ways.best_of(one_sided),
        "usual": ways.worst_of_each_eps(one_sided)[ways.USUAL],
        "inverse": ways.best_of(inverse),
        "exact": ways.best_of(row for row in scenes if row.way in EXACT),
        "in_air": in_air,
    }
    result.headline = result.finding("headline", way=way, integrator=integrator, centred=values["centred"])
    result.top.append(result.finding("advice", **values))
    pairs = []
    for measured in hard:
        if measured.quantity.name != FORWARD:
            name = measured.quantity.name
            at_scenes = ways.best_of(tried(by_eps, name))
            rows_here = ways.worst_of_each_eps(tried([row for row in measured.rows if row.eps], name))
            pairs.append({"row": rows_here[at_scenes.eps or 0.0], "scenes": at_scenes})
    result.find("hard", pairs=pairs)


def tried(rows: Sequence[DerivativeRow], quantity: str) -> list[DerivativeRow]:
    """The rows of a quantity by MuJoCo's function, centred; by differences of mj_step where there is none."""
    same = [row for row in rows if row.quantity == quantity and not row.way.endswith(ways.ONE_SIDED)]
    by_function = [row for row in same if not row.way.startswith(ways.BY_STEPS)]
    return by_function or same


def figures(result: DerivativesResult, robot: Robot) -> Iterator[Drawing]:
    from .figures_derivatives import draw_errors, draw_times  # matplotlib is for the process that draws

    yield partial(draw_errors, result)
    yield partial(draw_times, result)
