"""The search: what goes for nothing, which joints can be locked for an error, and how fast each model is by each step."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from ...core.timing import fastest
from ...engines.mujoco.motion import Path, Simulation, apart, couplings, joints
from ...engines.mujoco.names import INTEGRATORS, joint_places
from ...engines.mujoco.smaller import FREE, Smaller, locked, tied_joints
from .records import FreeRow, FrontierRow
from .scene import Scene

DOES = {
    "hinge": 0.1,
    "slide": 0.02,
    "ball": 0.1,
}  # rad or m: a joint that moves more is what the scene is about
STEPS = 0.25, 0.5, 1.0, 2.0, 4.0, 8.0  # multiples of the file's
TRIES = 8  # joints that are tried after the first that costs too much
FEW = 3  # models with the first 1, 2, 3 groups of joints locked are among those of the chart
ROUNDS = 6  # of timing
AS_FAST = 1.05  # fold: the accuracy of times
Groups = frozenset[int]  # of joints that are locked, by their numbers


class Kind(NamedTuple):
    """What was taken out, or stayed as it changed the motion; and the file then."""

    row: FreeRow
    file: Smaller


def take_out(scene: Scene) -> list[Kind]:
    """Take out one kind after the other, each only if the motion is the same to the last bit."""
    path, small, kinds = scene.run(scene.whole), scene.whole, []
    for kind, edit in FREE.items():
        try:
            trial, count = small.edited(edit, scene.use)
        except ValueError:  # something else refers to it
            continue
        if count:
            is_same = same_bits(scene.run(trial), path)
            small = trial if is_same else small
            kinds.append(Kind(FreeRow(kind=kind, taken_out=count, same_bits=is_same), small))
    return kinds


def same_bits(path: Path, other: Path) -> bool:
    return path.q.tobytes() == other.q.tobytes() and path.v.tobytes() == other.v.tobytes()


class Group(NamedTuple):
    """Joints that are locked together. predicted: how far they would move another joint, rad or m."""

    names: frozenset[str]
    predicted: float


def groups_of(scene: Scene, free: Smaller) -> list[Group]:
    """The joints that may be locked, those that cost least by prediction first.

    The prediction: were the joint locked, the others would be moved by its own movement times their coupling through M.
    """
    model, use = free.model, scene.use
    places, kinds = joints(model), {place.joint: place.kind for place in joint_places(model).values()}
    costs, groups = couplings(scene.run(free), np.hstack([use.middle[name] for name in places])), []
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
    free: Smaller
    groups: Sequence[Group]
    models: dict[Groups, Smaller | None] = field(default_factory=dict)
    errors: dict[Groups, float] = field(default_factory=dict)

    def names(self, groups: Iterable[int]) -> list[str]:
        names = {name for group in groups for name in self.groups[group].names}
        return [name for name in self.scene.use.middle if name in names]

    def positions(self, groups: Iterable[int]) -> dict[str, np.ndarray]:
        return {name: self.scene.use.middle[name] for name in self.names(groups)}

    def model(self, groups: Groups) -> Smaller | None:
        """None: they cannot be locked, as something else refers to a joint."""
        if groups not in self.models:
            try:
                self.models[groups] = locked(self.free, self.positions(groups))
            except ValueError:
                self.models[groups] = None
        return self.models[groups]

    def error(self, groups: Groups) -> float:
        """Of the joints that stay and the points, rad or m, by the file's step; inf where they cannot be locked."""
        if groups not in self.errors:
            self.errors[groups], small = np.inf, self.model(groups)
            if small is not None and small.model.nv:
                self.errors[groups] = apart(self.scene.run(small), self.path, self.scene.motion)
        return self.errors[groups]

    @cached_property
    def path(self) -> Path:
        return self.scene.run(self.free)

    def within(self, allowed: float) -> Groups:
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


class Candidate(NamedTuple):
    """A model with a step and an integrator.

    groups: that are locked; None: the file with everything. apart: from the file's run, both by its own step and integrator,
    rad or m; None: this one has another step or integrator.
    """

    row: FrontierRow
    small: Smaller
    groups: Groups | None
    apart: float | None


def frontier(
    scene: Scene, locks: Locks, errors: Sequence[float], quiet: Callable[[], object]
) -> list[Candidate]:
    """Each model by each integrator and step: its error against the reference, and its time; the file as it is first.

    Left out are those that are worse than all of the errors, but for the file's own step.
    """
    sets = {frozenset(range(count)) for count in range(min(FEW, len(locks.groups)) + 1)}
    sets |= {locks.within(error) for error in errors}
    models: list[tuple[Groups | None, Smaller]] = [(None, scene.whole)]
    possible = [
        (groups, locks.model(groups)) for groups in sorted(sets, key=len) if locks.error(groups) < np.inf
    ]
    models += [(groups, small) for groups, small in possible if small]
    reference, own = scene.finely(scene.whole), (scene.reading.integrator, scene.reading.dt)
    steps = [multiple * scene.reading.dt for multiple in STEPS]
    candidates, runs = [], []
    for groups, small in models:
        fine = scene.finely(small)
        count = len(locks.names(groups or ()))
        name = (
            "whole file"
            if groups is None
            else f"{count} joints locked"
            if count
            else "without what is not used"
        )
        for integrator, dt in sorted(product(INTEGRATORS, steps), key=own.__ne__):
            run = Simulation(small.model, scene.motion, dt, integrator)
            path = run()
            row = FrontierRow(
                model=name, locked=count, integrator=integrator, dt=dt, error=apart(path, reference, scene.motion),
                error_of_model=apart(fine, reference, scene.motion), error_of_step=apart(path, fine, scene.motion),
            )  # fmt: skip
            is_own = (integrator, dt) == own
            if is_own or row.error <= max(errors):
                candidates.append(
                    Candidate(row, small, groups, locks.error(groups or frozenset()) if is_own else None)
                )
                runs.append(run)
    quiet()
    seconds = fastest(dict(enumerate(runs)), ROUNDS)
    for number, candidate in enumerate(candidates):
        candidate.row.time_of_second = seconds[number] / scene.motion.duration
        candidate.row.gain = seconds[0] / seconds[number]
    return candidates


def best_within(candidates: Sequence[Candidate], allowed: float) -> Candidate:
    """The fastest within an error of the exact motion; if no step is, see best_at_own_step.

    Of those that are as fast, within the accuracy of times, the one with most joints locked.
    """
    good = [candidate for candidate in candidates if candidate.row.error <= allowed]
    if not good:
        return best_at_own_step(candidates, allowed)
    fast = max(candidate.row.gain for candidate in good) / AS_FAST
    return max(
        good, key=lambda candidate: (candidate.row.gain >= fast, candidate.row.locked, candidate.row.gain)
    )


def best_at_own_step(candidates: Sequence[Candidate], allowed: float) -> Candidate:
    """The one with most joints locked within an error of the file's own run, by its step."""
    good = [
        candidate for candidate in candidates if candidate.apart is not None and candidate.apart <= allowed
    ]
    return max(good, key=lambda candidate: (candidate.row.locked, candidate.row.gain))
