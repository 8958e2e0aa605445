"""Which step is stable for the robot of a file as it is: begins the work of compare/stability, and says what it found."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain
from math import ceil
from typing import Any, NamedTuple

from ...core.check import AT_OWN_STEP, AT_REQUESTED_STEP, About
from ...core.finding import Finding
from ...engines.mujoco.reading import Reading
from ...robots.file import names_of_keys
from ...stability.answer import Asked, PlaceAnswer, StepLimitRow, answers, integrators_at_rest
from ...stability.control import MOST_PERIOD, controlled
from ...stability.limits import LONGEST, SHORTEST
from ...stability.motion import MotionRow, motion
from ...stability.place import MOST_POSTURES, Posture, posture_of, postures_of, standing_at
from ...stability.runs import USUAL_PUSH
from ...stability.start import CALM
from ..setup import Request, Setup
from . import own_run
from .tables import ControlRow, OwnRunRow, StabilityResult

OF = "of_file"  # the template
RADII_WITHIN = 1e-4  # relative: of the growth in a step, MuJoCo's is by differences
WHOLE = 1e-9  # of a step: a delay that is so near to whole steps is
MOST_GROWTH = 10.0  # in a step: with more, differences leave the zone in which the forces are linear
DEFAULT = "Euler"  # MuJoCo's integrator where a file states none
FAR, CREEPS = 0.05, 1e-4  # rad or m, rad/s or m/s: of a rest that is told, from its posture, and of a creep
MODES = "growth of a step in closed form, TMT to MuJoCo"
PUSHED = "stable after a push"
AT_PERIOD = "stable at its control period"


class AtStep(NamedTuple):
    """What is begun of the file's step, or of a requested one."""

    asked: Asked
    is_requested: bool
    runs: Iterable[OwnRunRow]
    answers: Iterable[list[PlaceAnswer]]


class Work(NamedTuple):
    """What `begin` starts. left_out: names of postures that are not examined."""

    steps: Sequence[AtStep]
    control: Iterable[ControlRow | None]
    motions: Iterable[MotionRow]
    left_out: Sequence[str]


def begin(setup: Setup, reading: Reading) -> Work:
    """Start the work for the file's step and for a requested one.

    All integrators are asked at the first posture; at others the file's. A quick run has the file's and Euler at one posture.
    """
    request, own = setup.request, reading.integrator
    postures = [posture_of(request.posture, reading)] if request.posture else postures_of(reading)
    integrators = [own, DEFAULT] if setup.is_quick else [*integrators_at_rest(), own]
    asked = [Asked(reading.dt, own, list(dict.fromkeys(integrators)), drawn=not setup.is_quick)]
    asked += [Asked(*step, [step[1]]) for step in (request.step,) if step]
    steps = []
    for question in asked:
        is_requested = question is not asked[0]
        others = question._replace(integrators=[question.integrator], drawn=False, in_runs=setup.alone)
        tasks = [
            (posture, others if number else question)
            for number, posture in enumerate(postures if setup.alone else postures[:1])
        ]
        runs = own_run.begin(setup, reading, question.dt, question.integrator)
        found = setup.map(partial(answers_of, reading=reading, air=not is_requested), tasks)
        steps.append(AtStep(question, is_requested, runs, found))
    control = partial(control_row, reading=reading, request=request, asked=asked[-1])
    moving = partial(motion_row, reading=reading, asked=asked[-1])
    return Work(
        steps,
        setup.map(control, postures if request.control_period else ()),
        setup.map(moving, postures if request.at_speed else ()),
        list(names_of_keys(reading).values())[MOST_POSTURES:],
    )


def answers_of(task: tuple[Posture, Asked], reading: Reading, air: bool) -> list[PlaceAnswer]:
    posture, asked = task
    return answers(posture, reading, asked, air)


