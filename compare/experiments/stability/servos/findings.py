"""What the step limits mean: the answer at the top of a report, and the notes."""

from collections.abc import Sequence

from ....judge.check import Result
from ....robots import Robot
from ....truth.step_limits import LIMIT_UP_TO
from . import response
from .lifting import Lift
from .predicted import Prediction

DEFAULT_INTEGRATOR = "Euler"  # MuJoCo's integrator where a file states none
SHAKES = 10.0  # fold, of the speed with a stable integrator: then the step is the cause
WITHOUT_LIMIT = ("saddle", "drifts", "not_at_rest")
RESTS_WITHIN = 1e-6  # rad or m: a rest so near is the posture


def known(rows: Sequence[dict], integrator: str) -> list[dict]:
    """The rows of an integrator that count, of postures with a limit or known to have none, the least limit first."""
    mine = [row for row in rows if row["integrator"] == integrator and row["base"] != "locked"]
    mine = [row for row in mine if row["limit"] in ("finite", "none")]
    return sorted(mine, key=lambda row: row["predicted_dt_s"] or float("inf"))


def find_answer(result: Result, rows: Sequence[dict], robot: Robot, predictions: Sequence[Prediction]) -> None:
    """Whether the file's step is stable, with its own integrator and with MuJoCo's default."""
    dt, integrator = rows[0]["file_dt_s"], rows[0]["file_integrator"]
    default = verdict(rows, DEFAULT_INTEGRATOR) if integrator != DEFAULT_INTEGRATOR else None
    values = {"dt": dt, "integrator": integrator, "has_servos": robot.drive.feeds_back, "without": without_limit(rows)}
    verdicts = {"own": verdict(rows, integrator), "default": default}
    result.top.append(result.finding("own_step", "servos", **values, **verdicts, conditions=conditions(predictions)))
    if robot.drive.refused:
        result.top.append(result.finding("refused", "servos", actuators=dict(robot.drive.refused)))


def verdict(rows: Sequence[dict], integrator: str) -> dict:
    """Whether the file's step is stable with an integrator, at which postures, what limits it, what the full model does.

    stable None: unknown. postures: those that are not stable, else those that are; empty if these are all.
    """
    mine, postures = known(rows, integrator), {row["posture"] for row in rows}
    if not mine:
        return {"stable": None}
    bad = [row for row in mine if not row["stable_at_file_dt"]]
    where = [row["posture"] for row in bad or mine]
    full_model, warnings, resets = shaking(rows, bad)
    return {
        "stable": not bad,
        "postures": [] if len(where) == len(postures) else where,
        "limit": mine[0]["predicted_dt_s"],
        "joint": mine[0]["limiting_joint"],
        "posture": mine[0]["posture"] if len(postures) > 1 else None,
        "full_model": full_model,
        "warnings": warnings,
        "resets": resets,
        "error": max(row["step_response_error"] or 0.0 for row in mine),
    }


def shaking(rows: Sequence[dict], bad: Sequence[dict]) -> tuple[str, int, int]:
    """What the full model does where a step is not stable, and MuJoCo's warnings and resets then.

    "shakes": at one of these postures at least, far more than with a stable integrator; "calm"; "both": it moves much
    with a stable integrator too; "": it was not run. bad: rows of one integrator.
    """
    ran = [row for row in bad if row["full_model_calm"] is not None]
    moving = [row for row in ran if not row["full_model_calm"]]
    shaken = []
    for row in moving:
        stable = [of for of in rows if of["posture"] == row["posture"] and of["stable_at_file_dt"]]
        speeds = [of["full_model_rms_speed"] for of in stable if of["full_model_rms_speed"] is not None]
        speed = row["full_model_rms_speed"]
        if speed is None or speed > SHAKES * min(speeds, default=0.0):
            shaken.append(row)
    if not shaken:
        return ("both" if moving else "calm" if ran else ""), 0, 0
    return "shakes", *(sum(row[f"full_model_{key}"] for row in shaken) for key in ("warnings", "resets"))


def without_limit(rows: Sequence[dict]) -> list[dict]:
    """The postures that have no limit, by the reason."""
    groups = []
    for reason in WITHOUT_LIMIT:
        mine = [row for row in rows if row["limit"] == reason and row["base"] != "locked"]
        if mine:
            postures = list(dict.fromkeys(row["posture"] for row in mine))
            floats = any(row["base"] == "free" for row in mine)
            groups.append({"reason": reason, "postures": postures, "floats": floats})
    return groups


def conditions(predictions: Sequence[Prediction]) -> dict:
    """What is not part of the limits: contacts, if the file has any, gravity, joints that nothing holds."""
    robot = predictions[0].at.robot
    postures = [prediction.at for prediction in predictions if prediction.is_known]
    aside = dict.fromkeys(robot.coordinates.speeds[k] for at in postures for k in at.aside)
    contacts = any(feature.feature == "contact" for feature in robot.features)
    return {"contacts": contacts, "floats": bool(predictions[0].at.base), "aside": list(aside)}


