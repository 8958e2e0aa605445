"""No more model than a motion of a file needs: what goes for nothing, which joints can be locked for an error, how fast that is."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from tmt.derivation.composite import mass_matrix_and_bias

from ...core.check import About
from ...core.timing import fastest
from ...engines.mujoco.linear import put_controls, start_of
from ...engines.mujoco.motion import Motion, Simulation, Use, apart, joints, near, used
from ...engines.mujoco.motion import Path as Trace
from ...engines.mujoco.names import INTEGRATORS, joint_places
from ...engines.mujoco.reading import Reading, read
from ...engines.mujoco.smaller import FREE, Smaller, finished, locked, tied_joints
from ...engines.mujoco.source import Source
from ...engines.mujoco.step import STATE
from ...judge.agree import worst_of_each
from ...judge.entries import Entries
from ...judge.run import movement_unit
from ...robots.case import SEED, Case
from ...robots.coordinates import Coordinates
from ...stability.answer import Asked, answer, posture_of, postures_of
from ..setup import Setup
from .records import FreeRow, FrontierRow, JointRow, LimitRow, ReductionResult, StageRow, SubsetRow, UseRow
from .sub_blocks import check_blocks

ERROR = 1e-3  # rad or m, if none is asked for
DURATION = 1.0  # s, of the motion from a keyframe
DOES = {"hinge": 0.1, "slide": 0.02, "ball": 0.1, "free": 0.02}  # rad or m: a joint that moves more is what the scene is about
STEPS = 0.25, 0.5, 1.0, 2.0, 4.0, 8.0  # multiples of the file's
FINER = 8  # fold, the step of the reference
TENFOLD = 10.0  # errors that are asked too: a tenth, and ten times as large
TRIES = 8  # joints that are tried after the first that costs too much
FEW = 3  # models with the first 1, 2, 3 groups of joints locked are among those of the chart
SAMPLES, STATES = 10, 5  # states of the prediction; random states at which the locked models are compared
SHOWN_PAIRS = 20


@dataclass
class Scene:
    """A motion of a file by its own step and integrator."""

    reading: Reading
    motion: Motion
    whole: Smaller
    free: Smaller = field(init=False)

    def run(self, small: Smaller) -> Trace:
        return Simulation(small.model, self.motion, self.reading.dt, self.reading.integrator)()

    @cached_property
    def use(self) -> Use:
        return used(self.whole.model, self.motion, self.reading.dt, self.reading.integrator)

    @property
    def finest(self) -> tuple[float, str]:
        """The step and the integrator of the reference: of order 4 where no constraint makes the motion less smooth."""
        return self.reading.dt / FINER, self.reading.integrator if self.use.has_constraints else "RK4"

    def finely(self, small: Smaller) -> Trace:
        return Simulation(small.model, self.motion, *self.finest)()


class Group(NamedTuple):
    """Joints that are locked together. predicted: how far they would move another joint, rad or m."""

    names: frozenset[str]
    predicted: float


def add(result: ReductionResult, setup: Setup, reading: Reading) -> None:
    """Rows, checks and findings of a motion of a file, the answer first."""
    request, allowed = setup.request, setup.request.error or ERROR
    try:
        scene = scene_of(setup, reading)
    except ValueError as error:
        result.not_judged("", "a motion that is reduced", str(error), about=About.PROGRAM)
        return
    stages = take_out(result, scene)
    locks = Locks(scene, groups_of(scene))
    rows = frontier(scene, locks, (allowed / TENFOLD, allowed, allowed * TENFOLD), setup.quiet)
    row = next(row for row in rows if f"{allowed:g}" in row.best_for)
    small = finished(row.small, scene.motion, row.dt, row.integrator)
    text = small.text(block("reduction", "comment", row=row, scene=scene.motion, file=reading.source, allowed=allowed))
    add_tables(result, scene, locks, rows, stages, small)
    add_checks(result, scene, locks.positions(row.groups), row, allowed, text)
    if request.write:
        Path(request.write).write_text(text, encoding="utf-8")
    limits = [limit for name, file in (("whole", scene.whole), ("smaller", small)) for limit in limits_of(scene, file, name)]
    result.tables["reduction_limits"] = limits
    found = {"rows": rows, "row": row, "allowed": allowed, "limits": limits, "scene": scene, "locks": locks}
    result.top[:0] = [result.finding(kind, **found) for kind in ("of_file", "for_nothing", "gains", "limits")]


def scene_of(setup: Setup, reading: Reading) -> Scene:
    """The motion that is asked for: of --controls, of the first of --scenes, or of the first keyframe, with its controls."""
    request, robot = setup.request, setup.robot
    points = tuple((request.points or "").split(",")) if request.points else ()
    whole = Smaller.whole(reading.source, points)
    posture = posture_of(request.posture, reading) if request.posture else postures_of(reading)[0]
    q, v = np.array(posture.q) if posture.q else None, np.zeros(reading.model.nv)
    cases = [case for case in robot.cases if "user" in case.scene.tags]
    if not cases:
        state = start_of(reading.model, reading.drive, posture.key, v, q)
        data = mujoco.MjData(whole.model)
        mujoco.mj_setState(whole.model, data, state, STATE)
        recorded = None
        duration = DURATION
        if request.controls:
            controls = dict(request.controls)
            times = controls.pop("time")
            recorded, duration = (times, controls), float(times[-1])
        return Scene(reading, Motion.of(whole.model, data, posture.name, duration, recorded, points), whole)
    return Scene(reading, motion_of_case(cases[0], reading, whole, points), whole)


def motion_of_case(case: Case, reading: Reading, whole: Smaller, points: tuple[str, ...]) -> Motion:
    """The motion of a user's scene, with everything on; its changes of the model are not those of the file."""
    scene = case.scene
    if scene.locked or np.any(scene.damping) or not scene.gravity:
        raise ValueError(f"the scene {scene.name} changes the model itself (locked, damping, gravity)")
    key = scene.posture if isinstance(scene.posture, str) and scene.posture in reading.keyframes else ""
    state = start_of(reading.model, reading.drive, key, np.zeros(whole.model.nv), case.posture)
    data = mujoco.MjData(whole.model)
    mujoco.mj_setState(whole.model, data, state, STATE)
    data.qvel[:] = case.v
    if case.controller:
        put_controls(whole.model, data, reading.drive, case.controller.controls)
    else:
        data.qfrc_applied[:] = case.tau
    return Motion.of(whole.model, data, scene.name, scene.duration, points=points)


