"""The ways to a derivative: MuJoCo's differences over their eps, tmt's exact ones; and the errors of each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled.evaluator import Evaluator
from tmt.exact.many import Pairs, exact_of_many

from ...engines import Engine
from ...engines.mujoco import Mujoco
from ...engines.mujoco.differences import Call, of_inverse, of_steps, of_transition
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.mujoco.engine import methods_for
from ...engines.outside import OutsideDynamics
from ...engines.outside.model import EngineError
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR, gain_scale
from .subjects import Subject, dynamics_of
from .tables import DerivativeRow

Array = np.ndarray
Of = Callable[[float], Call]
Differences = Callable[[MujocoDynamics, Array, Array, Array, float, str, float, bool], Call]
SIZES = tuple(10.0**-k for k in range(2, 12))  # of differences
USUAL = 1e-6  # of mjd_transitionFD in MuJoCo's own samples
ONE_SIDED, CENTRED = "one-sided", "centred"
BY_INVERSE, NUMPY, COMPILED = "mjd_inverseFD", "tmt, NumPy", "tmt, compiled"
EXACT = NUMPY, COMPILED
INVERSE, FORWARD = "dtau/dq and dtau/dqd", "dqdd/dq, dqdd/dqd and dqdd/dtau"
ZERO = 1e-25  # what is no larger with 31 digits is zero
TRUNCATED = 2.0 / 99.0  # of the difference between an eps and ten times that: twice the term in eps^2


class Quantity(NamedTuple):
    """A derivative that has several ways."""

    name: str  # in tables
    exact: str  # the full name of tmt's quantity
    integrator: str = ""  # MuJoCo's, of a step

    def exact_values(self, subject: Subject, dt: float) -> Pairs:
        """(states, rows, columns)."""
        values = exact_of_many(subject.tree, self.exact, *self.given(subject, dt))
        return values if self.integrator else Pairs(*(self.side_by_side(part) for part in values))

    def given(self, subject: Subject, dt: float) -> list[Array]:
        """What tmt's quantity takes at all states."""
        third = accelerations(subject) if self.name == INVERSE else subject.tau
        steps = [np.full((subject.states, 1), dt)] if self.integrator else []
        return [subject.q, subject.qd, third, *steps]

    def side_by_side(self, matrices: Array) -> Array:
        """The derivatives of this quantity, (states, nv, columns), of those of tmt's, (states, parts, nv, nv)."""
        return np.concatenate([matrices[:, k] for k in range(2 if self.name == INVERSE else 3)], axis=2)

    def by_numpy(self, subject: Subject, dt: float) -> Array:
        values = tmt.literal.literal(self.exact)(*self.given(subject, dt), subject.tree)
        return np.asarray(values) if self.integrator else self.side_by_side(np.stack(values, axis=1))

    def by_machine_code(self, subject: Subject, dt: float) -> Array | None:
        evaluator = Evaluator(subject.tree, self.exact)
        rows = evaluator.of_rows(*self.given(subject, dt))
        if rows is None:
            return None
        values = rows.reshape(subject.states, *evaluator.shape)
        return values if self.integrator else self.side_by_side(values)

    def scale(self, subject: Subject, dt: float) -> Array:
        """Of each entry, (states, rows, columns)."""
        entries, qdd = Entries(subject.tree, subject.q, subject.qd), accelerations(subject)
        if self.name == INVERSE:
            return np.concatenate(entries.force_rates(qdd), axis=2)
        by = tmt.derivatives(subject.q, subject.qd, subject.tau, subject.tree)
        scale = entries.derivatives(subject.tau, qdd, by)
        return entries.step(dt, by, scale) if self.integrator else np.concatenate(scale[:3], axis=2)

    def differences(self, dynamics: MujocoDynamics, subject: Subject, dt: float, k: int) -> Iterator["Way"]:
        """MuJoCo's ways at state k."""
        q, qd, tau = subject.q[k], subject.qd[k], subject.tau[k]
        if self.name == FORWARD:
            return
        if self.name == INVERSE:
            a = accelerations(subject)[k]
            yield Way(BY_INVERSE, False, lambda eps: of_inverse(dynamics, q, qd, a, eps))
            return

        def of(ask: Differences, centred: bool) -> Of:
            return lambda eps: ask(dynamics, q, qd, tau, dt, self.integrator, eps, centred)

        for side, centred in ((ONE_SIDED, False), (CENTRED, True)):
            if self.integrator != "RK4":
                yield Way(f"mjd_transitionFD, {side}", centred, of(of_transition, centred))
            yield Way(f"differences of mj_step, {side}", centred, of(of_steps, centred))


class Way(NamedTuple):
    """Differences, (rows, columns): of all columns of the quantity, or of the first ones."""

    name: str
    centred: bool
    call: Of  # of an eps


def quantities(subject: Subject, integrators: Sequence[str]) -> list[Quantity]:
    """The derivatives of accelerations and torques, and of a step of each of these integrators that MuJoCo has."""
    methods = methods_for(subject.tree)
    known = [name for name in integrators if name in methods]
    steps = [Quantity(f"A and B, {name}", f"step_derivatives:{methods[name].scheme}", name) for name in known]
    inverse = Quantity(INVERSE, "inverse_dynamics_derivatives")
    return [Quantity(FORWARD, "derivatives"), inverse, *steps]


def accelerations(subject: Subject) -> Array:
    return tmt.acceleration(subject.q, subject.qd, subject.tau, subject.tree)


