"""Which step of a file is stable: begins the work of compare/stability, and says what it found."""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

from ...core.check import AT_OWN_STEP, AT_REQUESTED_STEP, About
from ...core.finding import Finding
from ...engines.mujoco.names import INTEGRATORS
from ...engines.mujoco.reading import Reading
from ...stability.answer import CREEPS, Answer, Question, StepLimitRow, answer
from ...stability.motion import Posture, posture_of, postures_of
from ..options import StabilityOptions
from ..setup import Setup
from .tables import StabilityResult

OF = "of_file"  # the template
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
AT_PERIOD = "stable at its control period"


class Work(NamedTuple):
    """What `begin` starts. quantity: of the checks."""

    quantity: str
    answers: Iterable[Answer | str]
    is_alone: bool
    error: float | None  # rad or m, of --error


def begin(setup: Setup, reading: Reading) -> Work:
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
    return Work(quantity, found, setup.alone, asked.error)


def answer_of(task: tuple[Posture, Question], reading: Reading) -> Answer | str:
    """The answer at a posture; why there is none."""
    try:
        return answer(reading, *task)
    except ValueError as error:
        return str(error)


def add(result: StabilityResult, work: Work) -> None:
    """Rows, checks, and what is said: the answer first, then what a user must know of it, what helps, the other postures."""
    answers, reasons = list[Answer](), dict[str, None]()
    for found in work.answers:
        if isinstance(found, str):
            reasons[found] = None
        else:
            answers.append(found)
    for reason in reasons:  # once for all postures
        result.not_judged("", work.quantity, reason, about=About.STEP)
    if not answers:
        return
    rows = [row for found in answers for row in found.rows]
    result.tables["step_limits"] = rows
    result.tables["stability_runs"] = [row for found in answers for row in found.tried]
    result.filed = ["stability_runs"]
    for found in answers:
        check(result, found.rows[0], work.quantity)
    result.repeated["runs"] = answers[0].recipes
    first, others = answers[0], [found.rows[0] for found in answers[1:]]
    tell(result, "answer", row=first.rows[0], rows=first.rows if work.is_alone else [])
    if work.error is not None:
        tell(result, "within", rows=first.rows, error=work.error)
    tell_of_row(result, first.rows[0])
    for joint, (inertia, mass, least) in first.light.items():
        tell(result, "light", joint=joint, inertia=inertia, mass=mass, least=least)
    damped = [row for row in first.rows if row.is_damped]
    if damped:
        tell(result, "damps", rows=damped)
    if first.rows[0].stable_at_file_dt is False:
        stable = [row.integrator for row in first.rows if row.stable_at_file_dt]
        if first.smaller:
            tell(result, "smaller", row=first.rows[0], push=first.smaller[0], limit=first.smaller[1])
        if stable or first.remedies or first.rows[0].of == "step":
            tell(result, "remedies", row=first.rows[0], integrators=stable, remedies=first.remedies)
    if first.rows[0].creep_rad_per_s > CREEPS:
        tell(result, "creep", row=first.rows[0], stops=first.stops)
    if others:
        unstable = [row for row in others if row.stable_at_file_dt is False]
        tell(result, "others", rows=others, unstable=unstable)


def tell(result: StabilityResult, kind: str, **values: Any) -> None:
    result.top.append(result.finding(kind, OF, **values))


def tell_of_row(result: StabilityResult, row: StepLimitRow) -> None:
    """What must be known of a posture to read its limits."""
    if row.judged_by == "divergence" or (row.judged_by == "speed" and row.by_itself == "in motion"):
        tell(result, "by_itself", row=row)
    if row.starts:
        tell(result, "starts", row=row)
    result.find("posture_of_file", OF, row=row)


def check(result: StabilityResult, row: StepLimitRow, quantity: str) -> None:
    """The check of the step, or of the period, in use at a posture."""
    about, note = About.STEP, f"with {row.file_integrator}{', ' + row.moves_first if row.moves_first else ''}"
    if row.stable_at_file_dt is None:
        finite = "at fine steps the push is not survived either"
        why = finite if row.judged_by else "no fine run is finite"
        result.not_judged(row.posture, quantity, why, "s", about=about)
        return
    used = row.period_s or row.file_dt_s
    limit = max(row.stable_up_to_s or 0.0, used) if row.stable_at_file_dt else row.stable_up_to_s or 0.0
    result.check(row.posture, quantity, used, limit, "s", note, about=about)


def headline(result: StabilityResult) -> Finding | None:
    """Whether the step in use is stable, at the posture that the answer and its table are of."""
    rows: Sequence[StepLimitRow] = result.tables["step_limits"]
    row = next((row for row in rows if row.integrator == row.file_integrator), None)
    return None if row is None or row.stable_at_file_dt is None else result.finding("headline", OF, row=row)
