"""Motions of a model that another one repeats: how far it is from them, and what they use."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np

from .names import control_of, element_name, number_of_actuators, output_of
from .stepper import Stepper, distance

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


class Roll(NamedTuple):
    """A motion of a Stepper's model: from a state, with controls at each step, (steps, nu), None: the state's."""

    name: str
    state: Array
    steps: int
    controls: Array | None = None


def carried(roll: Roll, whole: Stepper, stepper: Stepper, from_key: bool = False) -> Roll:
    """The motion of a whole model for another one: what both have is the same by its name.

    from_key: it starts at the keyframe of its name instead.
    """
    m, here, there = stepper.model, stepper.put(stepper.reset), whole.put(roll.state)
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
    if from_key:
        forces = here.qfrc_applied.copy()
        mujoco.mj_resetDataKeyframe(m, here, m.key(roll.name).id)
        here.qfrc_applied[:] = forces
    controls = None if roll.controls is None else np.take(roll.controls, columns, axis=1)
    return Roll(roll.name, stepper.state(), roll.steps, controls)


class Path(NamedTuple):
    """Where a motion of a model leads: q, (n + 1, nq), and v, (n + 1, nv); NaN from where it fails."""

    model: mujoco.MjModel
    q: Array
    v: Array


def path_of(stepper: Stepper, roll: Roll) -> Path:
    rolled, start = stepper.roll(*roll[1:]), stepper.put(roll.state)
    return Path(stepper.model, np.vstack([start.qpos, rolled.q[0]]), np.vstack([start.qvel, rolled.v[0]]))


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


def used(stepper: Stepper, rolls: Sequence[Roll], paths: Sequence[Path]) -> Use:
    """What the motions of a model use, step by step; paths: where they lead."""
    m, most_rows, forces = stepper.model, 0, np.zeros_like(stepper.data.actuator_force)
    pairs, rows = set[tuple[int, int]](), set[tuple[int, int]]()
    for roll in rolls:
        for d in stepper.watch(roll.state, roll.steps, roll.controls):
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
    rows = [row for row in zip(data.efc_type.tolist(), data.efc_id.tolist()) if row[0] in LIMITS]
    return found | {f"limit of {element_name(m, LIMITS[kind], owner)}" for kind, owner in rows}
