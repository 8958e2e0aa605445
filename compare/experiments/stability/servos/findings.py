"""What the step limits mean: the answer at the top of a report, and the notes."""

from collections.abc import Sequence

from ....judge.check import Result
from ....robots import Robot
from ....truth.step_limits import LIMIT_UP_TO
from . import response
from .lifting import Lift
from .predicted import Predicted

DEFAULT_INTEGRATOR = "Euler"  # MuJoCo's integrator where a file states none
SHAKES = 10.0  # fold, of the speed with a stable integrator: then the step is the cause
WITHOUT_LIMIT = ("saddle", "drifts", "not_at_rest")
RESTS_WITHIN = 1e-6  # rad or m: a rest so near is the posture


def known(rows: Sequence[dict], integrator: str) -> list[dict]:
    """The rows of an integrator that count, of postures with a limit or known to have none, the least limit first."""
    mine = [row for row in rows if row["integrator"] == integrator and row["base"] != "locked"]
    mine = [row for row in mine if row["limit"] in ("finite", "none")]
    return sorted(mine, key=lambda row: row["predicted_dt_s"] or float("inf"))


def find_answer(result: Result, rows: Sequence[dict], robot: Robot, predictions: Sequence[Predicted]) -> None:
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
    found = []
    for reason in WITHOUT_LIMIT:
        mine = [row for row in rows if row["limit"] == reason and row["base"] != "locked"]
        if mine:
            postures = list(dict.fromkeys(row["posture"] for row in mine))
            found.append({"reason": reason, "postures": postures, "floats": any(row["base"] == "free" for row in mine)})
    return found


def conditions(predictions: Sequence[Predicted]) -> dict:
    """What is not part of the limits: contacts, if the file has any, gravity, joints that nothing holds."""
    robot = predictions[0].at.robot
    aside = dict.fromkeys(robot.coordinates.speeds[k] for one in predictions if one.is_known for k in one.at.aside)
    contacts = any(feature.feature == "contact" for feature in robot.features)
    return {"contacts": contacts, "floats": bool(predictions[0].at.base), "aside": list(aside)}


def find_requested(
    result: Result, predictions: Sequence[Predicted], dt: float, integrator: str, errors: Sequence[float | None]
) -> None:
    """Whether the step of --dt and --integrator is stable; errors: of the step response, where it is."""
    robot, resting = predictions[0].at.robot, with_limit(predictions, integrator)
    values = {"dt": dt, "integrator": integrator, "has_servos": robot.drive.feeds_back, "known": bool(resting)}
    if resting:
        stable = {one.name: bool(one.is_stable(one.at.bases[0], integrator, dt)) for one in resting}
        least = min(resting, key=lambda one: one.limits[one.at.bases[0], integrator].dt or LIMIT_UP_TO)
        limit, same = least.limits[least.at.bases[0], integrator], all(stable.values())
        where = [name for name, is_stable in stable.items() if is_stable == same]
        values |= {
            "stable": same,
            "postures": [] if len(where) == len(predictions) else where,
            "limit": limit.dt,
            "joint": limit.joint,
            "posture": least.name if len(predictions) > 1 else None,
            "error": max((error for error in errors if error is not None), default=None),
        }
    result.top.append(result.finding("requested_step", "servos", **values, conditions=conditions(predictions)))


def with_limit(predictions: Sequence[Predicted], integrator: str) -> list[Predicted]:
    """The postures at rest whose step has a limit, or is known to have none, with an integrator."""
    return [one for one in predictions if one.rests and (one.at.bases[0], integrator) in one.pairs]


def find_changes(result: Result, one: Predicted, integrator: str, lifts: Sequence[Lift], dt: float) -> None:
    """What would make the file's step stable with an integrator: only what held in a run."""
    coordinates = one.at.robot.coordinates
    held, units = [lift for lift in lifts if lift.tried], dict(zip(coordinates.speeds, coordinates.units))

    def parts(kind: str) -> list[tuple]:
        chosen = (lift for lift in held if lift.kind == kind)
        return [(name, value, units.get(name)) for lift in chosen for name, value in zip(lift.names, lift.values)]

    others = [(lift.names[0], lift.factor) for lift in held if lift.kind == "integrator"]
    values = {"integrators": others, "kv": parts("kv"), "armature": parts("armature")}
    result.find("changes", "servos", dt=dt, posture=one.name, integrator=integrator, **values)


def find_notes(result: Result, rows: Sequence[dict], predictions: Sequence[Predicted]) -> None:
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
    find_actuators(result, predictions)


def worst_of(rows: Sequence[dict]) -> dict:
    """The largest error of the step response, and whether the file's step is stable at all postures."""
    errors = [row["step_response_error"] for row in rows if row["step_response_error"] is not None]
    return {"error": max(errors, default=None), "stable": all(row["stable_at_file_dt"] for row in rows)}


def find_postures(result: Result, predictions: Sequence[Predicted]) -> None:
    """Where the postures rest."""
    units = list(dict.fromkeys(predictions[0].at.robot.coordinates.units))
    moved = [(one.name, one.at.moved) for one in predictions if one.rests and one.at.moved > RESTS_WITHIN]
    if moved:
        result.find("rests", "servos", postures=moved, unit="/".join(units))
    if any(one.at.small(base).is_coupled for one in predictions if one.rests for base in one.at.bases):
        result.find("constraints", "servos")
    for one in predictions:
        joints, in_force = one.at.beyond(0.0) if one.at.limits else one.at.beyond(), bool(one.at.limits)
        if one.rests and joints:
            result.find("beyond_range", "servos", posture=one.name, joints=list(joints), in_force=in_force)
        base = one.at.bases[0]
        soft = [name for of, name in one.pairs if of == base and one.gives_way(of, name)]
        if soft:
            result.find("gives_way", "servos", posture=one.name, integrators=soft)


def find_actuators(result: Result, predictions: Sequence[Predicted]) -> None:
    """Actuators that exert nothing, or are cut by their range."""
    robot = predictions[0].at.robot
    drive, off = robot.drive, [(one.name, one.off) for one in robot.drive.actuators if one.off]
    if off:
        result.find("actuators_off", "servos", actuators=off)
    for one in predictions:
        cut = [(drive.actuators[i].name, force) for i, force in one.at.cut.forces.items()] if one.rests else []
        cut += [(robot.coordinates.speeds[k], force) for k, force in one.at.cut.sums.items()] if one.rests else []
        if cut:
            result.find("actuators_cut", "servos", posture=one.name, forces=cut)
    result.find("rest_without_actuators", "servos")
