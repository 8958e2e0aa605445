"""The answer for a file: a row for each integrator at a posture, what else its runs show, and what helps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ..core.rows import Row, column
from ..engines.mujoco.inventory import light_joints
from ..engines.mujoco.names import element_name
from ..engines.mujoco.reading import Reading
from .motion import Posture, motion_of
from .push import PUSHES, USUAL, WITHIN, Limit, Pushed
from .remedies import Remedy, creep_stops, remedies, shorter_steps
from .runs import FAST, Trial, in_threads
from .search import largest

DRAWN = (0.03, 0.1, 0.3)  # rad/s or m/s: pushes of the picture
CREEPS = 1e-4  # rad/s or m/s: what should rest and is faster
DAMPED = 0.5  # of the speed that fine runs keep: a step that leaves less damps
LONGEST_PERIOD = 0.5  # s, of a program
LONGER = 1.2  # fold: a limit that is told beside another one
EARTH = 30.0  # m/s2: a larger gravity is stated in another unit of length


@dataclass(kw_only=True)
class StepLimitRow(Row):
    """The longest stable step of an integrator, or the longest period of a program, after a push: step_limits.csv.

    Speeds are in rad/s or m/s, distances in rad or m, of joints and free bodies, in the file's unit of
    length. stable_up_to_s: None: no step down to fine_dt_s; fails_at_s: None: all that are tried hold.
    moves_first: the joint of the run that fails. end_speed: the largest in the last quarter of the runs, at
    the step in use and at fine steps. apart: the largest distance from fine runs on the way, at the step in
    use; within_error_s: the longest stable step that stays within --error. judged_by: rest; speed, it coasts or is
    in motion; divergence, it moves on by itself; falls, a stated push is survived at no step; "", no fine run
    is finite. outcome: of the step in use: holds, moves, grows, elsewhere, diverges. survived: the largest
    push that fine runs survive of those that were tried. fine_apart: of two fine steps. kept: the share of
    the speed of fine runs that is left at the step in use, where they coast. creep: of the fine run without a
    push.
    """

    posture: str
    integrator: str
    of: str = "step"
    push_rad_per_s: float
    stable_up_to_s: float | None = column(digits=3, default=None)
    fails_at_s: float | None = column(digits=3, default=None)
    moves_first: str = ""
    end_speed_file_rad_per_s: float | None = None
    end_speed_fine_rad_per_s: float | None = None
    apart: float | None = None
    within_error_s: float | None = column(digits=3, optional=True)
    stable_at_file_dt: bool | None = None
    outcome: str = ""
    judged_by: str = ""
    file_dt_s: float
    file_integrator: str
    period_s: float | None = column(digits=3, optional=True)
    delay_s: float | None = column(digits=3, optional=True)
    survived_rad_per_s: float = 0.0
    place: str = ""
    controls: str = ""
    starts: str = ""
    kept: float | None = None
    creep_rad_per_s: float = 0.0
    creeping_joint: str = ""
    fine_dt_s: float = 0.0
    fine_integrator: str = ""
    fine_apart: float | None = None
    by_itself: str = ""
    unpushed_rad_per_s: float | None = None
    run_s: float = 0.0
    unit: str = ""

    @property
    def longest_s(self) -> float:
        """The longest stable step, s: 0.0: none; inf: all that are tried."""
        return np.inf if self.stable_up_to_s and self.fails_at_s is None else self.stable_up_to_s or 0.0

    @property
    def is_damped(self) -> bool:
        return self.outcome != "diverges" and self.kept is not None and self.kept < DAMPED

    @property
    def used_s(self) -> float:
        """The step, or the period, in use."""
        return self.file_dt_s if self.of == "step" else self.period_s or 0.0


@dataclass(kw_only=True)
class TriedRow(Row):
    """A step that was tried: stability_runs.csv."""

    posture: str
    integrator: str
    push_rad_per_s: float
    dt_s: float = column(digits=4)
    outcome: str
    end_speed_rad_per_s: float | None
    apart: float | None


class Question(NamedTuple):
    """What is asked of a posture.

    dt, s, integrator: of the step in use. push: None: the usual one. error: rad or m. recorded: controls, see
    motion_of. control_period, delay: s, of a program; kp, kv: its gains. drawn: with the pushes of the
    picture; helped: with remedies.
    """

    dt: float
    integrator: str
    integrators: Sequence[str]
    push: float | None = None
    error: float | None = None
    recorded: Mapping[str, np.ndarray] | None = None
    control_period: float | None = None
    delay: float | None = None
    kp: float | None = None
    kv: float | None = None
    drawn: bool = False
    helped: bool = False


class Answer(NamedTuple):
    """Rows, in the order of the integrators; steps that were tried; remedies; what stops a creep.

    recipes: of the runs at the longest stable step in use, and at the first that fails. smaller: where the
    step in use fails, the largest smaller push after which the limit is longer, and that limit. light: of
    joints that move first, see light_joints.
    """

    rows: list[StepLimitRow]
    tried: list[TriedRow]
    remedies: list[Remedy]
    stops: list[Remedy]
    recipes: list[dict[str, Any]]
    smaller: tuple[float, float] | None
    light: Mapping[str, tuple[float, float, float]]

    @property
    def own(self) -> StepLimitRow | None:
        return next((row for row in self.rows if row.integrator == row.file_integrator), None)


def answer(reading: Reading, posture: Posture, question: Question) -> Answer:
    """The answer to a question. ValueError where nothing moves, or no actuator is there for a program."""
    if not reading.model.nv:
        raise ValueError("nothing moves")
    period = question.control_period
    motion = motion_of(reading, posture, question.recorded, question.kp, question.kv, period is not None)
    times = period or 0.0, question.delay or 0.0
    pushed = Pushed(motion, question.dt, question.integrator, question.push, *times)
    pushed.find_truth(PUSHES[-1] if question.drawn else USUAL)
    rows = in_threads(lambda name: row_of(pushed, name, question), question.integrators)
    found = Answer(rows, [], [], [], [], None, {})
    row, own = rows[0], found.own
    if question.drawn and row.judged_by == "rest" and period is None:
        for push in (push for push in DRAWN if pushed.push != push <= pushed.survived):
            known_steps = [(push, row.integrator, False, row.stable_up_to_s) for row in rows]
            in_threads(lambda asked: pushed.limit(*asked), known_steps)
    if question.helped and own and own.stable_at_file_dt is False:
        helps = remedies(pushed) if period is None else shorter_steps(pushed)
        found = found._replace(remedies=helps, smaller=smaller_push(pushed, own))
    if question.helped and row.creep_rad_per_s > CREEPS:
        found = found._replace(stops=creep_stops(pushed, pushed.creep()[1]))
    places = {name: place for place, name in enumerate(question.integrators)}  # threads end in any order
    for trial, verdict in sorted(pushed.tried.items(), key=lambda one: places[one[0].integrator]):
        found.tried.append(TriedRow(
            posture=posture.name, integrator=trial.integrator, push_rad_per_s=trial.push, dt_s=trial.dt,
            outcome=verdict.why or "holds", end_speed_rad_per_s=known(verdict.speed), apart=known(verdict.apart),
        ))  # fmt: skip
    for dt in (own.stable_up_to_s, own.fails_at_s) if own and own.of == "step" else ():
        if dt and (recipe := pushed.recipe(dt, pushed.integrator)):
            found.recipes.append(recipe)
    light, first = light_joints(reading.model), {row.moves_first for row in found.rows}
    return found._replace(light={name: numbers for name, numbers in light.items() if name in first})


def row_of(pushed: Pushed, integrator: str, question: Question) -> StepLimitRow:
    """The row of an integrator."""
    model, push, dt, period = pushed.model, pushed.push, question.dt, question.control_period
    creep, dof = pushed.creep()
    row = StepLimitRow(
        posture=pushed.motion.name, integrator=integrator, of="step" if period is None else "period",
        push_rad_per_s=push, file_dt_s=dt, file_integrator=question.integrator, period_s=period, delay_s=question.delay,
        survived_rad_per_s=pushed.survived, controls=pushed.motion.controls, run_s=pushed.lasts,
        starts=pushed.starts, creep_rad_per_s=creep, creeping_joint=joint_of(model, dof) if creep else "",
        fine_dt_s=pushed.fine_dt, fine_integrator=pushed.truth, judged_by=pushed.judged_by,
        end_speed_fine_rad_per_s=known(max(run.speed for run in pushed.fine_runs(push))), unit=unit_of(model),
        by_itself=pushed.by_itself, unpushed_rad_per_s=known(pushed.unpushed.speed),
    )  # fmt: skip
    if row.judged_by in ("", "falls"):
        return row
    row.place = "by chance" if pushed.place_is_chance(push) else ""
    row.fine_apart = known(pushed.fine_apart(push))
    limit, trial = limit_of(pushed, row, push), Trial(push, dt, integrator, pushed.period)
    if period is None:
        pushed.sure(trial)
    verdict = pushed.verdict(trial)
    row.stable_up_to_s, row.fails_at_s = limit.stable_up_to, limit.fails_at
    row.moves_first = "" if limit.dof is None else joint_of(model, limit.dof)
    row.end_speed_file_rad_per_s, row.apart = known(verdict.speed), known(verdict.apart)
    row.stable_at_file_dt, row.outcome, row.kept = verdict.holds, verdict.why or "holds", verdict.kept

    def is_near(step: float) -> bool:
        tried = pushed.verdict(Trial(push, step, integrator))
        return tried.holds and tried.apart <= (question.error or 0.0)

    most = (row.stable_up_to_s or 0.0) if period is None else pushed.longest
    if most and (question.error or 0.0) > (row.fine_apart or 0.0):  # fine runs know no less
        row.within_error_s, _ = largest(is_near, min(dt, most), pushed.fine_dt, most, WITHIN)
    return row


def limit_of(pushed: Pushed, row: StepLimitRow, push: float) -> Limit:
    """The limit of the step; of a program that of its period, in whole steps in use."""
    if row.of == "step":
        return pushed.limit(push, row.integrator)
    dt, most = pushed.dt, max(LONGEST_PERIOD, pushed.period)

    def whole(period: float) -> Trial:
        return Trial(push, dt, row.integrator, dt * max(1, round(period / dt)))

    low, high = largest(lambda period: pushed.verdict(whole(period)).holds, pushed.period, dt, most, WITHIN)
    failing = pushed.verdict(whole(high)).dof if high else None
    return Limit(low and whole(low).period, high and whole(high).period, failing)


def smaller_push(pushed: Pushed, row: StepLimitRow) -> tuple[float, float] | None:
    """The largest smaller push after which the limit is longer by LONGER, and that limit, s."""
    for push in reversed(PUSHES) if pushed.rests else ():
        limit = (limit_of(pushed, row, push).stable_up_to or 0.0) if push < pushed.push else 0.0
        if limit > LONGER * (row.stable_up_to_s or pushed.fine_dt):
            return push, limit
    return None


def known(value: float) -> float | None:
    """None where it is not finite, or beyond what a run of a robot shows."""
    return value if np.isfinite(value) and value < 1e3 * FAST else None


def joint_of(model: mujoco.MjModel, dof: int) -> str:
    """The name of the joint; of one without a name that of its body."""
    joint = int(model.dof_jntid[dof])
    if model.joint(joint).name:
        return element_name(model, "joint", joint)
    return element_name(model, "body", model.jnt_bodyid[joint])


def unit_of(model: mujoco.MjModel) -> str:
    """The unit of speeds: rad/s, m/s, or both; of a file in another unit of length that of the file."""
    kinds = {mujoco.mjtJoint(model.jnt_type[joint]) for joint in model.dof_jntid}
    slide, free = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE
    length = "m/s" if np.linalg.norm(model.opt.gravity) < EARTH else "the file's units a second"
    return " or ".join(["rad/s"] * bool(kinds - {slide}) + [length] * bool(kinds & {slide, free}))


def worst_step(rows: Sequence[StepLimitRow]) -> tuple[bool | None, float | None]:
    """Whether the step in use is stable at every posture, None if unknown; the shortest limit of its integrator, s."""
    own = [row for row in rows if row.integrator == row.file_integrator and row.stable_at_file_dt is not None]
    limits = [row.longest_s for row in own if np.isfinite(row.longest_s)]
    return (all(row.stable_at_file_dt for row in own) if own else None), min(limits, default=None)