def control_row(posture: Posture, reading: Reading, request: Request, asked: Asked) -> ControlRow | None:
    """The controller of --control-period at a posture; None: no actuator is a servo, and there are no gains for them."""
    place = standing_at(reading, posture)
    model = place.frictionless or place.model  # dry friction would hold small deviations at any period
    state = place.rest if request.kp is None else place.start  # servos made of motors hold the posture itself
    found = controlled(model, state, asked.dt, asked.integrator, request.kp, request.kv)
    if found is None:
        return None
    steps = max(1, round((request.control_period or 0.0) / asked.dt))
    delay = ceil((request.delay or 0.0) / asked.dt - WHOLE)  # a shorter one would be easier to bear
    growth, is_stable = found.factor(steps, delay), found.factor(steps, delay) == 1.0
    longest = found.longest_period(delay, steps * is_stable)
    latest = found.longest_delay(steps, delay) if is_stable else 0
    return ControlRow(
        posture=posture.name, integrator=asked.integrator, period=steps * asked.dt, delay=delay * asked.dt,
        growth=growth, grows_in_run=found.grows_in_run(steps, delay), servos=len(found.servos),
        longest_period=None if longest is None else longest * asked.dt,
        longest_delay=None if latest is None else latest * asked.dt,
    )  # fmt: skip


def motion_row(posture: Posture, reading: Reading, asked: Asked) -> MotionRow:
    return motion(standing_at(reading, posture), asked.dt, asked.integrator)


def add(result: StabilityResult, work: Work) -> None:
    """Rows, checks, the answer at the top, the curves, and what makes the step stable; motions first, if they are asked for."""
    for moving in work.motions:
        result.tables.setdefault("motion_stability", []).append(moving)
        passed = 1 if moving.passed else None
        where, quantity = moving.posture, "growth along its motion"
        result.check(where, quantity, passed, 1, "runs", rule="equal", about=About.STEP)
        result.top.append(result.finding("motion", OF, row=moving))
    for step in work.steps:
        runs = own_run.add(result, list(step.runs), step.is_requested)
        places = list(chain.from_iterable(step.answers))
        rows = [row for place in places for row in place.rows]
        add_checks(result, rows, AT_REQUESTED_STEP if step.is_requested else AT_OWN_STEP)
        add_answer(result, places, step, runs)
        if not step.is_requested:
            result.tables["step_limits"] = rows
            result.growth = {place.rows[0].surroundings: place.curves for place in places if place.curves}
    if work.left_out:
        result.top.append(result.finding("left_out", OF, most=MOST_POSTURES, names=work.left_out))
    for row in work.control:
        add_control(result, row)


def in_use(rows: Sequence[StepLimitRow], integrator: str) -> list[StepLimitRow]:
    """The rows of an integrator that tell of the robot in use, the least limit first: as it stands, else in the air."""
    mine = [row for row in rows if row.integrator == integrator]
    standing = [row for row in mine if row.surroundings != "air"]
    known = [row for row in standing if row.is_known]
    if not known and not any(row.limit == "saddle" for row in standing):
        known = [row for row in mine if row.is_known]
    return sorted(known, key=lambda row: row.longest)


def add_checks(result: StabilityResult, rows: Sequence[StepLimitRow], quantity: str) -> None:
    """Closed form to differences; the step in use; what runs show there; the push that it survives."""
    about = About.STEP
    for row in rows:
        if row.apart is not None and row.growth and row.growth <= MOST_GROWTH:
            where = f"{row.posture}, {row.surroundings}, {row.integrator}"
            result.check(where, MODES, abs(row.apart) / row.growth, RADII_WITHIN, "")
    own = in_use(rows, rows[0].file_integrator)
    for row in own:
        note = ", ".join(
            filter(None, (f"with {row.file_integrator}", row.limiting_joint, row.limiting_contact))
        )
        limit = max(min(row.longest, LONGEST), SHORTEST)
        result.check(row.posture, quantity, row.file_dt, limit, "s", note, about=about)
        if row.stable_at_file_dt and row.largest_push is not None and not row.has_fallen:
            push = USUAL_PUSH if row.finer_push else row.largest_push
            step = f"{1e3 * row.file_dt:.4g} ms with {row.file_integrator}"
            result.check(
                row.posture, PUSHED, push, USUAL_PUSH, "rad/s or m/s", step, rule="at least", about=about
            )
    if not own:
        kinds = sorted({row.limit for row in rows if row.integrator == row.file_integrator})
        result.not_judged("", quantity, f"no posture has a limit: {', '.join(kinds)}", "s", about=about)


