"""The integrators of other engines: one step against the same scheme of tmt, errors and orders."""

from collections.abc import Sequence

import numpy as np

from tmt.methods import METHODS

from ...core import timing
from ...core.check import About, Result
from ...engines import GRID, LABELS, RECORDS, Engine, Method, Setting
from ...engines.outside.file import EngineError, TooLong
from ...judge.agree import closest
from ...judge.order import MeasuredOrder, check_order, is_higher, measured_order
from ...judge.rounding import step_rounding
from ...judge.scale import EPS
from ...robots.case import Case
from ..followed import EARLY, REGULAR, differences, follow, one_step
from ..setup import Setup
from .motion import free_scene, reference
from .tables import MethodRow

STEP = 2.0**-7  # s: the longest single step; a power of two, which float32 has
MOST_ROUNDING = 1e-3  # rad or m: a step in which rounding may grow further is not compared
STATES = 8  # from which single steps are compared
FINER = (1, 2, 4, 8, 16, 32, 64)  # steps of the runs, as multiples of GRID or of the scene's own
ROUNDS = 5  # most runs by which one is timed
LONGEST = 1.0  # s: after a run that takes longer, no finer one is made
KNOWN = {"mujoco": ("Euler", "implicitfast", "discrete", "RK4"), "tmt": ("rk4", "dopri8_adaptive")}
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
CLEAR = 100.0  # eps, and an eps of each step: a larger error falls with its order
LEAST_RUNS = 4  # with regular errors, that measure an order


def compare_methods(result: Result, setup: Setup, engine: Engine) -> None:
    """Single steps from random states, and runs of the regular free scene with several settings."""
    case = free_scene(setup)
    for method in engine.methods_in(setup.robot.case()).values():
        setup.progress(f"engines: {method.label}{' compiles' * RECORDS[engine.name].compiles}")
        try:
            if method.scheme in METHODS and not method.adaptive:
                compare_steps(result, setup, engine, method)
            measured = add_runs(result, setup, case, engine, method) if case else None
        except TooLong:
            raise
        except EngineError as error:
            result.find("left_out", what=method.label, reason=str(error).rstrip("."))
            continue
        if case and measured and method.order:
            where, note = f"{case.name}, {method.label}", f"{measured.order:.2f}"
            twin = None
            if is_higher(measured.order, method.order):
                twin = order_of_twin(setup, case, method)
            check_order(result, where, method.order, measured.order, note=note, twin=twin)


def follow_known(result: Result, setup: Setup) -> None:
    """The runs of MuJoCo and tmt in the free scene, with which those of other engines are compared."""
    case = free_scene(setup)
    if case:
        for engine, methods in KNOWN.items():
            known = setup.engines[engine].methods
            for method in [known[name] for name in methods if name in known]:
                add_runs(result, setup, case, setup.engines[engine], method)


def compare_steps(result: Result, setup: Setup, engine: Engine, method: Method) -> None:
    """A check of one step from random states, compared with the same scheme of tmt."""
    sample, record = setup.random, RECORDS[engine.name]
    q, v = (values[:STATES].astype(record.precision).astype(float) for values in (sample.q, sample.qd))
    case, tau = setup.robot.case(), np.zeros(setup.robot.coordinates.nv)
    dt = step_of(setup)
    tolerance = step_rounding(METHODS[method.scheme], case.tree, q, v, tau, dt) * record.eps / EPS
    if not tolerance.max() <= MOST_ROUNDING:
        result.find("left_out", what=f"One step of {method.label}", reason="rounding grows too far in it")
        return
    twin = one_step(setup.engines["tmt"].of(case), (q, v), tau, dt, method.scheme)
    stepped = one_step(engine.of(case), (q, v), tau, dt, method.name)
    difference = differences(case.coordinates, stepped, twin)
    worst = closest(difference, tolerance)
    where, note = LABELS[engine.name], sample.describe(worst[0])
    what = f"one step of {method.name}, compared with tmt's {method.scheme}"
    result.check(where, what, difference[worst], tolerance[worst], "", note, True, about=About.ENGINE)


def step_of(setup: Setup) -> float:
    """The length of a single step, s: STEP, or the longest power of two that is not longer than the file's own step."""
    return min(STEP, 2.0 ** np.floor(np.log2(setup.reading.dt))) if setup.reading else STEP


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
        run = follow(dynamics, case, method, setting, reference(case), rounds=ROUNDS)
        ended = run.motion.ended
        row = MethodRow(
            scene=case.name, engine=LABELS[engine.name], method=method.name, scheme=method.scheme,
            dt=case.duration / setting.steps if setting.steps else None, tolerance=setting.tolerance,
            worst_error=None if ended else float(run.error.max()), seconds=run.seconds,
            seconds_alone=run.motion.seconds_alone, scatter=run.scatter, steady=run.scatter <= timing.STEADY,
            seconds_prepared=getattr(dynamics, "seconds_prepared", None),
            ended=None if ended is None else str(ended), order=method.order,
        )  # fmt: skip
        rows.append(row)
        if row.dt and not row.ended:
            steps.append(row.dt)
            errors.append(run.early)
        if run.seconds > LONGEST:
            row.finer_left_out = setting is not settings[-1]
            break
    measured = order_of(steps, errors, RECORDS[engine.name].eps)
    for row in rows:
        row.measured_order = measured and measured.order
    result.tables["engines_methods"] += rows
    return measured


def order_of_twin(setup: Setup, case: Case, method: Method) -> float | None:
    """The order of tmt's same scheme in the runs by which that of an engine is measured; None: it has none."""
    if method.scheme not in METHODS:
        return None
    tmt = setup.engines["tmt"]
    twin = next(one for one in tmt.methods.values() if one.scheme == method.scheme)
    unlisted = Result("engines", tables={"engines_methods": []})
    measured = add_runs(unlisted, setup, case, tmt, twin)
    return measured and measured.order


def order_of(steps: Sequence[float], errors: Sequence[float], eps: float) -> MeasuredOrder | None:
    """The order of errors that are regular and above rounding; None: it has not settled."""
    regular = [(dt, e) for dt, e in zip(steps, errors) if max(CLEAR, EARLY / dt) * eps < e < REGULAR]
    return measured_order([dt for dt, _ in regular], [error for _, error in regular], LEAST_RUNS)
