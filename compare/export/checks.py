"""Exported equations at random states, compared with MuJoCo and exact values; what an evaluation costs."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tmt.derivation.quantities import quantity_of
from tmt.exact.many import Pairs, exact_of_many
from tmt.export.parameters import PAYLOAD, PLACES, Parameters

from ..core import timing
from ..engines.mujoco import engine, read, tree_with_sites
from ..engines.mujoco.calls import loops
from ..engines.mujoco.smaller import changed
from ..experiments.quantities import QUANTITIES, Quantity
from ..judge.agree import closest, share_of
from ..judge.entries import Entries, unit
from ..judge.scale import FACTOR
from ..robots import Robot
from ..robots import states as samples
from ..robots.case import SEED
from ..robots.file import robot_of
from ..run.reference import Compared
from .programs import Array, CProgram, NotRun, Program, States, WrongProgram

ROUNDS = 20  # of timing
STEPS = 1e-3, 1e-2  # dt, s
OF_EXACT = 1e-30  # of the largest exact value: what rounding may leave there of one that is zero
OTHER = " (p)"  # after a quantity: with other values of the parameters
LENGTH = 0.1  # m: how far a mass is moved for them
Values = Mapping[str, Array]  # of arguments by name


class Row(NamedTuple):
    """A quantity: the differences with the largest shares of their tolerance, and these shares."""

    quantity: str
    unit: str
    operations: int
    from_mujoco: float | None  # None: MuJoCo has no such quantity
    of_mujoco: float | None  # share
    from_exact: float
    of_exact: float

    @property
    def passed(self) -> bool:
        return (self.of_mujoco or 0.0) <= 1.0 and self.of_exact <= 1.0


class Outcome(NamedTuple):
    rows: tuple[Row, ...] = ()
    not_run: str = ""  # why it was not run
    wrong: str = ""  # why it cannot run
    file: str = ""  # that was run, where there are others with the same expressions

    @property
    def has_other_parameters(self) -> bool:
        return any(row.quantity.endswith(OTHER) for row in self.rows)

    @property
    def passed(self) -> bool:
        return bool(self.rows) and all(row.passed for row in self.rows)


class Judge:
    """What the values of a program at states are compared with."""

    def __init__(self, compared: Compared, states: States, eps: float):
        self.tree, self.states, self.factor, self.eps = compared.robot.tree, states, FACTOR * eps, eps
        self.mujoco = compared.mujoco.of(compared.robot.case())
        self.scales = Entries(self.tree, *states[:2])

    def rows(self, program: Program, name: str) -> list[Row]:
        taken = self.states[: max(3, len(quantity_of(name).takes))]
        values, exact = program.values(name, self.states), exact_of_many(self.tree, name, *taken)
        rows = []
        for symbol, quantity in QUANTITIES.items():
            if quantity.function == name:
                largest = self.largest(quantity, values[quantity.part or 0], exact.part(quantity.part))
                units = quantity.units
                shown = units[0] if len(units) == 1 else unit(self.tree, *units)
                row_name = name if quantity.part is None else symbol
                rows.append(Row(row_name, shown, program.operations(name), *largest))
        if not rows:  # MuJoCo has none
            row, bound = quantity_of(name), program.rounding(name, self.states)
            labels = row.parts or (name,)
            for k, (label, value) in enumerate(zip(labels, values, strict=True)):
                truth = exact.part(k if row.parts else None)
                most = self.eps * bound[k] + OF_EXACT * np.abs(truth.high).max()
                largest = worst_of(truth.distance(value), most)
                rows.append(Row(label, row.unit, program.operations(name), None, None, *largest))
        return rows

    def largest(self, quantity: Quantity, values: Array, exact: Pairs) -> tuple[float, ...]:
        """The largest difference from MuJoCo and its share of the tolerance, then from the exact value."""
        arguments = self.states[: len(quantity.arguments)]
        theirs = getattr(self.mujoco, quantity.function)(*arguments)
        from_mujoco = values - (theirs if quantity.part is None else theirs[quantity.part])
        scale = getattr(self.scales, quantity.scale)
        if quantity.function == "acceleration":
            scale = scale(self.scales.force(self.states[2]), exact.high)
        tolerance = np.broadcast_to(self.factor * np.asarray(scale), exact.high.shape)
        return *worst_of(from_mujoco, tolerance), *worst_of(exact.distance(values), tolerance)


def checked(
    compared: Compared, make: Callable[[], Program], quantities: Sequence[str], count: int, single: bool,
    other: Compared | None = None, values: Values | None = None,
) -> tuple[Outcome, Program | None]:  # fmt: skip
    """Run a program at random states; a float32 program is asked at states that float32 has.

    other: the file with other values of the parameters, which the program is given then.
    """
    kind, names = np.float32 if single else np.float64, dict.fromkeys(quantities)
    states = [x.astype(kind).astype(float) for x in random_states(compared.robot, count)]
    eps = float(np.finfo(kind).eps)
    judge = Judge(compared, states, eps)
    try:
        program = make()
        rows = [row for name in names for row in judge.rows(program, name)]
        if other and values:
            stated, program.parameters = program.parameters, values
            judge = Judge(other, states, eps)
            changed = [row for name in names for row in judge.rows(program, name)]
            rows += [row._replace(quantity=row.quantity + OTHER) for row in changed]
            program.parameters = stated
    except NotRun as error:
        return Outcome(not_run=str(error)), None
    except WrongProgram as error:
        return Outcome(wrong=str(error)), None
    return Outcome(tuple(rows), file=program.file), program


def random_states(robot: Robot, count: int) -> list[Array]:
    """q (count, nq) within the ranges of the joints, qd and tau (count, nv), dt (count, 1)."""
    rng, most = np.random.default_rng(SEED), samples.largest_speeds_and_torques(robot)[:, None]
    q = robot.coordinates.random(rng, count, robot.ranges)
    rates = rng.uniform(-most, most, (2, count, robot.coordinates.nv))
    return [np.ascontiguousarray(q), *rates, rng.uniform(*STEPS, (count, 1))]


def worst_of(difference: Array, tolerance: Array) -> tuple[float, float]:
    """The difference with the largest share of its tolerance, and the share; inf where it is no number."""
    at = closest(difference, tolerance)
    return abs(float(difference[at])), float(share_of(np.abs(difference), tolerance)[at])


def with_sites(compared: Compared) -> Compared:
    """The same, with the frames of the file's bodies and sites as sites of the Tree."""
    if compared.reading is None:
        return compared
    tree = tree_with_sites(compared.reading)
    return compared._replace(robot=replace(compared.robot, tree=tree))


