"""The values of exported equations at random states, compared with MuJoCo and with exact values; and what an evaluation costs."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from tmt.compiled import evaluator
from tmt.exact.many import exact_of_many

from ..core import timing
from ..engines import Dynamics
from ..engines.mujoco.calls import MinimalCalls
from ..engines.mujoco.dynamics import convective_accelerations
from ..experiments.quantities import QUANTITIES
from ..judge.agree import closest
from ..judge.entries import Entries, unit
from ..judge.scale import FACTOR
from ..robots import Robot
from ..robots import states as samples
from ..robots.case import SEED
from ..run.reference import Compared
from .programs import CProgram, NotRun, Program, WrongProgram

ROUNDS = 20  # of timing


class Row(NamedTuple):
    """A quantity: its largest share of its tolerance, and there the difference and the tolerance; `unit` is theirs."""

    quantity: str
    unit: str
    operations: int
    from_mujoco: float
    of_mujoco: float  # share
    from_exact: float
    of_exact: float

    @property
    def passed(self) -> bool:
        return self.of_mujoco <= 1.0 and self.of_exact <= 1.0


class Outcome(NamedTuple):
    rows: tuple[Row, ...] = ()
    not_run: str = ""  # why it was not run
    wrong: str = ""  # why it cannot run
    of: str = ""  # the file that was run, where there are others with the same expressions

    @property
    def passed(self) -> bool:
        return bool(self.rows) and all(row.passed for row in self.rows)


def checked(
    compared: Compared, make: Callable[[], Program], quantities: Sequence[str], states: int, single: bool
) -> tuple[Outcome, Program | None]:
    """Run a program at random states; a float32 program is asked at states that float32 has."""
    q, qd, tau = (
        x.astype(np.float32).astype(float) if single else x for x in random_states(compared.robot, states)
    )
    eps = float(np.finfo(np.float32 if single else float).eps)
    theirs, scales, rows = compared.mujoco.of(compared.robot.case()), Entries(compared.robot.tree, q, qd), []
    try:
        program = make()
        for name in dict.fromkeys(quantities):
            own = program.values(name, q, qd, tau)
            count = program.operations(name)
            new = rows_of(compared.robot.tree, name, count, own, theirs, scales, (q, qd, tau), FACTOR * eps)
            if not new:
                raise WrongProgram(f"{name} has no counterpart in compare.experiments.quantities")
            rows += new
    except NotRun as error:
        return Outcome(not_run=str(error)), None
    except WrongProgram as error:
        return Outcome(wrong=str(error)), None
    return Outcome(tuple(rows), of=program.of), program


def random_states(robot: Robot, count: int) -> list[np.ndarray]:
    """q (count, nq) within the ranges of the joints, qd and tau (count, nv)."""
    rng, most = np.random.default_rng(SEED), samples.largest_speeds_and_torques(robot)[:, None]
    q = robot.coordinates.random(rng, count, robot.ranges)
    return [np.ascontiguousarray(q), *rng.uniform(-most, most, (2, count, robot.coordinates.nv))]


def rows_of(
    tree,
    name: str,
    operations: int,
    own: list,
    theirs: Dynamics,
    scales: Entries,
    states: tuple,
    factor: float,
) -> list[Row]:
    """A row for each array of a quantity."""
    exact, rows = exact_of_many(tree, name, *states), []
    for symbol, of in QUANTITIES.items():
        if of.function != name:
            continue
        taken, part = states[: len(of.arguments)], of.part
        if name == "convective_terms" and tree.coordinates.balls:
            values = convective_accelerations(theirs, *taken)
        else:
            values = getattr(theirs, name)(*taken)
        right = exact.part(part)
        scale = getattr(scales, of.scale)
        if name == "acceleration":
            scale = scale(scales.force(states[2]), right.high)
        tolerance = np.broadcast_to(factor * np.asarray(scale), right.high.shape)
        mine = np.asarray(own[part or 0], dtype=float)
        from_mujoco, from_exact = mine - (values if part is None else values[part]), right.distance(mine)
        units = of.units[0] if len(of.units) == 1 else unit(tree, *of.units)
        worst = [worst_of(difference, tolerance) for difference in (from_mujoco, from_exact)]
        rows.append(Row(symbol if part is not None else name, units, operations, *worst[0], *worst[1]))
    return rows


def worst_of(difference: np.ndarray, tolerance: np.ndarray) -> tuple[float, float]:
    """The difference with the largest share of its tolerance, and that share; inf where it is not a number."""
    at = closest(difference, tolerance)
    value, most = abs(float(difference[at])), float(tolerance[at])
    return value, value / most if most and np.isfinite(value) else 0.0 if value == 0.0 else np.inf


def times(compared: Compared, program: Program | None, quantities: Sequence[str], states: int) -> list[dict]:
    """ns of one evaluation by C code, by tmt's compiled code, one state after the other, and by mj_forward; {}: not C."""
    if not isinstance(program, CProgram):
        return []
    arrays, tree, calls = random_states(compared.robot, states), compared.robot.tree, {}
    for name in dict.fromkeys(quantities):
        calls[name, "c"] = program.call(name, *arrays)[0]
        compiled = evaluator(tree, name)
        out = np.empty((states, compiled.size))
        calls[name, "tmt"] = lambda compiled=compiled, out=out: compiled.fill(False, out, *arrays)
    if not MinimalCalls.unavailable():
        loops = MinimalCalls(compared.mujoco.of(compared.robot.case())).loops(*(x[0] for x in arrays))
        forward = loops["MuJoCo, mj_forward"][1]
        calls["", "mujoco"] = lambda: forward(states)
    for call in calls.values():
        call()  # its code is compiled, or loaded, on the first call
    seconds = timing.fastest(calls, ROUNDS)
    ns = {key: 1e9 * value / states for key, value in seconds.items()}
    return [
        {"quantity": name, "c": ns[name, "c"], "tmt": ns[name, "tmt"], "mujoco": ns.get(("", "mujoco"))}
        for name in dict.fromkeys(quantities)
    ]
