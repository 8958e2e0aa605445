"""Which step is stable for the robot of a file as it is: begins the work of compare/stability, and says what it found."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from ...core.check import AT_OWN_STEP, AT_REQUESTED_STEP, About
from ...core.rows import Row, column
from ...engines.mujoco.reading import Reading
from ...robots.file import names_of_keys
from ...stability.answer import (
    MOST_POSTURES,
    Asked,
    Curve,
    PlaceAnswer,
    Posture,
    StepLimitRow,
    answer,
    integrators_at_rest,
    posture_of,
    postures_of,
)
from ...stability.control import MOST_PERIOD, Controlled, controlled
from ...stability.limits import LONGEST, SHORTEST
from ...stability.motion import Motion, motion
from ...stability.place import Place, standing_at
from ...stability.runs import USUAL_PUSH
from ..setup import Setup
from .tables import LimitRow, StabilityResult

OF = "of_file"  # the template
RADII_WITHIN = 1e-4  # relative: of the growth in a step, MuJoCo's is by differences
WHOLE = 1e-9  # of a step: a delay that is so near to whole steps is
MOST_GROWTH = 10.0  # in a step: with more, differences leave the zone in which the forces are linear
DEFAULT_STEP, DEFAULT = 0.002, "Euler"  # MuJoCo's step, s, and integrator where a file states none
GIVES_WAY = 0.1  # rad or m: a rest at the limit so far from that of the file's step is said
FAR = 1e-3  # rad or m: a rest farther from its posture is said
CREEPS = 1e-5  # rad/s or m/s: a creep that is said
MODES = "growth of a step in closed form, TMT to MuJoCo"
PUSHED = "push that its own step survives"


class Work(NamedTuple):
    """What `begin` starts. asked: the steps that are asked for, the file's first."""

    asked: Sequence[Asked]
    answers: Sequence[Iterable[PlaceAnswer]]
    control: Iterable["ControlRow | None"]
    motions: Iterable["MotionRow"]


@dataclass(kw_only=True)
class ControlRow(Row):
    """A controller at its own rate: control.csv. Limits are None where all that was tried is stable.

    longest_delay: 0 if it is not stable.
    """

    posture: str
    integrator: str
    period: float = column("s", digits=4)
    delay: float = column("s", digits=4)
    growth: float = column(digits=6)  # in a period
    grows_in_run: bool
    longest_period: float | None = column("s", digits=4)
    longest_delay: float | None = column("s", digits=4)
    servos: int

    @property
    def is_stable(self) -> bool:
        return self.growth <= 1.0


@dataclass(kw_only=True)
class MotionRow(Row):
    """How deviations grow along the run from a keyframe with its speeds: motion_stability.csv."""

    posture: str
    integrator: str
    dt: float = column("s", digits=4)
    rate: float = column("per_s")
    exact_rate: float = column("per_s")
    lasts: float = column("s")
    failed_at: float | None = column("s")
    passed: bool


def begin(setup: Setup) -> Work | None:
    """Start the work for the file's step and for a requested one; None: there is no file.

    All integrators are asked at the first posture; at others the file's. A quick run has the file's and Euler at one posture.
    """
    reading = setup.reading
    if reading is None:
        return None
    request = setup.request
    postures = postures_of(reading)
    if request.posture:
        postures = [posture_of(request.posture, reading)]
    asked = [
        Asked(
            reading.dt,
            reading.integrator,
            integrators_of(setup, reading.integrator),
            drawn=not setup.is_quick,
        )
    ]
    if request.step:
        dt, integrator = request.step
        asked.append(Asked(dt, integrator, [integrator]))
    answers = []
    for number, question in enumerate(asked):
        others = question._replace(integrators=[question.integrator], drawn=False, in_runs=setup.alone)
        tasks = [(posture, contacts, question if posture is postures[0] else others)
                 for posture in postures[: None if setup.alone else 1] for contacts in (True, False)]  # fmt: skip
        answers.append(setup.map(partial(answer_of, reading=reading), tasks if not number else tasks[::2]))
    in_use = asked[-1]
    control: Iterable[ControlRow | None] = []
    motions: Iterable[MotionRow] = []
    if request.control_period:
        control = setup.map(partial(control_row, reading=reading, request=request, asked=in_use), postures)
    if request.at_speed:
        motions = setup.map(partial(motion_row, reading=reading, asked=in_use), postures)
    return Work(asked, answers, control, motions)


def integrators_of(setup: Setup, own: str) -> list[str]:
    if setup.is_quick:
        return list(dict.fromkeys((own, DEFAULT)))
    return list(dict.fromkeys([*integrators_at_rest(), own]))


