"""A user's equations, evaluated at states of the model's joints; their errors are collected."""

import time
import warnings

import numpy as np

import tmt
from tmt import literal
from tmt.model.values import shown

from ...process.interrupt import is_interrupt
from ...robots.case import Coordinates
from ...robots.joint_map import JointMap, JointsError, joint_map
from .. import rows_of_states
from . import functions
from .functions import ARGUMENTS, SHAPES, STATE, OwnError, Problem, and_more, call, state_in_words

SKEW = 1e-9  # of the largest entry: a mass matrix with a larger asymmetry is reported as not symmetric
DIVERGED = 2.0**49  # rad etc.: beyond it a run has diverged, and errors are not those of the equations


class OwnEquations:
    """A user's equations; quantities at any states of the model's joints, q (..., nq), v and tau (..., nv).

    source: an object or module with mass_matrix(q) and bias(q, qd), or a mapping of such names to functions; further functions
    see ARGUMENTS; `joint_names` if it has them. Or a tmt.Tree. Or the same names with SymPy matrices, and `symbols`.
    joints: the map from its joints to the model's; None: by its own names if it has them, else the model's.
    tree: the model's equations; their damping and springs are used if the source has no acceleration. required: functions that
    the source must have. OwnError for a source that cannot be used.
    """

    def __init__(
        self,
        source: object,
        coordinates: Coordinates,
        joints: JointMap | None = None,
        tree: tmt.Tree | None = None,
        required: tuple[str, ...] = ("mass_matrix", "bias"),
    ):
        self.source, self.coordinates, self.tree = source, coordinates, tree
        self.functions = functions.functions_of(source, coordinates, required)
        try:
            self.joints = joints or joint_map(coordinates, functions.names_of(source))
        except JointsError as error:
            raise OwnError(f"joint_names: {error}") from None
        # of each function that was called: whether it takes batches; the time of one state, alone and in a batch, s; its shape
        self.takes_batches: dict[str, bool] = {}
        self.times, self.shapes = {}, {}
        self.errors: dict[
            tuple[str, str], list
        ] = {}  # (quantity, error): [first state, text, all states, hashed]

    def has(self, name: str) -> bool:
        return name in self.functions

    @property
    def problems(self) -> list[Problem]:
        """The errors so far, each once."""
        errors = [(quantity, *error) for (quantity, _), error in self.errors.items()]
        return [
            Problem(name, at, f"{text} at {at}{and_more(len(all_of) - 1)}")
            for name, at, text, all_of in errors
        ]

    @property
    def seconds(self) -> float:
        """The time of one call of each function that was called, at one state, s."""
        return sum(single for single, _ in self.times.values())

    def affordable(self, states: int, seconds: float) -> int:
        """The number of states, at least 1, at which each function can be called once within a time, s."""
        each = sum(more for _, more in self.times.values())
        return int(np.clip(seconds / each, 1, states)) if each else states

    # quantities at states

    def mass_matrix(self, q) -> np.ndarray:
        """Mbar, kg m2, (..., nv, nv)."""
        M = self.values_of("mass_matrix", q)
        self.check_symmetry(M.reshape(-1, *M.shape[-2:]), *self.own_states(rows_of_states(q)[1]))
        return self.joints.mass_matrix(M)

    def bias(self, q, v) -> np.ndarray:
        """h, N m, (..., nv)."""
        return self.joints.forces(self.values_of("bias", q, v))

    def gravity_balance(self, q) -> np.ndarray:
        """Its gravity, or its bias at rest, N m, (..., nv)."""
        if self.has("gravity"):
            return self.joints.forces(self.values_of("gravity", q))
        return self.bias(q, np.zeros(self.coordinates.nv))

    def acceleration(self, q, v, tau) -> np.ndarray:
        """rad/s2, (..., nv): its own, or from Mbar a = tau - D v - k (q - rest) - h with the model's damping and springs."""
        if self.has("acceleration"):
            return self.joints.forces(self.values_of("acceleration", q, v, tau))
        batch, (q, v, tau) = rows_of_states(q, v, tau)
        M, forces = self.mass_matrix(q), tau - self.bias(q, v) - self.passive(q, v)
        solved = np.full(forces.shape, np.nan)
        for i in np.flatnonzero(np.isfinite(M).all(axis=(1, 2))):
            try:
                solved[i] = np.linalg.solve(M[i], forces[i])
            except np.linalg.LinAlgError:
                self.note("mass_matrix", "is singular", self.own_states([q]), np.arange(len(q)) == i)
        return solved.reshape(*batch, -1)

    def passive(self, q, v) -> np.ndarray:
        """The torque of the model's damping and springs, N m, (states, nv)."""
        if self.tree is None:
            return np.zeros(np.shape(v))
        drag = np.array(self.tree.damping) * v
        return drag + literal.spring_torque(q, self.tree) if self.tree.has_springs else drag

    def energy(self, q, v) -> np.ndarray:
        """J, (...); its zero is its own."""
        return self.values_of("energy", q, v)

    def com_positions(self, q) -> np.ndarray:
        """m, (..., m, 3)."""
        return self.values_of("com_positions", q)

    def jacobians(self, q) -> tuple[np.ndarray, np.ndarray]:
        """T_b and B_b, (..., m, 3, nv)."""
        both = np.moveaxis(self.values_of("jacobians", q), -4, 0)
        return tuple(self.joints.forces(part) for part in both)

    def try_at(self, q, v, tau) -> None:
        """Call every function at the first of some states until its time is known; OwnError if one cannot be used."""
        given = self.own_states(rows_of_states(q, v, tau)[1])
        for name in self.functions:
            if name not in self.takes_batches:
                self.first(name, given[: ARGUMENTS[name]])

    # how functions are called

    def values_of(self, name: str, *states) -> np.ndarray:
        """The values of a function at states of the model's joints, in its own joints; NaN where it raised."""
        if not self.has(name):
            raise OwnError(f"the equations have no {call(name)}")
        batch, rows = rows_of_states(*states)
        finite = np.isfinite(np.concatenate(rows, axis=1)).all(axis=1)  # not where a run has diverged
        given = self.own_states([part[finite] for part in rows])
        if not finite.any():
            return np.full((*batch, *self.shapes.get(name, SHAPES[name](self.coordinates.nv))), np.nan)
        if name not in self.takes_batches:
            self.first(name, given)
        computed, raised = self.each(name, given)
        bad = ~np.isfinite(computed).reshape(len(computed), -1).all(axis=1) & ~raised
        self.note(name, "is not finite", given, bad)
        values = np.full((len(rows[0]), *computed.shape[1:]), np.nan)
        values[finite] = computed
        return values.reshape((*batch, *values.shape[1:]))

    def own_states(self, rows: list[np.ndarray]) -> list[np.ndarray]:
        """q, qd and tau, those that are given, in the user's joints."""
        ways = (self.joints.own_positions, self.joints.own_speeds, self.joints.own_forces)
        return [way(part) for way, part in zip(ways, rows)]

    def each(self, name: str, given: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Values (states, ...) at states in the user's joints, NaN where it raised; and where it raised."""
        raised = np.zeros(len(given[0]), bool)
        if self.takes_batches.get(name):
            try:
                return self.called(name, given, len(raised)), raised
            except OwnError:  # it is located state by state
                pass
        values = np.full((len(raised), *self.shapes[name]), np.nan)
        for i in range(len(raised)):
            try:
                values[i] = self.called(name, [part[i] for part in given])
            except OwnError as error:
                raised[i] = True
                self.note(name, str(error), given, np.arange(len(raised)) == i)
        return values, raised

    def first(self, name: str, given: list[np.ndarray]) -> None:
        """Call a function at one state (OwnError if it fails), then find out whether it takes batches."""
        count = 3 if self.coordinates.nv == 2 else 2  # not as many as there are joints
        singles, times = [], []
        for i in range(min(count, len(given[0]))):
            state = [part[i] for part in given]
            started = time.perf_counter()
            try:
                singles.append(self.called(name, state))
            except OwnError as error:
                if i:  # it will be raised again, and noted
                    break
                raise OwnError(f"{error}, at {state_in_words(state)}") from error
            times.append(time.perf_counter() - started)
            self.shapes[name] = singles[0].shape
        self.times[name] = min(times), min(times)
        if len(singles) == count:
            started = time.perf_counter()
            together = self.tried_together(name, [part[:count] for part in given])
            if together is not None and functions.same(together, np.array(singles)):
                self.takes_batches[name] = True
                self.times[name] = min(times), (time.perf_counter() - started) / count
        if len(given[0]) > 1:  # else another time
            self.takes_batches.setdefault(name, False)

    def tried_together(self, name: str, given: list[np.ndarray]) -> np.ndarray | None:
        """Values of several states at once; None if it does not take batches."""
        before = {key: [*value[:2], set(value[2])] for key, value in self.errors.items()}
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                return self.called(name, given, len(given[0]))
        except OwnError:
            return None
        finally:
            self.errors = before  # it need not take batches

    def called(self, name: str, given: list[np.ndarray], count: int | None = None) -> np.ndarray:
        """The value of a function at one state, or at count of them; OwnError if it raised or returned anything else."""
        copies = [np.array(part) for part in given]
        try:
            value = self.functions[name](*copies)
        except BaseException as error:  # whatever a user's own function does
            if is_interrupt(error):
                raise
            hint = ""
            if isinstance(self.source, type) and isinstance(error, TypeError) and "missing" in str(error):
                hint = f"; expected an object, such as {self.source.__name__}(), not the class"
            elif isinstance(error, TypeError) and "positional argument" in str(error):
                hint = f"; expected {call(name)}"
            raise OwnError(f"{name} raised {functions.as_raised(error)}{hint}") from error
        for symbol, before, after in zip(STATE, given, copies):
            changed = np.atleast_2d(before != after).any(axis=1)
            self.note(
                name, f"changes its argument {symbol}", [np.atleast_2d(part) for part in given], changed
            )
        expected = self.shapes.get(name, SHAPES[name](self.coordinates.nv))
        if name != "jacobians":
            return functions.converted(name, value, expected, count)
        if not isinstance(value, tuple | list | np.ndarray) or len(value) != 2:
            wanted = f"two arrays, T and B, of shape (bodies, 3, {expected[-1]})"
            raise OwnError(f"jacobians is {shown(value)}; expected {wanted}")
        return np.stack([functions.converted(name, part, expected[1:], count) for part in value], axis=-4)

    def check_symmetry(self, M: np.ndarray, q: np.ndarray) -> None:
        with np.errstate(invalid="ignore"):  # inf - inf
            skew = np.abs(M - M.transpose(0, 2, 1)).max(axis=(1, 2))
        self.note("mass_matrix", "is not symmetric", [q], skew > SKEW * np.abs(M).max(axis=(1, 2)))

    def note(self, name: str, what: str, given: list[np.ndarray], where) -> None:
        """Add an error at those of the states (states, n), in the user's joints, where it occurred."""
        where = np.logical_and.reduce([where, *((np.abs(part) <= DIVERGED).all(axis=1) for part in given)])
        if not where.any():
            return
        first = int(np.argmax(where))
        text = what if what.startswith(name) else f"{name} {what}"
        state = state_in_words([part[first] for part in given])
        rows = np.concatenate([part[where] for part in given], axis=1)
        self.errors.setdefault((name, what), [state, text, set()])[2].update(
            hash(row.tobytes()) for row in rows
        )
