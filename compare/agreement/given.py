"""The arguments of assert_agrees, validated: the model, the states, each quantity of the user and of MuJoCo."""

import warnings
from collections.abc import Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.values import real_numbers, shown

from ..core.text import say
from ..engines.own import ARGUMENTS, OwnEquations, in_shape, is_function, numbers_of
from ..judge.agree import over
from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from ..robots.file import robot_of
from ..robots.joint_map import JointMap, joint_map
from ..robots.states import random
from ..robots.validation import is_number

SYMBOLS_OF = {
    "mass_matrix": "M",
    "bias": "h",
    "gravity": "g",
    "acceleration": "qdd",
}  # quantities and their entries
SCALES = {"mass_matrix": "mass_matrix", "bias": "bias", "gravity": "weight"}
DEFAULT_STATES = 100
OWN_SECONDS = 20.0  # s for the user's functions at random states


class State(NamedTuple):
    """A state in the user's joints."""

    number: int
    q: tuple[float, ...]
    qd: tuple[float, ...]
    tau: tuple[float, ...]


class Compared(NamedTuple):
    """One quantity at all states, (states, ...), in the user's joints."""

    own: np.ndarray
    right: np.ndarray  # MuJoCo's
    scale: np.ndarray
    tolerance: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        """Of the difference to the tolerance; 0 where both are 0, inf where the user's value is not finite."""
        off = np.abs(self.own - self.right)
        return over(np.where(np.isfinite(off), off, np.inf), self.tolerance)


