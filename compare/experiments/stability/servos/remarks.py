"""Notes on the limits of the step: what limits, where each posture rests, what is left out; and the answer to --dt."""

from collections.abc import Iterator, Sequence

from ....engines.mujoco import Reading
from ....robots import Robot
from . import response
from .circumstances import circumstances, constraints_in_words
from .lifting import Lift
from .predicted import Predicted, acting_at
from .sentences import in_digits, in_seconds, known, some_of

RESTS_WITHIN = 1e-6  # rad or m: a rest so near is the posture
FORCES = {"rad": "N m", "m": "N"}


def asked_in_words(found: Sequence[Predicted], dt: float, integrator: str, reading: Reading) -> str:
    """Whether a step with an integrator is stable at each posture, what limits it, and the error of the step response."""
    resting = [one for one in found if one.rests and (one.at.bases[0], integrator) in one.pairs]
    step = f"{in_seconds(dt)} under {integrator}"
    if not found[0].at.robot.drive.feeds_back:
        return f"Asked: {step}: no actuator feeds back, so that there is no servo that it could make unstable."
    if not resting:
        return f"Asked: {step}: that cannot be said; no posture is a stable rest under the servos."
    good = [one.name for one in resting if one.is_stable(one.at.bases[0], integrator, dt)]
    bad = [one.name for one in resting if one.name not in good]
    where = "" if len(resting) == len(found) and not (good and bad) else f" at {some_of(bad or good)}"
    least = min(resting, key=lambda one: one.limits[one.at.bases[0], integrator].dt or float("inf"))
    limit = least.limits[least.at.bases[0], integrator]
    text = f"Asked: {step}: {'not stable' if bad else 'stable'}{where}{circumstances(found)}"
    if limit.limit == "none":
        text += " (no limit up to 5 s)"
    else:
        text += f" (limit {in_seconds(limit.dt, dt)}, {limit.joint}" + f", at {least.name}" * (len(found) > 1) + ")"
    errors = [response_error_at(one, one.at.bases[0], integrator, dt, reading) for one in resting if one.name in good]
    errors = [error for error in errors if error is not None]
    where = "where it is stable " * bool(bad)
    return text + (f"; {where}the step response is at most {percent(max(errors))} off" if errors else "") + "."


def response_error_at(one: Predicted, base: str, integrator: str, dt: float, reading: Reading) -> float | None:
    """The error of the step response, see response.response_error; None also for a step that is too fine to be run."""
    if response.LASTS / dt > response.CURVE_MOST:
        return None
    return response.response_error(acting_at(reading, one.at, base), one.at, base, integrator, dt)


def percent(ratio: float) -> str:
    """A ratio in %."""
    return f"{in_digits(100.0 * ratio)} %"


INERTIAS = {"rad": "kg m2", "m": "kg"}


def lifts_in_words(lifted: Sequence[tuple[Predicted, str, list[Lift]]], dt: float) -> Iterator[str]:
    """What would make the file's step stable with an integrator that it is not stable with; of each only what held in a run."""
    for one, integrator, lifts in lifted:
        held = [lift for lift in lifts if lift.tried]
        others = [
            f"{lift.names[0]} {'(no limit up to 5 s)' if lift.factor is None else f'({in_digits(lift.factor)} times the limit)'}"
            for lift in held
            if lift.kind == "integrator"
        ]
        units = dict(zip(one.at.robot.coordinates.speeds, one.at.robot.coordinates.units))
        changes = []
        for lift in held:
            if lift.kind == "kv":
                changes.append(f"kv at most {some_of(each_value(lift, [''] * len(lift.names)))}")
            elif lift.kind == "armature":
                kinds = [INERTIAS[units[name]] for name in lift.names]
                changes.append(f"armature of at least {some_of(each_value(lift, kinds))}")
        texts = [f"with another integrator: {'; '.join(others)}"] * bool(others)
        texts += [f"with {integrator} {', or '.join(changes)}"] * bool(changes)
        where = f"{in_seconds(dt)} at {one.name}"
        if texts:
            yield f"What would make {where} stable, each tried in a run of MuJoCo: {'. Or '.join(texts)}."
        else:
            yield f"Nothing was found that makes {where} stable with {integrator}: no other integrator, kv or armature."


def each_value(lift: Lift, units: Sequence[str]) -> list[str]:
    """0.21 (joint7), for all that a change takes."""
    return [f"{value:g} {unit}".rstrip() + f" ({name})" for name, value, unit in zip(lift.names, lift.values, units)]


def servo_notes(found: Sequence[Predicted], rows: Sequence[dict], full: Sequence[dict]) -> list[str]:
    """All other sentences, in the order in which they are of use."""
    robot = found[0].at.robot
    return [
        *least_limits_in_words(rows),
        *step_costs_in_words(rows),
        *seen_in_words(rows),
        *bases_in_words(rows),
        *differences_in_words(full),
        *rests_in_words(found, rows),
        *constraints_in_words(found),
        *drive_in_words(robot, found),
        "All other notes, figures and tables here are of the robot without its actuators, at postures held by a constant torque.",
    ]


def least_limits_in_words(rows: Sequence[dict]) -> Iterator[str]:
    """Of each integrator the least limit, and the joint and the mode that set it."""
    texts = []
    for integrator in dict.fromkeys(row["integrator"] for row in rows):
        of = known(rows, integrator)
        if of and of[0]["limit"] == "finite":
            row = of[0]
            mode = f"a {row['mode_kind']} mode of {in_digits(row['mode_per_s'], 3)} per second"
            texts.append(
                f"{integrator} {in_seconds(row['predicted_dt_s'])} at {row['posture']} ({row['limiting_joint']}, {mode})"
            )
        elif of:
            texts.append(f"{integrator} none up to 5 s")
    if texts:
        yield f"With its actuators as the file states them, the least limit of the step of any posture: {'; '.join(texts)}."


