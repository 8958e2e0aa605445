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
    resting = [prediction for prediction in predictions if prediction.rests]
    shown = next((prediction for prediction in resting if prediction.is_finite), None)
    examined = resting if setup.alone and not setup.is_quick else [shown] * bool(shown)
    own = (reading.integrator, findings.DEFAULT_INTEGRATOR)
    tried = [
        (prediction, base, name)
        for prediction in examined
        for base, name in prediction.pairs
        if ((prediction is shown and not setup.is_quick) or (name in own and base == prediction.base))
        and not prediction.gives_way(base, name)
    ]
    least = [(least_at(resting, name, reading.dt), name) for name in dict.fromkeys(own)]
    unstable = [(prediction, name) for prediction, name in least if prediction]
    full = []
    for prediction in resting:
        names = integrators_run(prediction, own, reading.dt, prediction is shown and not setup.is_quick)
        full += [(prediction, name) for name in names]

    drawn = [
        (shown, name) for name in INTEGRATORS if shown and not setup.is_quick and (shown.base, name) in shown.pairs
    ]

    def start(function, items):
        return setup.map(partial(function, reading=reading), *(zip(*items) if items else [()]))

    return {
        "predictions": predictions,
        "tried": tried,
        "observed": start(observed_limit_at, tried),
        "radii": start(radii_apart, [(prediction,) for prediction in resting]),
        "errors": start(errors_at, [(prediction,) for prediction in resting]),
        "lifts": (unstable, start(lifts_at, unstable)),
        "full": (full, start(full_at, full)),
        "curves": (drawn, start(curve_at, drawn)),
    }


def least_at(resting: Sequence[Prediction], integrator: str, dt: float) -> Prediction | None:
    """The posture with the least limit of an integrator, if a step is not stable there; else None."""
    bad = [prediction for prediction in resting if prediction.is_stable(prediction.base, integrator, dt) is False]
    return min(
        bad, key=lambda prediction: prediction.limits[prediction.base, integrator].dt or LIMIT_UP_TO, default=None
    )


def integrators_run(prediction: Prediction, own: Sequence[str], dt: float, every: bool) -> list[str]:
    """The integrators with which the full model is run: every one, or these and, if none of them is stable, one that is."""
    stable = [name for name in INTEGRATORS if prediction.is_stable(prediction.base, name, dt)]
    more = () if set(stable) & {*own} else stable[:1]
    return [name for name in INTEGRATORS if every or name in (*own, *more)]


# in a further process


def observed_limit_at(prediction: Prediction, base: str, integrator: str, reading: Reading) -> tuple[str, float | None]:
    at = prediction.there[base, integrator]  # where it rests with such a step
    return observed.limit(acting_at(reading, at, base), at, integrator)


def errors_at(prediction: Prediction, reading: Reading) -> dict[tuple[str, str], float | None]:
    """The error of the step response at the file's step, by base and integrator."""
    return {(base, name): error_at(prediction, base, name, reading.dt, reading) for base, name in prediction.pairs}


def error_at(prediction: Prediction, base: str, integrator: str, dt: float, reading: Reading) -> float | None:
    return response.response_error(acting_at(reading, prediction.at, base), prediction.at, base, integrator, dt)


def curve_at(prediction: Prediction, integrator: str, reading: Reading) -> list[tuple[float, float]]:
    at, base, limit = prediction.at, prediction.base, prediction.limits[prediction.base, integrator].dt
    return response.curve(acting_at(reading, at, base), at, base, integrator, reading.dt, limit)


def lifts_at(prediction: Prediction, integrator: str, reading: Reading) -> list[lifting.Lift]:
    base = prediction.base
    return lifting.lifts(acting_at(reading, prediction.at, base), prediction.at, base, integrator, reading.dt)


def full_at(prediction: Prediction, integrator: str, reading: Reading) -> dict:
    return observed.full_model(reading.model, prediction.at, reading.dt, integrator)


# in the main process