def answer_of(task: tuple[Posture, bool, Asked], reading: Reading) -> PlaceAnswer:
    posture, contacts, asked = task
    return answer(posture, contacts, reading, asked)


def place_asked(posture: Posture, reading: Reading) -> Place:
    return standing_at(reading, posture.name, posture.key, np.array(posture.q) if posture.q else None)


def control_row(posture: Posture, reading: Reading, request: Any, asked: Asked) -> ControlRow | None:
    """The controller of --control-period at a posture; None: no actuator is a servo, and there are no gains for them."""
    place = place_asked(posture, reading)
    model = place.frictionless or place.model  # dry friction would hold small deviations at any period
    state = place.rest if request.kp is None else place.start  # servos made of motors hold the posture itself
    found = controlled(model, state, asked.dt, asked.integrator, request.kp, request.kv)
    if found is None:
        return None
    steps = max(1, round(request.control_period / asked.dt))
    delay = ceil((request.delay or 0.0) / asked.dt - WHOLE)  # a shorter one would be easier to bear
    is_stable = found.factor(steps, delay) == 1.0
    longest = found.longest_period(delay, steps * is_stable)
    latest = found.longest_delay(steps, delay) if is_stable else 0
    return ControlRow(
        posture=posture.name, integrator=asked.integrator, period=steps * asked.dt, delay=delay * asked.dt,
        growth=found.factor(steps, delay), grows_in_run=found.grows_in_run(steps, delay),
        longest_period=in_seconds(longest, found), longest_delay=in_seconds(latest, found), servos=len(found.servos),
    )  # fmt: skip


def in_seconds(steps: int | None, found: Controlled) -> float | None:
    return None if steps is None else steps * found.dt


def motion_row(posture: Posture, reading: Reading, asked: Asked) -> MotionRow:
    place = place_asked(posture, reading)
    moving: Motion = motion(place.model, place.start, asked.dt, asked.integrator)
    return MotionRow(
        posture=posture.name, integrator=asked.integrator, dt=asked.dt, rate=moving.rate, exact_rate=moving.exact_rate,
        lasts=moving.lasts, failed_at=moving.failed_at, passed=moving.is_stable,
    )  # fmt: skip


def add(result: StabilityResult, setup: Setup, work: Work) -> None:
    """Rows, checks, the answer at the top, the curves, and what makes the step stable."""
    if setup.reading and (names := list(names_of_keys(setup.reading).values())[MOST_POSTURES:]):
        result.top.append(result.finding("left_out", OF, most=MOST_POSTURES, names=names))
    for number, (asked, answers) in enumerate(zip(work.asked, work.answers)):
        found = list(answers)
        rows = [row for place in found for row in place.rows]
        add_checks(result, rows, AT_REQUESTED_STEP if number else AT_OWN_STEP)
        add_answer(
            result,
            rows,
            asked,
            is_requested=bool(number),
            cures=[cure for place in found for cure in place.cures],
        )
        if not number:
            result.tables["step_limits"] = rows
            result.growth = drawn(found)
    for row in work.control:
        add_control(result, row)
    for moving in work.motions:
        result.tables.setdefault("motion_stability", []).append(moving)
        result.check(moving.posture, "growth along its motion", 1 if moving.passed else None, 1, "runs",
                     rule="equal", about=About.STEP)  # fmt: skip
        result.top.append(result.finding("motion", OF, row=moving))


def drawn(found: Sequence[PlaceAnswer]) -> dict[str, dict[str, Curve]]:
    """The curves by the surroundings of their place."""
    return {place.rows[0].surroundings: place.curves for place in found if place.curves}


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
    for row in rows:
        where = f"{row.posture}, {row.surroundings}, {row.integrator}"
        if row.apart is not None and row.growth and row.growth <= MOST_GROWTH:
            result.check(where, MODES, abs(row.apart) / row.growth, RADII_WITHIN, "")
    own = in_use(rows, rows[0].file_integrator)
    for row in own:
        note = ", ".join(
            filter(None, (f"with {row.file_integrator}", row.limiting_joint, row.limiting_contact))
        )
        limit = max(min(row.longest, LONGEST), SHORTEST)
        result.check(row.posture, quantity, row.file_dt, limit, "s", note, about=About.STEP)
        if row.stable_at_file_dt and row.largest_push is not None and not row.has_fallen:
            push = USUAL_PUSH if row.finer_push else row.largest_push
            result.check(
                row.posture, PUSHED, push, USUAL_PUSH, "rad/s or m/s", rule="at least", about=About.STEP
            )
    if not own:
        kinds = {row.limit for row in rows if row.integrator == row.file_integrator}
        result.not_judged(
            "", quantity, f"no posture has a limit: {', '.join(sorted(kinds))}", "s", about=About.STEP
        )


