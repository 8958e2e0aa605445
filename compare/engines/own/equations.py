"""A user's equations, evaluated at states of the model's joints; their errors are collected."""

import time
from collections.abc import Sequence
from contextlib import nullcontext

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

import tmt
from tmt.derivation import method

from ...process.interrupt import Now, is_interrupt
from ...robots.coordinates import Coordinates
from ...robots.joint_map import JointMap, JointsError, joint_map
from .. import rows_of_states
from . import functions
from .functions import QUANTITIES, STATE, OwnError, Problem, call, state_in_words
from .own_file import aside

SKEW = 1e-9  # of the largest entry: a mass matrix with a larger asymmetry is reported as not symmetric
MOST_KNOWN = 50_000  # values that are not computed again
DIVERGED = 2.0**49  # rad etc.: beyond it a run has diverged, and errors are not those of the equations

States = Sequence[ndarray]  # q (states, nq), and qd and tau (states, nv) if needed; or of one state (nq,) ...


class OwnEquations:
    """A user's equations; quantities at any states of the model's joints, q (..., nq), v and tau (..., nv).

    source: an object or module with mass_matrix(q) and bias(q, qd), or a mapping of such names to functions;
    further functions see QUANTITIES; `joint_names` if it has them. Or a tmt.Tree. Or the same names with
    SymPy matrices, and `symbols`. joints: the map from its joints to the model's; None: by its own names if
    it has them, else the model's. tree: the model's equations; their damping and springs are used if the
    source has no acceleration. required: functions that the source must have. OwnError for a source that
    cannot be used.
    """

    def __init__(
        self, source: object, coordinates: Coordinates, joints: JointMap | None = None,
        tree: tmt.Tree | None = None, required: Sequence[str] = ("mass_matrix", "bias"),
    ):  # fmt: skip
        self.coordinates, self.tree = coordinates, tree
        self.functions = functions.functions_of(source, coordinates, required)
        if pair := self.functions.get("jacobians"):  # T and B, in one array
            self.functions["jacobians"] = lambda q: np.stack(pair(q), axis=-4)
        try:
            self.joints = joints or joint_map(coordinates, functions.names_of(source))
        except JointsError as error:
            raise OwnError(f"joint_names: {error}") from None
        nv = coordinates.nv
        self.shapes = {name: quantity.shape_for(nv) for name, quantity in QUANTITIES.items()}  # of one state
        self.times: dict[str, float] = {}  # of one state, s, of each function that was called
        self.errors: dict[tuple[str, str], Problem] = {}  # by the quantity and what is wrong
        self.known: dict[tuple[str | bytes, ...], ndarray] = {}  # values, by the function and the state

    def has(self, name: str) -> bool:
        return name in self.functions

    @property
    def problems(self) -> list[Problem]:
        """The errors so far, each once."""
        return list(self.errors.values())

    @property
    def seconds(self) -> float:
        """The time of one call of each function that was called, s."""
        return sum(self.times.values())

    def affordable(self, states: int, seconds: float) -> int:
        """The number of states, at least 1, at which each function can be called once within a time, s."""
        return int(np.clip(seconds / self.seconds, 1, states)) if self.seconds else states

    # quantities at states

    def mass_matrix(self, q: ArrayLike) -> ndarray:
        """Mbar, kg m2, (..., nv, nv)."""
        M = self.values_of("mass_matrix", q)
        rows, own_q = M.reshape(-1, *M.shape[-2:]), self.own_states(rows_of_states(q)[1])
        with np.errstate(invalid="ignore"):  # inf - inf
            skew = np.abs(rows - np.swapaxes(rows, 1, 2)).max(axis=(1, 2))
        self.note("mass_matrix", "is not symmetric", own_q, skew > SKEW * np.abs(rows).max(axis=(1, 2)))
        return self.joints.mass_matrix(M)

    def bias(self, q: ArrayLike, v: ArrayLike) -> ndarray:
        """h, N m, (..., nv)."""
        return self.joints.forces(self.values_of("bias", q, v))

    def coriolis_matrix(self, q: ArrayLike, v: ArrayLike) -> ndarray:
        """C with C v the velocity part of the bias, (..., nv, nv)."""
        return self.joints.mass_matrix(self.values_of("coriolis_matrix", q, v))

    def gravity_balance(self, q: ArrayLike) -> ndarray:
        """Its gravity, or its bias at rest, N m, (..., nv)."""
        if self.has("gravity"):
            return self.joints.forces(self.values_of("gravity", q))
        return self.bias(q, np.zeros(self.coordinates.nv))

    def acceleration(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike) -> ndarray:
        """rad/s2, (..., nv): its own, or from Mbar a = tau - D v - k (q - rest) - h, D and k of the model."""
        if self.has("acceleration"):
            return self.joints.forces(self.values_of("acceleration", q, v, tau))
        batch, (q, v, tau) = rows_of_states(q, v, tau)
        M, forces = self.mass_matrix(q), tau - self.bias(q, v)
        if self.tree is not None:
            forces = forces - passive(self.tree, q, v)
        solved = np.full(forces.shape, np.nan)
        for i in np.flatnonzero(np.isfinite(M).all(axis=(1, 2))):
            try:
                solved[i] = np.linalg.solve(M[i], forces[i])
            except np.linalg.LinAlgError:
                self.note("mass_matrix", "is singular", self.own_states([q]), np.arange(len(q)) == i)
        return solved.reshape(*batch, -1)

    def energy(self, q: ArrayLike, v: ArrayLike) -> ndarray:
        """J, (...); its zero is its own."""
        return self.values_of("energy", q, v)

    def com_positions(self, q: ArrayLike) -> ndarray:
        """m, (..., m, 3)."""
        return self.values_of("com_positions", q)

    def jacobians(self, q: ArrayLike) -> tuple[ndarray, ndarray]:
        """T_b and B_b, (..., m, 3, nv)."""
        T, B = np.moveaxis(self.values_of("jacobians", q), -4, 0)
        return self.joints.forces(T), self.joints.forces(B)

    def try_at(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike) -> None:
        """Call every function at the first of some states; OwnError if one cannot be used."""
        states = self.own_states(rows_of_states(q, v, tau)[1])
        for name in self.functions:
            if name not in self.times:
                self.each(name, [part[:1] for part in states[: QUANTITIES[name].arguments]])

    # how functions are called

    def values_of(self, name: str, *states: ArrayLike) -> ndarray:
        """The values of a function at states of the model, in its own joints; NaN where it raised."""
        if not self.has(name):
            raise OwnError(f"the equations have no {call(name)}")
        batch, rows = rows_of_states(*states)
        finite = np.isfinite(np.concatenate(rows, axis=1)).all(axis=1)  # not where a run has diverged
        computed = self.each(name, self.own_states([part[finite] for part in rows]))
        values = np.full((len(finite), *computed.shape[1:]), np.nan)
        values[finite] = computed
        return values.reshape((*batch, *values.shape[1:]))

    def own_states(self, rows: States) -> list[ndarray]:
        """q, qd and tau, those that are given, in the user's joints."""
        ways = (self.joints.own_positions, self.joints.own_speeds, self.joints.own_forces)
        return [way(part) for way, part in zip(ways, rows)]

    def each(self, name: str, states: States) -> ndarray:
        """Values (states, ...) at states in the user's joints, NaN where it raised.

        OwnError if it raises where it is called for the first time.
        """
        values, bad, count = dict[int, ndarray](), dict[str, ndarray](), len(states[0])
        for i, state in enumerate(zip(*states)):
            key = name, *(part.tobytes() for part in state)
            try:
                if key not in self.known:
                    self.known[key] = self.called(name, state)
                values[i] = self.known[key]
                if not np.isfinite(values[i]).all():
                    bad.setdefault(not_finite(name, values[i]), np.zeros(count, bool))[i] = True
            except OwnError as error:
                if name not in self.times:
                    raise OwnError(f"{error}, at {state_in_words(state)}") from error
                self.note(name, str(error), states, np.arange(count) == i)
        for what, where in bad.items():
            self.note(name, what, states, where)
        if len(self.known) > MOST_KNOWN:
            self.known.clear()
        of_one = [axis if isinstance(axis, int) else 0 for axis in self.shapes[name]]
        together = np.full((count, *of_one), np.nan)
        for i, value in values.items():
            together[i] = value
        return together

    def called(self, name: str, state: States) -> ndarray:
        """The value of a function at one state; OwnError if it is none."""
        copies, started = [np.array(part) for part in state], time.perf_counter()
        try:
            with aside(f"your {name}") if Now.is_listening else nullcontext():
                value = self.functions[name](*copies)
        except BaseException as error:  # whatever a user's own function does
            if is_interrupt(error):
                raise
            is_called_otherwise = isinstance(error, TypeError) and "positional argument" in str(error)
            hint = f"; expected {call(name)}" if is_called_otherwise else ""
            raise OwnError(f"{name} raised {functions.as_raised(error)}{hint}") from error
        for symbol, before, after in zip(STATE, state, copies):
            changed, row = np.array([np.any(before != after)]), [part[None] for part in state]
            self.note(name, f"changes its argument {symbol}", row, changed)
        value = functions.converted(name, value, self.shapes[name])
        self.times[name] = min(self.times.get(name, np.inf), time.perf_counter() - started)
        self.shapes[name] = value.shape
        return value

    def note(self, name: str, what: str, states: States, where: ndarray) -> None:
        """Add an error at those of the states (states, n), in the user's joints, where it occurred."""
        where = np.logical_and.reduce([where, *((np.abs(part) <= DIVERGED).all(axis=1) for part in states)])
        if where.any():
            first = state_in_words([part[np.argmax(where)] for part in states])
            text = what if what.startswith(name) else f"{name} {what}"
            problem = self.errors.setdefault((name, what), Problem(name, text, first, set()))
            rows = np.concatenate([part[where] for part in states], axis=1)
            problem.states.update(hash(row.tobytes()) for row in rows)


def not_finite(name: str, value: ndarray) -> str:
    """What is said of a value with entries that are not finite: the first of them, if it is not all."""
    where = ~np.isfinite(value)
    first = "".join(f"[{k}]" for k in np.argwhere(where)[0].tolist())
    return "is not finite" if where.all() else f"{name}{first} is not finite"


def passive(tree: tmt.Tree, q: ndarray, v: ndarray) -> ndarray:
    """The torque of damping and springs, N m, (..., nv); NaN where q is."""
    springs = method.spring_torque(tree, list(np.moveaxis(q, -1, 0)))
    return np.array(tree.damping) * v + np.stack(np.broadcast_arrays(*springs), axis=-1)
