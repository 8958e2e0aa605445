"""Exported equations at random states, compared with MuJoCo and exact values; what an evaluation costs."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import tmt
from tmt.derivation.quantities import argument_of, quantity_of
from tmt.exact.many import Pairs, exact_of_many
from tmt.export.parameters import Parameters

from ..core import timing
from ..engines.mujoco import tree_with_sites
from ..engines.mujoco.runs import loops
from ..experiments.quantities import QUANTITIES
from ..judge.agree import closest, share_of
from ..judge.entries import Entries
from ..judge.scale import FACTOR, gain_scale
from ..robots import Robot
from ..robots import states as samples
from ..robots.case import SEED
from ..run.reference import Compared
from .programs import Array, CProgram, NotRun, Program, States, WrongProgram

ROUNDS = 20  # of timing
STEPS = 1e-3, 1e-2  # dt, s
OTHER = " (p)"  # after a quantity: with other values of the parameters
LENGTH = 0.1  # m: how far a mass is moved for them


class Row(NamedTuple):
    """A quantity: the differences with the largest shares of their tolerance, and these shares."""

    quantity: str
    unit: str
    operations: int
    from_mujoco: float | None  # None: not compared
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


def checked(
    compared: Compared, make: Callable[[], Program], quantities: Sequence[str], count: int, single: bool,
    chosen: Parameters | None = None,
) -> tuple[Outcome, Program | None]:  # fmt: skip
    """Run a program at random states; a float32 program is asked at states that float32 has.

    chosen: parameters, of which other values are tried too, beside tmt on a Tree that has them.
    """
    kind, names = np.float32 if single else np.float64, dict.fromkeys(quantities)
    states = [x.astype(kind).astype(float) for x in random_states(compared.robot, count)]
    tree, factor, rows = compared.robot.tree, FACTOR * float(np.finfo(kind).eps), list[Row]()
    mujoco = compared.mujoco.of(compared.robot.case())
    try:
        program = make()
        for name in names:
            rows += rows_of(program, name, tree, states, factor, mujoco)
        if chosen and chosen.values:
            program.parameters = other_values(chosen, kind)
            numbers = {name: list(value) for name, value in program.parameters.items()}
            other = tmt.Tree(**vars(chosen.applied(numbers)))
            for name in names:
                more = rows_of(program, name, other, states, factor)
                rows += [row._replace(quantity=row.quantity + OTHER) for row in more]
    except NotRun as error:
        return Outcome(not_run=str(error)), None
    except WrongProgram as error:
        return Outcome(wrong=str(error)), None
    return Outcome(tuple(rows), file=program.file), program


def rows_of(
    program: Program, name: str, tree: tmt.Tree, states: States, factor: float, mujoco: Any = None
) -> Iterator[Row]:
    """A row for each array of a quantity: its values beside the exact ones of a Tree and, if given, MuJoCo's."""
    row, operations, entries = quantity_of(name), program.operations(name), Entries(tree, *states[:2])
    values = program.values(name, states)
    exact = exact_of_many(tree, name, *states[: max(3, len(row.takes))])
    counterparts = {symbol: x for symbol, x in QUANTITIES.items() if x.function == name}
    labels = list(counterparts) if row.parts and counterparts else row.parts or [name]
    sizes = [] if counterparts else list(scales_of(entries, name, states, exact))
    for k, label in enumerate(labels):
        value, truth = (values[:, k], exact.part(k)) if row.parts else (values, exact)
        from_mujoco: tuple[float | None, float | None] = None, None
        if counterparts:
            quantity = list(counterparts.values())[k]
            unit = quantity.unit(tree)
            scale = quantity.size(entries, states[2], truth.high)
        else:
            unit, scale = row.unit, sizes[k]
        tolerance = np.broadcast_to(factor * np.asarray(scale), value.shape)
        if counterparts and mujoco is not None:
            theirs = getattr(mujoco, name)(*states[: len(row.takes)])
            from_mujoco = worst_of(value - (theirs[k] if row.parts else theirs), tolerance)
        yield Row(label, unit, operations, *from_mujoco, *worst_of(truth.distance(value), tolerance))


