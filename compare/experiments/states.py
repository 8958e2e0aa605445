"""Kinematics, the mass matrix, gravity and accelerations: two engines at named postures and random states.

Each is a row of EXPERIMENTS_AT_STATES: the quantities that are compared, and what else is checked of them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

import tmt
from tmt import literal
from tmt.derivation import method
from tmt.derivation.dual import seeded

from ..core.check import Result
from ..core.finding import Finding
from ..core.text import say
from ..engines import LABELS, WHOSE
from ..engines.tmt import Compiled
from ..judge.agree import agree, over
from ..judge.entries import Entries, unit
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from ..robots.states import MOST_SPEEDS, Sample, singular_positions
from . import Drawing, Functions
from .quantities import QUANTITIES
from .setup import Setup


class Comparison:
    """Two engines, at random states also tmt's compiled functions, but in quick runs: each function is called once."""

    def __init__(self, setup: Setup, result: Result, sample: Sample):
        self.sample, self.robot = sample, setup.robot
        self.engines: list[Any] = [*setup.compared().values()]  # Dynamics that know more, MuJoCo second
        is_small = self.robot.coordinates.nv <= MOST_SPEEDS  # code for more takes minutes to compile
        if sample is setup.random and is_small and not (setup.is_quick or self.robot.own):
            self.engines.append(Compiled(self.robot.tree))
        self.scale = Entries(self.robot.tree, sample.q, sample.qd)
        self.returned: dict[str, list[Any]] = {}
        self.agree = partial(agree, result, sample)  # a row and a check of values of the two engines

    def values(self, name: str) -> list[np.ndarray]:
        """A quantity by each engine, (states, ...)."""
        quantity = QUANTITIES[name]
        function, part, states = quantity.function, quantity.part, quantity.states(self.sample)
        if function not in self.returned:
            self.returned[function] = [getattr(engine, function)(*states) for engine in self.engines]
        return [values if part is None else values[part] for values in self.returned[function]]

    @property
    def acceleration_size(self) -> np.ndarray:
        """The accelerations that scales are taken from: a user's own may be NaN."""
        qdd, mujoco_qdd, *_ = self.values("qdd")
        return mujoco_qdd if self.robot.own else qdd

    @cached_property
    def acceleration_scale(self) -> np.ndarray:
        return QUANTITIES["qdd"].size(self.scale, self.sample.tau, self.acceleration_size)

    def compare(self, name: str) -> None:
        """Rows and checks of a quantity of two engines, and of MuJoCo and the compiled functions."""
        quantity, (values, mujoco_values, *compiled) = QUANTITIES[name], self.values(name)
        scale = self.acceleration_scale if name == "qdd" else quantity.size(self.scale)
        units, exact = quantity.unit(self.robot.tree), quantity.exact(self.sample)
        self.agree(name, units, values, mujoco_values, scale, exact)
        for of_code in compiled:
            self.agree(f"{name}, compiled", units, of_code, mujoco_values, scale)


def rows(name: str, setup: Setup) -> Result:
    """The quantities of an experiment at named postures and random states, and its further checks."""
    experiment, result = EXPERIMENTS_AT_STATES[name], Result(name, label=LABELS[setup.robot.compared[0]])
    samples = [setup.named, setup.random]
    if name == "acceleration" and not setup.robot.own:
        samples = [part for sample in samples if len((part := regular_part(result, sample)).q)]
    comparisons = [Comparison(setup, result, sample) for sample in samples]
    for comparison in comparisons:
        for quantity in quantities(name, setup.robot):
            comparison.compare(quantity)
        result.notes += comparison.sample.notes
    if comparisons and len(comparisons[-1].engines) > 2:
        result.find("rows_compiled", of="shared")
    if comparisons and experiment.more:
        experiment.more(result, comparisons)
    return result


def regular_part(result: Result, sample: Sample) -> Sample:
    """The states at which Mbar is regular; of the others there is no acceleration to judge."""
    is_singular, why = singular_positions(sample.tree, sample.q)
    if not is_singular.any():
        return sample
    place = sample.describe(int(np.argmax(is_singular)))
    result.not_judged(sample.name, "qdd", f"Mbar is singular at {place}: {why}")
    exact = int((~is_singular[: sample.exact_states]).sum())
    return sample.part(np.flatnonzero(~is_singular), exact)