def step_costs_in_words(rows: Sequence[dict]) -> Iterator[str]:
    """The error of the step response at the file's step, by integrator."""
    texts = []
    for integrator in dict.fromkeys(row["integrator"] for row in rows):
        of = known(rows, integrator)
        errors = [row["step_response_error"] for row in of if row["step_response_error"] is not None]
        if errors:
            unstable = "" if all(row["stable_at_file_dt"] for row in of) else " (not stable everywhere)"
            texts.append(f"{integrator} {percent(max(errors))}{unstable}")
    if texts:
        dt = in_seconds(rows[0]["file_dt_s"])
        yield (
            f"What a step of {dt} costs beside that: all targets of servos are moved by a step, and for {response.LASTS:g} s "
            f"MuJoCo's response is compared with the exact one. Largest difference over largest response: {', '.join(texts)}."
        )


def seen_in_words(rows: Sequence[dict]) -> Iterator[str]:
    """How many limits were found in runs, and how near they are."""
    both = [row for row in rows if row["observed_dt_s"] and row["predicted_dt_s"]]
    if not both:
        return
    apart = max(abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) for row in both)
    places = list(dict.fromkeys(row["posture"] for row in both))
    finite = sum(row["limit"] == "finite" for row in rows)
    yield (
        f"{len(both)} of {finite} limits were looked for in runs of MuJoCo, by bisection without the prediction, at "
        f"{some_of(places)}: they are at most {percent(apart)} from the predicted ones."
    )


def bases_in_words(rows: Sequence[dict]) -> Iterator[str]:
    """How far a locked base would mislead."""
    limits = {(row["posture"], row["integrator"], row["base"]): row["predicted_dt_s"] for row in rows}
    ratios = [
        limits[posture, integrator, "locked"] / dt
        for (posture, integrator, base), dt in limits.items()
        if base == "free" and dt and limits[posture, integrator, "locked"]
    ]
    if ratios:
        low, high = (f"{ratio:.3f}" for ratio in (min(ratios), max(ratios)))
        span = f"{low} times" if low == high else f"{low} to {high} times"
        yield (
            "The robot floats: its limits are without gravity, with the base free to give way. Those with the base locked are "
            f"{span} as large, and do not count."
        )


def differences_in_words(full: Sequence[dict]) -> Iterator[str]:
    """Where the full model does not do what the limits say."""
    known_rows = [row for row in full if row["predicted_stable"] is not None]
    calm = [row for row in known_rows if not row["predicted_stable"] and row["calm"]]
    shaken = [row for row in known_rows if row["predicted_stable"] and not row["calm"]]
    if known_rows and not (calm or shaken):
        yield (
            f"With everything on, two seconds of the full model from each posture do as the limits say in all {len(known_rows)} "
            "runs (full_model.csv)."
        )
    for rows, what in (
        (calm, "stays calm where the limits say that it is not stable: friction, equalities or contacts may hold it"),
        (
            shaken,
            "is not calm where the limits say that it is stable: contacts, joint limits, a fall or the way to its rest move it",
        ),
    ):
        if rows:
            names = [f"{row['posture']} ({row['integrator']})" for row in rows]
            yield f"In {len(rows)} of {len(known_rows)} runs the full model {what}: {some_of(names)}."


def rests_in_words(found: Sequence[Predicted], rows: Sequence[dict]) -> Iterator[str]:
    """Where the postures rest, and which have none."""
    unit = "/".join(dict.fromkeys(found[0].at.robot.coordinates.units))
    moved = [f"{one.name} {one.at.moved:.2g}" for one in found if one.rests and one.at.moved > RESTS_WITHIN]
    if moved:
        yield (
            "Under their servos postures move to a rest, found by Newton's method, which is what is looked at; how far it is "
            f"from the stated one, in {unit}: {some_of(moved)}."
        )
    for one in found:
        if not one.rests:
            left, forces = one.at.rest[1], " or ".join(dict.fromkeys(FORCES[u] for u in one.at.robot.coordinates.units))
            weightless = ", without gravity, for it floats," * bool(one.at.base)
            yield (
                f"{one.name} is not at rest under its actuators{weightless or ','} and no rest was found near it: {left:.3g} "
                f"{forces} are left."
            )
        else:
            limit = one.limits[one.at.bases[0], next(iter(one.limits))[1]]
            if limit.limit == "saddle":
                yield (
                    f"{one.name} is a saddle under its actuators: whatever the step, it is left at {limit.rate:.3g} per second, "
                    f"{limit.joint} first."
                )
            elif limit.limit == "drifts":
                yield f"{one.name} drifts: along a movement there is neither stiffness nor damping, and no limit to be said."


def drive_in_words(robot: Robot, found: Sequence[Predicted]) -> Iterator[str]:
    """What of the drive is left out, cut, or known by differences alone."""
    drive = robot.drive
    off = [f"{one.name} ({one.off})" for one in drive.actuators if one.off]
    if off:
        yield f"These actuators exert nothing: {some_of(off)}."
    for one in found:
        if one.rests and (one.at.cut.forces or one.at.cut.sums):
            cut = [f"{drive.actuators[i].name} at {force:.3g}" for i, force in one.at.cut.forces.items()]
            cut += [f"the sum at {robot.coordinates.speeds[k]} at {force:.3g}" for k, force in one.at.cut.sums.items()]
            yield f"At {one.name} the range of their force cuts {some_of(cut)}: there they have neither stiffness nor damping."
    if by_differences := found[0].at.driven.differenced:
        yield (
            f"The transmission of {some_of(by_differences)} turns with the posture: its derivative is a central difference of "
            "MuJoCo's, not exact."
        )
