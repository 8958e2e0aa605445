"""The ways to a derivative: MuJoCo's differences over their eps, tmt's exact ones; their errors."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product, repeat
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.linalg import matrix_balance

import tmt
from tmt.compiled.evaluator import Evaluator
from tmt.exact.many import Pairs, exact_of_many

from ...core.check import Result
from ...core.rows import Row, column
from ...engines.mujoco import Mujoco
from ...engines.mujoco.calls import Call, of_inverse, of_steps, of_transition
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.mujoco.engine import methods_for
from ...judge.agree import share_of
from ...judge.entries import Entries
from ...judge.rounding import LEFT_OUT, of_positions
from ...judge.scale import EPS, FACTOR, gain_scale
from .subjects import Subject, dynamics_of

Array = np.ndarray
Units = Sequence[tuple[str, str]]  # of movements, of speeds ...: of turns, of slides
SIZES = tuple(10.0**-k for k in range(2, 12))  # of differences
USUAL = 1e-6  # of mjd_transitionFD in MuJoCo's own samples
ONE_SIDED, CENTRED = "one-sided", "centred"
TRANSITION, BY_STEPS = "mjd_transitionFD", "differences of mj_step"
BY_INVERSE, NUMPY, COMPILED = "mjd_inverseFD", "tmt, NumPy", "tmt, compiled"
EXACT = NUMPY, COMPILED
INVERSE, FORWARD = "dtau/dq and dtau/dqd", "dqdd/dq, dqdd/dqd and dqdd/dtau"
STATE: Units = ("rad", "m"), ("rad/s", "m/s")
FORCE: Units = (("N m", "N"),)
ZERO = 1e-25  # what is no larger with 31 digits is zero
TRUNCATED = 2.0 / 99.0  # of the difference between an eps and ten times that: twice the term in eps^2


@dataclass(kw_only=True)
class DerivativeRow(Row):
    """One way to a derivative: its largest error over the states of a subject."""

    subject: str  # a scene, or what is hard about its states
    quantity: str  # of a Quantity
    way: str
    eps: float | None  # of a difference, rad, m and per s; None: it is exact
    error: float | None  # relative to the size of its unit; None: not a number
    states: int
    unit: str  # of the derivatives with that error
    largest: float  # that size, see `sizes`

    @property
    def size(self) -> float:
        """The error; infinite where it is not a number."""
        return inf if self.error is None else self.error


@dataclass(kw_only=True)
class CostRow(Row):
    """One way to a derivative: the error that it reaches, and the time of an evaluation."""

    quantity: str
    way: str
    best_eps: float | None
    error: float | None  # with that
    time: float | None = column("us")


@dataclass(kw_only=True)
class ContactRow(Row):
    """Centred differences of the step of a robot that stands, beside those of the eps that agrees best with the next one."""

    posture: str
    integrator: str
    contacts: int  # in which forces act
    eps: float
    difference: float | None  # relative to the size of its unit; None: not finite
    changed: str  # pairs that open or close within eps; "": contacts stay


@dataclass
class DerivativesResult(Result):
    """Its result: what its figure needs, too."""

    main: str = ""  # the subject that is timed
    integrator: str = ""  # of which the eps of a step is advised
    drawn: Sequence[DerivativeRow] = ()  # from which it is, and those of the inverse dynamics
    times: dict[tuple[str, str], float] = field(default_factory=dict)  # s, by quantity and way


def worst_of_each_eps(rows: Iterable[DerivativeRow]) -> dict[float, DerivativeRow]:
    """The row with the largest error for each eps, 0 where there is none; from coarse to fine."""
    ascending = sorted(rows, key=lambda row: (-(row.eps or 0.0), row.size))
    return {row.eps or 0.0: row for row in ascending}


def best_of(rows: Iterable[DerivativeRow]) -> DerivativeRow:
    """The row with the largest error for the eps that serves these rows best."""
    return min(worst_of_each_eps(rows).values(), key=lambda row: row.size)


class Quantity(NamedTuple):
    """A derivative that has several ways; the values of each are (states, rows, columns)."""

    name: str  # in tables
    function: str  # the full name of tmt's quantity
    units: Units  # of its rows; columns are movements, speeds and torques
    integrator: str = ""  # MuJoCo's, of a step

    def arguments(self, subject: Subject, dt: float) -> list[Array]:
        """What tmt's quantity takes at all states."""
        third = accelerations(subject) if self.name == INVERSE else subject.tau
        steps = [np.full((subject.states, 1), dt)] if self.integrator else []
        return [subject.q, subject.qd, third, *steps]

    def exact_values(self, subject: Subject, dt: float) -> Pairs:
        values = exact_of_many(subject.tree, self.function, *self.arguments(subject, dt))
        return Pairs(*map(side_by_side, values))

    def by_numpy(self, subject: Subject, dt: float) -> Array:
        values = tmt.literal.literal(self.function)(*self.arguments(subject, dt), subject.tree)
        return side_by_side(np.asarray(values) if self.integrator else np.stack(values, axis=1))

    def by_machine_code(self, subject: Subject, dt: float) -> Array | None:
        evaluator = Evaluator(subject.tree, self.function)
        rows = evaluator.of_rows(*self.arguments(subject, dt))
        return None if rows is None else side_by_side(rows.reshape(subject.states, *evaluator.shape))

    def scale(self, subject: Subject, dt: float) -> Array:
        """Of each entry."""
        entries, qdd = Entries(subject.tree, subject.q, subject.qd), accelerations(subject)
        if self.name == INVERSE:
            return np.concatenate(entries.force_rates(qdd), axis=2)
        by = tmt.derivatives(subject.q, subject.qd, subject.tau, subject.tree)
        scale = entries.derivatives(subject.tau, qdd, by)
        return entries.step(dt, by, scale) if self.integrator else np.concatenate(scale[:3], axis=2)

    def differences(self, dynamics: MujocoDynamics, subject: Subject, dt: float, k: int) -> list["Way"]:
        """MuJoCo's ways at state k."""
        q, qd = subject.q[k], subject.qd[k]
        if self.name == INVERSE:
            call = partial(of_inverse, dynamics, q, qd, accelerations(subject)[k])
            return [Way(BY_INVERSE, False, call)]
        functions, ways = {BY_STEPS: of_steps} if self.integrator else {}, []
        if functions and dynamics.stepper(dt, self.integrator).takes_transition:
            functions = {TRANSITION: of_transition} | functions
        for side, (name, function) in product((ONE_SIDED, CENTRED), functions.items()):
            state = dynamics, q, qd, subject.tau[k], dt, self.integrator, side == CENTRED
            ways.append(Way(f"{name}, {side}", side == CENTRED, partial(function, *state)))
        return ways


