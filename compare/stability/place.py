"""Where a file's limits are asked for: a posture, with its contacts or in the air, and where the robot rests there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

import tmt

from ..engines.mujoco.names import element_name, on
from ..engines.mujoco.reading import Reading
from ..engines.mujoco.step import Step, distance, start_of
from ..engines.mujoco.variants import (
    add_armature,
    has_free_base,
    in_the_air,
    loose_objects,
    of_base,
    without_dry_friction,
)
from ..robots.coordinates import Coordinates
from ..robots.file import names_of_keys
from .limits import is_saddle, tried
from .rest import NEAR_REST, left_at, relaxed, rest_near

MOST_POSTURES = 6  # the first keyframes
FINE = 4  # fold: steps of the file's own, and finer, at which a saddle is known
LEFT_BY = 0.02  # rad or m: the movement along its mode with which a saddle is left
MOST_SADDLES = 3  # that are left one after the other
FALLEN = 0.5  # rad or m: the movement of a free body that is a fall
FALLS = 1.0  # m/s2: what is still accelerated so at the end of a relaxed run is held by nothing
TOUCHES = 1.0  # s: what touches nothing within this time is in the air; what bounces is not
MOVING = 0.01  # rad/s or m/s: what creeps faster does not rest
HELD_STILL = 1e9  # kg or kg m2, of armature


class Posture(NamedTuple):
    """A posture that is asked for. key: the keyframe, "": qpos0; q: positions instead, (nq,), or ()."""

    name: str
    key: str
    q: tuple[float, ...] = ()


def postures_of(reading: Reading) -> list[Posture]:
    """The keyframes, by the names of their postures; qpos0 if there is none."""
    named = names_of_keys(reading)
    keys = list(reading.keyframes)[:MOST_POSTURES]
    return [Posture(named[key], key) for key in keys] or [Posture("qpos0", "")]


def posture_of(asked: str | Sequence[float], reading: Reading) -> Posture:
    """The posture of a name, or positions of all joints (deg, m, quaternions); ValueError, in one line, for neither.

    A name may be numbers separated by commas.
    """
    named = {posture.name: posture for posture in postures_of(reading)} | {"qpos0": Posture("qpos0", "")}
    if isinstance(asked, str) and asked in named:
        return named[asked]
    coordinates = Coordinates(reading.tree.joint_names, reading.tree.kind)
    try:
        numbers = tuple(map(float, asked.split(",") if isinstance(asked, str) else asked))
    except ValueError:
        numbers = ()
    if len(numbers) != len(reading.qpos0) or not np.isfinite(numbers).all():
        choices = f"{', '.join(named)}, or {len(reading.qpos0)} numbers (deg, m, quaternions)"
        raise ValueError(f"posture {asked} is not one of this file: expected {choices}")
    name = asked if isinstance(asked, str) else ",".join(f"{x:g}" for x in numbers)
    return Posture(name, "", tuple(coordinates.from_degrees(numbers, positions=True).tolist()))


@dataclass(frozen=True)
class Place:
    """A posture of a file, and where it rests.

    contacts: with them, or in the air: without contacts, and without gravity if the base is free. start, rest: MuJoCo's states.
    still: which speeds are those of loose objects that move on, (nv,): they are held where they are.
    """

    reading: Reading
    posture: Posture
    contacts: bool
    start: np.ndarray
    rest: np.ndarray
    still: np.ndarray
    is_touching: bool

    @cached_property
    def model(self) -> mujoco.MjModel:
        model = self.reading.model if self.contacts else in_the_air(self.reading.model)
        return with_held(model, self.still) if self.still.any() else model

    @cached_property
    def frictionless(self) -> mujoco.MjModel | None:
        """The model without dry friction of joints and tendons; None: it has none."""
        return without_dry_friction(self.model)

    @property
    def tree(self) -> tmt.Tree:
        return replace(self.reading.tree, gravity=tuple(self.model.opt.gravity * on(self.model, "GRAVITY")))

    @property
    def surroundings(self) -> str:
        if not self.contacts:
            return "air"
        return "contact" if self.is_touching else "free"

    @cached_property
    def left(self) -> float:
        """The largest acceleration at the rest, rad/s2 or m/s2."""
        return left_at(Step(self.model, self.model.opt.timestep, self.reading.integrator), self.rest)

    @cached_property
    def speeds(self) -> np.ndarray:
        """At the rest, (nv,) rad/s or m/s."""
        step = Step(self.model, self.model.opt.timestep, self.reading.integrator)
        step.put(self.rest)
        return step.data.qvel.copy()

    @property
    def creep(self) -> float:
        """The largest speed at the rest, rad/s or m/s."""
        return float(np.abs(self.speeds).max(initial=0.0))

    @property
    def falls(self) -> bool:
        """Whether nothing stops the fall of a free base."""
        return has_free_base(self.model) and not self.is_touching and self.left > FALLS

    @property
    def has_fallen(self) -> bool:
        """Whether a free body is far from where it was, and lies there or falls on; not one that floats."""
        is_far = bool(((np.abs(self.moved) > FALLEN) & of_base(self.model)).any())
        return is_far and (self.is_touching or self.falls)

    @property
    def moved(self) -> np.ndarray:
        """From the posture to its rest, (nv,) rad or m."""
        return distance(self.model, self.start, self.rest)

    @property
    def speed_names(self) -> tuple[str, ...]:
        return Coordinates(self.reading.tree.joint_names, self.reading.tree.kind).speeds

    @property
    def held_objects(self) -> str:
        """The names of the loose objects that are held where they are."""
        bodies = dict.fromkeys(self.model.dof_bodyid[self.still].tolist())
        return ", ".join(element_name(self.model, "body", body) for body in bodies)


def placed(reading: Reading, posture: Posture, contacts: bool) -> Place:
    """The place of a posture, with what it rests on."""
    model = reading.model if contacts else in_the_air(reading.model)
    q = np.array(posture.q) if posture.q else None
    start = start_of(model, reading.drive, posture.key, np.zeros(model.nv), q)
    rest = beyond_saddles(model, relaxed(model, start))
    step = Step(model, model.opt.timestep, reading.integrator)
    still = restless_objects(step, rest) if contacts else np.zeros(model.nv, bool)
    if still.any():
        step.put(rest)
        step.data.qvel[still] = 0.0
        rest = step.state()
    thrown = left_at(step, rest) > FALLS and touches(step, start)
    return Place(reading, posture, contacts, start, rest, still, thrown or touches(step, rest))


def touches(step: Step, state: np.ndarray) -> bool:
    """Whether a run from a state soon touches something."""
    return any(data.ncon for data in step.run(state, round(TOUCHES / step.dt)))


def restless_objects(step: Step, state: np.ndarray) -> np.ndarray:
    """Which speeds are those of loose objects that go on moving where the robot would rest, (nv,)."""
    loose, trees = loose_objects(step.model), np.array(step.model.dof_treeid)
    if not loose.any():
        return loose
    rest = rest_near(step, state)
    moves = (np.abs(rest.accelerations) > NEAR_REST) | (np.abs(rest.speeds) > MOVING)
    return loose & np.isin(trees, trees[moves])


def with_held(model: mujoco.MjModel, still: np.ndarray) -> mujoco.MjModel:
    """The model in which some speeds hardly change, whatever acts."""
    changed = mujoco.MjModel.__copy__(model)
    add_armature(changed, HELD_STILL * still)
    return changed


def beyond_saddles(model: mujoco.MjModel, state: np.ndarray) -> np.ndarray:
    """Where a model sinks to from a state, if that is a saddle; else the state."""
    dt = min(model.opt.timestep, 1e-3)
    for _ in range(MOST_SADDLES):
        coarse = tried(model, state, dt, "implicitfast")
        if not coarse.growth.rate:  # the usual case: a finer step need not be tried
            return state
        fine = tried(model, state, dt / FINE, "implicitfast")
        if not is_saddle(coarse, fine):
            return state
        along = fine.growth.shape[: model.nv].real
        by = np.zeros(fine.rest.step.size)
        by[: model.nv] = LEFT_BY * along / np.abs(along).max()
        state = relaxed(model, fine.rest.step.moved(fine.rest.state, by))
    return state


def standing_at(reading: Reading, posture: Posture) -> Place:
    """A posture with all that the file has on."""
    return placed(reading, posture, contacts=True)


def in_the_air_at(standing: Place) -> Place | None:
    """The same posture in the air; None: nothing touches it, and it rests."""
    if not standing.is_touching and not standing.falls:
        return None
    return placed(standing.reading, standing.posture, contacts=False)