def other_values(parameters: Parameters) -> Values:
    """Random values near the model's; masses of a payload are some kg."""
    rng, values = np.random.default_rng(SEED), {}
    for name, stated in parameters.values.items():
        part, _ = parameters.places.get(name, ("gravity", 0))
        value = np.array(stated)
        if part == "mass":
            value = (value + name.startswith(PAYLOAD)) * rng.uniform(0.5, 1.5)
        elif part == "inertia":
            root = rng.uniform(-LENGTH, LENGTH, (3, 3))  # of the second moment of 1 kg
            second = root @ root.T
            tensor = np.trace(second) * np.eye(3) - second
            value = np.array([tensor[place] for place in PLACES])
        else:
            value = value + rng.uniform(-LENGTH, LENGTH, value.shape)
        values[name] = value
    return values


def with_values(compared: Compared, parameters: Parameters, values: Values) -> Compared:
    """What is compared, from the file with these values."""
    reading = read(changed(compared.mujoco.source, compared.robot.tree, parameters, values))
    shown = compared.robot.name
    return with_sites(Compared(compared.reference, robot_of(reading, shown), engine(reading), reading))


def times(
    compared: Compared, program: Program | None, quantities: Sequence[str], count: int
) -> list[dict[str, Any]]:
    """ns of an evaluation by C, also compiled for this processor, and by mj_forward; []: not C."""
    if not isinstance(program, CProgram):
        return []
    names, states = list(dict.fromkeys(quantities)), random_states(compared.robot, count)
    libraries = {"c": program.library} | program.faster()
    calls: dict[object, Callable[..., Any]] = {}
    for name in names:
        for flag, library in libraries.items():
            calls[name, flag], _ = program.call(name, states, library)
    of_mujoco = loops(compared.mujoco.of(compared.robot.case()), *(x[0] for x in states[:3]))
    if of_mujoco:
        calls["mujoco"] = partial(of_mujoco["MuJoCo, mj_forward"], count)
    seconds = timing.fastest(calls, ROUNDS, time.thread_time)
    ns = {key: 1e9 * taken / count for key, taken in seconds.items()}
    rows = []
    for name in names:
        faster = {flag: ns[name, flag] for flag in libraries if flag != "c"}
        rows.append({"quantity": name, "c": ns[name, "c"], "mujoco": ns.get("mujoco"), "faster": faster})
    return rows
