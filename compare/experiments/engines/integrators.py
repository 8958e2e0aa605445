"""The integrators of other engines: one step compared with the same scheme of tmt, errors and orders in a free scene."""

from itertools import pairwise

import numpy as np

from tmt.methods import METHODS

from ...engines import GRID, LABELS, RECORDS, Engine, Method, Setting
from ...judge.check import About, Result, closest
from ...judge.rounding import step_rounding
from ...judge.run import ORDER_MARGIN
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import Reference, has_no_reference, reference
from ..setup import Setup

STEP = 2.0**-7  # s: of single steps, a number that float32 has
STATES = 8  # from which single steps are compared
FINER = (1, 2, 4, 8, 16, 32, 64)  # steps of the runs, as multiples of GRID or of the scene's own
LONGEST = 1.0  # s: after a run that takes longer, no finer one is made
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
EARLY = 1.0  # s: until then errors fall regularly
REGULAR = 3e-2  # rad: a smaller error falls with its order
CLEAR = 100.0  # times the smallest error that rounding allows: a larger one falls with its order


def compare_methods(result: Result, setup: Setup, engine: Engine) -> None:
    """Single steps from random states, and the runs of the regular free scene with several steps or tolerances."""
    case = free_scene(setup)
    truth = None if case is None or has_no_reference(setup.robot) else reference(case)
    for method in engine.methods.values():
        setup.progress(f"engines: {method.label}")
        if method.scheme in METHODS and not method.adaptive:
            compare_steps(result, setup, engine, method)
        if truth is not None:
            follow(result, case, truth, engine, method, setup.of(FINER, FINER[:4], FINER[:4]))


def free_scene(setup: Setup) -> Case | None:
    """The first scene without locked joints and servos that falls regularly, or else moves freely; None if there is none."""
    cases = [case for case in setup.robot.cases_of_torque if not case.scene.locked and not case.is_held]
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


def follow(
    result: Result, case: Case, truth: Reference, engine: Engine, method: Method, finer: tuple[int, ...]
) -> None:
    """Rows of the runs of one method, and a check of its measured order."""
    base = GRID * -(-case.steps // GRID)
    settings = [Setting(case.duration, base * k) for k in finer]
    if method.adaptive:
        settings = [Setting(case.duration, tolerance=tolerance) for tolerance in TOLERANCES[: len(finer)]]
    rows = []
    for setting in settings:
        dynamics = engine.of(case)
        run, read = dynamics.prepare(*case.start, case.tau, setting, method.name)
        motion = read(run())
        error = truth.error(motion.q, range(len(case.joints)))
        row = {"scene": case.name, "engine": LABELS[engine.name], "method": method.name, "scheme": method.scheme,
               "dt_s": case.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
               "worst_error_rad": None if motion.ended else float(error.max()),
               "early": None if motion.ended else float(error[truth.t <= EARLY].max()),
               "seconds": motion.seconds, "seconds_prepared": dynamics.seconds_prepared, "ended": motion.ended}  # fmt: skip
        rows.append(row)
        if motion.seconds > LONGEST:
            break
    order = measured_order(rows, RECORDS[engine.name].eps)
    result.tables["engines_methods"] += [
        {name: value for name, value in row.items() if name != "early"}
        | {"order": method.order, "measured_order": order}
        for row in rows
    ]
    if order is not None and method.order:
        deviation = order - method.order
        where = f"{case.name}, {method.label}"
        note = f"{order:.2f}"
        result.check(where, f"deviation from order {method.order}: error", abs(deviation), ORDER_MARGIN, "", note,
                     about=About.PREDICTION)  # fmt: skip


def measured_order(rows: list[dict], eps: float) -> float | None:
    """The order by which the error falls between the last two runs whose errors are regular, and settled before; or None."""
    least = CLEAR * eps
    regular = [row for row in rows if row["dt_s"] and row["early"] and least < row["early"] < REGULAR]
    orders = [np.log(a["early"] / b["early"]) / np.log(a["dt_s"] / b["dt_s"]) for a, b in pairwise(regular)]
    settled = len(orders) > 1 and abs(orders[-1] - orders[-2]) <= ORDER_MARGIN
    return float(orders[-1]) if settled else None