def find_requested(
    result: Result, predictions: Sequence[Prediction], dt: float, integrator: str, errors: Sequence[float | None]
) -> None:
    """Whether the step of --dt and --integrator is stable; errors: of the step response, where it is."""
    robot, resting = predictions[0].at.robot, with_limit(predictions, integrator)
    values = {"dt": dt, "integrator": integrator, "has_servos": robot.drive.feeds_back, "known": bool(resting)}
    if resting:
        bad = [prediction for prediction in resting if not prediction.is_stable(prediction.base, integrator, dt)]
        where = [prediction.name for prediction in bad or resting]
        least = min(resting, key=lambda prediction: prediction.limits[prediction.base, integrator].dt or LIMIT_UP_TO)
        limit = least.limits[least.base, integrator]
        values |= {"stable": not bad, "postures": [] if len(where) == len(predictions) else where, "limit": limit.dt}
        values |= {"joint": limit.joint, "posture": least.name if len(predictions) > 1 else None}
        values["error"] = max((error for error in errors if error is not None), default=None)
    result.top.append(result.finding("requested_step", "servos", **values, conditions=conditions(predictions)))


def with_limit(predictions: Sequence[Prediction], integrator: str) -> list[Prediction]:
    """The postures at rest whose step has a limit, or is known to have none, with an integrator."""
    return [prediction for prediction in predictions if (prediction.base, integrator) in prediction.pairs]


def find_changes(result: Result, prediction: Prediction, integrator: str, lifts: Sequence[Lift], dt: float) -> None:
    """What would make the file's step stable with an integrator: only what held in a run."""
    coordinates = prediction.at.robot.coordinates
    held, units = [lift for lift in lifts if lift.tried], dict(zip(coordinates.speeds, coordinates.units))

    def parts(kind: str) -> list[tuple]:
        chosen = (lift for lift in held if lift.kind == kind)
        return [(name, value, units.get(name)) for lift in chosen for name, value in zip(lift.names, lift.values)]

    others = [(lift.names[0], lift.factor) for lift in held if lift.kind == "integrator"]
    values = {"integrators": others, "kv": parts("kv"), "armature": parts("armature")}
    result.find("changes", "servos", dt=dt, posture=prediction.name, integrator=integrator, **values)


def find_notes(result: Result, rows: Sequence[dict], predictions: Sequence[Prediction]) -> None:
    """The other notes, in the order in which they are of use."""
    of_each = [known(rows, integrator) for integrator in dict.fromkeys(row["integrator"] for row in rows)]
    integrators, dt = [mine[0] | worst_of(mine) for mine in of_each if mine], rows[0]["file_dt_s"]
    if integrators:
        result.find("integrators", "servos", integrators=integrators, dt=dt, seconds=response.LASTS, up_to=LIMIT_UP_TO)
    both = [row for row in rows if row["observed_dt_s"] and row["predicted_dt_s"]]
    if both:
        off = max(abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) for row in both)
        finite = sum(row["limit"] == "finite" for row in rows)
        places = list(dict.fromkeys(row["posture"] for row in both))
        result.find("observed", "servos", count=len(both), finite=finite, off=off, postures=places)
    full = [row for row in rows if row["full_model_calm"] is not None and row["stable_at_file_dt"] is not None]
    if full:
        differ = [row for row in full if row["full_model_calm"] != row["stable_at_file_dt"]]
        names = {
            calm: [f"{row['posture']} ({row['integrator']})" for row in differ if row["full_model_calm"] == calm]
            for calm in (True, False)
        }
        result.find("full_model", "servos", count=len(full), calm=names[True], moving=names[False])
    find_postures(result, predictions)


def worst_of(rows: Sequence[dict]) -> dict:
    """The largest error of the step response, and whether the file's step is stable at all postures."""
    errors = [row["step_response_error"] for row in rows if row["step_response_error"] is not None]
    return {"error": max(errors, default=None), "stable": all(row["stable_at_file_dt"] for row in rows)}


def find_postures(result: Result, predictions: Sequence[Prediction]) -> None:
    """Where the postures rest, and the actuators that exert nothing or are cut by their range."""
    robot = predictions[0].at.robot
    resting = [prediction for prediction in predictions if prediction.rests]
    moved = [(prediction.name, prediction.at.moved) for prediction in resting if prediction.at.moved > RESTS_WITHIN]
    if moved:
        result.find("rests", "servos", postures=moved, unit="/".join(dict.fromkeys(robot.coordinates.units)))
    if any(prediction.at.small(base).is_coupled for prediction in resting for base in prediction.at.bases):
        result.find("constraints", "servos")
    drive = robot.drive
    if off := [(actuator.name, actuator.off) for actuator in drive.actuators if actuator.off]:
        result.find("actuators_off", "servos", actuators=off)
    for prediction in resting:
        at, name, in_force = prediction.at, prediction.name, bool(prediction.at.limits)
        if joints := list(at.beyond(0.0) if in_force else at.beyond()):
            result.find("beyond_range", "servos", posture=name, joints=joints, in_force=in_force)
        pairs = [pair for pair in prediction.pairs if pair[0] == prediction.base]
        if soft := [integrator for base, integrator in pairs if prediction.gives_way(base, integrator)]:
            result.find("gives_way", "servos", posture=name, integrators=soft)
        cut = [(drive.actuators[i].name, force) for i, force in at.cut.forces.items()]
        cut += [(robot.coordinates.speeds[k], force) for k, force in at.cut.sums.items()]
        if cut:
            result.find("actuators_cut", "servos", posture=name, forces=cut)
    result.find("rest_without_actuators", "servos")