def add(result: Result, setup: Setup, work: dict) -> None:
    """Rows, checks, curves, the answer at the top and the notes of the computations that `begin` has started."""
    predictions, reading = work["predictions"], setup.reading
    rows = limit_rows(predictions, reading.dt, reading.integrator)
    by_place = {(row["posture"], row["base"], row["integrator"]): row for row in rows}
    resting = [prediction for prediction in predictions if prediction.rests]
    for prediction, errors, radii in zip(resting, work["errors"], work["radii"]):
        for pair, error in errors.items():
            by_place[prediction.name, *pair]["step_response_error"] = error
        check_radii(result, prediction, radii)
    for (prediction, base, name), (kind, dt) in zip(work["tried"], work["observed"]):
        row = by_place[prediction.name, base, name]
        row["observed_dt_s"] = dt
        check_observed(result, row, kind, len(prediction.at.bases) > 1)
    for (prediction, name), run in zip(*work["full"]):
        by_place[prediction.name, prediction.base, name].update(run)
    if setup.robot.drive.feeds_back:
        check_own_step(result, rows)
    result.tables["step_limits"] = rows
    findings.find_answer(result, rows, setup.robot, predictions)
    if setup.step:
        dt, name = setup.step
        within = findings.with_limit(predictions, name)
        stable = [prediction for prediction in within if prediction.is_stable(prediction.base, name, dt)]
        errors = [error_at(prediction, prediction.base, name, dt, reading) for prediction in stable]
        findings.find_requested(result, predictions, dt, name, errors)
    for (prediction, name), lifts in zip(*work["lifts"]):
        findings.find_changes(result, prediction, name, lifts, reading.dt)
    findings.find_notes(result, rows, predictions)
    drawn, curves = work["curves"]
    if drawn:
        shown = drawn[0][0]
        result.curves["step response"] = {
            "posture": shown.name,
            "rows": [row for row in rows if (row["posture"], row["base"]) == (shown.name, shown.base)],
            "lines": {name: curve for (_, name), curve in zip(drawn, curves)},
        }


def named_place(posture: str, base: str, integrator: str, several: bool) -> str:
    """The scene of a check; several: whether there are several bases."""
    return f"{posture}, " + f"{base} base, " * several + integrator


def check_radii(result: Result, prediction: Prediction, radii: Mapping[tuple[str, str], float]) -> None:
    """The growth of a step near the limit compared with MuJoCo's own derivative."""
    for (base, integrator), apart in radii.items():
        where = named_place(prediction.name, base, integrator, len(prediction.at.bases) > 1)
        result.check(
            where, "spectral radius of a step near the limit with servos, TMT to MuJoCo", apart, RADII_WITHIN, ""
        )


def check_observed(result: Result, row: dict, kind: str, several: bool) -> None:
    """The limit in MuJoCo's runs compared with the predicted one."""
    below = kind == "always" and row["limit"] == "finite" and row["predicted_dt_s"] < observed.SOUGHT_FROM
    if kind == row["limit"] == "none" or below:  # shorter steps are not tried
        return
    both = kind == row["limit"] == "finite"
    apart = abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if both else None
    note = "" if both else f"predicted: {row['limit']}, observed: {kind}"
    where = named_place(row["posture"], row["base"], row["integrator"], several)
    quantity = "step limit with servos, observed / predicted - 1"
    result.check(where, quantity, apart, OBSERVED_WITHIN, "", note, about=About.PREDICTION)


def check_own_step(result: Result, rows: Sequence[dict]) -> None:
    """Whether the file's own step is stable under its own integrator, where that is known."""
    for row in findings.known(rows, rows[0]["file_integrator"]):
        limit = row["predicted_dt_s"] or LIMIT_UP_TO
        note = ", ".join(filter(None, (f"under {row['file_integrator']}", row["limiting_joint"])))
        result.check(row["posture"], AT_OWN_STEP, row["file_dt_s"], limit, "s", note, about=About.STEP)