def add_answer(
    result: StabilityResult,
    rows: Sequence[StepLimitRow],
    asked: Asked,
    is_requested: bool,
    cures: Sequence[Any],
) -> None:
    own = in_use(rows, asked.integrator)
    worst = next((row for row in own if row.stable_at_file_dt is False), own[0] if own else None)
    own_runs = result.tables.get("own_run", ())
    runs = [run for run in own_runs if (run.dt, run.integrator) == (asked.dt, asked.integrator)]
    here = [row for row in rows if worst and row.posture == worst.posture]
    where, is_stable = (worst.surroundings, worst.stable_at_file_dt) if worst else ("", None)
    others = [row for row in here if row.integrator != asked.integrator and row.surroundings == where]
    air = [row for row in here if row.integrator == asked.integrator and row.surroundings == "air" != where]
    alike = [row for row in own if row is not worst and row.stable_at_file_dt == is_stable]
    default = None if is_requested else at_default(worst, others, asked)
    saddles = [row for row in rows if row.limit == "saddle" and row.integrator == asked.integrator]
    values = {
        "row": worst, "saddle": saddles[0] if saddles else None,
        "also": [row.posture for row in alike], "others": others, "air": air[0] if air else None,
        "default": default, "requested": is_requested, "dt": asked.dt, "integrator": asked.integrator,
        "uncalm": [run for run in runs if run.outcome in ("worse", "fails")], "up_to": LONGEST,
        "usual": USUAL_PUSH, "far": GIVES_WAY,
    }  # fmt: skip
    result.top.append(result.finding("answer", OF, **values))
    places: dict[tuple[str, str], StepLimitRow] = {}
    for row in rows:
        places.setdefault((row.posture, row.surroundings), row)
    for row in places.values():
        if row.surroundings != "air" and (
            not row.is_known or (row.moved or 0.0) > FAR or (row.creep or 0.0) > CREEPS
        ):
            result.find("rest", OF, row=row, far=FAR, creeps=CREEPS)
    if worst and worst.stable_at_file_dt is False:
        stable = [row.integrator for row in others if row.stable_at_file_dt]
        result.find("cures", OF, row=worst, integrators=stable, cures=cures)


def at_default(
    worst: StepLimitRow | None, others: Sequence[StepLimitRow], asked: Asked
) -> dict[str, Any] | None:
    """Whether MuJoCo's default step is stable; None: it is the file's, or is not known."""
    rows = [row for row in (worst, *others) if row and row.integrator == DEFAULT and row.is_known]
    if not rows or (asked.dt, asked.integrator) == (DEFAULT_STEP, DEFAULT):
        return None
    row = rows[0]
    stable = row.longest >= DEFAULT_STEP
    by_friction = stable and row.is_held_by_friction and (row.smooth_dt or 0.0) < DEFAULT_STEP
    return {"dt": DEFAULT_STEP, "integrator": DEFAULT, "stable": stable, "by_friction": by_friction}


def add_control(result: StabilityResult, row: ControlRow | None) -> None:
    if row is None:
        result.not_judged(
            "",
            "stable at its control period",
            "no actuator is a servo of a joint; state --kp and --kv, which act on lengths",
            about=About.STEP,
        )
        return
    result.tables.setdefault("control", []).append(row)
    most = MOST_PERIOD if row.longest_period is None else row.longest_period
    allowed = max(most, row.period) if row.is_stable else min(most, (1.0 - 1e-9) * row.period)
    result.check(row.posture, "stable at its control period", row.period, allowed, "s", about=About.STEP)
    result.check(row.posture, "run of its control period, as predicted", int(row.grows_in_run != row.is_stable), 1, "runs",
                 rule="equal", about=About.PREDICTION)  # fmt: skip
    result.top.append(result.finding("control", OF, row=row))


def limits_in_use(rows: Sequence[StepLimitRow]) -> list[LimitRow]:
    """The limits of a file's robot as it stands, in the form of those of the arm, for the picture of the first screen."""
    kinds = {"finite": "finite", "none": "never_fails", "moving": "never_fails", "below": "always_fails"}
    return [
        LimitRow(
            scene=row.posture, engine="mujoco", method=row.integrator, damping=0.0, mode=row.growth_rate or 0.0,
            predicted_dt=row.predicted_dt, observed_dt=min(row.longest, LONGEST) if row.observed_dt else None,
            limit=kinds[row.limit], passed=True,
        )
        for row in rows if row.limit in kinds and row.surroundings != "air"
    ]  # fmt: skip