class Given:
    """The arguments of `assert_agrees` and `differences`, and MuJoCo's values."""

    def __init__(
        self, mjcf: Any, mass_matrix: Any, bias: Any, gravity: Any, acceleration: Any, q: Any, qd: Any, tau: Any,
        joints: Sequence[str] | None, rtol: float, states: int, seed: int,
    ) -> None:  # fmt: skip
        brought = dict(zip(SYMBOLS_OF, (mass_matrix, bias, gravity, acceleration)))
        self.brought = brought = {name: value for name, value in brought.items() if value is not None}
        if not brought:
            raise ValueError(f"nothing to compare: expected {', '.join(SYMBOLS_OF)} or some of them")
        if not is_number(rtol) or rtol < 0.0:
            raise ValueError(f"rtol is {shown(rtol)}; expected a number of at least 0")
        self.rtol, self.rounding = float(rtol), FACTOR * EPS + float(rtol)
        self.problems: list[str] = []  # other errors of the user's functions at the states, a line each
        self.read(mjcf)
        self.joints: JointMap = joint_map(self.coordinates, joints)
        functions = {name: value for name, value in brought.items() if is_function(value)}
        self.own = (
            OwnEquations(functions, self.coordinates, self.joints, self.tree, ()) if functions else None
        )
        if q is not None:
            self.take_states(q, qd, tau)
            if states != DEFAULT_STATES:
                text = f"states={shown(states)} is not used: the {len(self.q)} states of q are compared"
                warnings.warn(text, stacklevel=3)
            return
        for name, value in (brought | {"qd": qd, "tau": tau}).items():
            if value is not None and name not in functions:
                expected = f"a function, or q of shape (states, {self.coordinates.nq})"
                raise ValueError(f"{name} is {shown(value)}, but not q is given; expected {expected}")
        self.take_random(states, seed)

    def read(self, mjcf: Any) -> None:
        from ..engines.mujoco import engine, read  # here, so that `import compare` need not wait for it

        if isinstance(mjcf, str | PathLike) and not str(mjcf).lstrip().startswith("<"):
            mjcf = Path(mjcf)
        self.reading = reading = cast(Any, read(mjcf))
        self.robot = robot_of(reading, "the model")
        self.mujoco = engine(reading).of(self.robot.case())
        self.tree, self.coordinates = reading.tree, self.robot.coordinates

    def take_random(self, states: int, seed: int) -> None:
        """Random states, fewer if the user's functions are slow."""
        for name, value, least in (("states", states, 1), ("seed", seed, 0)):
            if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
                raise ValueError(f"{name} is {shown(value)}; expected a whole number of at least {least}")
        sample = random(self.robot, states, 0, seed)
        for note in sample.notes:
            warnings.warn(say(note), stacklevel=4)
        assert self.own is not None  # all that was brought are functions
        self.own.try_at(sample.q, sample.qd, sample.tau)
        count = self.own.affordable(len(sample.q), OWN_SECONDS)
        if count < len(sample.q):
            text = (
                f"{count} states instead of {states}: your functions take {self.own.seconds:.2g} s per state"
            )
            warnings.warn(text, stacklevel=4)
        self.q, self.qd, self.tau = sample.q[:count], sample.qd[:count], sample.tau[:count]

    def take_states(self, q: Any, qd: Any, tau: Any) -> None:
        """The given states, in the user's joints."""
        nq, nv = self.coordinates.nq, self.coordinates.nv
        own = {"q": rows_given("q", q, nq, None)}
        count = len(own["q"])
        for name, value in {"qd": qd, "tau": tau}.items():
            needed = [of for of in self.brought if name in ("q", "qd", "tau")[: ARGUMENTS[of]]]
            if value is None and needed:
                raise ValueError(
                    f"{needed[0]} depends on {name}; expected {name} of shape ({count}, {nv}), or 0.0"
                )
            own[name] = rows_given(name, 0.0 if value is None else value, nv, count)
        self.q = self.joints.positions(own["q"])
        self.qd, self.tau = self.joints.speeds(own["qd"]), self.joints.forces(own["tau"])
        for joint, name in zip(self.coordinates.places.joints, self.coordinates.names):
            off = (
                np.abs(np.linalg.norm(self.q[:, joint.q], axis=1) - 1.0).max()
                if joint.kind == "ball"
                else 0.0
            )
            if off > CLOSE_TO_ONE:
                raise ValueError(
                    f"q of {name} is not a quaternion of length 1 at every state; expected w, x, y, z"
                )

    @cached_property
    def states(self) -> list[State]:
        """The states, in the user's joints."""
        of = self.joints
        own = of.own_positions(self.q), of.own_speeds(self.qd), of.own_forces(self.tau)
        return [State(i, *map(tuple, state)) for i, state in enumerate(zip(*(part.tolist() for part in own)))]

    @cached_property
    def values(self) -> dict[str, np.ndarray]:
        """The user's values of each quantity, in the model's joints, (states, ...)."""
        own = self.own
        values = {
            name: self.asked(own, name) if own is not None and own.has(name) else self.table(name, brought)
            for name, brought in self.brought.items()
        }
        self.problems = [problem.text for problem in own.problems] if own is not None else []
        return values

    def asked(self, source: object, name: str) -> np.ndarray:
        """A quantity of an engine at the states."""
        state = (self.q, self.qd, self.tau)[: ARGUMENTS[name]]
        return getattr(source, {"gravity": "gravity_balance"}.get(name, name))(*state)

    def table(self, name: str, brought: object) -> np.ndarray:
        """An array of values in the user's joints, in the model's, (states, ...); a row may hold Mbar flattened by rows."""
        count, nv = len(self.q), self.coordinates.nv
        array = numbers_of(brought)
        shape = (count, nv, nv) if name == "mass_matrix" else (count, nv)
        if array is None:
            raise ValueError(
                f"{name} is {shown(brought)}; expected real numbers of shape {shape}, or a function"
            )
        flat = in_shape(array, (count, nv * nv)) if name == "mass_matrix" else None
        values = in_shape(array, shape) if flat is None else flat.reshape(shape)
        if values is None:
            raise ValueError(f"{name} has shape {array.shape}; expected {shape}, its values at the given q")
        return self.joints.mass_matrix(values) if name == "mass_matrix" else self.joints.forces(values)

    @cached_property
    def compared(self) -> dict[str, Compared]:
        """Each quantity of the user and of MuJoCo."""
        scale, comparisons = Entries(self.tree, self.q, self.qd), {}
        for name, own in self.values.items():
            right = self.asked(self.mujoco, name)
            try:
                accelerations = name == "acceleration"
                size = getattr(scale, SCALES.get(name, name))
                size = size(scale.force(self.tau), right) if accelerations else size
            except np.linalg.LinAlgError:
                text = "Mbar of the model is singular at a state: there is no acceleration to compare"
                raise ValueError(text) from None
            turned = self.joints.own_mass_matrix if name == "mass_matrix" else self.joints.own_forces
            size = np.abs(turned(np.broadcast_to(size, right.shape)))
            comparisons[name] = Compared(turned(own), turned(right), size, self.rounding * size)
        return comparisons

    def entries(self, name: str) -> dict[tuple[int, ...], str]:
        """The names of the entries of a quantity, by their place."""
        names = [self.coordinates.speeds[i] for i in self.joints.v]
        symbol = SYMBOLS_OF[name]
        if name == "mass_matrix":
            return {(i, j): f"{symbol}[{a}][{b}]" for i, a in enumerate(names) for j, b in enumerate(names)}
        return {(i,): f"{symbol}[{a}]" for i, a in enumerate(names)}

    @property
    def fails(self) -> bool:
        return any((comparison.ratio > 1.0).any() for comparison in self.compared.values())


def rows_given(name: str, values: Any, size: int, count: int | None) -> np.ndarray:
    """States as rows, (states, size); a number is used for all. ValueError for anything else. count: of states, None: any."""
    array = real_numbers(values)
    expected = f"({'states' if count is None else count}, {size})"
    if array is None:
        raise ValueError(f"{name} is {shown(values)}; expected real numbers of shape {expected}")
    if array.ndim == 0 and count is not None:
        array = np.full((count, size), float(array))
    elif array.ndim == 1 and size in (1, len(array)):
        array = array.reshape(-1, size)
    if (
        array.ndim != 2
        or array.shape[1] != size
        or (count is not None and len(array) != count)
        or not len(array)
    ):
        raise ValueError(f"{name} has shape {np.shape(values)}; expected {expected}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has values that are not finite; expected finite numbers")
    return array
