"""Which step is stable with a robot's own servos, predicted and observed, and its error: tables/step_limits.csv."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from ....core.check import AT_OWN_STEP, AT_REQUESTED_STEP, About, Result
from ....truth.linear import posture_names
from ....truth.step_limits import LIMIT_UP_TO
from ...setup import Setup
from ..tables import LimitRow, StabilityResult, StepLimitRow, StepResponse
from . import findings, lifting, observed, response
from .observed import OBSERVED_WITHIN
from .predicted import Prediction, limit_rows, predicted_at, radii_apart

MOST_POSTURES_DRIVEN = 6  # the first of the named ones
RADII_WITHIN = 1e-4  # of the spectral radius, MuJoCo's is by differences
TOLERANCES = {"observed": OBSERVED_WITHIN, "radii": RADII_WITHIN}


Started = tuple[Sequence[tuple], Iterable[Any]]  # the arguments of calls, and what they return


class Work(NamedTuple):
    """What `begin` starts, each with the postures and integrators that it is about."""

    predictions: Sequence[Prediction]
    observed: Started
    radii: Started
    errors: Started
    lifts: Started
    curves: Started


def begin(setup: Setup) -> Work | None:
    """Predict the limits and start the runs; None: the robot has no actuator, or its numbers are stated.

    All integrators are observed at the first posture that has a limit; at others the file's and Euler. A quick run has these
    two alone and observes, as a run of all experiments does, at one posture; it draws nothing.
    """
    robot, reading = setup.robot, setup.reading
    if reading is None or not robot.drive.actuators:
        return None
    predictions = [predicted_at(robot, name, reading) for name in posture_names(robot)[:MOST_POSTURES_DRIVEN]]
    resting = [prediction for prediction in predictions if prediction.limits]
    finite = [prediction for prediction in resting if any(limit.dt for limit in prediction.limits.values())]
    examined = resting if setup.alone and not setup.is_quick else finite[:1]
    shown = finite[:1] if not setup.is_quick else []  # where all integrators are run
    own = tuple(dict.fromkeys((reading.integrator, findings.DEFAULT_STEP[1])))
    tried = [
        (prediction.there[name], name)
        for prediction in examined
        for name in prediction.known
        if (prediction in shown or name in own) and not prediction.gives_way(name)
    ]
    unstable = [(one, name) for name in own for one in resting if one.is_stable(name, reading.dt) is False]
    worst = {name: one.at for one, name in sorted(unstable, key=lambda pair: -pair[0].longest(pair[1]))}
    drawn = [(one.at, name, one.limits[name].dt) for one in shown for name in one.known]

    def start(function, items: Sequence[tuple]) -> Started:
        return items, setup.map(partial(function, reading=reading), *(zip(*items) if items else [()]))

    return Work(
        predictions,
        observed=start(observed.limit, tried),
        radii=start(radii_apart, [(prediction,) for prediction in resting]),
        errors=start(response.response_error, [(one.at, name) for one in resting for name in one.known]),
        lifts=start(lifting.lifts, [(at, name) for name, at in worst.items()]),
        curves=start(response.curve, drawn),
    )


def add(result: StabilityResult, setup: Setup, work: Work) -> None:
    """Rows, checks, curves, the answer at the top and the notes of the computations that `begin` has started."""
    predictions, reading = work.predictions, setup.reading
    rows = limit_rows(predictions, reading.dt, reading.integrator)
    by_place = {(row.posture, row.integrator): row for row in rows}
    for (at, name), error in zip(*work.errors):
        by_place[at.name, name].step_response_error = error
    for run in result.tables.get("own_run", ()):
        if (place := (run.start, run.integrator)) in by_place and run.dt == reading.dt:
            by_place[place].add_own_run(run)
    for (prediction,), radii in zip(*work.radii):
        check_radii(result, prediction.at.name, radii)
    for (at, name), (kind, dt) in zip(*work.observed):
        row = by_place[at.name, name]
        row.observed_dt = dt
        if dt is None or not row.predicted_dt or observed.is_shown(at, name, row.predicted_dt):
            check_observed(result, row, kind)
    if setup.robot.drive.feeds_back:
        check_step(result, rows, AT_OWN_STEP)
    result.tables["step_limits"] = rows
    findings.find_answer(result, rows, predictions)
    if setup.step:
        dt, name = setup.step
        requested, by_name = limit_rows(predictions, dt, name), {one.at.name: one.at for one in predictions}
        for row in findings.known(requested, name):
            if row.stable_at_file_dt:
                row.step_response_error = response.response_error(by_name[row.posture], name, reading, dt)
        findings.find_answer(result, requested, predictions, requested=True)
        if setup.robot.drive.feeds_back:
            check_step(result, requested, AT_REQUESTED_STEP)
    for (at, name), changes in zip(*work.lifts):
        result.find("changes", "servos", dt=reading.dt, posture=at.name, integrator=name, **changes)
    findings.find_notes(result, rows, predictions)
    drawn, curves = work.curves
    if drawn:
        shown = drawn[0][0].name
        lines = {name: curve for (_, name, _), curve in zip(drawn, curves)}
        of_posture = [row for row in rows if row.posture == shown]
        result.step_response = StepResponse(shown, of_posture, lines)


def check_radii(result: Result, posture: str, radii: Mapping[str, float]) -> None:
    """The growth of a step near the limit compared with MuJoCo's own derivative."""
    quantity = "spectral radius of a step near the limit with servos, TMT to MuJoCo"
    for integrator, difference in radii.items():
        result.check(f"{posture}, {integrator}", quantity, difference, RADII_WITHIN, "")


def check_observed(result: Result, row: StepLimitRow, kind: str) -> None:
    """The limit in MuJoCo's runs compared with the predicted one."""
    below = kind == "always" and row.limit == "finite" and row.predicted_dt < observed.SOUGHT_FROM
    if kind == row.limit == "none" or below:  # shorter steps are not tried
        return
    off = row.apart
    note = f"predicted: {row.limit}, observed: {kind}" if off is None else ""
    where, quantity = f"{row.posture}, {row.integrator}", "step limit with servos, observed / predicted - 1"
    result.check(where, quantity, off, OBSERVED_WITHIN, "", note, about=About.PREDICTION)


def limits_in_use(rows: Sequence[StepLimitRow]) -> list[LimitRow]:
    """The limits that are known with servos, in the form of those without."""
    kinds = {"finite": "finite", "none": "never_fails"}
    return [
        LimitRow(
            scene=row.posture,
            engine="mujoco",
            method=row.integrator,
            damping=0.0,
            mode=row.mode,
            predicted_dt=row.predicted_dt,
            observed_dt=row.observed_dt,
            limit=kinds[row.limit],
            passed=(row.apart or 0.0) <= OBSERVED_WITHIN,
        )
        for row in rows
        if row.limit in kinds
    ]


def check_step(result: Result, rows: Sequence[StepLimitRow], quantity: str) -> None:
    """Whether the step of these rows is stable under their integrator, where that is known."""
    for row in findings.known(rows, rows[0].file_integrator):
        limit = row.predicted_dt or LIMIT_UP_TO
        note = ", ".join(filter(None, (f"under {row.file_integrator}", row.limiting_joint)))
        result.check(row.posture, quantity, row.file_dt, limit, "s", note, about=About.STEP)
