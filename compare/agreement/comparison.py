"""The arguments of assert_agrees, validated, and each quantity of the user and of MuJoCo at the states.

Of a Coriolis matrix C, which Mbar and h do not determine, two quantities are compared: C qd, and C + C' =
dMbar/dt, which says that dMbar/dt - 2 C is skew.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import product
from typing import Any, cast

import numpy as np
from numpy import ndarray

from tmt import literal
from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.values import shown

from ..core.text import say
from ..core.words import capital
from ..engines.own import METHOD_NAMES, QUANTITIES, OwnEquations, OwnError
from ..engines.own.functions import (
    converted,
    in_shape,
    in_words,
    is_function,
    numbers_of,
)
from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from ..robots.file import robot_of
from ..robots.joint_map import joint_map
from ..robots.scene import is_number
from ..robots.states import random
from .values import COMPARED, OF_CORIOLIS, PRODUCT, SYMBOLS, SYMMETRIC, Compared, State

DEFAULT_STATES = 100
OWN_SECONDS = 20.0  # s for the user's functions at random states


class Comparison:
    """A user's quantities and MuJoCo's at the same states; the arguments are those of `assert_agrees`.

    brought: what is given. values, right, tolerances: of each quantity in the model's joints, (states, ...).
    compared: the same in the user's. coriolis: the user's matrix. problems: other errors of the user's
    functions, a line each.
    """

    def __init__(
        self, mjcf: Any, quantities: Mapping[str, Any], q: Any, qd: Any, tau: Any,
        joints: Sequence[str] | None, rtol: float, states: int, seed: int,
    ) -> None:  # fmt: skip
        from ..engines.mujoco import engine, read, tree_with_sites  # here: `import compare` need not wait
        from ..engines.mujoco.reading import origin_of

        self.brought = {name: value for name, value in quantities.items() if value is not None}
        if not self.brought:
            expected = [name for name in SYMBOLS if name in QUANTITIES]
            raise ValueError(f"nothing to compare: expected {', '.join(expected)} or some of them")
        if not is_number(rtol) or rtol < 0.0:
            raise ValueError(f"rtol is {shown(rtol)}; expected a number of at least 0")
        self.rtol, self.rounding = float(rtol), FACTOR * EPS + float(rtol)
        self.reading = cast(Any, read(origin_of(mjcf)))  # its source may be a model
        self.robot = robot_of(self.reading, "the model")
        self.mujoco = engine(self.reading).of(self.robot.case())
        self.tree, self.coordinates = tree_with_sites(self.reading), self.robot.coordinates
        self.warned: list[str] = []
        try:
            self.take(q, qd, tau, joints, states, seed)
        except OwnError as error:
            from ..engines.mujoco.parameters import closed_loop

            loop = closed_loop(self.reading, "the model")  # of which equations may have fewer joints
            raise OwnError(f"{error}. {capital(say(loop))}." if loop else str(error)) from error
        for text in self.warned:
            warnings.warn(text, stacklevel=3)
        self.compare()

    def take(self, q: Any, qd: Any, tau: Any, joints: Sequence[str] | None, states: int, seed: int) -> None:
        """The functions, the states, and the user's values at these."""
        self.joints = joint_map(self.coordinates, joints)
        functions = {name: value for name, value in self.brought.items() if is_function(value)}
        self.equations: OwnEquations | None = None  # of the user's functions, if there are any
        if functions:
            self.equations = OwnEquations(functions, self.coordinates, self.joints, self.tree, ())
        if q is None:
            for name, value in (self.brought | {"qd": qd, "tau": tau}).items():
                if value is not None and name not in functions:
                    expected = f"a function, or q of shape (states, {self.coordinates.nq})"
                    raise ValueError(f"{name} is {shown(value)}, and q is not given; expected {expected}")
            self.take_random(cast(OwnEquations, self.equations), states, seed)
        else:
            self.take_states(q, qd, tau)
            needs_speeds = {"bias", "acceleration", "coriolis_matrix"} & {*self.brought}
            if np.ndim(qd) and not self.qd.any() and needs_speeds:
                self.warned.append("qd is 0 at all states: no velocity terms are compared")
            if states != DEFAULT_STATES:
                used = f"the {len(self.q)} states of q are compared"
                self.warned.append(f"states={shown(states)} is not used: {used}")
        self.values = {
            name: self.asked(self.equations, name) if name in functions else self.table(name, value)
            for name, value in self.brought.items()
        }
        self.problems = [problem.text for problem in self.equations.problems] if self.equations else []

    def take_random(self, equations: OwnEquations, states: int, seed: int) -> None:
        """Random states, fewer if the user's functions are slow."""
        for name, value, least in (("states", states, 1), ("seed", seed, 0)):
            if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
                raise ValueError(f"{name} is {shown(value)}; expected a whole number of at least {least}")
        sample = random(self.robot, states, 0, seed)
        self.warned += map(say, sample.notes)
        equations.try_at(sample.q, sample.qd, sample.tau)
        count = equations.affordable(len(sample.q), OWN_SECONDS)
        if count < len(sample.q):
            time = f"{equations.seconds:.2g} s per state"
            self.warned.append(f"{count} states instead of {states}: your functions take {time}")
        self.q, self.qd, self.tau = sample.q[:count], sample.qd[:count], sample.tau[:count]

    def take_states(self, q: Any, qd: Any, tau: Any) -> None:
        """The given states, in the user's joints."""
        self.q = self.joints.positions(rows_given("q", q, ("states", self.coordinates.nq)))
        shape, rows = (len(self.q), self.coordinates.nv), {}
        for name, value in {"qd": qd, "tau": tau}.items():
            needed = [quantity for quantity in self.brought if name in QUANTITIES[quantity].state]
            if value is None and needed:
                raise ValueError(f"{needed[0]} depends on {name}; expected {name} of shape {shape}, or 0.0")
            rows[name] = rows_given(name, 0.0 if value is None else value, shape)
        self.qd, self.tau = self.joints.speeds(rows["qd"]), self.joints.forces(rows["tau"])
        for joint, name in zip(self.coordinates.places.joints, self.coordinates.names):
            lengths = np.linalg.norm(self.q[:, joint.q], axis=1)
            if joint.kind == "ball" and np.abs(lengths - 1.0).max() > CLOSE_TO_ONE:
                wanted = "a quaternion of length 1 at every state; expected w, x, y, z"
                raise ValueError(f"q of {name} is not {wanted}")

    def asked(
        self, source: object, name: str, q: ndarray | None = None, qd: ndarray | None = None
    ) -> ndarray:
        """A quantity of an engine at the states, or at others."""
        state = self.q if q is None else q, self.qd if qd is None else qd, self.tau
        return np.asarray(getattr(source, METHOD_NAMES[name])(*state[: QUANTITIES[name].arguments]))

    def table(self, name: str, brought: object) -> ndarray:
        """An array of the user's values in the model's joints; a row may hold Mbar flattened by rows."""
        count, nv = len(self.q), self.coordinates.nv
        array, shape = numbers_of(brought), (count, *QUANTITIES[name].shape_for(nv))
        if name == "mass_matrix" and array is not None:
            flat = in_shape(array, (count, nv * nv))
            brought = brought if flat is None else flat.reshape(count, nv, nv)
        values = converted(name, brought, shape, ", or a function", ", its values at the given q")
        return self.joints.mass_matrix(values) if len(shape) == 3 else self.joints.forces(values)

    def compare(self) -> None:
        """MuJoCo's values, the tolerances, and all in the user's joints."""
        self.coriolis = self.values.pop("coriolis_matrix", np.zeros(0))
        self.right = {name: self.asked(self.mujoco, name) for name in self.values}
        if self.coriolis.size:
            self.values |= parts(self.coriolis, self.qd)
            self.right |= parts(literal.coriolis_matrix(self.tree, self.q, self.qd), self.qd)
            self.right[PRODUCT] = self.mujoco.bias(self.q, self.qd) - self.mujoco.gravity_balance(self.q)
        self.tolerances, self.compared = dict[str, ndarray](), dict[str, Compared]()
        for name, right in self.right.items():
            rounding = FACTOR * EPS * np.broadcast_to(self.scale(name, right), right.shape)
            self.tolerances[name] = rounding + self.rtol * np.abs(right).max(axis=0)
            own, allowed = self.own(name), (rounding, self.tolerances[name])
            values = own(self.values[name]), own(right), *(np.abs(own(part)) for part in allowed)
            self.compared[name] = Compared(*values)

    def own(self, name: str) -> Callable[[ndarray], ndarray]:
        """Takes a quantity to the user's joints."""
        return self.joints.own_mass_matrix if len(COMPARED[name].shape) == 2 else self.joints.own_forces

    def scale(self, name: str, right: ndarray) -> ndarray:
        """The scale of each entry of a quantity, in the model's joints. right: MuJoCo's values."""
        scale = Entries(self.tree, self.q, self.qd)
        if name in OF_CORIOLIS:  # the product is a difference from the weight
            C = scale.coriolis_matrix
            of_product = np.einsum("sij,sj->si", C, np.abs(self.qd)) + scale.weight
            return of_product if name == PRODUCT else 2.0 * C
        if name != "acceleration":
            return {"mass_matrix": scale.mass_matrix, "bias": scale.bias, "gravity": scale.weight}[name]
        try:
            return scale.acceleration(scale.force(self.tau), right)
        except np.linalg.LinAlgError:
            text = "Mbar of the model is singular at a state: there is no acceleration to compare"
            raise ValueError(text) from None

    def entries(self, name: str) -> dict[tuple[int, ...], str]:
        """The names of the entries of a quantity, by their place."""
        names = [self.coordinates.speeds[i] for i in self.joints.v]
        places = product(range(len(names)), repeat=len(COMPARED[name].shape))
        return {place: SYMBOLS[name] + "".join(f"[{names[i]}]" for i in place) for place in places}

    @cached_property
    def states(self) -> list[State]:
        """The states, in the user's joints."""
        joints = self.joints
        own = joints.own_positions(self.q), joints.own_speeds(self.qd), joints.own_forces(self.tau)
        return [State(i, *map(tuple, state)) for i, state in enumerate(zip(*(part.tolist() for part in own)))]

    @property
    def compensated(self) -> tuple[str, ...]:
        """The bodies with gravcomp, where all that differs is that the comparison has their whole weight."""
        bodies = [part.names for part in self.reading.features if part.feature == "gravcomp"]
        if not bodies or not self.fails:
            return ()
        torque = self.mujoco.compensation(self.q, self.reading.model.body_gravcomp)
        for name, compared in self.compared.items():
            taken = self.own(name)(torque) if name in ("bias", "gravity") else 0.0
            if not (np.abs(compared.yours + taken - compared.right) <= compared.tolerance).all():
                return ()
        return tuple(bodies[0])

    @property
    def fails(self) -> bool:
        return any(compared.fails for compared in self.compared.values())


def parts(C: ndarray, qd: ndarray) -> dict[str, ndarray]:
    """What is compared of C (states, nv, nv) at speeds qd (states, nv)."""
    return {PRODUCT: np.einsum("sij,sj->si", C, qd), SYMMETRIC: C + C.swapaxes(1, 2)}


def rows_given(name: str, values: Any, shape: tuple[int | str, int]) -> ndarray:
    """States as rows, (states, n), in this shape; a number is used for all. ValueError for anything else."""
    count, size = shape
    array = numbers_of(values)
    if array is not None and isinstance(count, int) and array.ndim == 0:
        values = np.full((count, size), float(array))
    elif array is not None and not isinstance(count, int) and array.ndim == 1 and size in (1, len(array)):
        values = array.reshape(-1, size)
    rows = converted(name, values, shape)
    if not len(rows):
        raise ValueError(f"{name} has shape {np.shape(values)}; expected {in_words(shape)}")
    if not np.isfinite(rows).all():
        raise ValueError(f"{name} has values that are not finite; expected finite numbers")
    return rows
