"""One step of a compiled model with everything on: where it leads from a state, its derivative, and runs of it.

A deviation of a state is a movement of the positions (nv,), the speeds (nv,) and the activations (na,), in this order.
"""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from .names import INTEGRATORS, bit, number_of_actuators
from .variants import Servo

STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # all that a step depends on
TOLERANCE, ITERATIONS, LINE_SEARCH = 1e-15, 200, 100  # of MuJoCo's solver: the force of constraints, exactly
NUDGE = 1e-7  # rad, m and their rates: of central differences
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))
RELAXING = [name for name in ("implicitfast", "discrete") if name in INTEGRATORS]  # the second bears most
BAD = [int(getattr(mujoco.mjtWarning, f"mjWARN_BADQ{what}")) for what in ("POS", "VEL", "ACC")]


class Step:
    """A step of a model of dt, s, by an integrator's name; the model is copied.

    exact: the solver's tolerance is that of rounding; else the file's own settings.
    """

    def __init__(self, model: mujoco.MjModel, dt: float, integrator: str, exact: bool = True) -> None:
        self.model = mujoco.MjModel.__copy__(model)
        self.dt, self.integrator = dt, integrator
        option = self.model.opt
        option.timestep, option.integrator = dt, INTEGRATORS[integrator]
        option.disableflags |= bit("AUTORESET")
        option.enableflags &= ~SLEEP  # a body that sleeps has no derivative
        if exact:
            option.disableflags |= bit("ISLAND")  # with islands the zones of the rows are not kept
            option.solver = mujoco.mjtSolver.mjSOL_NEWTON
            option.tolerance, option.iterations, option.ls_iterations = TOLERANCE, ITERATIONS, LINE_SEARCH
        self.data = mujoco.MjData(self.model)

    @property
    def size(self) -> int:
        """Of a deviation."""
        return 2 * self.model.nv + self.model.na

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in self.__dict__.items() if name != "data"}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.data = mujoco.MjData(self.model)

    def state(self) -> np.ndarray:
        """The state that the data have."""
        state = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def put(self, state: np.ndarray, by: np.ndarray | None = None) -> None:
        """Set the data to a state, moved by a deviation."""
        m, d = self.model, self.data
        mujoco.mj_setState(m, d, state, STATE)
        if by is not None:
            mujoco.mj_integratePos(m, d.qpos, by[: m.nv], 1.0)
            d.qvel += by[m.nv : 2 * m.nv]
            d.act += by[2 * m.nv :]

    def moved(self, state: np.ndarray, by: np.ndarray) -> np.ndarray:
        self.put(state, by)
        return self.state()

    def after(self, state: np.ndarray, by: np.ndarray | None = None) -> np.ndarray:
        """How far one step leads from a state that is moved by a deviation, measured from the state itself."""
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
        """The derivative of a step by the deviation of the state, (n, n), by differences to the two `sides`."""
        columns = [
            (self.after(state, ahead) - self.after(state, behind)) / (ahead - behind).sum()
            for ahead, behind in self.sides(state, nudge)
        ]
        return np.array(columns).T

    def sides(self, state: np.ndarray, nudge: float) -> list[tuple[np.ndarray, np.ndarray]]:
        """The two deviations of each difference, (n,): to both sides, of an activation at the end of its range to one.

        A muscle's activation is never below 0, where its time constant is another one.
        """
        self.put(state)
        act, (low, high) = self.data.act.copy(), activation_ranges(self.model)
        ahead, behind = nudge * np.eye(self.size), -nudge * np.eye(self.size)
        for place in range(self.model.na):
            column = 2 * self.model.nv + place
            ahead[column] *= act[place] + nudge <= high[place]
            behind[column] *= act[place] - nudge >= low[place]
        return list(zip(ahead, behind))

    def contacts(self) -> int:
        """The number of contacts of the data."""
        return int(self.data.ncon)

    def lengths(self) -> np.ndarray:
        """Of all outputs of the actuators at the data's state."""
        mujoco.mj_fwdPosition(self.model, self.data)
        return self.data.actuator_length.copy()

    def commands(
        self, servos: Sequence[Servo], state: np.ndarray, by: np.ndarray | None = None
    ) -> np.ndarray:
        """What a program computes for its servos from the lengths and speeds of a state that is moved, (k,)."""
        self.put(state, by)
        return self.commands_now(servos)

    def commands_now(self, servos: Sequence[Servo]) -> np.ndarray:
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        length, speed = self.data.actuator_length, self.data.actuator_velocity
        return np.array([servo.force(length[servo.output], speed[servo.output]) for servo in servos])

    def by_control(self, state: np.ndarray, controls: np.ndarray, nudge: float = NUDGE) -> np.ndarray:
        """The derivative of a step by some of the controls, (n, k)."""
        columns = []
        for control in controls:
            ends = []
            for sign in (1.0, -1.0):
                self.put(state)
                self.data.ctrl[control] += sign * nudge
                ends.append(self.after(self.state()))
            columns.append((ends[0] - ends[1]) / (2.0 * nudge))
        return np.array(columns).reshape(-1, self.size).T

    def run(self, state: np.ndarray, steps: int) -> Iterator[mujoco.MjData]:
        """The data after each step of a run, until a number in it is bad."""
        self.put(state)
        self.data.warning.number[:] = 0
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
            if self.data.warning.number[BAD].any():
                return
            yield self.data

    def run_program(
        self, state: np.ndarray, servos: Sequence[Servo], steps: int, period: int, delay: int
    ) -> Iterator[mujoco.MjData]:
        """As `run`, with the servos' controls from a program that reads every `period` steps; it acts `delay` steps later."""
        places, read = [servo.control for servo in servos], []
        self.put(state)
        for step in range(steps):
            if step % period == 0:
                read.append(self.commands_now(servos))
            if step >= delay:
                self.data.ctrl[places] = read[(step - delay) // period]
            mujoco.mj_step(self.model, self.data)
            if self.data.warning.number[BAD].any():
                return
            yield self.data

    def relaxed(self, state: np.ndarray, seconds: float, rate: float, still: float) -> np.ndarray:
        """Where a run leads whose speeds decay at a rate, 1/s, more; it ends when nothing moves faster than `still`."""
        end = state
        for data in self.run(state, round(seconds / self.dt)):
            data.qvel *= 1.0 - rate * self.dt
            end = data
            if np.abs(data.qvel).max() < still and np.abs(data.qacc).max() < still / self.dt:
                break
        return state if end is state else self.state()


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
