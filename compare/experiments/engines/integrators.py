"""The integrators of other engines: one step against the same scheme of tmt, errors and orders."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.rows import Row, column
from ...engines import GRID, LABELS, RECORDS, Engine, Method, Setting
from ...engines.outside.model import TooLong, Unread
from ...judge.agree import closest
from ...judge.order import MeasuredOrder, check_order, measured_order
from ...judge.rounding import step_rounding
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import has_no_reference, reference
from ..followed import EARLY, REGULAR, differences, follow, one_step
from ..setup import Setup

STEP = 2.0**-7  # s: of single steps, a number that float32 has
STATES = 8  # from which single steps are compared
FINER = (1, 2, 4, 8, 16, 32, 64)  # steps of the runs, as multiples of GRID or of the scene's own
SHORT = 0.1  # s: a shorter run is timed several times
LONGEST = 1.0  # s: after a run that takes longer, no finer one is made
KNOWN = {"mujoco": ("Euler", "RK4"), "tmt": ("rk4", "dopri8_adaptive")}
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
CLEAR = 100.0  # eps, and an eps of each step: a larger error falls with its order
LEAST_RUNS = 4  # with regular errors, that measure an order


@dataclass(kw_only=True)
class MethodRow(Row):
    scene: str
    engine: str
    method: str
    scheme: str
    dt: float | None = column("s", digits=5)
    tolerance: float | None
    worst_error: float | None = column("rad")
    seconds: float
    seconds_prepared: float | None
    ended: str | None
    order: int | None
    measured_order: float | None = None


def compare_methods(result: Result, setup: Setup, engine: Engine) -> None:
    """Single steps from random states, and runs of the regular free scene with several settings."""
    case = free_scene(setup)
    for method in engine.methods_in(setup.robot.case()).values():
        setup.progress(f"engines: {method.label}{' compiles' * RECORDS[engine.name].compiles}")
        try:
            if method.scheme in METHODS and not method.adaptive:
                compare_steps(result, setup, engine, method)
            measured = add_runs(result, setup, case, engine, method) if case else None
        except (TooLong, Unread) as error:
            result.find("left_out", what=method.label, reason=str(error))
            break
        if case and measured and method.order:
            where, note = f"{case.name}, {method.label}", f"{measured.order:.2f}"
            check_order(result, where, method.order, measured.order, note=note)


def follow_known(result: Result, setup: Setup) -> None:
    """The runs of MuJoCo and tmt, with which those of other engines are compared in the figure."""
    case = free_scene(setup)
    if case:
        for engine, methods in KNOWN.items():
            for method in methods:
                add_runs(result, setup, case, setup.engines[engine], setup.engines[engine].methods[method])


def free_scene(setup: Setup) -> Case | None:
    """The first scene without locked joints and servos, better a regular one; None: no reference."""
    cases = [case for case in setup.robot.cases_of_torque if not case.scene.locked and not case.is_held]
    if has_no_reference(setup.robot):
        return None
    return next((case for case in cases if "regular" in case.scene.tags), next(iter(cases), None))


def compare_steps(result: Result, setup: Setup, engine: Engine, method: Method) -> None:
    """A check of one step from random states, compared with the same scheme of tmt."""
    sample, record = setup.random, RECORDS[engine.name]
    q, v = (values[:STATES].astype(record.precision).astype(float) for values in (sample.q, sample.qd))
    case, tau = setup.robot.case(), np.zeros(setup.robot.coordinates.nv)
    twin = one_step(setup.engines["tmt"].of(case), (q, v), tau, STEP, method.scheme)
    stepped = one_step(engine.of(case), (q, v), tau, STEP, method.name)
    difference = differences(case.coordinates, stepped, twin)
    tolerance = step_rounding(METHODS[method.scheme], case.tree, q, v, tau, STEP) * record.eps / EPS
    worst = closest(difference, tolerance)
    where, note = LABELS[engine.name], sample.describe(worst[0])
    what = f"one step of {method.name}, compared with tmt's {method.scheme}"
    result.check(where, what, difference[worst], tolerance[worst], "", note, True, about=About.ENGINE)


def add_runs(
    result: Result, setup: Setup, case: Case, engine: Engine, method: Method
) -> MeasuredOrder | None:
    """Rows of the runs of one method in a scene, and the order of its errors in the first second."""
    base, finer = GRID * -(-case.steps // GRID), setup.of(FINER, FINER[:4], FINER[:4])
    settings = [Setting(case.duration, base * k) for k in finer]
    if method.adaptive:
        settings = [Setting(case.duration, tolerance=tolerance) for tolerance in TOLERANCES[: len(finer)]]
    rows, steps, errors = [], [], []
    for setting in settings:
        dynamics = engine.of(case)
        run = follow(dynamics, case, method, setting, reference(case), repeat=SHORT)
        row = MethodRow(
            scene=case.name,
            engine=LABELS[engine.name],
            method=method.name,
            scheme=method.scheme,
            dt=case.duration / setting.steps if setting.steps else None,
            tolerance=setting.tolerance,
            worst_error=None if run.motion.ended else float(run.error.max()),
            seconds=run.seconds,
            seconds_prepared=getattr(dynamics, "seconds_prepared", None),
            ended=None if run.motion.ended is None else str(run.motion.ended),
            order=method.order,
        )
        rows.append(row)
        if row.dt and not row.ended:
            steps.append(row.dt)
            errors.append(run.early)
        if run.seconds > LONGEST:
            break
    measured = order_of(steps, errors, RECORDS[engine.name].eps)
    for row in rows:
        row.measured_order = measured and measured.order
    result.tables["engines_methods"] += rows
    return measured


def order_of(steps: Sequence[float], errors: Sequence[float], eps: float) -> MeasuredOrder | None:
    """The order of errors that are regular and above rounding; None: it has not settled."""
    regular = [(dt, e) for dt, e in zip(steps, errors) if max(CLEAR, EARLY / dt) * eps < e < REGULAR]
    return measured_order([dt for dt, _ in regular], [error for _, error in regular], LEAST_RUNS)
