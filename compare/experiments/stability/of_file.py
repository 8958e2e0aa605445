"""Which step of a file is stable: begins the work of compare/stability, and says what it found."""

from functools import partial
from typing import Any

from ...core.check import AT_OWN_STEP, AT_REQUESTED_STEP, About, Result
from ...core.finding import Finding
from ...engines.mujoco.names import INTEGRATORS
from ...engines.mujoco.reading import Reading
from ...stability.answer import CREEPS, Answer, Question, StepLimitRow, answer
from ...stability.motion import Posture, posture_of, postures_of
from ..options import StabilityOptions
from ..setup import Setup
from .tables import Runs

OF = "of_file"  # the template
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
AT_PERIOD = "stable at its control period"


def begin(setup: Setup, reading: Reading) -> list[Runs]:
    """Start the work: all integrators at the first posture or the one that is asked for, the file's own at the others.

    A quick run has the file's integrator and Euler; one of several experiments the first posture alone.
    """
    asked = setup.asked(StabilityOptions)
    postures = [posture_of(asked.posture, reading)] if asked.posture else postures_of(reading)
    dt, own = asked.dt or reading.dt, asked.integrator or reading.integrator
    names = [own, DEFAULT] if setup.is_quick else [own, *INTEGRATORS]
    question = Question(
        dt, own, list(dict.fromkeys(names)), asked.push, asked.error, asked.recorded, asked.control_period,
        asked.delay, asked.kp, asked.kv, drawn=setup.alone and not setup.is_quick, helped=True,
    )  # fmt: skip
    others = question._replace(integrators=[own], drawn=False, helped=False)
    tasks = [(posture, others if number else question) for number, posture in enumerate(postures)]
    quantity = AT_PERIOD if asked.control_period else AT_REQUESTED_STEP if asked.dt else AT_OWN_STEP
    found = setup.map(partial(answer_of, reading=reading), tasks if setup.alone else tasks[:1])
    return [Runs(found, partial(add, quantity=quantity, is_alone=setup.alone, error=asked.error))]


def answer_of(task: tuple[Posture, Question], reading: Reading) -> list[Answer | str]:
    """The answer at a posture; why there is none."""
    try:
        return [answer(reading, *task)]
    except ValueError as error:
        return [str(error)]


def add(
    result: Result, found: list[Answer | str], quantity: str, is_alone: bool, error: float | None
) -> None:
    """Rows, checks, and what is said: the answer first, then what a user must know of it, what helps, the other postures.

    quantity: of the checks. error: rad or m, of --error.
    """
    answers = [each for each in found if isinstance(each, Answer)]
    reasons = dict.fromkeys(each for each in found if isinstance(each, str))  # once for all postures
    for reason in reasons:
        result.not_judged("", quantity, reason, about=About.STEP)
    if not answers:
        return
    result.tables["step_limits"] = [row for each in answers for row in each.rows]
    result.tables["stability_runs"] = [row for each in answers for row in each.tried]
    result.filed = ["stability_runs"]
    for each in answers:
        check(result, each.rows[0], quantity)
    first, row, rows = answers[0], answers[0].rows[0], answers[0].rows
    result.repeated["runs"] = first.recipes
    others = [each.rows[0] for each in answers[1:]]
    tell(result, "answer", row=row, rows=rows if is_alone else [], others=others)
    if error is not None:
        tell(result, "within", rows=rows, error=error)
    tell_of_row(result, row)
    for joint, (inertia, mass, least) in first.light.items():
        tell(result, "light", joint=joint, inertia=inertia, mass=mass, least=least)
    if damped := [row for row in rows if row.is_damped]:
        tell(result, "damps", rows=damped)
    if row.stable_at_file_dt is False:
        stable = [row.integrator for row in rows if row.stable_at_file_dt]
        if first.smaller:
            tell(result, "smaller", row=row, push=first.smaller[0], limit=first.smaller[1])
        if stable or first.remedies or row.of == "step":
            tell(result, "remedies", row=row, integrators=stable, remedies=first.remedies)
    if row.creep_rad_per_s > CREEPS:
        tell(result, "creep", row=row, stops=first.stops)
    if others:
        unstable = [row for row in others if row.stable_at_file_dt is False]
        tell(result, "others", rows=others, unstable=unstable)


def tell(result: Result, kind: str, **values: Any) -> None:
    result.top.append(result.finding(kind, OF, **values))


def tell_of_row(result: Result, row: StepLimitRow) -> None:
    """What must be known of a posture to read its limits."""
    if row.judged_by == "divergence" or (row.judged_by == "speed" and row.by_itself == "in motion"):
        tell(result, "by_itself", row=row)
    if row.starts:
        tell(result, "starts", row=row)
    result.find("posture_of_file", OF, row=row)


def check(result: Result, row: StepLimitRow, quantity: str) -> None:
    """The check of the step, or of the period, in use at a posture."""
    if row.stable_at_file_dt is None:
        finite = "at fine steps the push is not survived either"
        why = finite if row.judged_by else "no fine run is finite"
        result.not_judged(row.posture, quantity, why, "s", about=About.STEP)
        return
    note, up_to = (
        ", ".join(filter(None, [f"with {row.file_integrator}", row.moves_first])),
        row.stable_up_to_s or 0.0,
    )
    limit = max(up_to, row.used_s) if row.stable_at_file_dt else up_to
    result.check(row.posture, quantity, row.used_s, limit, "s", note, about=About.STEP)


def headline(result: Result) -> Finding | None:
    """Whether the step in use is stable, at the posture that the answer and its table are of, and at the others."""
    rows = [row for row in result.tables["step_limits"] if row.integrator == row.file_integrator]
    if not rows or rows[0].stable_at_file_dt is None:
        return None
    return result.finding("headline", OF, row=rows[0], others=rows[1:])