def quantities(name: str, robot: Robot) -> list[str]:
    """Those of an experiment that tmt's equations, or a user's own, give."""
    if name == "acceleration" and robot.own:
        return ["bias", "qdd"] if "mass_matrix" in robot.own else ["qdd"]
    names, is_own = EXPERIMENTS_AT_STATES[name].quantities, bool(robot.own) and name == "kinematics"
    return [quantity for quantity in names if not is_own or QUANTITIES[quantity].function in robot.own]


def check_mass(result: Result, comparisons: Sequence[Comparison]) -> None:
    """Symmetry and definiteness at random states."""
    M, mujoco_M, *_ = comparisons[-1].values("Mbar")
    check_symmetry(result, M, comparisons[-1].scale.mass_matrix)  # MuJoCo's is one triangle written twice
    check_definiteness(result, result.label, M)
    check_definiteness(result, "MuJoCo", mujoco_M)


def check_symmetry(result: Result, M: np.ndarray, scale: np.ndarray) -> None:
    """Mbar (states, nv, nv) is symmetric except for rounding of each entry."""
    what, skew = f"{result.label}: Mbar - Mbar' over the scale of the entry", np.abs(M - M.transpose(0, 2, 1))
    result.check("random states", what, over(skew, scale).max(), FACTOR * EPS, "", rounding=True)


def check_definiteness(result: Result, label: str, M: np.ndarray) -> None:
    """The smallest eigenvalue of Mbar over the largest, in units of its diagonal, is more than rounding."""
    diagonal = np.einsum("sii->si", M)
    is_positive = (diagonal > 0.0).all(axis=1, keepdims=True)  # else it is not definite
    root = np.sqrt(np.where(is_positive, diagonal, 1.0))
    scaled = M / (root[:, :, None] * root[:, None, :])
    values = np.linalg.eigvalsh(scaled) if np.isfinite(scaled).all() else np.full((1, 2), np.nan)
    what = f"{label}: least eigenvalue of Mbar in units of its diagonal over the largest"
    least = (values[:, 0] / np.abs(values).max(axis=1)).min()
    result.check("random states", what, least, FACTOR * EPS, "", rule="at least")


def check_gravity(result: Result, comparisons: Sequence[Comparison]) -> None:
    """A user's own gravity beside the bias at rest; holding torques of gravity and springs together."""
    for comparison in comparisons:
        engine, mujoco, *_ = comparison.engines
        sample, scale, (held, *_) = comparison.sample, comparison.scale, comparison.values("holding torque")
        tree, units = sample.tree, unit(sample.tree, "N m", "N")
        if {"gravity", "bias"} <= {*comparison.robot.own}:
            still = engine.bias(sample.q, np.zeros(tree.coordinates.nv))
            comparison.agree("yours: gravity - bias at rest", units, held, still, scale.weight)
        if tree.has_springs:
            held, size = held + literal.spring_torque(tree, sample.q), scale.weight + scale.springs
            mujoco_held = mujoco.inverse(sample.q, 0.0, 0.0)
            comparison.agree("holding torque, springs too", units, held, mujoco_held, size)


def check_acceleration(result: Result, comparisons: Sequence[Comparison]) -> None:
    """Each engine's accelerations in the inverse dynamics of the other; energy and power."""
    robot = comparisons[0].robot
    if robot.own and "mass_matrix" not in robot.own:
        return
    check_wide(result, comparisons)
    tree, damping, whose = robot.tree, np.array(robot.tree.damping), WHOSE[robot.compared[0]]
    torques, work = unit(tree, "N m", "N"), "(tau - D qd).qd" if damping.any() else "tau.qd"
    for comparison in comparisons:
        engine, mujoco, *_ = comparison.engines
        sample, scale, (qdd, mujoco_qdd, *_) = comparison.sample, comparison.scale, comparison.values("qdd")
        q, qd, tau, drag = sample.q, sample.qd, sample.tau, damping * sample.qd
        closing = scale.closing(scale.force(tau), comparison.acceleration_size)
        inertia = np.einsum("sij,sj->si", engine.mass_matrix(q), mujoco_qdd)
        springs = literal.spring_torque(tree, q) if tree.has_springs else 0.0
        back = inertia + comparison.values("bias")[0] + drag + springs
        comparison.agree(f"tau from MuJoCo's qdd by {result.label}", torques, back, tau, closing)
        back = mujoco.inverse(q, qd, qdd)
        comparison.agree(f"tau from {whose} qdd by mj_inverse", torques, tau, back, closing)
        if not robot.own and comparison is comparisons[0]:
            C, Y = literal.coriolis_matrix(tree, q, qd), literal.regressor(tree, q, qd, qdd)
            moving = np.einsum("sij,sj->si", C, qd) + literal.gravity_balance(tree, q)
            size = np.einsum("sij,sj->si", scale.coriolis_matrix, np.abs(qd)) + scale.weight
            comparison.agree("bias from C qd", torques, moving, mujoco.bias(q, qd), size)
            of_bodies = Y @ tree.inertial_parameters + np.array(tree.armature) * qdd + drag + springs
            comparison.agree("tau from Y theta", torques, of_bodies, back, closing)
        if "energy" in robot.own:  # which may be zero at any position
            zero = np.array(tree.zero)[None], np.zeros((1, tree.coordinates.nv))
            above, mujoco_above = (side.energy(q, qd) - side.energy(*zero) for side in (engine, mujoco))
            comparison.agree("energy above the zero position's", "J", above, mujoco_above, scale.energy)

        power, size = np.einsum("si,si->s", tau - drag, qd), np.einsum("si,si->s", closing, np.abs(qd))
        for name, accelerations in ((whose, qdd), (WHOSE["mujoco"], mujoco_qdd)):
            gained = energy_rate(tree, q, qd, accelerations)
            comparison.agree(f"dE/dt - {work} at {name} qdd", "W", gained, power, size)


