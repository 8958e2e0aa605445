"""Which step is stable with a robot's own servos, predicted and observed, and its error: tables/step_limits.csv."""

from collections.abc import Mapping, Sequence
from functools import partial

from ....engines.mujoco import Reading
from ....engines.mujoco.names import INTEGRATORS
from ....judge.check import AT_OWN_STEP, About, Result
from ....truth.linear import posture_names
from ....truth.step_limits import LIMIT_UP_TO
from ...setup import Setup
from . import findings, lifting, observed, response
from .predicted import Prediction, acting_at, limit_rows, predicted_at, radii_apart

MOST_POSTURES_DRIVEN = 6  # the first of the named ones
OBSERVED_WITHIN = 0.01  # relative
RADII_WITHIN = 1e-4  # of the spectral radius, MuJoCo's is by differences
TOLERANCES = {"observed": OBSERVED_WITHIN, "radii": RADII_WITHIN}


def begin(setup: Setup) -> dict | None:
    """Predict the limits and start the runs; None: the robot has no actuator, or its numbers are stated.

    All integrators are observed, and run in the full model, at the first posture that has a limit; at others the file's and
    Euler. A quick run has these two alone and observes, as a run of all experiments does, at one posture; it draws nothing.
    """
    robot, reading = setup.robot, setup.reading
    if reading is None or not robot.drive.actuators:
        return None
    predictions = [predicted_at(robot, name, reading) for name in posture_names(robot)[:MOST_POSTURES_DRIVEN]]
    resting = [prediction for prediction in predictions if prediction.limits]
    finite = [prediction for prediction in resting if any(limit.dt for limit in prediction.limits.values())]
    shown = finite[0] if finite else None
    examined = resting if setup.alone and not setup.is_quick else [shown] * bool(shown)
    own = tuple(dict.fromkeys((reading.integrator, findings.DEFAULT_INTEGRATOR)))
    all_run = None if setup.is_quick else shown  # the posture at which all integrators are run
    tried = [
        (prediction, name)
        for prediction in examined
        for name in prediction.known
        if (prediction is all_run or name in own) and not prediction.gives_way(name)
    ]
    full = [(prediction, name) for prediction in resting for name in (INTEGRATORS if prediction is all_run else own)]
    unstable = [(findings.least(resting, name), name) for name in own]
    unstable = [(at, name) for at, name in unstable if at and at.is_stable(name, reading.dt) is False]
    drawn = [(shown, name) for name in shown.known] if all_run else []

    def start(function, items):
        return items, setup.map(partial(function, reading=reading), *(zip(*items) if items else [()]))

    return {
        "predictions": predictions,
        "observed": start(observed_limit_at, tried),
        "radii": start(radii_apart, [(prediction,) for prediction in resting]),
        "errors": start(error_at, [(prediction, name) for prediction in resting for name in prediction.known]),
        "lifts": start(lifts_at, unstable),
        "full": start(full_at, full),
        "curves": start(curve_at, drawn),
    }


# in a further process


def observed_limit_at(prediction: Prediction, integrator: str, reading: Reading) -> tuple[str, float | None]:
    at = prediction.there[integrator]  # where it rests with such a step
    return observed.limit(acting_at(reading, at), at, integrator)


def error_at(prediction: Prediction, integrator: str, reading: Reading, dt: float | None = None) -> float | None:
    acting = acting_at(reading, prediction.at)
    return response.response_error(acting, prediction.at, integrator, dt or reading.dt)


def curve_at(prediction: Prediction, integrator: str, reading: Reading) -> list[tuple[float, float]]:
    at, limit = prediction.at, prediction.limits[integrator].dt
    return response.curve(acting_at(reading, at), at, integrator, reading.dt, limit)


def lifts_at(prediction: Prediction, integrator: str, reading: Reading) -> list[lifting.Lift]:
    return lifting.lifts(acting_at(reading, prediction.at), prediction.at, integrator, reading.dt)


def full_at(prediction: Prediction, integrator: str, reading: Reading) -> dict:
    return observed.full_model(reading.model, prediction.at, reading.dt, integrator)


# in the main process


def add(result: Result, setup: Setup, work: dict) -> None:
    """Rows, checks, curves, the answer at the top and the notes of the computations that `begin` has started."""
    predictions, reading = work["predictions"], setup.reading
    rows = limit_rows(predictions, reading.dt, reading.integrator)
    by_place = {(row["posture"], row["integrator"]): row for row in rows}
    for (prediction, name), error in zip(*work["errors"]):
        by_place[prediction.name, name]["step_response_error"] = error
    for (prediction,), radii in zip(*work["radii"]):
        check_radii(result, prediction.name, radii)
    for (prediction, name), (kind, dt) in zip(*work["observed"]):
        row = by_place[prediction.name, name]
        row["observed_dt_s"] = dt
        check_observed(result, row, kind)
    for (prediction, name), run in zip(*work["full"]):
        by_place[prediction.name, name].update(run)
    if setup.robot.drive.feeds_back:
        check_own_step(result, rows)
    result.tables["step_limits"] = rows
    findings.find_answer(result, rows, setup.robot, predictions)
    if setup.step:
        dt, name = setup.step
        requested, by_name = (
            limit_rows(predictions, dt, name),
            {prediction.name: prediction for prediction in predictions},
        )
        for row in findings.known(requested, name):
            if row["stable_at_file_dt"]:
                row["step_response_error"] = error_at(by_name[row["posture"]], name, reading, dt)
        findings.find_requested(result, requested, setup.robot, predictions)
    for (prediction, name), lifts in zip(*work["lifts"]):
        findings.find_changes(result, prediction, name, lifts, reading.dt)
    findings.find_notes(result, rows, predictions)
    drawn, curves = work["curves"]
    if drawn:
        shown = drawn[0][0].name
        lines = {name: curve for (_, name), curve in zip(drawn, curves)}
        of_posture = [row for row in rows if row["posture"] == shown]
        result.curves["step response"] = {"posture": shown, "rows": of_posture, "lines": lines}


def check_radii(result: Result, posture: str, radii: Mapping[str, float]) -> None:
    """The growth of a step near the limit compared with MuJoCo's own derivative."""
    quantity = "spectral radius of a step near the limit with servos, TMT to MuJoCo"
    for integrator, apart in radii.items():
        result.check(f"{posture}, {integrator}", quantity, apart, RADII_WITHIN, "")


def check_observed(result: Result, row: dict, kind: str) -> None:
    """The limit in MuJoCo's runs compared with the predicted one."""
    below = kind == "always" and row["limit"] == "finite" and row["predicted_dt_s"] < observed.SOUGHT_FROM
    if kind == row["limit"] == "none" or below:  # shorter steps are not tried
        return
    both = kind == row["limit"] == "finite"
    apart = abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if both else None
    note = "" if both else f"predicted: {row['limit']}, observed: {kind}"
    where, quantity = f"{row['posture']}, {row['integrator']}", "step limit with servos, observed / predicted - 1"
    result.check(where, quantity, apart, OBSERVED_WITHIN, "", note, about=About.PREDICTION)


def check_own_step(result: Result, rows: Sequence[dict]) -> None:
    """Whether the file's own step is stable under its own integrator, where that is known."""
    for row in findings.known(rows, rows[0]["file_integrator"]):
        limit = row["predicted_dt_s"] or LIMIT_UP_TO
        note = ", ".join(filter(None, (f"under {row['file_integrator']}", row["limiting_joint"])))
        result.check(row["posture"], AT_OWN_STEP, row["file_dt_s"], limit, "s", note, about=About.STEP)
