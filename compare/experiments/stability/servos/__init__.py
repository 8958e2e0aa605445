"""Which step is stable under a robot's own servos, predicted and observed, and what it costs: step_limits.csv, full_model.csv."""

from collections.abc import Sequence
from functools import partial

from ....engines.mujoco import Reading
from ....engines.mujoco.flags import INTEGRATORS
from ....judge.check import AT_OWN_STEP, About, Result
from ....robots import Robot
from ....truth.postures import posture_names
from ....truth.step_limits import LIMIT_UP_TO
from ...setup import Setup
from . import full_model, lifting, observed, response
from .circumstances import circumstances
from .predicted import Predicted, Steps, acting_at, limit_rows, predicted_at, steps_at
from .remarks import asked_in_words, lifts_in_words, response_error_at, servo_notes
from .sentences import DEFAULT_INTEGRATOR, at_the_top, known, refused_in_words

MOST_POSTURES_DRIVEN = 6  # of named ones the first
OBSERVED_WITHIN = 0.01  # relative
FORMS_WITHIN = 1e-6  # relative, of the closed form and the eigenvalues of a step
RADII_WITHIN = 1e-4  # of the spectral radius, of which MuJoCo's is by differences


def claim_of_servos(robot: Robot) -> str:
    """What is examined of a robot with actuators."""
    if not robot.drive.actuators:
        return ""
    return (
        " Under its own servos, as the file states them, the limit of the step of each integrator of MuJoCo at each posture at "
        "rest follows from M, K = -d force/dq and D = -d force/dqd in closed form, and runs show the same. Whether the file's "
        "own step is stable is a check of the robot, not of the two models."
    )


def tolerance_of_servos(robot: Robot) -> str:
    """How far apart what is compared of a robot with actuators may be."""
    if not robot.drive.actuators:
        return ""
    return (
        f" Under its own servos: a limit that is found by bisection in runs of MuJoCo, ranges of forces off, is within "
        f"{100 * OBSERVED_WITHIN:g} % of the predicted one; the closed form within {FORMS_WITHIN:g} of the step at which the "
        f"spectral radius passes 1; that radius near the limit within {RADII_WITHIN:g} of MuJoCo's own (mjd_transitionFD)."
    )


def begin(setup: Setup) -> dict | None:
    """Predict, and set going what is run; None: the robot has no actuator, or its numbers are stated.

    All integrators are observed, and run in the full model, at the first posture that has a limit; at others the file's and
    Euler. A quick run has these two alone and observes, as a run of all experiments does, at one posture; it draws nothing.
    """
    robot, reading = setup.robot, setup.reading
    if reading is None or not robot.drive.actuators:
        return None
    names = posture_names(robot)[:MOST_POSTURES_DRIVEN]
    found = [predicted_at(robot, name, reading) for name in names]
    resting = [one for one in found if one.rests]
    shown = next((one for one in resting if one.is_finite), None)
    looked_at = resting if setup.alone and not setup.is_quick else [shown] * bool(shown)
    own = (reading.integrator, DEFAULT_INTEGRATOR)
    tried = [
        (one, base, name)
        for one in looked_at
        for base, name in one.pairs
        if ((one is shown and not setup.is_quick) or (name in own and base == one.at.bases[0]))
        and not one.gives_way(base, name)
    ]
    drawn = (
        [name for name in INTEGRATORS if (shown.at.bases[0], name) in shown.pairs]
        if shown and not setup.is_quick
        else []
    )
    unstable = [(one, name) for name in dict.fromkeys(own) if (one := least_at(resting, name, reading.dt))]

    def ask(function, items):
        return setup.map(partial(function, reading=reading), *(zip(*items) if items else [()]))

    return {
        "found": found,
        "shown": shown,
        "tried": tried,
        "observed": ask(observed_limit_at, tried),
        "steps": ask(steps_at, [(one,) for one in resting]),
        "errors": ask(errors_at, [(one,) for one in resting]),
        "lifts": (unstable, ask(lifts_at, unstable)),
        "full": ask(
            full_at, [(one, integrators_run(one, own, one is shown and not setup.is_quick)) for one in resting]
        ),
        "curves": (drawn, ask(curve_at, [(shown, name) for name in drawn])),
    }


def least_at(resting: Sequence[Predicted], integrator: str, dt: float) -> Predicted | None:
    """The posture with the least limit of an integrator, if a step is not stable there; else None."""
    bad = [one for one in resting if one.is_stable(one.at.bases[0], integrator, dt) is False]
    return min(bad, key=lambda one: one.limits[one.at.bases[0], integrator].dt or LIMIT_UP_TO, default=None)


def integrators_run(one: Predicted, own: Sequence[str], every: bool) -> list[str]:
    """The integrators with which the full model is run: every one, or these and, if none of them is stable, one that is."""
    dt, base = one.at.dt, one.at.bases[0]
    stable = [name for name in INTEGRATORS if one.is_stable(base, name, dt)]
    more = () if set(stable) & {*own} else stable[:1]
    return [name for name in INTEGRATORS if every or name in (*own, *more)]


# in a further process


def observed_limit_at(one: Predicted, base: str, integrator: str, reading: Reading) -> tuple[str, float | None]:
    """The limit that MuJoCo's runs show."""
    at = one.there[base, integrator]  # where it rests with such a step
    return observed.limit(acting_at(reading, at, base), at, integrator)