def scales_of(entries: Entries, name: str, states: States, exact: Pairs) -> Sequence[Array]:
    """The scales of a quantity that MuJoCo has not, one for each of its arrays."""
    (q, qd, third, dt), tree, n = states, entries.tree, entries.tree.coordinates.nv
    function, argument = name.partition(":")[0], argument_of(name)
    if function == "coriolis_matrix":
        return [entries.coriolis_matrix]
    if function == "regressor":
        return [entries.regressor(third)]
    if function == "inverse_mass_matrix":
        return [entries.solved(np.eye(n), exact.high)]
    if function == "inverse_dynamics":
        return [entries.residual(entries.force() + gain_scale(tree, q, qd), third)]
    if function == "inverse_dynamics_derivatives":
        return entries.force_rates(third)
    if function in ("derivatives", "step_derivatives"):
        qdd, by = tmt.acceleration(tree, q, qd, third), tmt.derivatives(tree, q, qd, third)
        of_rates = entries.derivatives(third, qdd, by)
        return of_rates if function == "derivatives" else [entries.step(dt[:, :, None], by, of_rates)]
    # what belongs to a frame is that of a body that has its centre of mass there
    site, names = tree.site_of(argument), [f"body {b}" for b in range(len(tree.mass) + 1)]
    body = {"body_joint": site.joint, "mass": 0.0, "com": site.offset, "inertia": np.zeros((3, 3))}
    fields = {field: (*getattr(tree, field), value) for field, value in body.items()}
    of_body = Entries(tmt.Tree(**vars(tree) | fields | {"body_names": tuple(names)}), q, qd)
    if function == "frame_pose":
        scale = np.full(exact.high.shape, float(of_body.count[-1]))
        scale[..., 3] = of_body.positions[:, -1]
        return [scale]
    both = (of_body.T, of_body.B) if function == "frame_jacobian" else (of_body.v_conv, of_body.w_conv)
    shape = len(q), 3, *exact.high.shape[2:]
    return [np.concatenate([np.broadcast_to(scale[:, -1], shape) for scale in both], axis=1)]


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


def other_values(chosen: Parameters, kind: type = float) -> dict[str, Array]:
    """Random values near the model's, numbers of that kind: 0.5 to 1.5 kg more, and an inertia that a body can have."""
    rng, values = np.random.default_rng(SEED), {}
    for name, stated in chosen.values.items():
        part, _ = chosen.places.get(name, ("gravity", 0))
        by = rng.uniform(-LENGTH, LENGTH, len(stated))
        if part == "mass":
            by = 1.0 + 5.0 * by  # kg
        elif part == "inertia":  # kg m2, of 1 kg
            by = LENGTH**2 * (np.array([2.0] * 3 + [0.0] * 3) + 2.0 * by)
        values[name] = (np.array(stated) + by).astype(kind).astype(float)
    return values


def times(
    compared: Compared, program: Program | None, quantities: Sequence[str], count: int
) -> list[dict[str, Any]]:
    """ns of an evaluation by C and by mj_forward; []: not C."""
    if not isinstance(program, CProgram):
        return []
    states = random_states(compared.robot, count)
    calls: dict[str, Callable[..., Any]] = {name: program.call(name, states)[0] for name in quantities}
    of_mujoco = loops(compared.mujoco.of(compared.robot.case()), *(x[0] for x in states[:3]))
    if of_mujoco:
        calls["mujoco"] = partial(of_mujoco["MuJoCo, mj_forward"], count)
    seconds = timing.fastest(calls, ROUNDS, time.thread_time)
    ns = {name: 1e9 * taken / count for name, taken in seconds.items()}
    return [{"quantity": x, "c": ns[x], "mujoco": ns.get("mujoco")} for x in dict.fromkeys(quantities)]
