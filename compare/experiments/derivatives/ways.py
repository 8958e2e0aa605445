"""A = dx+/dx and B = dx+/du of a step, x = (tangent, speed): exact ones of tmt, MuJoCo's differences, their errors."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, product

import numpy as np

import tmt
from tmt.exact.many import exact_of_many

from ...core.rows import Row, column
from ...engines.mujoco import Mujoco
from ...engines.mujoco.changes import FIXED_GAIN
from ...engines.mujoco.names import control_of
from ...engines.mujoco.stepper import Stepper
from ...judge.agree import share_of
from ...judge.entries import Entries
from ...judge.rounding import of_a_step
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.case import Case
from ...robots.file import SET_GOING
from ...robots.scene import WrongField
from ...truth.reference import has_no_reference

Array = np.ndarray
SIZES = tuple(10.0**-k for k in range(1, 13))  # of differences: rad, m, per s, of a control
ALIKE = 3.0  # fold: errors that are alike, and eps with them a plateau
CENTRED, ONE_SIDED = "centred", "one-sided"
TRANSITION, BY_STEPS = "mjd_transitionFD", "differences of mj_step"
TRUNCATED = 2.0 / 99.0  # of the difference between an eps and ten times that: twice the term in eps^2


@dataclass
class DerivativeRow(Row):
    """A way to A and B with an eps, None: it is exact; its largest error over the states, in this block."""

    way: str
    eps: float | None
    error: float | None  # None: not a number
    block: str
    states: int


@dataclass
class WayRow(Row):
    """A way with its best eps, and those that are alike; time: of a call."""

    way: str
    eps: float | None = None
    finest_alike: float | None = None
    coarsest_alike: float | None = None
    error: float | None = None
    time: float | None = column("us", default=None)


def best_of(way: str, errors: Mapping[float, float | None]) -> WayRow:
    """The best of errors by eps, None where they are not a number: the middle of neighbours that are alike."""
    known = {eps: np.inf if error is None else error for eps, error in sorted(errors.items())}
    sizes, least = list(known), min(known, key=lambda eps: known[eps])
    runs = [list(run) for _, run in groupby(sizes, lambda eps: known[eps] <= ALIKE * known[least])]
    (alike,) = (run for run in runs if least in run)
    eps = min((alike[(len(alike) - 1) // 2], alike[len(alike) // 2]), key=lambda eps: known[eps])
    return WayRow(way, eps, alike[0], alike[-1], errors[eps])


def worst_block(difference: Array, exact: Array, nv: int, least: Array | float = 0) -> tuple[float, str]:
    """The largest difference over the largest entry of its block, and that block, as dq/du.

    Of [A B], (..., n, n + k), with nv tangents and speeds, then activations. Blocks whose entries are no
    larger than `least`, of each entry, are zero except for rounding, and left out. inf: a difference is not a
    number.
    """
    least, worst, n = np.broadcast_to(least, exact.shape), (0.0, ""), exact.shape[-2]
    to = {"dq": slice(nv), "dv": slice(nv, 2 * nv), "da": slice(2 * nv, n)}
    by = to | {"du": slice(n, None)}
    for row, col in product(to, by):
        parts = (np.abs(part[..., to[row], by[col]]) for part in (difference, exact, least))
        largest, size, rounding = (part.max(axis=(-2, -1), initial=0.0) for part in parts)
        shares = np.where(size > rounding, largest / np.where(size > 0.0, size, 1.0), 0.0)
        worst = max(worst, (float(np.max(shares)) if np.isfinite(shares).all() else np.inf, f"{row}/{col}"))
    return worst


class Subject:
    """States along a scene, without contacts and limits: in MuJoCo by a Stepper, in tmt by a Tree.

    by: the inputs u, controls where the robot's actuators act, else torques. gains: of each state the
    generalized force by each of them, (states, nv, k).
    """

    def __init__(self, engine: Mujoco, case: Case, dt: float, integrator: str, states: int) -> None:
        self.case, self.dt, dynamics, dofs = case, dt, engine.of(case), engine.of(case).dofs
        self.stepper = Stepper(dynamics.model, dt, integrator)
        self.scheme, m = engine.methods_in(case)[integrator].scheme, self.stepper.model
        scene = *case.start, case.tau, case.scene.dt, case.steps
        method: tuple[str, float | None] = "dopri8_adaptive", 1e-9
        if has_no_reference(case.robot):  # it would take 1e8 evaluations
            method = "implicitfast", None
        _, q, qd = tmt.simulate(case.tree, *scene, *method)
        reached = np.flatnonzero(np.isfinite(qd).all(axis=1))
        at = reached[np.linspace(0, len(reached) - 1, states + 1).astype(int)[1:]]
        self.q, self.qd, self.tau = q[at], qd[at], np.tile(case.tau, (states, 1))
        self.by, self.inputs, self.places = "qfrc_applied", dofs, np.r_[dofs, m.nv + dofs]
        if case.controller:
            acting = [i for i, u in enumerate(case.controller.controls) if u is not None]
            # a control that changes damping or stiffness is no torque
            is_torque = ~m.actuator_gainprm[:, 1:3].any(axis=1) | (m.actuator_gaintype == FIXED_GAIN)
            inputs = [control_of(m, i)[0] for i in acting if is_torque[i] and not m.actuator_actnum[i]]
            self.by, self.inputs = "ctrl", np.array(inputs, dtype=int)
        self.starts, self.gains = list[Array](), np.zeros((states, len(dofs), len(self.inputs)))
        for k in range(states):
            data = self.stepper.put(self.stepper.reset)
            data.ctrl[:], data.act[:] = dynamics.data.ctrl, dynamics.data.act
            data.qpos[dynamics.qpos], data.qvel[dofs] = self.q[k], self.qd[k]
            data.qfrc_applied[dofs] = self.tau[k] - dynamics.constant
            self.starts.append(self.stepper.state())
            for (number, place), by in product(enumerate(self.inputs), (1.0, -1.0)):  # forces are affine
                state = self.starts[k].copy()
                state[self.stepper.places[self.by]][place] += by
                moved = self.stepper.forward(state)
                self.gains[k, :, number] += 0.5 * by * (moved.qfrc_actuator + moved.qfrc_applied)[dofs]

    def by_differences(self, eps: float, centred: bool) -> Array:
        """MuJoCo's [A B] at all states, (states, 2 nv, 2 nv + k)."""
        pairs = [self.stepper.derivative(start, eps, centred, self.by) for start in self.starts]
        parts = np.r_[self.places, len(pairs[0][0]) + self.inputs]
        return np.array([np.hstack(pair) for pair in pairs])[:, self.places][:, :, parts]

    @cached_property
    def by_torques(self) -> Array:
        """The same by torques."""
        state = self.q, self.qd, self.tau, np.full(len(self.q), self.dt)
        return np.concatenate(tmt.step_derivatives(self.case.tree, *state, self.scheme), axis=2)

    @cached_property
    def exact(self) -> Array:
        """tmt's exact [A B] by inputs."""
        return by_inputs(self.by_torques, self.gains)

    @cached_property
    def scale(self) -> Array:
        """Of each entry of [A B] by torques."""
        state, entries = (self.q, self.qd, self.tau), Entries(self.case.tree, self.q, self.qd)
        by, qdd = tmt.derivatives(self.case.tree, *state), tmt.acceleration(self.case.tree, *state)
        return entries.step(self.dt, by, entries.derivatives(self.tau, qdd, by))

    @cached_property
    def tolerance(self) -> Array:
        """64 eps x the scale of each entry of [A B] by inputs."""
        return FACTOR * EPS * by_inputs(self.scale, np.abs(self.gains))

    def errors_of_tmt(self) -> tuple[float, float]:
        """The error of tmt's [A B] at the first state to 31 digits, and its share of the tolerance."""
        first = self.q[:1], self.qd[:1], self.tau[:1], np.array([[self.dt]])
        exact = exact_of_many(self.case.tree, f"step_derivatives:{self.scheme}", *first)
        distance, tolerance = exact.distance(self.by_torques[:1]), FACTOR * EPS * self.scale[:1]
        error, _ = worst_block(distance, exact.high, distance.shape[1] // 2, tolerance)
        return error, float(share_of(distance, tolerance).max())

    def share_of_differences(self, values: Mapping[float, Array]) -> float:
        """The largest share, over eps and entries, of what rounding and truncation can do to centred differences.

        Rounding: that of a step over the eps. Truncation: twice the term in eps^2, from ten and a hundred
        times eps.
        """
        A, shares = self.exact[:, :, : self.exact.shape[1]], []
        sizes = of_a_step(self.case.tree, self.q, self.qd, self.tau, self.dt, A)
        for coarser, coarse, eps in zip(SIZES, SIZES[1:], SIZES[2:]):
            terms = np.abs(values[coarse] - values[eps]), np.abs(values[coarser] - values[coarse]) / 100.0
            truncated = TRUNCATED * np.fmax(*terms)  # where one happens to be small, as eps^4 counts too
            bound = FACTOR * EPS * sizes / eps + truncated + self.tolerance
            shares.append(float(share_of(np.abs(values[eps] - self.exact), bound).max()))
        return max(shares)


def by_inputs(values: Array, gains: Array) -> Array:
    """[A B] by inputs, of that by torques."""
    by_state, by_torque = np.split(values, [2 * gains.shape[1]], axis=2)
    return np.concatenate([by_state, by_torque @ gains], axis=2)


def case_of(robot: Robot) -> Case:
    """The scene whose step is differentiated, in which all moves: of servos, else of motors, else of torques."""
    cases = [case for case in robot.cases if not case.scene.locked]
    if servos := [case for case in cases if case.controller]:
        return servos[-1]
    moving = [case for case in cases if not case.is_held] or cases
    free = min(moving, key=lambda case: "regular" not in case.scene.tags)
    speed = tuple(SET_GOING[kind] for kind in robot.coordinates.kinds_of_speeds)
    name = f"{free.name.removesuffix(', set going')}, set going"  # the scene of a robot at rest has this name already
    set_going = free.changed(name=name, speed=speed) if robot.is_read else free
    try:
        return set_going.changed(torque="servos")  # of motors, whose controls are 0
    except WrongField:
        return set_going


def number(error: float) -> float | None:
    return error if np.isfinite(error) else None