def check_wide(result: Result, comparisons: Sequence[Comparison]) -> None:
    """Accelerations are not judged if, at all states, rounding can be more than the largest of a joint."""
    values = [np.abs(values) for comparison in comparisons for values in comparison.values("qdd")[:2]]
    largest = np.nanmax(np.concatenate(values), axis=0)
    scales = np.concatenate([comparison.acceleration_scale for comparison in comparisons])
    least = FACTOR * EPS * scales.min(axis=0)
    wide = np.flatnonzero((least >= largest) & (largest > 0.0))
    if len(wide):
        worst = wide[np.argmax(least[wide] / largest[wide])]
        joint = comparisons[0].robot.coordinates.speeds[worst]
        sizes = {"tolerance": least[worst], "largest": largest[worst]}
        reason = Finding("shared", "wide", {"joint": joint, **sizes, "others": len(wide) - 1})
        result.not_judged("all states", "qdd", say(reason))


def energy_rate(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Time derivative of the energy along the motion, W, (states,), exact by dual numbers."""
    state = seeded([*q.T, *qd.T], [*tree.coordinates.component_rates(q.T, qd.T), *qdd.T])
    positions, speeds = state[: q.shape[1]], state[q.shape[1] :]
    bodies = method.bodies(tree, positions, speeds)
    potential = method.potential(bodies, tree.gravity) + method.spring_energy(tree, positions)
    return (potential + method.kinetic(bodies, speeds, tree.armature)).slope


class AtStates(NamedTuple):
    """What an experiment at states compares."""

    quantities: tuple[str, ...]  # of QUANTITIES
    more: Callable[[Result, Sequence[Comparison]], None] | None = None  # further checks


EXPERIMENTS_AT_STATES = {
    "kinematics": AtStates(("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv", "c", "dc/dq", "centroidal momentum matrix")),
    "mass": AtStates(("Mbar",), check_mass),
    "gravity": AtStates(("holding torque",), check_gravity),
    "acceleration": AtStates(("bias", "qdd", "energy", "potential energy"), check_acceleration),
}  # fmt: skip


def functions(name: str) -> Functions:
    """Those of one of these experiments."""

    def claim_values(robot: Robot) -> dict[str, Any]:
        return {"quantities": quantities(name, robot)}

    return Functions(partial(rows, name), headline=headline, overview=overview, claim_values=claim_values)


def headline(result: Result) -> Finding | None:
    """The difference with the largest share of its tolerance; one that is not a number comes first."""
    shares = [np.inf if row.worst_difference is None else row.difference_over_bar for row in result.rows]
    known = [(share, row) for share, row in zip(shares, result.rows) if share is not None]
    _, top = max(known, key=lambda pair: pair[0], default=(None, None))
    return Finding("shared", "agreement_headline", {"row": top}) if top else None


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[Drawing]:
    """The picture of M, h and accelerations on the first screen, where one of them was compared."""
    from .figures import agreements, draw_agreement

    if agreements(results):
        yield partial(draw_agreement, results)
