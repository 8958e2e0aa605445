"""What a robot does: a motion of a file with everything on, which smaller models of the file repeat; and what it uses."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout

from .names import INTEGRATORS, bit, control_of, element_name, number_of_actuators

Array = np.ndarray
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
INPUTS = int(mujoco.mjtState.mjSTATE_CTRL) | int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
NEAR, SAMPLES = 0.01, 25  # m, and states of a motion: pairs that came so near are told
EARLY = 1e-9  # s: a control acts from the step that begins so shortly before it
ACTS = {  # what has a row of constraints, by the kinds of rows
    "equality": (mujoco.mjtConstraint.mjCNSTR_EQUALITY,),
    "joint": (mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT,),
    "tendon": (mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON, mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON),
}
TIMERS = {  # the stages of a step by MuJoCo's timers; of `sensors and rest` those that are taken from the whole
    "position": ("POS_KINEMATICS", "POS_INERTIA"),
    "collision": ("POS_COLLISION",),
    "constraint": ("POS_MAKE", "POS_PROJECT"),
    "velocity": ("VELOCITY",),
    "actuation": ("ACTUATION",),
    "solve": ("CONSTRAINT",),
}


@dataclass(frozen=True)
class Motion:
    """A motion, by the names of joints and actuators. Controls are constant between their times.

    start: qpos and qvel of each joint; activations, inputs: of each actuator, the inputs (times, its controls); forces: applied
    all the time, at the speeds of each joint, N m or N. points: names of sites whose places count too.
    """

    name: str
    duration: float  # s
    start: Mapping[str, tuple[Array, Array]]
    activations: Mapping[str, Array]
    times: Array  # s
    inputs: Mapping[str, Array]
    forces: Mapping[str, Array] = field(default_factory=dict)
    points: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        state: Array,
        name: str,
        duration: float,
        recorded: tuple[Array, Mapping[str, Array]] | None = None,
        points: tuple[str, ...] = (),
        speeds: Array | None = None,
        forces: Array | None = None,
    ) -> "Motion":
        """From a state, see linear.start_of. recorded: times, and controls (times,) of some actuators; speeds, forces: (nv,)."""
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        if speeds is not None:
            data.qvel[:] = speeds
        if forces is not None:
            data.qfrc_applied[:] = forces
        times, given = recorded or (np.zeros(1), {})
        start = {name: (data.qpos[q].copy(), data.qvel[v].copy()) for name, (q, v) in joints(model).items()}
        inputs, activations = {}, {}
        for actuator, (places, acts) in actuators(model).items():
            activations[actuator] = data.act[acts].copy()
            inputs[actuator] = np.tile(data.ctrl[places], (len(times), 1))
            if actuator in given:
                inputs[actuator][:, 0] = given[actuator]
        applied = {name: data.qfrc_applied[v].copy() for name, (_, v) in joints(model).items()}
        return cls(name, duration, start, activations, times, inputs, applied, points)

    def placed(self, model: mujoco.MjModel) -> mujoco.MjData:
        """The data of a model at the start."""
        data = mujoco.MjData(model)
        for name, (q, v) in joints(model).items():
            data.qpos[q], data.qvel[v] = self.start[name]
            data.qfrc_applied[v] = self.forces.get(name, 0.0)
        for actuator, (places, acts) in actuators(model).items():
            data.act[acts], data.ctrl[places] = self.activations[actuator], self.inputs[actuator][0]
        return data

    def controls(self, model: mujoco.MjModel, dt: float, steps: int) -> Array:
        """The controls of a model at each step, (steps, nu)."""
        at = np.searchsorted(self.times, dt * np.arange(steps) + EARLY, side="right") - 1
        controls = np.zeros((steps, model.nu))
        for actuator, (places, _) in actuators(model).items():
            controls[:, places] = self.inputs[actuator][np.maximum(at, 0)]
        return controls


def joints(model: mujoco.MjModel) -> dict[str, tuple[slice, slice]]:
    """The places in qpos and qvel of each joint."""
    places = {}
    ends = zip([*model.jnt_qposadr[1:], model.nq], [*model.jnt_dofadr[1:], model.nv])
    for number, (q, v) in enumerate(ends):
        start = model.jnt_qposadr[number], model.jnt_dofadr[number]
        places[element_name(model, "joint", number)] = slice(start[0], q), slice(start[1], v)
    return places


def actuators(model: mujoco.MjModel) -> dict[str, tuple[slice, slice]]:
    """The places in ctrl and act of each actuator."""
    places = {}
    for number in range(number_of_actuators(model)):
        control, count = control_of(model, number)
        act, acts = max(0, model.actuator_actadr[number]), model.actuator_actnum[number]
        name = element_name(model, "actuator", number)
        places[name] = slice(control, control + count), slice(act, act + acts)
    return places


class Path(NamedTuple):
    """Where a motion of a model leads: q (n + 1, nq), v (n + 1, nv), each dt, s; NaN from where it fails."""

    model: mujoco.MjModel
    dt: float
    q: Array
    v: Array

    def points(self, names: Iterable[str], every: int) -> Array:
        """Of sites each so many steps, (times, sites, 3) m."""
        data, places = mujoco.MjData(self.model), []
        for q in self.q[::every]:
            data.qpos[:] = q
            mujoco.mj_kinematics(self.model, data)
            places.append([data.site(name).xpos.copy() for name in names])
        return np.array(places)


class Simulation:
    """A motion by a model, a step, s, and an integrator; a call repeats it."""

    def __init__(self, model: mujoco.MjModel, motion: Motion, dt: float, integrator: str) -> None:
        self.model = mujoco.MjModel.__copy__(model)
        self.model.opt.timestep, self.model.opt.integrator = dt, INTEGRATORS[integrator]
        self.model.opt.disableflags |= bit("AUTORESET")
        self.dt, self.steps, self.data = dt, max(1, round(motion.duration / dt)), motion.placed(self.model)
        self.start = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, self.start, STATE)
        forces = np.tile(self.data.qfrc_applied, (self.steps, 1))
        self.inputs = np.hstack([motion.controls(self.model, dt, self.steps), forces])

    def __call__(self) -> Path:
        nq, nv = self.model.nq, self.model.nv
        states, _ = rollout.rollout(
            self.model, self.data, self.start, self.inputs[None], control_spec=INPUTS, nstep=self.steps
        )
        path = np.vstack([self.start, states[0]])[:, : 1 + nq + nv]
        failed = np.cumsum(~(np.diff(path[:, 0], prepend=-1.0) > 0.0)) > 0  # its clock stands still
        path[failed] = np.nan
        return Path(self.model, self.dt, path[:, 1 : 1 + nq], path[:, 1 + nq :])


def movements(path: Path, other: Path, among: Iterable[str] = ()) -> dict[str, float]:
    """How far two paths are apart at their common times: the largest of each joint that both have, rad or m, and point."""
    steps = max(path.dt, other.dt)
    every, every_other = round(steps / path.dt), round(steps / other.dt)
    q, whole = path.q[::every], other.q[::every_other]
    count = min(len(q), len(whole))
    places, same = joints(other.model), np.array(q[:count])
    for name, (columns, _) in joints(path.model).items():
        same[:, columns] = whole[:count, places[name][0]]
    apart = np.zeros((count, path.model.nv))
    for row, here, there in zip(apart, q, same):
        mujoco.mj_differentiatePos(path.model, row, 1.0, there, here)
    largest = {name: float(np.abs(apart[:, v]).max()) for name, (_, v) in joints(path.model).items()}
    if points := tuple(among):
        distances = path.points(points, every)[:count] - other.points(points, every_other)[:count]
        largest |= dict(zip(points, np.linalg.norm(distances, axis=2).max(axis=0).tolist()))
    return largest


def apart(path: Path, other: Path, motion: Motion) -> float:
    """How far a path is from that of another model of the motion, rad or m; inf where one of them fails."""
    largest = max(movements(path, other, motion.points).values(), default=0.0)
    return largest if np.isfinite(largest) else np.inf


@dataclass
class Use:
    """What a motion used: names of geoms that touched, of what acted, how far each joint moved."""

    geoms: set[str] = field(default_factory=set)
    pairs: set[tuple[str, str]] = field(default_factory=set)
    acted: dict[str, set[str]] = field(default_factory=lambda: {kind: set() for kind in (*ACTS, "actuator")})
    has_constraints: bool = False
    ranges: dict[str, float] = field(default_factory=dict)  # rad or m
    middle: dict[str, Array] = field(
        default_factory=dict
    )  # the mean positions of the joints; of one with a quaternion the start


def used(model: mujoco.MjModel, motion: Motion, dt: float, integrator: str) -> Use:
    """What the motion of a model uses, step by step."""
    simulation, use = Simulation(model, motion, dt, integrator), Use()
    m, d, nu = simulation.model, simulation.data, model.nu
    path, forces = [d.qpos.copy()], np.zeros(len(d.actuator_force))
    pairs, rows = set[tuple[int, int]](), set[tuple[int, int]]()
    for inputs in simulation.inputs:
        d.ctrl[:] = inputs[:nu]
        mujoco.mj_step(m, d)
        pairs.update(map(tuple, np.sort(d.contact.geom, axis=1).tolist()))
        acts = (d.efc_force != 0.0) | (d.efc_type != ACTS["equality"][0])
        rows.update(zip(d.efc_type[acts].tolist(), d.efc_id[acts].tolist()))
        use.has_constraints |= d.nefc > 0
        forces = np.maximum(forces, np.abs(d.actuator_force))
        path.append(d.qpos.copy())
    use.pairs = {(geom_name(m, one), geom_name(m, other)) for one, other in pairs}
    use.geoms = {name for pair in use.pairs for name in pair}
    for kind, types in ACTS.items():
        use.acted[kind] = {element_name(m, kind, number) for row, number in rows if row in types}
    for number in range(number_of_actuators(m)):
        if forces[number]:
            use.acted["actuator"].add(element_name(m, "actuator", number))
    q = np.array(path)
    still = Path(m, dt, np.tile(q[0], (len(q), 1)), q)
    use.ranges = movements(Path(m, dt, q, q), still)
    for name, (columns, _) in joints(m).items():
        is_number = columns.stop - columns.start == 1
        use.middle[name] = q[:, columns].mean(axis=0) if is_number else q[0, columns]
    return use


def couplings(path: Path, middle: Array) -> Array:
    """How far each speed would move each other one, were it locked at a position: (nv, nv) rad or m, moved by locked.

    Its own movement times its coupling through M, the largest at sampled states of a path.
    """
    model, data = path.model, mujoco.MjData(path.model)
    costs, inverse, moved = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    for q in path.q[:: max(1, len(path.q) // SAMPLES)]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mujoco.mj_solveM(model, data, inverse, np.eye(model.nv))
        mujoco.mj_differentiatePos(model, moved, 1.0, middle, q)
        costs = np.maximum(costs, np.abs(inverse / np.diag(inverse) * moved))
    return costs


def geom_name(model: mujoco.MjModel, number: int) -> str:
    return element_name(model, "geom", number)


def stages_of(simulation: Simulation) -> dict[str, float]:
    """Seconds of each stage of a step, by MuJoCo's own timers."""
    data, steps = simulation.data, simulation.steps
    mujoco.mj_setState(simulation.model, data, simulation.start, STATE)
    for inputs in simulation.inputs:
        data.ctrl[:] = inputs[: simulation.model.nu]
        mujoco.mj_step(simulation.model, data)
    timers = {name.removeprefix("mjTIMER_"): member for name, member in mujoco.mjtTimer.__members__.items()}
    taken = {
        name: data.timer[int(member)].duration / steps
        for name, member in timers.items()
        if name != "mjNTIMER"
    }
    seconds = {stage: sum(taken[name] for name in names) for stage, names in TIMERS.items()}
    return seconds | {"sensors and rest": taken["STEP"] - sum(seconds.values()), "whole step": taken["STEP"]}


def near(model: mujoco.MjModel, path: Path, touched: set[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """The pairs of geoms that came near and never touched, and their least distances at sampled states, m."""
    wide, data = mujoco.MjModel.__copy__(model), mujoco.MjData(model)
    pairs: dict[tuple[str, str], float] = {}
    wide.geom_margin += NEAR
    for q in path.q[:: max(1, len(path.q) // SAMPLES)]:
        data.qpos[:] = q
        mujoco.mj_fwdPosition(wide, data)
        for one, distance in zip(np.sort(data.contact.geom, axis=1).tolist(), data.contact.dist.tolist()):
            pair = geom_name(model, one[0]), geom_name(model, one[1])
            if pair not in touched and distance < pairs.get(pair, NEAR):
                pairs[pair] = distance
    return dict(sorted(pairs.items(), key=lambda item: item[1]))
