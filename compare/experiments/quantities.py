"""The quantities that both engines give at a state, one row each, and their comparison over samples.

The experiments at single states share their headline and first screen too: those of this module.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import tmt

from ..core.check import Result
from ..core.finding import Finding
from ..core.text import say
from ..engines import LABELS
from ..engines.tmt import Compiled
from ..judge.agree import agree
from ..judge.entries import Entries, unit
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from ..robots.states import MOST_SPEEDS, Sample
from . import Drawing
from .setup import Setup

if TYPE_CHECKING:
    from tmt.exact.many import Pairs


class Quantity(NamedTuple):
    """How a quantity is computed, and what its difference is measured by."""

    function: str  # of Dynamics and of tmt's compiled functions
    arguments: tuple[str, ...]  # of a Sample
    units: tuple[str, ...]  # for hinges and balls, for slides, for one of each; a single one for all
    scale: str  # of judge.entries
    part: int | None = None  # of a function that returns several arrays

    def states(self, sample: Sample) -> list[np.ndarray]:
        """The arguments of the function at the states of a sample."""
        return [getattr(sample, argument) for argument in self.arguments]

    def exact(self, sample: Sample) -> "Pairs":
        return sample.exact(self.function, self.part)

    def unit(self, tree: tmt.Tree) -> str:
        return self.units[0] if len(self.units) == 1 else unit(tree, *self.units)

    def size(self, scale: Entries, tau: ArrayLike = 0.0, qdd: ArrayLike = 0.0) -> np.ndarray:
        """The scale of each entry. tau, qdd: of accelerations, from which their scale is taken."""
        if self.function == "acceleration":
            return scale.acceleration(scale.force(tau), qdd)
        return getattr(scale, self.scale)


QUANTITIES = {
    "x_b": Quantity("com_positions", ("q",), ("m",), "positions"),
    "omega_b": Quantity("angular_velocities", ("q", "qd"), ("rad/s",), "angular_velocities"),
    "T_b": Quantity("jacobians", ("q",), ("m/rad", "m/m"), "T", 0),
    "B_b": Quantity("jacobians", ("q",), ("",), "B", 1),
    "v_conv": Quantity("convective_terms", ("q", "qd"), ("m/s2",), "v_conv", 0),
    "w_conv": Quantity("convective_terms", ("q", "qd"), ("rad/s2",), "w_conv", 1),
    "c": Quantity("com", ("q",), ("m",), "com"),
    "dc/dq": Quantity("com_jacobian", ("q",), ("m/rad", "m/m"), "com_jacobian"),
    "centroidal momentum matrix": Quantity(
        "centroidal_momentum_matrix",
        ("q",),
        ("kg m/rad or kg m2/rad", "kg or kg m"),
        "centroidal_momentum_matrix",
    ),
    "Mbar": Quantity("mass_matrix", ("q",), ("kg m2", "kg", "kg m"), "mass_matrix"),
    "holding torque": Quantity("gravity_balance", ("q",), ("N m", "N"), "weight"),
    "spring torque": Quantity("spring_torque", ("q",), ("N m", "N"), "springs"),
    "bias": Quantity("bias", ("q", "qd"), ("N m", "N"), "bias"),
    "qdd": Quantity("acceleration", ("q", "qd", "tau"), ("rad/s2", "m/s2"), "acceleration"),
    "energy": Quantity("energy", ("q", "qd"), ("J",), "energy"),
    "potential energy": Quantity("potential_energy", ("q",), ("J",), "potential_energy"),
}


class Comparison:
    """Two engines, at random states also tmt's compiled functions: each function is called once."""

    def __init__(self, setup: Setup, result: Result, sample: Sample):
        self.sample, self.robot = sample, setup.robot
        self.engines: list[Any] = [*setup.compared().values()]  # Dynamics that know more, MuJoCo second
        is_small = self.robot.coordinates.nv <= MOST_SPEEDS  # code for more takes minutes to compile
        if sample is setup.random and is_small and not self.robot.own:
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

    def acceleration_size(self) -> np.ndarray:
        """The accelerations that scales are taken from: a user's own may be NaN."""
        qdd, mujoco_qdd, *_ = self.values("qdd")
        return mujoco_qdd if self.robot.own else qdd

    @cached_property
    def acceleration_scale(self) -> np.ndarray:
        return QUANTITIES["qdd"].size(self.scale, self.sample.tau, self.acceleration_size())

    def compare(self, name: str) -> None:
        """Rows and checks of a quantity of two engines, and of MuJoCo and the compiled functions."""
        quantity, (values, mujoco_values, *compiled) = QUANTITIES[name], self.values(name)
        scale = self.acceleration_scale if name == "qdd" else quantity.size(self.scale)
        units, exact = quantity.unit(self.robot.tree), quantity.exact(self.sample)
        self.agree(name, units, values, mujoco_values, scale, exact)
        for of_code in compiled:
            self.agree(f"{name}, compiled", units, of_code, mujoco_values, scale)


def compared(setup: Setup, experiment: str, *names: str) -> tuple[Result, list[Comparison]]:
    """The result of an experiment that compares these quantities at named postures and random states."""
    result = Result(experiment, label=LABELS[setup.robot.compared[0]])
    comparisons = [Comparison(setup, result, sample) for sample in (setup.named, setup.random)]
    for comparison in comparisons:
        for name in names:
            comparison.compare(name)
        result.notes += comparison.sample.notes
    if len(comparisons[-1].engines) > 2:
        result.find("rows_compiled", of="shared")
    return result, comparisons


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