def add_answer(
    result: StabilityResult, places: Sequence[PlaceAnswer], step: AtStep, runs: Sequence[OwnRunRow]
) -> None:
    """The sentence about the step, the limits of all postures, and after it what matters. runs: with the worst outcome.

    The limits of the other integrators are those that were found for the file's step.
    """

    def tell(kind: str, **values: Any) -> None:
        result.top.append(result.finding(kind, OF, **values))

    rows = [row for place in places for row in place.rows]
    asked, own = step.asked, in_use(rows, step.asked.integrator)
    worst = next((row for row in own if row.stable_at_file_dt is False), own[0] if own else None)
    here = [row for row in rows if worst and row.posture == worst.posture]
    as_it_stands = [row for row in here if worst and row.surroundings == worst.surroundings]
    others = [row for row in as_it_stands if row is not worst]
    air = [row for row in here if row.integrator == asked.integrator and row.surroundings == "air"]
    mine = [row for row in rows if row.integrator == asked.integrator]
    is_calm = runs[0].outcome in ("calm", "alike")
    tell(
        "answer", row=worst, saddle=next((row for row in mine if row.limit == "saddle"), None), others=others,
        air=next((row for row in air if row is not worst and row.is_known), None), run=None if is_calm else runs[0],
        requested=step.is_requested, dt=asked.dt, integrator=asked.integrator, up_to=LONGEST, calm=CALM,
    )  # fmt: skip
    if is_calm:
        creeps = any((row.creep or 0.0) > CREEPS for row in as_it_stands)
        tell("own_run", run=runs[0], others=len(runs) - 1, creeps=creeps)
    add_facts(tell, worst)
    if not step.is_requested:
        for place in places if len(rows) > 1 else ():
            tell("limits_at", rows=place.rows, up_to=LONGEST)
        for first in (place.rows[0] for place in places):
            if first.surroundings != "air" and is_told(first):
                tell("rest", row=first, far=FAR, creeps=CREEPS)
    if worst and worst.stable_at_file_dt is False:
        cures = next(place.cures for place in places if worst in place.rows)
        limits = others_at(worst, [*rows, *result.tables.get("step_limits", ())])
        stable = [row.integrator for row in limits if worst.file_dt <= row.longest]
        tell("cures", row=worst, tried=[row.integrator for row in limits], integrators=stable, cures=cures)


def others_at(row: StepLimitRow, rows: Iterable[StepLimitRow]) -> list[StepLimitRow]:
    """The known limits of other integrators where a row is, one of each."""
    known = [other for other in rows if other.is_known and other.integrator != row.integrator]
    here = [
        other for other in known if (other.posture, other.surroundings) == (row.posture, row.surroundings)
    ]
    return list({other.integrator: other for other in here}.values())


def add_facts(tell: Callable[..., None], row: StepLimitRow | None) -> None:
    """What else matters of the step in use."""
    if row is None:
        return
    if row.decided_by_runs and row.limit in ("finite", "none"):
        tell("by_derivative", row=row, up_to=LONGEST)
    if row.finer_push and row.largest_push is not None and row.largest_push < USUAL_PUSH:
        tell("push", row=row)
    if row.needs_friction(row.file_dt):
        tell("friction", row=row)


def is_told(row: StepLimitRow) -> bool:
    """Whether a rest is far from its posture, creeps, or is none."""
    is_far = (row.moved or 0.0) > FAR or (row.creep or 0.0) > CREEPS
    return is_far or not row.is_known or row.has_fallen or bool(row.held_objects)


def add_control(result: StabilityResult, row: ControlRow | None) -> None:
    if row is None:
        why = "no actuator is a servo of a joint; state --kp and --kv, which act on lengths"
        result.not_judged("", AT_PERIOD, why, about=About.STEP)
        return
    result.tables.setdefault("control", []).append(row)
    most = MOST_PERIOD if row.longest_period is None else row.longest_period
    allowed = max(most, row.period) if row.is_stable else min(most, (1.0 - 1e-9) * row.period)
    result.check(row.posture, AT_PERIOD, row.period, allowed, "s", about=About.STEP)
    as_predicted, quantity = int(row.grows_in_run != row.is_stable), "run of its control period, as predicted"
    result.check(row.posture, quantity, as_predicted, 1, "runs", rule="equal", about=About.PREDICTION)
    result.top.append(result.finding("control", OF, row=row))


def headline(result: StabilityResult) -> Finding | None:
    """Whether the file's step is stable: along the worst of the motions that are asked for, else at rest."""
    table = result.tables["step_limits"]
    own = in_use(table, table[0].file_integrator)
    motions: list[MotionRow] = result.tables.get("motion_stability", [])
    motion = max(motions, key=lambda row: (not row.passed, row.rate), default=None)
    values = {"row": own[0] if own else None, "up_to": LONGEST, "dt": table[0].file_dt, "motion": motion}
    return result.finding("headline", OF, **values) if own or motion else None