class Way(NamedTuple):
    """Differences, (rows, columns): of all columns of the quantity, or of the first ones."""

    name: str
    centred: bool
    call: Callable[[float], Call]  # of an eps


def side_by_side(values: Array) -> Array:
    """Matrices (states, rows, columns); of (states, parts, nv, nv) the first three beside each other."""
    return values if values.ndim == 3 else np.concatenate(values[:, :3].swapaxes(0, 1), axis=2)


def step_name(integrator: str) -> str:
    return f"A and B, {integrator}"


def quantities(subject: Subject, integrators: Sequence[str]) -> list[Quantity]:
    """The derivatives of accelerations and torques, and of a step of each of these integrators of MuJoCo."""
    methods = methods_for(subject.tree)
    schemes = {name: methods[name].scheme for name in integrators if name in methods}
    steps = [Quantity(step_name(x), f"step_derivatives:{scheme}", STATE, x) for x, scheme in schemes.items()]
    forward = Quantity(FORWARD, "derivatives", (("rad/s2", "m/s2"),))
    return [forward, Quantity(INVERSE, "inverse_dynamics_derivatives", FORCE), *steps]


def accelerations(subject: Subject) -> Array:
    return tmt.acceleration(subject.q, subject.qd, subject.tau, subject.tree)


def units_of(tree: tmt.Tree, units: Units) -> Array:
    """The unit of each movement, each speed ..., of which there are these."""
    joints = zip(tree.kind, tree.coordinates.joints)
    slides = [kind == "slide" for kind, joint in joints for _ in joint.speeds]
    return np.array([pair[is_slide] for pair in units for is_slide in slides])


def relative(
    difference: Array, exact: Array, units: tuple[Array, Array], least: Array | float = ZERO
) -> tuple[float, str, float]:
    """The largest difference over its size, see sizes; the unit there, and that size.

    Sizes up to `least` are zeros. The first is inf where a difference is not a number.
    """
    size = sizes(exact, units)
    error = share_of(np.abs(difference), np.where(size > least, size, np.inf))
    at = np.unravel_index(int(error.argmax()), error.shape)
    return float(error[at]), f"{units[0][at[0]]} per {units[1][at[1]]}", float(size[at])


def sizes(exact: Array, units: tuple[Array, Array]) -> Array:
    """What each difference is relative to: the largest exact entry of its unit, (rows, columns).

    A step has units of the state in its rows and columns, and a block of them may be as good as zero. They
    are balanced: speeds are in units of the robot's own time. Then one size is that of all A, and of B for
    each unit.
    """
    (rows, columns), size = units, np.zeros(exact.shape)
    for unit, by in product(np.unique(rows), np.unique(columns)):
        block = np.ix_(rows == unit, columns == by)
        size[block] = np.abs(exact[block]).max()
    if not np.isin(rows, columns).all():
        return size
    names, first, place = np.unique(rows, return_index=True, return_inverse=True)
    couplings = size[np.ix_(first, first)] * (1.0 - np.eye(len(names)))
    scale = matrix_balance(couplings, permute=False, separate=True)[1][0]
    scales = dict(zip(names, scale))
    of_rows, of_columns = scale[place][:, None], np.array([scales.get(unit, 1.0) for unit in columns])
    balanced, groups = size / of_rows * of_columns, np.where(np.isin(columns, names), "state", columns)
    largest = [balanced[:, groups == group].max() for group in groups]
    return of_rows * largest / of_columns