def errors_at(one: Predicted, reading: Reading) -> dict[tuple[str, str], float | None]:
    """The error of the step response at the file's step, by base and integrator."""
    return {(base, name): response_error_at(one, base, name, reading.dt, reading) for base, name in one.pairs}


def curve_at(one: Predicted, integrator: str, reading: Reading) -> list[tuple[float, float]]:
    """The error of the step response over the step, with the base that counts."""
    base = one.at.bases[0]
    return response.curve(
        acting_at(reading, one.at, base), one.at, base, integrator, reading.dt, one.limits[base, integrator].dt
    )


def lifts_at(one: Predicted, integrator: str, reading: Reading) -> list[lifting.Lift]:
    """What would make the file's step stable with an integrator, each tried."""
    base = one.at.bases[0]
    return lifting.lifts(acting_at(reading, one.at, base), one.at, base, integrator, reading.dt)


def full_at(one: Predicted, integrators: Sequence[str], reading: Reading) -> list[dict]:
    """What the full model does at the file's step, with some integrators."""
    base = one.at.bases[0]
    stable = {name: one.is_stable(base, name, reading.dt) for name in integrators}
    return full_model.rows(reading.full_model, one.at, reading.dt, stable)


# in the main process


def add(result: Result, setup: Setup, work: dict) -> list[str]:
    """Rows, checks, curves and the sentence at the top, of what `begin` has set going; returns the notes."""
    found, shown, reading = work["found"], work["shown"], setup.reading
    rows = limit_rows(found, reading.dt, reading.integrator)
    by_place = {(row["posture"], row["base"], row["integrator"]): row for row in rows}
    resting = [one for one in found if one.rests]
    for one, errors in zip(resting, work["errors"]):
        for pair, error in errors.items():
            by_place[one.name, *pair]["step_response_error"] = error
    for one, steps in zip(resting, work["steps"]):
        check_steps(result, one, steps)
    for (one, base, name), (kind, dt) in zip(work["tried"], work["observed"]):
        row = by_place[one.name, base, name]
        row["observed_dt_s"] = dt
        check_observed(result, row, kind, len(one.at.bases) > 1)
    if setup.robot.drive.feeds_back:
        check_own_step(result, rows)
    full = [row for part in work["full"] for row in part]
    result.tables |= {"step_limits": rows, "full_model": full}
    where = circumstances(found)
    result.top = [
        at_the_top(rows, full, setup.robot.drive.feeds_back, where),
        *refused_in_words(setup.robot.drive.refused),
    ]
    if setup.asked:
        result.top.append(asked_in_words(found, *setup.asked, reading))
    lifted = [(one, name, lifts) for (one, name), lifts in zip(work["lifts"][0], work["lifts"][1])]
    said = [*result.top, *lifts_in_words(lifted, reading.dt), *servo_notes(found, rows, full)]
    drawn, curves = work["curves"]
    if drawn:
        result.curves["step response"] = {
            "posture": shown.name,
            "rows": [row for row in rows if (row["posture"], row["base"]) == (shown.name, shown.at.bases[0])],
            "lines": dict(zip(drawn, curves)),
        }
    return said


def named_place(row: dict, several: bool) -> str:
    """A row's posture, base and integrator, as the scene of a check; several: whether there are several bases."""
    return f"{row['posture']}, " + f"{row['base']} base, " * several + row["integrator"]


def check_steps(result: Result, one: Predicted, steps: Sequence[Steps]) -> None:
    """The closed form beside the eigenvalues of a step, and these beside MuJoCo's own derivative."""
    for found in steps:
        row = {"posture": one.name, "base": found.base, "integrator": found.integrator}
        where = named_place(row, len(one.at.bases) > 1)
        if found.apart is not None:
            quantity = "limit of the step under its servos, closed form to eigenvalues of a step"
            result.check(where, quantity, found.apart, FORMS_WITHIN, "", about=About.PREDICTION)
        if found.beside is not None:
            quantity = "growth of a step near that limit, TMT to MuJoCo"
            result.check(where, quantity, found.beside, RADII_WITHIN, "")


def check_observed(result: Result, row: dict, kind: str, several: bool) -> None:
    """The limit in MuJoCo's runs beside the predicted one."""
    below = kind == "always" and row["limit"] == "finite" and row["predicted_dt_s"] < observed.SOUGHT_FROM
    if kind == row["limit"] == "none" or below:  # shorter steps are not tried
        return
    both = kind == row["limit"] == "finite"
    apart = abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) if both else None
    note = "" if both else f"predicted: {row['limit']}, observed: {kind}"
    quantity = "limit of the step under its servos, observed to predicted"
    result.check(named_place(row, several), quantity, apart, OBSERVED_WITHIN, "", note, about=About.PREDICTION)


def check_own_step(result: Result, rows: Sequence[dict]) -> None:
    """Whether the file's own step is stable under its own integrator, wherever that can be said."""
    for row in known(rows, rows[0]["file_integrator"]):
        limit = row["predicted_dt_s"] or LIMIT_UP_TO
        note = ", ".join(filter(None, (f"under {row['file_integrator']}", row["limiting_joint"])))
        result.check(row["posture"], AT_OWN_STEP, row["file_dt_s"], limit, "s", note, about=About.STEP)
