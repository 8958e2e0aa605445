"""What the step limits mean: the answer at the top of a report, and the notes."""

from collections.abc import Sequence

from ....core.check import Result
from ....engines.mujoco.names import INTEGRATORS
from ....truth.step_limits import LIMIT_UP_TO
from ..tables import StepLimitRow
from . import response
from .predicted import COUPLED, KNOWN, Prediction, limit_rows, unmodelled

DEFAULT_STEP = 0.002, "Euler"  # MuJoCo's step, s, and integrator where a file states none
RESTS_WITHIN = 1e-6  # rad or m: a rest so near is the posture


def known(rows: Sequence[StepLimitRow], integrator: str) -> list[StepLimitRow]:
    """The rows of an integrator at postures with a limit or known to have none, the least limit first."""
    mine = [row for row in rows if row.integrator == integrator and row.limit in KNOWN]
    return sorted(mine, key=lambda row: row.predicted_dt or float("inf"))


def find_answer(
    result: Result, rows: Sequence[StepLimitRow], predictions: Sequence[Prediction], requested: bool = False
) -> None:
    """Whether the file's step is stable, with its own integrator and with MuJoCo's default.

    requested: rows and answer are those of the step of --dt and --integrator, as if the file stated them.
    """
    dt, integrator, at = rows[0].file_dt, rows[0].file_integrator, predictions[0].at
    drive, default = at.robot.drive, None
    if not requested and (dt, integrator) != DEFAULT_STEP:
        default = verdict(limit_rows(predictions, *DEFAULT_STEP), DEFAULT_STEP[1])
    unknown = unmodelled(at.robot)
    if requested and (unknown or not drive.feeds_back):
        return
    off = {actuator.name: actuator.off for actuator in drive.actuators if actuator.off}
    answer = result.finding(
        "step", "servos", dt=dt, integrator=integrator, requested=requested, has_servos=drive.feeds_back,
        own=verdict(rows, integrator), default=default, default_dt=DEFAULT_STEP[0], unmodelled=unknown,
        without={row.posture: row.limit for row in rows if row.limit not in (*KNOWN, COUPLED)},
        coupled=any(row.limit == COUPLED for row in rows),
        left_out={name: why for name, why in (drive.refused | off).items() if name not in unknown},
        contacts=any(feature.feature == "contact" for feature in at.robot.features), floats=bool(at.base),
    )  # fmt: skip
    result.top.append(answer)


def verdict(rows: Sequence[StepLimitRow], integrator: str) -> dict:
    """Whether a step is stable with an integrator, at which postures, and what limits it.

    stable None: unknown. postures: those that are not stable, else those that are; empty if these are all.
    """
    mine, postures = known(rows, integrator), {row.posture for row in rows}
    if not mine:
        return {"stable": None}
    bad = [row for row in mine if not row.stable_at_file_dt]
    where = [row.posture for row in bad or mine]
    return {
        "stable": not bad, "postures": [] if len(where) == len(postures) else where,
        "limit": mine[0].predicted_dt, "joint": mine[0].limiting_joint,
        "posture": mine[0].posture if len(postures) > 1 else None,
        "error": max(row.step_response_error or 0.0 for row in mine),
    }  # fmt: skip


def find_notes(result: Result, rows: Sequence[StepLimitRow], predictions: Sequence[Prediction]) -> None:
    """The limits and errors of all integrators, where the postures rest, and actuators whose force is cut by its range."""
    of_each = [known(rows, integrator) for integrator in INTEGRATORS]
    errors = [max((row.step_response_error or 0.0 for row in mine), default=0.0) for mine in of_each]
    if integrators := [{"row": mine[0], "error": error} for mine, error in zip(of_each, errors) if mine]:
        values = {"dt": rows[0].file_dt, "seconds": response.LASTS, "up_to": LIMIT_UP_TO}
        result.find("integrators", "servos", integrators=integrators, **values)
    resting, robot = (
        [prediction.at for prediction in predictions if prediction.limits],
        predictions[0].at.robot,
    )
    moved = {at.name: at.away(at.start) for at in resting if at.away(at.start) > RESTS_WITHIN}
    cut = {at.name: [robot.drive.actuators[i].name for i in at.cut] for at in resting if at.cut}
    if moved or cut:
        result.find(
            "rests", "servos", moved=moved, unit=" or ".join(dict.fromkeys(robot.coordinates.units)), cut=cut
        )
