"""The search: what goes for nothing, which joints can be locked, how fast and how stable the steps are."""

import time
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ...core.timing import fastest
from ...engines.mujoco.motion import Path, Simulation, couplings, joints
from ...engines.mujoco.names import INTEGRATORS, kind_of
from ...engines.mujoco.reading import read
from ...engines.mujoco.smaller import FREE, Smaller, finished, locked, tied_joints
from ...engines.mujoco.source import without_visuals
from ...stability.answer import Asked, limit_row
from ...stability.limits import GIVES_WAY, tried
from ...stability.place import Place, postures_of, standing_at
from .records import FreeRow, FrontierRow, LimitRow
from .scene import FINER, Scene

DOES, DOES_SLIDE = 0.1, 0.02  # rad, m: a joint that moves more is what the scene is about
STEPS = 0.5, 1.0, 2.0, 4.0, 8.0  # multiples of the file's
FEW = 3  # models with the first 1, 2, 3 groups of joints locked are among those of the chart
ROUNDS = 6  # of timing
AS_FAST = 1.05  # fold: the accuracy of times
Groups = frozenset[int]  # of joints that are locked, by their numbers


def take_out(scene: Scene) -> list[tuple[FreeRow, Smaller]]:
    """Take out one kind after the other if the motion is the same to the last bit: rows and models."""
    paths, small, kinds = scene.run(scene.whole), scene.whole, []
    for kind, edit in FREE.items():
        trial = Smaller(small.spec.copy())
        try:
            count = edit(trial, scene.use)
            trial = Smaller(trial.spec)
        except ValueError:  # something else refers to it
            continue
        if count:
            is_same = same_bits(scene.run(trial), paths)
            small = trial if is_same else small
            kinds.append((FreeRow(kind=kind, taken_out=count, same_bits=is_same), small))
    return kinds


def same_bits(paths: Sequence[Path], others: Sequence[Path]) -> bool:
    bits = [[(path.q.tobytes(), path.v.tobytes()) for path in run] for run in (paths, others)]
    return bits[0] == bits[1]


class Group(NamedTuple):
    """Joints that are locked together. predicted: how far they would move another joint, rad or m."""

    names: list[str]
    predicted: float


def groups_of(scene: Scene, free: Smaller) -> list[Group]:
    """The joints that may be locked.

    The prediction: were the joint locked, the others would be moved by its own movement times their coupling
    through M.
    """
    model, use, places = free.model, scene.use, joints(free.model)
    slides = [name for number, name in enumerate(places) if kind_of(model, number) == "slide"]
    most = dict.fromkeys(places, DOES) | dict.fromkeys(slides, DOES_SLIDE)
    costs = couplings(model, scene.positions(free), np.hstack([use.middle[name] for name in places]))
    groups = []
    for names in tied_joints(model):
        if all(use.ranges[name] <= most[name] for name in names):
            speeds = np.r_[tuple(places[name][1] for name in names)]
            others = np.setdiff1d(np.arange(model.nv), speeds)
            groups.append(Group(names, float(costs[np.ix_(others, speeds)].max(initial=0.0))))
    return sorted(groups, key=lambda group: group.predicted)


class Locks:
    """Models with groups of joints locked, and the errors that this alone makes."""

    def __init__(self, scene: Scene, free: Smaller) -> None:
        self.scene, self.free, self.groups = scene, free, groups_of(scene, free)
        self.paths = scene.run(free)
        self.model, self.error = cache(self.model_of), cache(self.error_of)
        self.order = sorted(range(len(self.groups)), key=self.error_alone)

    def positions(self, groups: Iterable[int]) -> dict[str, np.ndarray]:
        names = {name for group in groups for name in self.groups[group].names}
        return {name: middle for name, middle in self.scene.use.middle.items() if name in names}

    def model_of(self, groups: Groups) -> Smaller | None:
        """None: they cannot be locked, as something else refers to a joint."""
        try:
            return locked(self.free, self.positions(groups))
        except ValueError:
            return None

    def error_of(self, groups: Groups) -> float:
        """Of the joints that stay and the points, by the file's step; inf where they cannot be locked."""
        small = self.model(groups)
        if small is None or not small.model.nv:
            return np.inf
        return self.scene.apart(self.scene.run(small), self.paths)

    def error_alone(self, group: int) -> float:
        return self.error(frozenset({group}))

    def first(self, count: int) -> Groups:
        """Those whose locks alone cost least."""
        return frozenset(self.order[:count])

    def within(self, allowed: float) -> Groups:
        """The groups that can be locked for an error: all, or each that it allows, of least cost first."""
        chosen = self.first(len(self.order))
        if self.error(chosen) <= allowed:
            return chosen
        chosen = frozenset()
        for group in self.order:
            if self.error(chosen | {group}) <= allowed:
                chosen |= {group}
        return chosen


class Candidate(NamedTuple):
    """A model with a step and an integrator, and the groups of joints that are locked."""

    row: FrontierRow
    small: Smaller
    groups: Groups


