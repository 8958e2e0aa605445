"""Steps of a model with everything that its file has: runs of them, one by one, and their derivatives."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import ArrayLike

from .actuators import held_at, ranges_of
from .names import INTEGRATORS, SETTLING, bit, control_of, element_name

Array = np.ndarray
STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # all that a step depends on
PHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS  # the part that mujoco.rollout gives after each step
PARTS = {
    name.removeprefix("mjSTATE_").lower(): member
    for name, member in mujoco.mjtState.__members__.items()
    if int(member).bit_count() == 1 and int(member) & int(STATE)
}
INPUTS = ("ctrl", "qfrc_applied", "xfrc_applied", "eq_active", "mocap_pos", "mocap_quat", "userdata")
# of delays and of springs that yield
REMEMBERED = sum(int(member) for name, member in PARTS.items() if name in ("history", "plastic"))
BAD = [int(getattr(mujoco.mjtWarning, f"mjWARN_BADQ{what}")) for what in ("POS", "VEL", "ACC")]
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))
INTEGRATING = mujoco.mjtDyn.mjDYN_INTEGRATOR

# a warning would append MUJOCO_LOG.TXT to the current directory; divergence is detected here instead
_log = mujoco.MjLogConfig.get()
_log.logto_file = _log.logto_console = False
_log.set()


class Rolled(NamedTuple):
    """A batch of runs, without their starts.

    q, v: after each step, (runs, steps, nq) and (runs, steps, nv), rad or m, and per s; NaN from where MuJoCo
    finds a bad number. states: where each run is at last, (runs, n): the start of a roll that goes on.
    """

    q: Array
    v: Array
    states: Array


class Stepper:
    """A copy of a model with a step, an integrator and no automatic reset, for good.

    A state is a vector of all on which a step depends (MuJoCo's mjSTATE_INTEGRATION): time, qpos, qvel, act,
    what delays remember, the start of the solver, and inputs: ctrl, qfrc_applied, mocap_pos ... `places` has
    the slice of each part by its name, so that `states[:, stepper.places["qvel"]] += push` pushes.
    """

    def __init__(self, model: mujoco.MjModel, dt: float, integrator: str) -> None:
        """dt: s. integrator: a name of names.INTEGRATORS."""
        self.model, self.dt, self.integrator = mujoco.MjModel.__copy__(model), dt, integrator
        self.model.opt.timestep, self.model.opt.integrator = dt, INTEGRATORS[integrator]
        self.model.opt.disableflags |= bit("AUTORESET")
        self.model.opt.enableflags &= ~SLEEP  # a state does not say what sleeps
        self.data = mujoco.MjData(self.model)
        sizes = {name: mujoco.mj_stateSize(self.model, part) for name, part in PARTS.items()}
        ends = np.cumsum(list(sizes.values())).tolist()
        self.places = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends)}
        self.reset = self.state()  # as mj_resetData leaves it

    def start(
        self, key: str = "", q: ArrayLike | None = None, v: ArrayLike | None = None,
        controls: ArrayLike | None = None,
    ) -> Array:  # fmt: skip
        """The state of a keyframe, by its name, or of qpos0, with other positions, speeds or controls.

        q: (nq,), at rest unless v, (nv,), is given; controls: (nu,). Controls are those of the keyframe if
        any keyframe of the file states some. Else actuators whose force is affine in their length hold the
        posture, within their ranges, as do integrators (intvelocity) in a keyframe without activations; all
        others have control 0. Raises KeyError for a name that no keyframe has.
        """
        m, d = self.model, self.data
        mujoco.mj_resetData(m, d)
        if key:
            keys = {element_name(m, "key", number): number for number in range(m.nkey)}
            mujoco.mj_resetDataKeyframe(m, d, keys[key])
        if q is not None:
            d.qpos[:], d.qvel[:] = q, 0.0
        if v is not None:
            d.qvel[:] = v
        has_controls = bool(key) and m.key_ctrl.any()
        has_activations = bool(key) and m.key_act.any()
        state, ctrl, act = self.state(), d.ctrl.copy(), d.act.copy()
        for i, u in enumerate(held_at(m, d.qpos)):
            (place, inputs), is_integrator = control_of(m, i), m.actuator_dyntype[i] == INTEGRATING
            if inputs == 1 and not has_controls:
                ctrl[place] = 0.0 if is_integrator else u
            settles = int(m.actuator_dyntype[i]) in SETTLING and (is_integrator or not has_controls)
            if settles and not has_activations:
                act[m.actuator_actadr[i]] = u
        if controls is not None:
            ctrl[:] = controls
        state[self.places["ctrl"]], state[self.places["act"]] = ctrl, act
        mujoco.mj_resetData(m, d)
        return state

    def state(self) -> Array:
        """The state that the data have, (n,)."""
        state = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def put(self, state: Array) -> mujoco.MjData:
        """The data at a state, (n,), with no warning; what depends on the state is not computed."""
        mujoco.mj_setState(self.model, self.data, state, STATE)
        self.data.warning.number[:] = 0
        return self.data

    def as_fields(self, state: Array) -> dict[str, list[float]]:
        """A state, (n,), as fields of MjData that are not zero; without memories of delays and of plastic springs."""
        data = self.put(state)
        names = "qpos", "qvel", "act", "ctrl", "mocap_pos", "mocap_quat", "qfrc_applied"
        return {name: getattr(data, name).ravel().tolist() for name in names if getattr(data, name).any()}

    def watch(self, state: Array, steps: int, controls: Array | None = None) -> Iterator[mujoco.MjData]:
        """The data after each step of a run from a state, (n,), until MuJoCo finds a bad number.

        controls: at each step, (steps, nu); None: those of the state, which may be changed on the way.
        Derived fields (contacts, forces, accelerations) are of the state before the step.
        """
        self.put(state)
        for step in range(steps):
            if controls is not None:
                self.data.ctrl[:] = controls[step]
            mujoco.mj_step(self.model, self.data)
            if self.data.warning.number[BAD].any():
                return
            yield self.data

    def loop(self, state: Array, steps: int, controls: ArrayLike | None = None) -> Callable[[], Array]:
        """A run as one call of MuJoCo's own loop, with all memory in place, to be measured.

        It gives the physical part of the state, PHYSICS, after each step, (steps, size): time, qpos, qvel
        first. After a warning MuJoCo steps no more and repeats the last. The data are where the run ends.
        controls: (steps, nu); None: those of the state.
        """
        m = self.model
        changed = {name: np.any((state != self.reset)[self.places[name]]) for name in INPUTS}
        names = [name for name in INPUTS if changed[name] or name == "ctrl"]
        rows = np.tile(np.concatenate([state[self.places[name]] for name in names]), (steps, 1))
        if controls is not None:
            rows[:, : m.nu] = controls
        first = np.zeros(mujoco.mj_stateSize(m, PHYSICS))
        mujoco.mj_extractState(m, state, STATE, first, PHYSICS)
        warmstart = state[self.places["warmstart"]][None].copy()
        # filled, so that the first run does not have to fetch the memory
        states = np.full((1, steps, len(first)), np.nan)
        sensors = np.zeros((1, steps, m.nsensordata))
        spec = sum(int(PARTS[name]) for name in names)

        def run() -> Array:
            rollout(
                [m], [self.data], first[None], rows[None], control_spec=spec, skip_checks=True, nstep=steps,
                initial_warmstart=warmstart, state=states, sensordata=sensors,
            )  # fmt: skip
            return states[0]

        return run

    def roll(self, states: ArrayLike, steps: int, inputs: ArrayLike | None = None) -> Rolled:
        """Runs from states, (runs, n) or (n,), bitwise as mj_step takes them.

        inputs: controls at each step, (steps, nu) or (runs, steps, nu); None: those of the states, constant.
        Rolling on from `Rolled.states` is the same as rolling on at once; a run that has ended ends at once.
        """
        m, ends = self.model, np.array(states, float, ndmin=2)
        rows: list[Array | None] = [None] * len(ends)
        if inputs is not None:
            rows = [*np.broadcast_to(np.asarray(inputs, float), (len(ends), steps, m.nu))]
        paths = np.full((len(ends), steps, 1 + m.nq + m.nv), np.nan)
        for k, (start, controls) in enumerate(zip(ends, rows)):
            path = self.loop(start, steps, controls)()[:, : paths.shape[2]]
            if self.data.warning.number.any():  # the loop ends at any, a run where a number is bad
                watched = [np.r_[d.time, d.qpos, d.qvel] for d in self.watch(start, steps, controls)]
                path = np.reshape(watched, (-1, paths.shape[2]))
            paths[k, : len(path)], ends[k] = path, self.state()
        return Rolled(paths[:, :, 1 : 1 + m.nq], paths[:, :, 1 + m.nq :], ends)

    def taken(self, path: Array) -> int:
        """How many steps of a path of `loop` there are, (steps, size), where the data are at its end.

        A step after which a number is bad is not one of them; after another warning MuJoCo has not gone on.
        """
        if not self.data.warning.number.any():
            return len(path)
        warned = int(np.argmax(path[:, 0] == path[-1, 0]))  # from here on the last state is repeated
        return warned if self.data.warning.number[BAD].any() else warned + 1

    @property
    def takes_transition(self) -> bool:
        """Whether mjd_transitionFD is right: it refuses RK4 and delays, and leaves what has yielded."""
        return self.integrator != "RK4" and not mujoco.mj_stateSize(self.model, REMEMBERED)

    def derivative(
        self, state: Array, eps: float, centred: bool = True, by: str = "ctrl"
    ) -> tuple[Array, Array]:
        """A and B of a step: its derivatives by the deviation of the state, (n, n), and by inputs, (n, k).

        A deviation is a tangent vector of the positions (nv,), the speeds (nv,) and the activations (na,). by: ctrl
        (k = nu) or qfrc_applied (k = nv). eps: of the differences, rad, m, per s. They are those of MuJoCo's
        mjd_transitionFD where it is right, else of mj_step; at an end of the range of an activation or of a
        control they are one-sided.
        """
        m, n = self.model, 2 * self.model.nv + self.model.na
        values = np.concatenate([np.zeros(2 * m.nv), state[self.places["act"]], state[self.places[by]]])
        endless = np.tile([[-np.inf], [np.inf]], 2 * m.nv)
        low, high = np.hstack([endless, ranges_of(m, by)])
        ahead, behind = eps * (values + eps <= high), eps * (values - eps >= low)
        behind[ahead > 0.0] *= centred
        both, first = np.zeros((n, len(values))), 0
        if self.takes_transition and ahead[:n].all() and (behind[:n] > 0.0).all() == centred:
            A, B = np.zeros((n, n)), np.zeros((n, m.nu))
            mujoco.mjd_transitionFD(m, self.put(state), eps, centred, A, B, None, None)
            if by == "ctrl":
                return A, B
            both[:, :n], first = A, n
        for k in range(first, len(values)):
            one, other = np.zeros((2, len(values)))
            one[k], other[k] = ahead[k], -behind[k]
            if ahead[k] + behind[k]:
                moved = self.deviation(self.after(state, other, by), self.after(state, one, by))
                both[:, k] = moved / (ahead[k] + behind[k])
        return both[:, :n], both[:, n:]

    def after(self, state: Array, by: Array, inputs: str = "ctrl") -> Array:
        """The state, (n,), a step after a state that is moved, see `moved`."""
        mujoco.mj_step(self.model, self.moved(state, by, inputs))
        return self.state()

    def moved(self, state: Array, by: Array, inputs: str = "ctrl") -> mujoco.MjData:
        """The data at a state, (n,), that is moved; what depends on it is not computed.

        by: a deviation, (2 nv + na,), which may be followed by a change of inputs, (nu,) or (nv,).
        """
        m, d = self.model, self.put(state)
        tangent, speed, activation, change = np.split(by, np.cumsum([m.nv, m.nv, m.na]))
        mujoco.mj_integratePos(m, d.qpos, tangent, 1.0)
        d.qvel += speed
        d.act += activation
        if len(change):
            getattr(d, inputs)[:] += change
        return d

    def forward(self, state: Array, by: Array | None = None) -> mujoco.MjData:
        """The data at a state, (n,), that may be moved, with all that depends on it."""
        data = self.put(state) if by is None else self.moved(state, by)
        mujoco.mj_forward(self.model, data)
        return data

    def deviation(self, one: Array, other: Array) -> Array:
        """The deviation from one state to another: tangent, speeds, activations, (2 nv + na,)."""
        q, v, act = (self.places[name] for name in ("qpos", "qvel", "act"))
        tangent = distance(self.model, one[q], other[q])
        return np.concatenate([tangent, other[v] - one[v], other[act] - one[act]])


def distance(m: mujoco.MjModel, q0: Array, q1: Array) -> Array:
    """The tangent vector from positions to others, (..., nq): (..., nv) rad, m; of a ball in its own axes."""
    pairs = np.broadcast_arrays(q0, q1)
    rows = [np.ascontiguousarray(q, float).reshape(-1, m.nq) for q in pairs]
    moved = np.zeros((len(rows[0]), m.nv))
    for row, *ends in zip(moved, *rows):
        mujoco.mj_differentiatePos(m, row, 1.0, *ends)
    return moved.reshape(*pairs[0].shape[:-1], m.nv)