class Task(NamedTuple):
    """The errors at one subject."""

    subject: Subject
    integrators: Sequence[str]
    compiles: bool


class Measured(NamedTuple):
    """What is known of a quantity at the states of a subject, before anything is timed."""

    subject: Subject
    quantity: Quantity
    rows: list[DerivativeRow]
    shares: dict[str, float]  # of the tolerance, by the way: of tmt's and of the centred differences


def measured(task: Task, mujoco: Mujoco, dt: float) -> list[Measured]:
    """All ways to each quantity at all states."""
    subject, result = task.subject, []
    dynamics = dynamics_of(mujoco, subject)
    for quantity in quantities(subject, task.integrators):
        exact, tolerance = quantity.exact_values(subject, dt), FACTOR * EPS * quantity.scale(subject, dt)
        by_tmt = {NUMPY: quantity.by_numpy(subject, dt)}
        machine = quantity.by_machine_code(subject, dt) if task.compiles else None
        if machine is not None:
            by_tmt[COMPILED] = machine
        row = partial(row_of, subject, quantity, exact=exact, tolerance=tolerance)
        rows = [row(way, None, values) for way, values in by_tmt.items()]
        shares = {way: largest_share(exact, values, tolerance) for way, values in by_tmt.items()}
        ways = [quantity.differences(dynamics, subject, dt, k) for k in range(subject.states)]
        for same in zip(*ways):
            values = {eps: np.array([way.call(eps)() for way in same]) for eps in SIZES}
            name = same[0].name
            rows += [row(name, eps, values[eps]) for eps in SIZES]
            if same[0].centred:
                shares[name] = share_of_differences(values, exact, subject, quantity, dt)
        result.append(Measured(subject, quantity, rows, shares))
    return result


def row_of(
    subject: Subject, quantity: Quantity, way: str, eps: float | None, values: Array, exact: Pairs,
    tolerance: Array,
) -> DerivativeRow:  # fmt: skip
    """The largest error of a way at all states, whose values have all columns or the first ones."""
    columns = values.shape[2]
    units = units_of(subject.tree, quantity.units), units_of(subject.tree, (*STATE, *FORCE))[:columns]
    high, low, least = (part[:, :, :columns] for part in (*exact, tolerance))
    error, unit, largest = max(map(relative, (values - high) - low, high, repeat(units), least))
    return DerivativeRow(
        subject=subject.name, quantity=quantity.name, way=way, eps=eps, states=subject.states,
        error=error if np.isfinite(error) else None, unit=unit, largest=largest,
    )  # fmt: skip


def largest_share(exact: Pairs, values: Array, tolerance: Array) -> float:
    """The largest share of a tolerance of the distance from the exact values, of all or the first columns."""
    exact = Pairs(*(part[:, :, : values.shape[2]] for part in exact))
    return float(share_of(exact.distance(values), tolerance).max())


def share_of_differences(
    values: Mapping[float, Array], exact: Pairs, subject: Subject, quantity: Quantity, dt: float
) -> float:
    """The largest share, over eps and entries, of what rounding and truncation can do to a difference.

    Rounding: 64 eps of what a step adds, there and carried through the step, over the eps of the difference;
    a ball's turn is a quaternion, as in judge.rounding. Truncation: twice the term in eps^2, from ten and a
    hundred times eps. Of discrete with servos at rest also the force that MuJoCo leaves out, over the eps of
    the difference.
    """
    entries, qdd = Entries(subject.tree, subject.q, subject.qd), accelerations(subject)
    force = entries.force(subject.tau) + gain_scale(subject.tree, subject.q, subject.qd)
    rates = np.abs(subject.qd) + dt * entries.acceleration(force, qdd)
    sizes = np.concatenate([of_positions(subject.tree, subject.q) + dt * rates, rates], axis=1)[:, :, None]
    sizes = sizes + np.abs(exact.high[:, :, : sizes.shape[1]]) @ sizes
    left_out = np.zeros_like(sizes)
    if quantity.integrator == "discrete" and subject.tree.has_gains:
        total = np.einsum("sij,sj->si", tmt.mass_matrix(subject.q, subject.tree), qdd)
        at_rest = np.linalg.norm(total, axis=1, keepdims=True) < 4.0 * LEFT_OUT
        rates = dt * LEFT_OUT * entries.inverse.sum(axis=2) * at_rest
        left_out = np.concatenate([dt * rates, rates], axis=1)[:, :, None]
    shares = []
    for coarser, coarse, eps in zip(SIZES, SIZES[1:], SIZES[2:]):
        terms = np.abs(values[coarse] - values[eps]), np.abs(values[coarser] - values[coarse]) / 100.0
        truncated = TRUNCATED * np.fmax(*terms)  # where one happens to be small, as eps^4 counts too
        shares.append(largest_share(exact, values[eps], (FACTOR * EPS * sizes + left_out) / eps + truncated))
    return max(shares)