def units_of_speeds(tree: tmt.Tree, blocks: int) -> Array:
    """A number for the unit of each movement, speed and torque, of which there are these: slides have others than turns."""
    joints = zip(tree.kind, tree.coordinates.joints)
    slides = [kind == "slide" for kind, joint in joints for _ in joint.speeds]
    return np.repeat(np.arange(blocks), len(slides)) * 2 + np.tile(slides, blocks)


def relative(difference: Array, exact: Array, units: tuple[Array, Array]) -> float:
    """The largest difference over the largest exact entry of the same unit; inf where one is not a number."""
    worst, (rows, columns) = 0.0, units
    if not np.isfinite(difference).all():
        return np.inf
    for row in np.unique(rows):
        for column in np.unique(columns):
            block = np.ix_(rows == row, columns == column)
            size = float(np.abs(exact[block]).max())
            off = float(np.abs(difference[block]).max())
            worst = max(worst, off / size if size > ZERO else 0.0)
    return worst


class Measured(NamedTuple):
    """What is known of a quantity at the states of a subject, before anything is timed."""

    subject: Subject
    quantity: Quantity
    rows: list[DerivativeRow]
    shares: Mapping[str, float]  # of the tolerance, by the way: of tmt's and of the centred differences


def engines_of(subject: Subject, engines: Mapping[str, Engine]) -> dict[str, OutsideDynamics]:
    """The engines that read the file and have derivatives of its accelerations, by name."""
    every = {name: engine.of(subject.case) for name, engine in engines.items() if not engine.unavailable()}
    outside = {name: of for name, of in every.items() if isinstance(of, OutsideDynamics)}
    return {name: of for name, of in outside.items() if has_derivatives(of)}


def has_derivatives(dynamics: OutsideDynamics) -> bool:
    """Whether an engine reads the file and has derivatives; the experiment `engines` says why not."""
    try:
        return dynamics.has("derivatives")
    except EngineError:
        return False


def measured(
    subject: Subject, mujoco: Mujoco, integrators: Sequence[str], dt: float, compiles: bool
) -> list[Measured]:
    """All ways to each quantity at all states."""
    dynamics, result = dynamics_of(mujoco, subject), []
    for quantity in quantities(subject, integrators):
        exact, scale = quantity.exact_values(subject, dt), quantity.scale(subject, dt)
        found: dict[tuple[str, float | None], Array] = {(NUMPY, None): quantity.by_numpy(subject, dt)}
        machine = quantity.by_machine_code(subject, dt) if compiles else None
        if machine is not None:
            found[COMPILED, None] = machine
        shares = {
            way: over(exact.distance(values), FACTOR * EPS * scale) for (way, _), values in found.items()
        }
        ways = [list(quantity.differences(dynamics, subject, dt, k)) for k in range(subject.states)]
        for same in zip(*ways):
            values = {eps: np.array([way.call(eps)() for way in same]) for eps in SIZES}
            found |= {(same[0].name, eps): value for eps, value in values.items()}
            if same[0].centred:
                shares[same[0].name] = share_of_differences(values, exact, subject, dt)
        rows = [row_of(subject, quantity, way, eps, value, exact) for (way, eps), value in found.items()]
        result.append(Measured(subject, quantity, rows, shares))
    return result


def row_of(
    subject: Subject, quantity: Quantity, way: str, eps: float | None, values: Array, exact: Pairs
) -> DerivativeRow:
    """The largest error of a way at all states, whose values have all columns or the first ones."""
    high, low = (part[:, :, : values.shape[2]] for part in exact)
    units = (
        units_of_speeds(subject.tree, 2 if quantity.integrator else 1),
        units_of_speeds(subject.tree, 3)[: values.shape[2]],
    )
    error = max(relative((v - h) - l, h, units) for v, h, l in zip(values, high, low))
    return DerivativeRow(
        subject=subject.name,
        quantity=quantity.name,
        way=way,
        eps=eps,
        error=error if np.isfinite(error) else None,
        states=subject.states,
    )


def over(difference: Array, tolerance: Array) -> float:
    """The largest share of a tolerance; that of a difference of exactly zero is 0."""
    share = np.divide(
        difference, tolerance, out=np.where(difference > 0.0, np.inf, 0.0), where=tolerance > 0.0
    )
    return float(share.max())


def share_of_differences(values: Mapping[float, Array], exact: Pairs, subject: Subject, dt: float) -> float:
    """The largest share, over eps and entries, of what rounding and truncation can make a centred difference off.

    Rounding: 64 eps of what a step adds, over the eps of the difference. Truncation: twice the term in eps^2, from ten times eps.
    """
    entries, qdd = Entries(subject.tree, subject.q, subject.qd), accelerations(subject)
    force = entries.force(subject.tau) + gain_scale(subject.tree, subject.q, subject.qd)
    rates = np.abs(subject.qd) + dt * entries.acceleration(force, qdd)
    moved = np.abs(subject.tree.coordinates.difference(list(subject.q.T), subject.tree.zero)).T
    sizes = np.concatenate([moved + dt * rates, rates], axis=1)[:, :, None]
    shares = []
    for coarse, eps in pairwise(SIZES):
        truncated = TRUNCATED * np.abs(values[coarse] - values[eps])
        exactly = Pairs(*(part[:, :, : values[eps].shape[2]] for part in exact))
        shares.append(over(exactly.distance(values[eps]), FACTOR * EPS * sizes / eps + truncated))
    return max(shares)