def take_out(result: ReductionResult, scene: Scene) -> list[tuple[FreeRow, Smaller, Smaller]]:
    """Take out one kind after the other, each only if the motion is the same to the last bit: the rows, and models to be timed."""
    scene.free, path, stages = scene.whole, scene.run(scene.whole), []
    for kind, edit in FREE.items():
        try:
            trial, count = scene.free.edited(lambda small: edit(small, scene.use))
        except ValueError:  # something else refers to it
            continue
        if count:
            row = FreeRow(kind=kind, taken_out=count, same_bits=same_bits(scene.run(trial), path))
            stages.append((row, scene.free, trial))
            scene.free = trial if row.same_bits else scene.free
    result.tables["reduction_free"] = [row for row, *_ in stages]
    return stages


def same_bits(path: Trace, other: Trace) -> bool:
    return path.q.tobytes() == other.q.tobytes() and path.v.tobytes() == other.v.tobytes()


def groups_of(scene: Scene) -> list[Group]:
    """The joints that may be locked, those that cost least by prediction first.

    The prediction: were the joint locked, the others would be moved by its own movement times their coupling through M.
    """
    model, path, use = scene.free.model, scene.run(scene.free), scene.use
    places, kinds = joints(model), {place.joint: place.kind for place in joint_places(model).values()}
    data, costs = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    middle, unit = np.hstack([use.middle[name] for name in places]), np.eye(model.nv)
    for q in path.q[:: max(1, len(path.q) // SAMPLES)]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        inverse, moved = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        mujoco.mj_solveM(model, data, inverse, unit)
        mujoco.mj_differentiatePos(model, moved, 1.0, middle, q)
        costs = np.maximum(costs, np.abs(inverse / np.diag(inverse) * moved))
    groups = []
    for names in tied_joints(model):
        if all(use.ranges[name] <= DOES[kinds[list(places).index(name)]] for name in names):
            speeds = np.r_[tuple(places[name][1] for name in names)]
            others = np.setdiff1d(np.arange(model.nv), speeds)
            groups.append(Group(names, float(costs[np.ix_(others, speeds)].max(initial=0.0))))
    groups.sort(key=lambda group: group.predicted)
    return groups[: len(places) - 1]


@dataclass
class Locks:
    """Models with groups of joints locked, and the errors that this alone makes."""

    scene: Scene
    groups: Sequence[Group]
    models: dict[frozenset[int], Smaller | None] = field(default_factory=dict)
    errors: dict[frozenset[int], float] = field(default_factory=dict)

    def names(self, groups: Iterable[int]) -> list[str]:
        names = {name for group in groups for name in self.groups[group].names}
        return [name for name in self.scene.use.middle if name in names]

    def positions(self, groups: Iterable[int]) -> dict[str, np.ndarray]:
        return {name: self.scene.use.middle[name] for name in self.names(groups)}

    def model(self, groups: frozenset[int]) -> Smaller | None:
        """None: they cannot be locked, as something else refers to a joint."""
        if groups not in self.models:
            try:
                self.models[groups] = locked(self.scene.free, self.positions(groups))
            except ValueError:
                self.models[groups] = None
        return self.models[groups]

    def error(self, groups: frozenset[int]) -> float:
        """Of the joints that stay and the points, rad or m, by the file's step; inf where they cannot be locked."""
        if groups not in self.errors:
            small = self.model(groups)
            is_run = small is not None and small.model.nv > 0
            self.errors[groups] = apart(self.scene.run(small), self.path, self.scene.motion) if is_run else np.inf
        return self.errors[groups]

    @cached_property
    def path(self) -> Trace:
        return self.scene.run(self.scene.free)

    def within(self, allowed: float) -> frozenset[int]:
        """The groups that can be locked for an error: the first by prediction, and then each that the error allows."""
        low, high = 0, len(self.groups) + 1  # the first `low` are within the error
        while high - low > 1:
            middle = (low + high) // 2
            is_within = self.error(frozenset(range(middle))) <= allowed
            low, high = (middle, high) if is_within else (low, middle)
        chosen = frozenset(range(low))
        for number in range(low, min(len(self.groups), low + TRIES)):
            if self.error(chosen | {number}) <= allowed:
                chosen |= {number}
        return chosen


def frontier(scene: Scene, locks: Locks, errors: Sequence[float], quiet: Callable[[], None]) -> list[FrontierRow]:
    """A row of each model, integrator and step: its error against the reference, and its time. errors: that may be allowed."""
    chosen = [frozenset(range(count)) for count in range(min(FEW, len(locks.groups)) + 1)]
    chosen += [locks.within(error) for error in errors]
    models = {groups: small for groups in sorted({*chosen}, key=len) if (small := locks.model(groups))}
    reference, rows, runs = scene.finely(scene.whole), [], {}
    for groups, small in [(None, scene.whole), *models.items()]:
        fine = scene.finely(small)
        of_model = apart(fine, reference, scene.motion)
        for integrator in INTEGRATORS:
            for multiple in STEPS:
                dt = multiple * scene.reading.dt
                run = Simulation(small.model, scene.motion, dt, integrator)
                path = run()
                row = FrontierRow(
                    locked=0 if groups is None else len(locks.names(groups)), integrator=integrator, dt=dt,
                    error=apart(path, reference, scene.motion), error_of_model=of_model,
                    error_of_step=apart(path, fine, scene.motion),
                )  # fmt: skip
                row.small, row.groups, row.is_whole = small, groups or frozenset(), groups is None
                is_own = (dt, integrator) == (scene.reading.dt, scene.reading.integrator)
                if is_own or row.error <= max(errors):
                    rows.append(row)
                    runs[len(rows) - 1] = run
    quiet()
    seconds = fastest(runs, ROUNDS)
    own = next(row for row in rows if row.is_own)
