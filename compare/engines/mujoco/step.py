"""One step of a model with everything on: where it leads from a state, its derivative, and runs of it.

A deviation of a state is a movement of the positions (nv,), the speeds (nv,) and the activations (na,), in
this order.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

from .actuators import held_at
from .names import INTEGRATORS, bit, element_name, number_of_actuators, set_control
from .variants import Servo

STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # all that a step depends on
# what delays and yielding springs remember
REMEMBERED = sum(int(getattr(mujoco.mjtState, f"mjSTATE_{part}", 0)) for part in ("HISTORY", "PLASTIC"))
TOLERANCE, ITERATIONS, LINE_SEARCH = 1e-15, 200, 100  # of MuJoCo's solver: the force of constraints, exactly
NUDGE = 1e-7  # rad, m and their rates: of central differences
LITTLE = 1e-6  # of an activation at the start of a run that is pushed
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))
RELAXING = [name for name in ("implicitfast", "discrete") if name in INTEGRATORS]  # the second bears most
BAD = [int(getattr(mujoco.mjtWarning, f"mjWARN_BADQ{what}")) for what in ("POS", "VEL", "ACC")]
Act = Callable[[int], None]  # before a step of a run, by its number
# of models, which are not changed afterwards, for their steps; as long as they are in use
copies: WeakKeyDictionary[mujoco.MjModel, mujoco.MjModel] = WeakKeyDictionary()


def takes_transition(model: mujoco.MjModel, integrator: str) -> bool:
    """Whether mjd_transitionFD is right: it refuses RK4 and delays, and leaves what has yielded."""
    return integrator != "RK4" and not mujoco.mj_stateSize(model, REMEMBERED)


class Step:
    """A step of a model of dt, s, by an integrator's name.

    exact: the solver's tolerance is that of rounding; else the file's own settings. The steps of a model
    share a copy of it, as meshes are large: `put` sets the options.
    """

    def __init__(self, model: mujoco.MjModel, dt: float, integrator: str, exact: bool = True) -> None:
        if model not in copies:
            copies[model] = mujoco.MjModel.__copy__(model)
        self.model, self.dt, self.integrator = copies[model], dt, integrator
        self.options = options_of(model, exact) | {"timestep": dt, "integrator": INTEGRATORS[integrator]}
        self.set_options()
        self.data = mujoco.MjData(self.model)

    def set_options(self) -> None:
        for name, value in self.options.items():
            setattr(self.model.opt, name, value)

    @property
    def size(self) -> int:
        """Of a deviation."""
        return 2 * self.model.nv + self.model.na

    def state(self) -> np.ndarray:
        """The state that the data have."""
        return state_of(self.model, self.data)

    def put(self, state: np.ndarray, by: np.ndarray | None = None) -> None:
        """Set the data to a state, moved by a deviation."""
        m, d = self.model, self.data
        self.set_options()
        mujoco.mj_setState(m, d, state, STATE)
        if by is not None:
            mujoco.mj_integratePos(m, d.qpos, by[: m.nv], 1.0)
            d.qvel += by[m.nv : 2 * m.nv]
            d.act += by[2 * m.nv :]

    def moved(self, state: np.ndarray, by: np.ndarray) -> np.ndarray:
        self.put(state, by)
        return self.state()

    def after(self, state: np.ndarray, by: np.ndarray | None = None) -> np.ndarray:
        """How far a step leads from a state that is moved by a deviation, from the state itself."""
        m, d = self.model, self.data
        self.put(state)
        start, speed, activation = d.qpos.copy(), d.qvel.copy(), d.act.copy()
        self.put(state, by)
        mujoco.mj_step(m, d)
        movement = np.zeros(m.nv)
        mujoco.mj_differentiatePos(m, movement, 1.0, start, d.qpos)
        return np.concatenate([movement, d.qvel - speed, d.act - activation])

    def next(self, state: np.ndarray) -> np.ndarray:
        """The state after a step."""
        self.put(state)
        mujoco.mj_step(self.model, self.data)
        return self.state()

    def derivative(self, state: np.ndarray, nudge: float = NUDGE) -> np.ndarray:
        """The derivative of a step by the deviation of the state, (n, n), by differences to the two `sides`.

        MuJoCo's mjd_transitionFD is the same and faster, but does not have the ends of a range of
        activations.
        """
        sides, columns = self.sides(state, nudge), list[np.ndarray]()
        is_taken = takes_transition(self.model, self.integrator)
        if is_taken and all(ahead.any() and behind.any() for ahead, behind in sides):
            A = np.zeros((self.size, self.size))
            self.put(state)
            mujoco.mjd_transitionFD(self.model, self.data, nudge, True, A, None, None, None)
            return A
        for ahead, behind in sides:
            moved = self.after(state, ahead) - self.after(state, behind)
            columns.append(moved / (ahead - behind).sum())
        return np.array(columns).T

    def sides(self, state: np.ndarray, nudge: float) -> list[tuple[np.ndarray, np.ndarray]]:
        """The two deviations of each difference, (n,): to one side of an activation at the end of its range.

        A muscle's activation is never below 0, where its time constant is another one.
        """
        self.put(state)
        act, (low, high) = self.data.act.copy(), activation_ranges(self.model)
        ahead, behind = nudge * np.eye(self.size), -nudge * np.eye(self.size)
        first = 2 * self.model.nv
        ahead[first:] *= (act + nudge <= high)[:, None]
        behind[first:] *= (act - nudge >= low)[:, None]
        return list(zip(ahead, behind))

    def touching(self, state: np.ndarray, by: np.ndarray) -> set[str]:
        """The pairs of geoms whose contacts have forces at a moved state, and how many contacts each has."""
        self.put(state, by)
        mujoco.mj_forward(self.model, self.data)
        contacts = self.data.contact
        pairs = [tuple(pair) for pair in contacts.geom[contacts.efc_address >= 0].tolist()]
        names = [" and ".join(element_name(self.model, "geom", geom) for geom in pair) for pair in pairs]
        return {f"{name} ({pairs.count(pair)})" for pair, name in zip(pairs, names)}

    def lengths(self) -> np.ndarray:
        """Of all outputs of the actuators at the data's state."""
        mujoco.mj_fwdPosition(self.model, self.data)
        return self.data.actuator_length.copy()

    def commands(self, servos: Sequence[Servo]) -> np.ndarray:
        """What a program computes for its servos from the lengths and speeds of the data, (k,)."""
        length = self.lengths()
        mujoco.mj_fwdVelocity(self.model, self.data)
        speed = self.data.actuator_velocity
        return np.array([servo.force(length[servo.output], speed[servo.output]) for servo in servos])

    def by_control(self, state: np.ndarray, controls: np.ndarray) -> np.ndarray:
        """The derivative of a step by some of the controls, (n, k)."""

        def pushed(control: int, by: float) -> np.ndarray:
            self.put(state)
            self.data.ctrl[control] += by
            return self.after(self.state())

        columns = [(pushed(k, NUDGE) - pushed(k, -NUDGE)) / (2.0 * NUDGE) for k in controls.tolist()]
        return np.array(columns).reshape(-1, self.size).T

    def run(self, state: np.ndarray, steps: int, act: Act = lambda step: None) -> Iterator[mujoco.MjData]:
        """The data after each step of a run, until a number in it is bad."""
        self.put(state)
        self.data.warning.number[:] = 0
        for step in range(steps):
            act(step)
            mujoco.mj_step(self.model, self.data)
            if self.data.warning.number[BAD].any():
                return
            yield self.data

    def run_program(
        self, state: np.ndarray, servos: Sequence[Servo], steps: int, period: int, delay: int
    ) -> Iterator[mujoco.MjData]:
        """A run whose servos' controls a program reads every `period` steps; they act `delay` steps later."""
        places, read = [servo.control for servo in servos], []

        def act(step: int) -> None:
            if step % period == 0:
                read.append(self.commands(servos))
            if step >= delay:
                self.data.ctrl[places] = read[(step - delay) // period]

        return self.run(state, steps, act)

    def relaxed(self, state: np.ndarray, seconds: float, rate: float, still: float) -> np.ndarray:
        """Where a run leads whose speeds decay at a rate, 1/s, until nothing moves faster than `still`."""
        end = state
        for data in self.run(state, round(seconds / self.dt)):
            data.qvel *= 1.0 - rate * self.dt
            end = data
            if np.abs(data.qvel).max() < still and np.abs(data.qacc).max() < still / self.dt:
                break
        return state if end is state else self.state()


def options_of(model: mujoco.MjModel, exact: bool) -> dict[str, float]:
    """The options of the steps of a model beside their length and their integrator."""
    names = ("solver", "tolerance", "iterations", "ls_iterations")
    options: dict[str, float] = {name: getattr(model.opt, name) for name in names}
    no_islands = bit("ISLAND") if exact else 0  # with islands the zones of the rows are not kept
    options["disableflags"] = model.opt.disableflags | bit("AUTORESET") | no_islands
    options["enableflags"] = model.opt.enableflags & ~SLEEP  # a body that sleeps has no derivative
    if exact:
        options["solver"] = mujoco.mjtSolver.mjSOL_NEWTON
        options |= {"tolerance": TOLERANCE, "iterations": ITERATIONS, "ls_iterations": LINE_SEARCH}
    return options


class WholeRun(NamedTuple):
    """A run of a file's model as it is."""

    speeds: np.ndarray  # root mean square of all speeds in each part, rad/s and m/s; NaN from where it fails
    failed_at: float | None  # s: MuJoCo warns of a bad number; None: it runs on
    end: np.ndarray  # the last state


def whole_run(
    model: mujoco.MjModel, start: np.ndarray, dt: float, integrator: str, lasts: float, parts: int
) -> WholeRun:
    """A run from start_of a model with all that the file has, for `lasts` s or until it fails."""
    step, count = Step(model, dt, integrator, exact=False), max(1, round(lasts / parts / dt))
    squares = np.full(parts * count, np.nan)
    for k, data in enumerate(step.run(start, parts * count)):
        squares[k] = data.qvel @ data.qvel / model.nv
    speeds, failed = squares.reshape(parts, count).mean(axis=1), np.flatnonzero(~np.isfinite(squares))
    return WholeRun(np.sqrt(speeds), float(failed[0] + 1) * dt if len(failed) else None, step.state())


def start_of(
    model: mujoco.MjModel, drive: Any, key: str, push: np.ndarray, q: np.ndarray | None = None,
    controls: Sequence[float | None] = (),
) -> np.ndarray:  # fmt: skip
    """The state of a keyframe, or of qpos0 if the name is empty, with `push` (nv,) added to its speeds.

    q: other positions, (nq,), at rest. controls: u of each actuator, None: as it is.
    Where no controls are stated the targets of servos are the posture; activations
    are those of the keyframe, if it states any.
    """
    data, keys = mujoco.MjData(model), [element_name(model, "key", k) for k in range(model.nkey)]
    if key:
        mujoco.mj_resetDataKeyframe(model, data, keys.index(key))
    stated = data.act.copy()
    if q is not None:
        data.qpos[:], data.qvel[:] = q, 0.0
    data.qvel[:] += push
    mujoco.mj_fwdPosition(model, data)
    known = drive.stated.get(key, (None,) * len(drive.names))
    for i, held in enumerate(held_at(model, data.qpos).tolist()):
        asked, u = controls[i] if controls else None, held if known[i] is None else known[i]
        set_control(model, i, u if asked is None else asked, data.ctrl, data.act)
    if stated.any():
        data.act[:] = np.clip(stated, *activation_ranges(model))
    if push.any():  # activations, too: what is pushed nowhere stays where it is
        data.act[:] = np.clip(data.act + LITTLE, *activation_ranges(model))
    return state_of(model, data)


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def activation_ranges(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest value of each activation, (na,) each: infinite where it has no range."""
    low, high = np.full(model.na, -np.inf), np.full(model.na, np.inf)
    for actuator in range(number_of_actuators(model)):
        place = model.actuator_actadr[actuator] + model.actuator_actnum[actuator] - 1
        if model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_MUSCLE:
            low[place], high[place] = 0.0, 1.0
        elif model.actuator_actlimited[actuator]:
            low[place], high[place] = model.actuator_actrange[actuator]
    return low, high


def distance(model: mujoco.MjModel, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The movement from a state to another one, (nv,) rad or m."""
    data, movement = mujoco.MjData(model), np.zeros(model.nv)
    mujoco.mj_setState(model, data, start, STATE)
    before = data.qpos.copy()
    mujoco.mj_setState(model, data, end, STATE)
    mujoco.mj_differentiatePos(model, movement, 1.0, before, data.qpos)
    return movement
