"""Motions of a file that smaller models of it repeat: how far those are from them, and what they use."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np

import tmt

from .names import control_of, element_name, number_of_actuators, output_of
from .stepper import Stepper, distance

if TYPE_CHECKING:
    from .smaller import Smaller

Array = np.ndarray
ACTS = {  # what has a row of constraints, by the kinds of rows
    "equality": (mujoco.mjtConstraint.mjCNSTR_EQUALITY,),
    "joint": (mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT,),
    "tendon": (mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON, mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON),
}

LIMITS = {int(ACTS[kind][0]): kind for kind in ("joint", "tendon")}


def joints(model: mujoco.MjModel) -> dict[str, tuple[slice, slice]]:
    """The places in qpos and qvel of each joint."""
    ends = [*model.jnt_qposadr.tolist(), model.nq], [*model.jnt_dofadr.tolist(), model.nv]
    q, v = ([slice(*pair) for pair in pairwise(places)] for places in ends)
    return {element_name(model, "joint", number): (q[number], v[number]) for number in range(model.njnt)}


def actuators(model: mujoco.MjModel) -> dict[str, tuple[slice, slice]]:
    """The places in ctrl and act of each actuator."""
    places = {}
    for number in range(number_of_actuators(model)):
        (first, count), act = control_of(model, number), max(0, model.actuator_actadr[number])
        acts = slice(act, act + model.actuator_actnum[number])
        places[element_name(model, "actuator", number)] = slice(first, first + count), acts
    return places


class Path(NamedTuple):
    """Where a motion of a model leads: q, (n + 1, nq), and v, (n + 1, nv); NaN from where it fails."""

    model: mujoco.MjModel
    q: Array
    v: Array


class Repeated:
    """A motion of a whole model, repeated by a smaller one.

    whole, state: from where, by a Stepper of the whole model. steps: how many. controls: at each step, (steps,
    nu) of the whole model; None: those of the state. key: a keyframe of the model from which it starts instead.
    What both have is the same by its name.
    """

    def __init__(
        self, stepper: Stepper, whole: Stepper, state: Array, steps: int, controls: Array | None = None,
        key: str = "",
    ) -> None:  # fmt: skip
        self.stepper, self.steps, self.controls = stepper, steps, None
        m, here, there = stepper.model, stepper.put(stepper.reset), whole.put(state)
        here.time, of_joints, of_actuators = there.time, joints(whole.model), actuators(whole.model)
        here.mocap_pos[:], here.mocap_quat[:] = there.mocap_pos, there.mocap_quat
        for name, (q, v) in joints(m).items():
            whole_q, whole_v = of_joints[name]
            here.qpos[q], here.qvel[v] = there.qpos[whole_q], there.qvel[whole_v]
            here.qfrc_applied[v] = there.qfrc_applied[whole_v]
        columns = list[int]()
        for name, (u, act) in actuators(m).items():
            whole_u, whole_act = of_actuators[name]
            here.ctrl[u], here.act[act] = there.ctrl[whole_u], there.act[whole_act]
            columns += range(whole_u.start, whole_u.stop)
        if key:
            forces = here.qfrc_applied.copy()
            mujoco.mj_resetDataKeyframe(m, here, m.key(key).id)
            here.qfrc_applied[:] = forces
        if controls is not None:
            self.controls = np.take(controls, columns, axis=1)
        self.state = stepper.state()

    def path(self) -> Path:
        rolled, start = self.stepper.roll(self.state, self.steps, self.controls), self.stepper.put(self.state)
        return Path(
            self.stepper.model, np.vstack([start.qpos, rolled.q[0]]), np.vstack([start.qvel, rolled.v[0]])
        )

    def watched(self) -> Iterator[mujoco.MjData]:
        """The data after each step; see Stepper.watch."""

        def act(step: int, data: mujoco.MjData) -> None:
            if self.controls is not None:
                data.ctrl[:] = self.controls[step]

        return self.stepper.watch(self.state, self.steps, act)


def places_of(path: Path, names: Iterable[str]) -> Array:
    """The places of sites along a path, (n + 1, sites, 3) m."""
    data, sites = mujoco.MjData(path.model), [path.model.site(name).id for name in names]
    places = np.zeros((len(path.q), len(sites), 3))
    for row, q in zip(places, path.q):
        data.qpos[:] = q
        mujoco.mj_kinematics(path.model, data)
        row[:] = data.site_xpos[sites]
    return places


def movements(path: Path, whole: Path, points: Sequence[str] = ()) -> dict[str, float]:
    """How far a path is from that of a whole model: the largest of each joint and point, rad or m, or NaN."""
    of_whole, here = joints(whole.model), joints(path.model)
    columns = [np.zeros((len(path.q), 0)), *(whole.q[:, of_whole[name][0]] for name in here)]
    apart = np.abs(distance(path.model, np.hstack(columns), path.q))
    largest = {name: float(apart[:, v].max()) for name, (_, v) in here.items()}
    if points:
        distances = np.linalg.norm(places_of(path, points) - places_of(whole, points), axis=2)
        largest |= dict(zip(points, distances.max(axis=0).tolist()))
    return largest


def apart(paths: Sequence[Path], others: Sequence[Path], points: Sequence[str] = ()) -> float:
    """How far the paths of a model are from those of a whole one, rad or m; inf where one of them fails."""
    largest = [list(movements(*pair, points).values()) for pair in zip(paths, others)]
    error = float(np.max(largest, initial=0.0))  # a NaN stays one
    return error if np.isfinite(error) else np.inf


class Use(NamedTuple):
    """What motions used: pairs of geoms that touched, what acted by kind, how far joints moved from the first start.

    middle: the mean positions of the joints; of a joint with a quaternion the start.
    """

    pairs: set[tuple[str, str]]
    acted: dict[str, set[str]]
    has_constraints: bool
    moved: dict[str, float]
    middle: dict[str, Array]

    @property
    def geoms(self) -> set[str]:
        return {name for pair in self.pairs for name in pair}

    def parts(self, m: mujoco.MjModel) -> dict[str, tuple[int | None, set[str]]]:
        """By the kind of a part how many the model has, None: not known, and the names of those that acted."""
        return {
            "geoms that touch": (int(((m.geom_contype | m.geom_conaffinity) != 0).sum()), self.geoms),
            "pairs that touch": (None, {" and ".join(pair) for pair in self.pairs}),
            "limits of joints": (int(m.jnt_limited.sum()), self.acted["joint"]),
            "limits and friction of tendons": (m.ntendon, self.acted["tendon"]),
            "equalities": (m.neq, self.acted["equality"]),
            "actuators": (number_of_actuators(m), self.acted["actuator"]),
        }


def used(motions: Sequence[Repeated], paths: Sequence[Path]) -> Use:
    """What the motions of a model use, step by step; paths: where they lead."""
    m, most_rows, forces = motions[0].stepper.model, 0, np.zeros_like(motions[0].stepper.data.actuator_force)
    pairs, rows = set[tuple[int, int]](), set[tuple[int, int]]()
    for motion in motions:
        for d in motion.watched():
            pairs.update(map(tuple, np.sort(d.contact.geom, axis=1).tolist()))
            acts = (d.efc_force != 0.0) | (d.efc_type != ACTS["equality"][0])
            rows.update(zip(d.efc_type[acts].tolist(), d.efc_id[acts].tolist()))
            most_rows, forces = max(most_rows, d.nefc), np.maximum(forces, np.abs(d.actuator_force))
    acted = {"actuator": {name for i, name in enumerate(actuators(m)) if forces[output_of(m, i)]}}
    for kind, types in ACTS.items():
        acted[kind] = {element_name(m, kind, number) for row, number in rows if row in types}
    q, middle, moved = np.vstack([path.q for path in paths]), {}, dict.fromkeys(joints(m), 0.0)
    for path in paths:
        still = Path(m, np.tile(q[0], (len(path.q), 1)), path.v)
        moved = {name: max(moved[name], largest) for name, largest in movements(path, still).items()}
    for name, (columns, _) in joints(m).items():
        is_number = columns.stop - columns.start == 1
        middle[name] = q[:, columns].mean(axis=0) if is_number else q[0, columns]
    return Use({pair_of(m, pair) for pair in pairs}, acted, most_rows > 0, moved, middle)


def pair_of(model: mujoco.MjModel, numbers: Iterable[int]) -> tuple[str, str]:
    one, other = (element_name(model, "geom", number) for number in numbers)
    return one, other


def acting(m: mujoco.MjModel, data: mujoco.MjData) -> set[str]:
    """The pairs of geoms that touch, with the number of their contacts, and the limits that act."""
    pairs = [tuple(sorted(pair)) for pair in data.contact.geom[data.contact.efc_address >= 0].tolist()]
    found = {f"{' and '.join(pair_of(m, pair))} ({pairs.count(pair)})" for pair in pairs}
    rows = zip(data.efc_type.tolist(), data.efc_id.tolist())
    return found | {
        f"limit of {element_name(m, LIMITS[kind], owner)}" for kind, owner in rows if kind in LIMITS
    }


class Roll(NamedTuple):
    """What Stepper.roll takes: a state of the whole model; controls at each step, (steps, nu), None: its own."""

    name: str
    state: Array
    steps: int
    controls: Array | None = None


@dataclass
class Scene:
    """Motions of a whole model by its own step and integrator.

    points: sites whose places count too. small: what is left of the model, None: all.
    """

    tree: tmt.Tree
    whole: "Smaller"
    stepper: Stepper
    rolls: Sequence[Roll]
    points: tuple[str, ...] = ()
    small: "Smaller | None" = None

    @property
    def left(self) -> "Smaller":
        return self.small or self.whole

    @property
    def name(self) -> str:
        return "; ".join(roll.name for roll in self.rolls)

    @property
    def duration(self) -> float:
        return self.stepper.dt * sum(roll.steps for roll in self.rolls)

    def repeated(self, small: "Smaller", from_keys: bool = False) -> list[Repeated]:
        """Its motions by a smaller model. from_keys: from the keyframes of their names."""
        stepper = Stepper(small.model, self.stepper.dt, self.stepper.integrator)
        return [
            Repeated(stepper, self.stepper, *roll[1:], key=roll.name if from_keys else "")
            for roll in self.rolls
        ]

    def run(self, small: "Smaller", from_keys: bool = False) -> list[Path]:
        return [motion.path() for motion in self.repeated(small, from_keys)]

    def timed(self, small: "Smaller") -> Callable[[], object]:
        """The same as one call, to be timed."""
        loops = [
            motion.stepper.loop(motion.state, motion.steps, motion.controls)
            for motion in self.repeated(small)
        ]
        return lambda: [loop() for loop in loops]

    @cached_property
    def paths(self) -> list[Path]:
        """Of the whole model."""
        return self.run(self.whole)

    @property
    def is_finite(self) -> bool:
        return all(np.isfinite(path.q).all() for path in self.paths)

    @cached_property
    def use(self) -> Use:
        return used(self.repeated(self.whole), self.paths)

    def error(self, small: "Smaller", from_keys: bool = False) -> float:
        """How far a model is from the whole one, rad or m; inf where its run fails."""
        return apart(self.run(small, from_keys), self.paths, self.points)

    def recipe(self, small: "Smaller", file: str, error: float) -> dict[str, Any] | None:
        """How plain MuJoCo repeats the error of a file with a smaller model, rad or m; None: controls change on the way.

        places: of the whole model's positions, those that the smaller one has. Each motion starts from a keyframe of its name.
        """
        if self.points or any(roll.controls is not None for roll in self.rolls):
            return None
        of_whole = joints(self.whole.model)
        places = [k for name in joints(small.model) for k in range(self.whole.model.nq)[of_whole[name][0]]]
        return {
            "file": file, "dt": self.stepper.dt, "integrator": self.stepper.integrator, "places": places, "error": error,
            "motions": [
                {"key": roll.name, "steps": roll.steps, "start": self.stepper.as_fields(roll.state)} for roll in self.rolls
            ],
        }  # fmt: skip

    def starts(self, small: "Smaller") -> Iterator[tuple[str, mujoco.MjData]]:
        """The names of the motions, and in turn the data of a model at their starts."""
        for roll, repeated in zip(self.rolls, self.repeated(small)):
            yield roll.name, repeated.stepper.put(repeated.state)
