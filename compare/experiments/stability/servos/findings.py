"""What the step limits mean: the answer at the top of a report, and the notes."""

from collections.abc import Sequence

from ....judge.check import Result
from ....robots import Robot
from ....truth.step_limits import LIMIT_UP_TO
from . import response
from .lifting import Lift
from .predicted import KNOWN, Prediction

DEFAULT_INTEGRATOR = "Euler"  # MuJoCo's integrator where a file states none
WITHOUT_LIMIT = ("saddle", "drifts", "not_at_rest")
RESTS_WITHIN = 1e-6  # rad or m: a rest so near is the posture


def known(rows: Sequence[dict], integrator: str) -> list[dict]:
    """The rows of an integrator at postures with a limit or known to have none, the least limit first."""
    mine = [row for row in rows if row["integrator"] == integrator and row["limit"] in KNOWN]
    return sorted(mine, key=lambda row: row["predicted_dt_s"] or float("inf"))


def least(predictions: Sequence[Prediction], integrator: str) -> Prediction | None:
    """The posture with the least limit of an integrator."""
    resting = [prediction for prediction in predictions if integrator in prediction.known]
    return min(resting, key=lambda prediction: prediction.limits[integrator].dt or LIMIT_UP_TO, default=None)


def find_answer(result: Result, rows: Sequence[dict], robot: Robot, predictions: Sequence[Prediction]) -> None:
    """Whether the file's step is stable, with its own integrator and with MuJoCo's default."""
    dt, integrator = rows[0]["file_dt_s"], rows[0]["file_integrator"]
    default = verdict(rows, DEFAULT_INTEGRATOR) if integrator != DEFAULT_INTEGRATOR else None
    reasons = {row["posture"]: row["limit"] for row in rows if row["limit"] in WITHOUT_LIMIT}
    values = {"dt": dt, "integrator": integrator, "has_servos": robot.drive.feeds_back, "without": reasons}
    verdicts = {"own": verdict(rows, integrator), "default": default}
    result.top.append(result.finding("own_step", "servos", **values, **verdicts, conditions=conditions(predictions)))
    left_out = robot.drive.refused | {actuator.name: actuator.off for actuator in robot.drive.actuators if actuator.off}
    if left_out:
        result.top.append(result.finding("refused", "servos", actuators=left_out))


def verdict(rows: Sequence[dict], integrator: str) -> dict:
    """Whether the file's step is stable with an integrator, at which postures, what limits it, what the full model does.

    stable None: unknown. postures: those that are not stable, else those that are; empty if these are all.
    full_model: the runs where the step is not stable.
    """
    mine, postures = known(rows, integrator), {row["posture"] for row in rows}
    if not mine:
        return {"stable": None}
    bad = [row for row in mine if not row["stable_at_file_dt"]]
    where = [row["posture"] for row in bad or mine]
    return {
        "stable": not bad,
        "postures": [] if len(where) == len(postures) else where,
        "limit": mine[0]["predicted_dt_s"],
        "joint": mine[0]["limiting_joint"],
        "posture": mine[0]["posture"] if len(postures) > 1 else None,
        "full_model": shaking(rows, [row for row in bad if row["full_model_calm"] is not None]),
        "error": max(row["step_response_error"] or 0.0 for row in mine),
    }


def shaking(rows: Sequence[dict], bad: Sequence[dict]) -> dict | None:
    """What the full model does where a step is not stable, at the posture with the largest speed; None: it was not run.

    speed: rad/s and m/s, infinite: it diverged; stable_speed: the smallest with an integrator that is stable there.
    """
    if not bad:
        return None
    speeds = [float("inf") if row["full_model_rms_speed"] is None else row["full_model_rms_speed"] for row in bad]
    row = bad[speeds.index(max(speeds))]
    stable = [of for of in rows if of["posture"] == row["posture"] and of["stable_at_file_dt"]]
    stable_speeds = [of["full_model_rms_speed"] for of in stable if of["full_model_rms_speed"] is not None]
    counts = {key: row[f"full_model_{key}"] for key in ("calm", "warnings", "resets")}
    return {"speed": max(speeds), "stable_speed": min(stable_speeds, default=None), **counts}


def conditions(predictions: Sequence[Prediction]) -> dict:
    """What is not part of the limits: contacts, if the file has any, gravity."""
    robot = predictions[0].at.robot
    contacts = any(feature.feature == "contact" for feature in robot.features)
    return {"contacts": contacts, "floats": bool(predictions[0].at.base)}


def find_requested(result: Result, rows: Sequence[dict], robot: Robot, predictions: Sequence[Prediction]) -> None:
    """Whether the step of --dt and --integrator is stable; rows: as if the file stated them, with errors where it is."""
    dt, integrator = rows[0]["file_dt_s"], rows[0]["file_integrator"]
    values = {
        "dt": dt,
        "integrator": integrator,
        "has_servos": robot.drive.feeds_back,
        "own": verdict(rows, integrator),
    }
    result.top.append(result.finding("requested_step", "servos", **values, conditions=conditions(predictions)))


def find_changes(result: Result, prediction: Prediction, integrator: str, lifts: Sequence[Lift], dt: float) -> None:
    """What would make the file's step stable with an integrator."""
    units = dict(zip(prediction.at.robot.coordinates.speeds, prediction.at.robot.coordinates.units))
    values = {"integrators": [lift.names[0] for lift in lifts if lift.kind == "integrator"], "kv": [], "armature": []}
    for lift in lifts:
        if lift.kind != "integrator":
            values[lift.kind] = [(name, value, units.get(name)) for name, value in zip(lift.names, lift.values)]
    result.find("changes", "servos", dt=dt, posture=prediction.name, integrator=integrator, **values)


def find_notes(result: Result, rows: Sequence[dict], predictions: Sequence[Prediction]) -> None:
    """The limits and errors of all integrators, where the postures rest, and forces that are cut by their range."""
    of_each = [known(rows, integrator) for integrator in dict.fromkeys(row["integrator"] for row in rows)]
    integrators = [mine[0] | {"error": largest_error(mine)} for mine in of_each if mine]
    if integrators:
        values = {"dt": rows[0]["file_dt_s"], "seconds": response.LASTS, "up_to": LIMIT_UP_TO}
        result.find("integrators", "servos", integrators=integrators, **values)
    robot, resting = predictions[0].at.robot, [prediction for prediction in predictions if prediction.limits]
    away = [(prediction.name, prediction.at.away(prediction.at.start)) for prediction in resting]
    if moved := [(name, distance) for name, distance in away if distance > RESTS_WITHIN]:
        result.find("rests", "servos", postures=moved, unit="/".join(dict.fromkeys(robot.coordinates.units)))
    for prediction in resting:
        if forces := [(robot.drive.actuators[i].name, force) for i, force in prediction.at.cut.items()]:
            result.find("actuators_cut", "servos", posture=prediction.name, forces=forces)
    result.find("rest_without_actuators", "servos")


def largest_error(rows: Sequence[dict]) -> float | None:
    return max((row["step_response_error"] for row in rows if row["step_response_error"] is not None), default=None)