def frontier(
    scene: Scene, locks: Locks, errors: Sequence[float], quiet: Callable[[], object]
) -> list[Candidate]:
    """Each model by each integrator and step: its error and its time; the file as it is first.

    Those that are worse than all of the errors are left out; the file's own step stays.
    """
    sets = {locks.first(count) for count in range(FEW + 1)}
    sets |= {locks.within(error) for error in errors}
    models = [("whole file", scene.whole, Groups())]
    for groups in sorted(sets, key=len):
        small, count = locks.model(groups), len(locks.positions(groups))
        if small and locks.error(groups) < np.inf:
            models.append((f"joints locked: {count}" if count else "without what is not used", small, groups))
    reference, own = scene.finely(scene.whole), (scene.reading.integrator, scene.reading.dt)
    steps = [multiple * scene.reading.dt for multiple in STEPS]
    settings = [own, *(setting for setting in product(INTEGRATORS, steps) if setting != own)]
    candidates, runs = [], []
    for name, small, groups in models:
        fine = scene.finely(small)
        error_of_model = scene.apart(fine, reference)
        for integrator, dt in settings:
            run, is_own = scene.simulation(small, dt, integrator), (integrator, dt) == own
            paths = run()
            row = FrontierRow(
                model=name, locked=len(locks.positions(groups)), integrator=integrator, dt=dt,
                error=scene.apart(paths, reference), error_of_model=error_of_model,
                error_of_step=scene.apart(paths, fine),
                error_at_own_step=locks.error(groups) if is_own else None,
            )  # fmt: skip
            if is_own or row.error <= max(errors):
                candidates.append(Candidate(row, small, groups))
                runs.append(run)
    quiet()
    seconds = seconds_of(runs)
    for number, candidate in enumerate(candidates):
        candidate.row.time_of_second = seconds[number] / scene.duration
        candidate.row.gain = seconds[0] / seconds[number]
    return candidates


def seconds_of(runs: Sequence[Simulation]) -> dict[int, float]:
    """Of processor time: other programs may wait for the processor, too."""
    return fastest(dict(enumerate(runs)), ROUNDS, time.thread_time)


class Answer(NamedTuple):
    """The fastest for an error, rad or m, of the exact motion or, at the file's own step, of its own run.

    exact: the fastest for one of the exact motion; None: there is none.
    """

    allowed: float
    row: FrontierRow
    exact: FrontierRow | None

    @property
    def at_own_step(self) -> bool:
        """Whether it is within the error of the file's own run alone."""
        return self.row.error > self.allowed

    @property
    def is_gain(self) -> bool:
        return self.row.gain >= AS_FAST


def answer_within(rows: Sequence[FrontierRow], allowed: float) -> Answer:
    exact = [row for row in rows if row.error <= allowed and row.stable_at_rest]
    own = [row for row in rows if row.error_at_own_step is not None and row.error_at_own_step <= allowed]
    return Answer(allowed, best_of([*exact, *own]), best_of(exact) if exact else None)


def best_of(rows: Sequence[FrontierRow]) -> FrontierRow:
    """Of those that are as fast as the fastest, within AS_FAST, the one with most joints locked."""
    fast = max(row.gain for row in rows) / AS_FAST
    return max((row for row in rows if row.gain >= fast), key=lambda row: (row.locked, row.gain))


def rest_of(scene: Scene, small: Smaller) -> Place | None:
    """Where a model rests near the start of the first motion; None: elsewhere."""
    start = finished(small, scene.motions[:1], scene.reading.dt, scene.reading.integrator)
    reading = read(without_visuals(start.spec).compile())
    place = standing_at(reading, postures_of(reading)[0])
    return place if np.abs(place.moved).max(initial=0.0) <= GIVES_WAY else None


def stable_answers(scene: Scene, candidates: Sequence[Candidate], errors: Iterable[float]) -> list[Answer]:
    """The answers for errors, rad or m, by steps that are stable at rest, where a run may show nothing."""
    rows, judged, rests = [candidate.row for candidate in candidates], set[int](), dict[str, Place | None]()
    while True:
        answers = [answer_within(rows, error) for error in errors]
        told = {id(row) for answer in answers for row in (answer.row, answer.exact)} - judged
        candidate = next((candidate for candidate in candidates if id(candidate.row) in told), None)
        if candidate is None:
            return answers
        row = candidate.row
        judged.add(id(row))
        if row.model not in rests:
            rests[row.model] = rest_of(scene, candidate.small)
        if not is_stable(rests[row.model], row):
            for other in rows:
                is_alike = (other.model, other.integrator) == (row.model, row.integrator)
                other.stable_at_rest &= not (is_alike and other.dt >= row.dt)


def is_stable(place: Place | None, row: FrontierRow) -> bool:
    """Whether its step is not the cause of what grows at rest; the file's own step is what it is."""
    if place is None or row.error_at_own_step is not None:
        return True
    own, finer = (tried(place.model, place.rest, dt, row.integrator) for dt in (row.dt, row.dt / FINER))
    return own.is_stable or not finer.is_stable


def compared_limits(scene: Scene, small: Smaller, integrators: Sequence[str]) -> list[LimitRow]:
    """The step limits of the whole and of the smaller file."""
    rows, asked = [], Asked(scene.reading.dt, scene.reading.integrator, (), in_runs=False)
    for model, file in (("whole", scene.whole), ("smaller", small)):
        place = rest_of(scene, file)
        for integrator in integrators:
            row = LimitRow(model, integrator, "rests_elsewhere")
            if place:
                answer, _ = limit_row(place, integrator, asked)
                row = LimitRow(model, integrator, answer.limit, answer.predicted_dt, answer.limiting_joint)
            rows.append(row)
    return rows
