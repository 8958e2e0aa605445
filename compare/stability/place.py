"""Where a file's limits are asked for: a posture, with its contacts or in the air, and where the robot rests there."""

from dataclasses import dataclass, replace
from functools import cached_property

import mujoco
import numpy as np

import tmt

from ..engines.mujoco.reading import Reading
from ..engines.mujoco.step import Step, distance, start_of
from ..engines.mujoco.variants import has_free_base, in_the_air, of_base, without_dry_friction
from ..robots.coordinates import Coordinates
from .limits import SADDLE, grows_by_itself, tried
from .rest import Rest, relaxed

FINE = 4  # fold: steps of the file's own, and finer, at which a saddle is known
LEFT_BY = 0.02  # rad or m: the movement along its mode with which a saddle is left
MOST_SADDLES = 3  # that are left one after the other
FALLEN = 0.5  # rad or m: the movement of a free body that is a fall
FALLS = 1.0  # m/s2: what is still accelerated so at the end of a relaxed run is held by nothing


@dataclass(frozen=True)
class Place:
    """A posture of a file, and where it rests.

    contacts: with them, or in the air: without contacts, and without gravity if the base is free. start, rest: MuJoCo's states.
    """

    reading: Reading
    posture: str
    contacts: bool
    start: np.ndarray
    rest: np.ndarray
    touching: int  # contacts at rest
    left: float  # rad/s2 or m/s2: the acceleration at the rest
    creep: np.ndarray  # (nv,): its speeds

    @cached_property
    def model(self) -> mujoco.MjModel:
        return self.reading.model if self.contacts else in_the_air(self.reading.model)

    @cached_property
    def frictionless(self) -> mujoco.MjModel | None:
        """The model without dry friction of joints and tendons; None: it has none."""
        return without_dry_friction(self.model)

    @property
    def tree(self) -> tmt.Tree:
        return replace(self.reading.tree, gravity=tuple(self.model.opt.gravity))

    @property
    def surroundings(self) -> str:
        if not self.contacts:
            return "air"
        return "contact" if self.touching else "free"

    @property
    def has_fallen(self) -> bool:
        """Whether a free body is far from where it was: a walker that lies."""
        far = np.abs(self.moved) > FALLEN
        return bool((far & of_base(self.model)).any())

    @property
    def moved(self) -> np.ndarray:
        """From the posture to its rest, (nv,) rad or m."""
        return distance(self.model, self.start, self.rest)

    @property
    def speed_names(self) -> tuple[str, ...]:
        return Coordinates(self.reading.tree.joint_names, self.reading.tree.kind).speeds


def placed(reading: Reading, posture: str, key: str, q: np.ndarray | None, contacts: bool) -> Place:
    """The place of a keyframe (key; "": qpos0), or of positions q (nq,), with what it rests on."""
    model = reading.model if contacts else in_the_air(reading.model)
    start = start_of(model, reading.drive, key, np.zeros(model.nv), q)
    rest = beyond_saddles(model, relaxed(model, start))
    step = Step(model, model.opt.timestep, reading.integrator)
    found = Rest.at(step, rest)
    return Place(reading, posture, contacts, start, rest, step.contacts(), found.left, found.speeds)


def beyond_saddles(model: mujoco.MjModel, state: np.ndarray) -> np.ndarray:
    """Where a model sinks to from a state, if that is a saddle; else the state."""
    dt = min(model.opt.timestep, 1e-3)
    for _ in range(MOST_SADDLES):
        coarse, fine = (tried(model, state, step, "implicitfast") for step in (dt, dt / FINE))
        if not (grows_by_itself(coarse, fine) and fine.growth.rate > SADDLE):
            return state
        along = fine.growth.shape[: model.nv].real
        by = np.zeros(fine.rest.step.size)
        by[: model.nv] = LEFT_BY * along / np.abs(along).max()
        state = relaxed(model, fine.rest.step.moved(fine.rest.state, by))
    return state


def standing_at(reading: Reading, posture: str, key: str, q: np.ndarray | None = None) -> Place:
    """A posture with all that the file has on. key: of a keyframe, "": qpos0; q: other positions, (nq,)."""
    return placed(reading, posture, key, q, contacts=True)


def in_the_air_at(standing: Place, key: str, q: np.ndarray | None = None) -> Place | None:
    """The same posture in the air; None: nothing touches it, and it rests."""
    has_fallen = has_free_base(standing.reading.model) and standing.left > FALLS
    if not standing.touching and not has_fallen:
        return None
    return placed(standing.reading, standing.posture, key, q, contacts=False)
