"""The integrators of other engines: one step compared with the same scheme of tmt, errors and orders in a free scene."""

import time
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...engines import GRID, LABELS, RECORDS, Engine, Method, Motion, Setting
from ...engines.outside.model import TooLong, Unread
from ...judge.agree import closest
from ...judge.rounding import step_rounding
from ...judge.run import ORDER_MARGIN
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import has_no_reference, reference
from ..setup import Setup

STEP = 2.0**-7  # s: of single steps, a number that float32 has
STATES = 8  # from which single steps are compared
FINER = (1, 2, 4, 8, 16, 32, 64)  # steps of the runs, as multiples of GRID or of the scene's own
RUNS, SHORT = 5, 0.1  # a run is timed up to 5 times, as long as these take less than 0.1 s together
LONGEST = 1.0  # s: after a run that takes longer, no finer one is made
KNOWN = {"mujoco": ("Euler", "RK4"), "tmt": ("rk4", "dopri8_adaptive")}
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
EARLY = 1.0  # s: until then errors fall regularly
REGULAR = 3e-2  # rad: a smaller error falls with its order
CLEAR = 100.0  # eps, and an eps of each step: a larger error falls with its order


def compare_methods(result: Result, setup: Setup, engine: Engine) -> None:
    """Single steps from random states, and the runs of the regular free scene with several steps or tolerances."""
    case = free_scene(setup)
    for method in engine.methods_in(setup.robot.case()).values():
        setup.progress(f"engines: {method.label}{' compiles' * RECORDS[engine.name].compiles}")
        try:
            if method.scheme in METHODS and not method.adaptive:
                compare_steps(result, setup, engine, method)
            if case is not None:
                rows = follow(result, case, engine, method, setup)
                check_order(result, f"{case.name}, {method.label}", method, rows[0]["measured_order"])
        except (TooLong, Unread) as error:
            result.find("left_out", what=method.label, reason=str(error))
            break


def follow_known(result: Result, setup: Setup) -> None:
    """The runs of MuJoCo and tmt, with which those of other engines are compared in the figure."""
    case = free_scene(setup)
    for name, methods in KNOWN.items() if case is not None else ():
        for method in methods:
            follow(result, case, setup.engines[name], setup.engines[name].methods[method], setup)


def free_scene(setup: Setup) -> Case | None:
    """The first scene without locked joints and servos, preferably one with regular errors; None if there is no reference."""
    cases = [case for case in setup.robot.cases_of_torque if not case.scene.locked and not case.is_held]
    if has_no_reference(setup.robot):
        return None
    return next((case for case in cases if "regular" in case.scene.tags), next(iter(cases), None))


def compare_steps(result: Result, setup: Setup, engine: Engine, method: Method) -> None:
    """A check of one step from random states, compared with the same scheme of tmt."""
    sample, record = setup.random, RECORDS[engine.name]
    states = [values[:STATES].astype(record.precision).astype(float) for values in (sample.q, sample.qd)]
    case, tau = setup.robot.case(), np.zeros(setup.robot.coordinates.nv)
    ours = setup.engines["tmt"].of(case).run(*states, tau, STEP, 1, method.scheme)
    theirs = engine.of(case).run(*states, tau, STEP, 1, method.name)
    movement = case.coordinates.difference(theirs.q[:, 1], ours.q[:, 1])
    difference = np.abs(np.concatenate([movement, theirs.v[:, 1] - ours.v[:, 1]], axis=1))
    tolerance = step_rounding(METHODS[method.scheme], case.tree, *states, tau, STEP) * record.eps / EPS
    worst = closest(difference, tolerance)
    quantity = f"one step of {method.name}, compared with tmt's {method.scheme}"
    result.check(LABELS[engine.name], quantity, difference[worst], tolerance[worst], "", sample.describe(worst[0]), True,
                 about=About.ENGINE)  # fmt: skip


def follow(result: Result, case: Case, engine: Engine, method: Method, setup: Setup) -> list[dict]:
    """Rows of the runs of one method in a scene."""
    truth, base, finer = reference(case), GRID * -(-case.steps // GRID), setup.of(FINER, FINER[:4], FINER[:4])
    settings = [Setting(case.duration, base * k) for k in finer]
    if method.adaptive:
        settings = [Setting(case.duration, tolerance=tolerance) for tolerance in TOLERANCES[: len(finer)]]
    rows, early = [], []
    for setting in settings:
        dynamics = engine.of(case)
        run, read = dynamics.prepare(*case.start, case.tau, setting, method.name)
        motion, seconds = fastest(run, read)
        error = truth.error(motion.q, range(len(case.joints)))
        early.append(None if motion.ended or not setting.steps else float(error[truth.t <= EARLY].max()))
        row = {"scene": case.name, "engine": LABELS[engine.name], "method": method.name, "scheme": method.scheme,
               "dt_s": case.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
               "worst_error_rad": None if motion.ended else float(error.max()), "seconds": seconds,
               "seconds_prepared": getattr(dynamics, "seconds_prepared", None), "ended": motion.ended,
               "order": method.order}  # fmt: skip
        rows.append(row)
        if seconds > LONGEST:
            break
    order = measured_order([row["dt_s"] for row in rows], early, RECORDS[engine.name].eps)
    rows = [row | {"measured_order": order} for row in rows]
    result.tables["engines_methods"] += rows
    return rows


def fastest(run: Callable, read: Callable) -> tuple[Motion, float]:
    """The motion of a prepared run, and the least of its times, s: of several runs, unless one takes long."""
    times = []
    while len(times) < RUNS and sum(times) < SHORT:
        begin = time.perf_counter()
        outcome = run()
        seconds = time.perf_counter() - begin
        motion = read(outcome)
        times.append(seconds if motion.seconds is None else motion.seconds)
    return motion, min(times)


def check_order(result: Result, where: str, method: Method, order: float | None) -> None:
    if order is not None and method.order:
        quantity, off = f"deviation from order {method.order}: error", abs(order - method.order)
        result.check(where, quantity, off, ORDER_MARGIN, "", f"{order:.2f}", about=About.PREDICTION)


def measured_order(steps: Sequence[float], errors: Sequence[float | None], eps: float) -> float | None:
    """The order by which the error falls between the last two of at least four runs with regular errors; None: not settled."""
    known = [(dt, error) for dt, error in zip(steps, errors) if error]
    regular = [(dt, error) for dt, error in known if max(CLEAR, EARLY / dt) * eps < error < REGULAR]
    orders = [np.log(a[1] / b[1]) / np.log(a[0] / b[0]) for a, b in pairwise(regular)]
    settled = len(orders) > 2 and abs(orders[-1] - orders[-2]) <= ORDER_MARGIN
    return float(orders[-1]) if settled else None
