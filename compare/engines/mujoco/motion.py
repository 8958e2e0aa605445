"""Motions of a file with everything on, which smaller models of the file repeat; and what they use."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout

from .names import INTEGRATORS, bit, element_name, number_of_actuators

Array = np.ndarray
HELD = "QFRC_APPLIED", "MOCAP_POS", "MOCAP_QUAT"
STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
INPUTS = sum(int(getattr(mujoco.mjtState, f"mjSTATE_{name}")) for name in ("CTRL", *HELD))
NEAR, SAMPLES = 0.01, 25  # m, and states of a motion: pairs that came so near are told
EARLY = 1e-9  # s: a control acts from the step that begins so shortly before it
ACTS = {  # what has a row of constraints, by the kinds of rows
    "equality": (mujoco.mjtConstraint.mjCNSTR_EQUALITY,),
    "joint": (mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT,),
    "tendon": (mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON, mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON),
}
TIMERS = {  # the stages of a step by MuJoCo's timers
    "position": ("POS_KINEMATICS", "POS_INERTIA"),
    "collision": ("POS_COLLISION",),
    "constraint": ("POS_MAKE", "POS_PROJECT"),
    "velocity": ("VELOCITY",),
    "actuation": ("ACTUATION",),
    "solve": ("CONSTRAINT",),
}


def joints(model: mujoco.MjModel) -> dict[str, tuple[slice, slice]]:
    """The places in qpos and qvel of each joint."""
    ends = [*model.jnt_qposadr.tolist(), model.nq], [*model.jnt_dofadr.tolist(), model.nv]
    q, v = ([slice(*pair) for pair in pairwise(places)] for places in ends)
    return {element_name(model, "joint", number): (q[number], v[number]) for number in range(model.njnt)}


def data_at(model: mujoco.MjModel, state: Array, whole: mujoco.MjModel) -> mujoco.MjData:
    """The data of the whole model, which may have fewer bodies, at a state of step.start_of of a model."""
    data, shared = mujoco.MjData(whole), np.zeros(mujoco.mj_stateSize(model, STATE | INPUTS))
    mujoco.mj_extractState(model, state, mujoco.mjtState.mjSTATE_INTEGRATION, shared, STATE | INPUTS)
    mujoco.mj_setState(whole, data, shared, STATE | INPUTS)
    return data


@dataclass(frozen=True)
class Motion:
    """A motion of a whole model, which smaller ones repeat; controls are constant between times.

    start: the state, and what acts all the time: forces, and where bodies are held. inputs: the controls of
    each actuator, (times, controls of it).
    """

    name: str
    duration: float  # s
    start: mujoco.MjData
    times: Array  # s
    inputs: Mapping[str, Array]

    def placed(self, model: mujoco.MjModel) -> mujoco.MjData:
        """The data of a model at the start."""
        data, start = mujoco.MjData(model), self.start
        whole_joints, whole_actuators = list(joints(start.model)), actuators(start.model)
        for number, joint in enumerate(joints(model)):
            here, there = data.joint(number), start.joint(whole_joints.index(joint))
            here.qpos[:], here.qvel[:], here.qfrc_applied[:] = there.qpos, there.qvel, there.qfrc_applied
        for number, actuator in enumerate(actuators(model)):
            data.actuator(number).ctrl[:] = self.inputs[actuator][0]
            place = activations(start.model, whole_actuators.index(actuator))
            data.act[activations(model, number)] = start.act[place]
        data.mocap_pos[:], data.mocap_quat[:] = start.mocap_pos, start.mocap_quat
        return data

    def controls(self, model: mujoco.MjModel, dt: float, steps: int) -> Array:
        """The controls of a model at each step, (steps, nu)."""
        at = np.searchsorted(self.times, dt * np.arange(steps) + EARLY, side="right") - 1
        inputs = [np.zeros((len(self.times), 0)), *(self.inputs[name] for name in actuators(model))]
        return np.hstack(inputs)[np.maximum(at, 0)]


def actuators(model: mujoco.MjModel) -> list[str]:
    return [element_name(model, "actuator", number) for number in range(number_of_actuators(model))]


def inputs_of(data: mujoco.MjData, times: int) -> dict[str, Array]:
    """The controls of the data at a number of times, see Motion."""
    names = enumerate(actuators(data.model))
    return {name: np.tile(data.actuator(number).ctrl, (times, 1)) for number, name in names}


def activations(model: mujoco.MjModel, actuator: int) -> slice:
    """The place in act of an actuator."""
    first = max(0, model.actuator_actadr[actuator])
    return slice(first, first + model.actuator_actnum[actuator])


class Path(NamedTuple):
    """Where a motion of a model leads: q (n + 1, nq), v (n + 1, nv), each dt, s; NaN from where it fails."""

    model: mujoco.MjModel
    dt: float
    q: Array
    v: Array

    @property
    def samples(self) -> Array:
        """Some of its positions, (states, nq)."""
        return self.q[:: max(1, len(self.q) // SAMPLES)]

    def points(self, names: Iterable[str], every: int) -> Array:
        """Of sites, after every given number of steps, (times, sites, 3) m."""
        data, places = mujoco.MjData(self.model), []
        for q in self.q[::every]:
            data.qpos[:] = q
            mujoco.mj_kinematics(self.model, data)
            places.append([data.site(name).xpos.copy() for name in names])
        return np.array(places)


class Simulation:
    """Motions by a model, a step, s, and an integrator; a call repeats them."""

    def __init__(self, model: mujoco.MjModel, motions: Iterable[Motion], dt: float, integrator: str) -> None:
        self.model = mujoco.MjModel.__copy__(model)
        self.model.opt.timestep, self.model.opt.integrator = dt, INTEGRATORS[integrator]
        self.model.opt.disableflags |= bit("AUTORESET")
        self.dt, self.runs, self.data = dt, list[tuple[Array, Array]](), mujoco.MjData(self.model)
        for motion in motions:
            data, steps = motion.placed(self.model), max(1, round(motion.duration / dt))
            start = np.zeros(mujoco.mj_stateSize(self.model, STATE))
            mujoco.mj_getState(self.model, data, start, STATE)
            held = np.r_[data.qfrc_applied, data.mocap_pos.ravel(), data.mocap_quat.ravel()]
            inputs = np.hstack([motion.controls(self.model, dt, steps), np.tile(held, (steps, 1))])
            self.runs.append((start, inputs))
        self.steps = sum(len(inputs) for _, inputs in self.runs)

    def __call__(self) -> list[Path]:
        nq, nv, paths = self.model.nq, self.model.nv, []
        for start, inputs in self.runs:
            options = {"control_spec": INPUTS, "nstep": len(inputs)}
            states, _ = rollout.rollout(self.model, self.data, start, inputs[None], **options)
            path = np.vstack([start, states[0]])[:, : 1 + nq + nv]
            failed = np.cumsum(~(np.diff(path[:, 0], prepend=-1.0) > 0.0)) > 0  # its clock stands still
            path[failed] = np.nan
            paths.append(Path(self.model, self.dt, path[:, 1 : 1 + nq], path[:, 1 + nq :]))
        return paths

    def stepped(self) -> Iterator[mujoco.MjData]:
        """The data at each start, before the first step, and after each step."""
        for start, inputs in self.runs:
            mujoco.mj_resetData(self.model, self.data)
            mujoco.mj_setState(self.model, self.data, start, STATE)
            yield self.data
            for row in inputs:
                mujoco.mj_setState(self.model, self.data, row, INPUTS)
                mujoco.mj_step(self.model, self.data)
                yield self.data


def movements(path: Path, other: Path, among: Iterable[str] = ()) -> dict[str, float]:
    """How far two paths are apart at common times: the largest of each common joint and point, rad or m."""
    steps = max(path.dt, other.dt)
    every, every_other = round(steps / path.dt), round(steps / other.dt)
    q, whole = path.q[::every], other.q[::every_other]
    count = min(len(q), len(whole))
    places = joints(other.model)
    same = np.hstack([whole[:count, places[name][0]] for name in joints(path.model)])
    apart = np.zeros((count, path.model.nv))
    for row, here, there in zip(apart, q[:count], same):
        mujoco.mj_differentiatePos(path.model, row, 1.0, there, here)
    largest = {name: float(np.abs(apart[:, v]).max()) for name, (_, v) in joints(path.model).items()}
    if points := tuple(among):
        distances = path.points(points, every)[:count] - other.points(points, every_other)[:count]
        largest |= dict(zip(points, np.linalg.norm(distances, axis=2).max(axis=0).tolist()))
    return largest


def apart(paths: Sequence[Path], others: Sequence[Path], points: Iterable[str] = ()) -> float:
    """How far the paths of a model are from those of another one, rad or m; inf where one of them fails."""
    largest = [list(movements(*pair, points).values()) for pair in zip(paths, others)]
    error = float(np.max(largest, initial=0.0))  # a NaN stays one
    return error if np.isfinite(error) else np.inf


class Use(NamedTuple):
    """What motions used: pairs of geoms that touched, what acted by kind, how far joints moved.

    middle: the mean positions of the joints; of a joint with a quaternion the start.
    """

    pairs: set[tuple[str, str]]
    acted: dict[str, set[str]]
    has_constraints: bool
    ranges: dict[str, float]
    middle: dict[str, Array]

    @property
    def geoms(self) -> set[str]:
        return {name for pair in self.pairs for name in pair}


def used(simulation: Simulation) -> Use:
    """What the motions of a model use, step by step."""
    m, path, most_rows, forces = simulation.model, [], 0, np.zeros(len(simulation.data.actuator_force))
    pairs, rows = set[tuple[int, int]](), set[tuple[int, int]]()
    for d in simulation.stepped():
        pairs.update(map(tuple, np.sort(d.contact.geom, axis=1).tolist()))
        acts = (d.efc_force != 0.0) | (d.efc_type != ACTS["equality"][0])
        rows.update(zip(d.efc_type[acts].tolist(), d.efc_id[acts].tolist()))
        most_rows, forces = max(most_rows, d.nefc), np.maximum(forces, np.abs(d.actuator_force))
        path.append(d.qpos.copy())
    acted = {"actuator": {name for name, force in zip(actuators(m), forces) if force}}
    for kind, types in ACTS.items():
        acted[kind] = {element_name(m, kind, number) for row, number in rows if row in types}
    q, middle = np.array(path), {}
    still = np.tile(q[0], (len(q), 1))
    ranges = movements(Path(m, simulation.dt, q, q), Path(m, simulation.dt, still, q))
    for name, (columns, _) in joints(m).items():
        is_number = columns.stop - columns.start == 1
        middle[name] = q[:, columns].mean(axis=0) if is_number else q[0, columns]
    return Use({pair_of(m, pair) for pair in pairs}, acted, most_rows > 0, ranges, middle)


def pair_of(model: mujoco.MjModel, numbers: Iterable[int]) -> tuple[str, str]:
    one, other = (element_name(model, "geom", number) for number in numbers)
    return one, other


def couplings(model: mujoco.MjModel, positions: Array, middle: Array) -> Array:
    """How far each speed would move each other one, were it locked: (nv, nv) rad or m, moved by locked.

    Its own movement times its coupling through M, the largest at positions (times, nq).
    """
    data = mujoco.MjData(model)
    costs, inverse, moved = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    for q in positions:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mujoco.mj_solveM(model, data, inverse, np.eye(model.nv))
        mujoco.mj_differentiatePos(model, moved, 1.0, middle, q)
        costs = np.maximum(costs, np.abs(inverse / np.diag(inverse) * moved))
    return costs


def stages_of(simulation: Simulation) -> dict[str, float]:
    """The time of each stage of a step, us, by MuJoCo's timers: medians, as a step may be interrupted."""
    durations = np.array([data.timer.duration.copy() for data in simulation.stepped()])
    steps = 1e6 * np.median(np.diff(durations, axis=0), axis=0)

    def taken(*names: str) -> float:
        return float(sum(steps[int(getattr(mujoco.mjtTimer, f"mjTIMER_{name}"))] for name in names))

    stages, whole = {stage: taken(*names) for stage, names in TIMERS.items()}, taken("STEP")
    return stages | {"sensors and rest": whole - sum(stages.values()), "whole step": whole}


def near(
    model: mujoco.MjModel, positions: Array, touched: set[tuple[str, str]]
) -> dict[tuple[str, str], float]:
    """The pairs of geoms that came near and never touched, and their least distances, m, nearest first."""
    wide, data = mujoco.MjModel.__copy__(model), mujoco.MjData(model)
    pairs: dict[tuple[str, str], float] = {}
    wide.geom_margin += NEAR
    for q in positions:
        data.qpos[:] = q
        mujoco.mj_fwdPosition(wide, data)
        for numbers, distance in zip(np.sort(data.contact.geom, axis=1), data.contact.dist.tolist()):
            pair = pair_of(wide, numbers)
            if pair not in touched and distance < pairs.get(pair, NEAR):
                pairs[pair] = distance
    return dict(sorted(pairs.items(), key=lambda item: item[1]))
