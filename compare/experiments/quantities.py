"""The quantities that both engines give at a state, one row of a table each, and their comparison over samples of states.

The experiments at single states share their figures, headline and first screen too: those of this module.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from ..core.check import Result
from ..core.finding import Finding
from ..core.text import say
from ..engines import LABELS
from ..engines.mujoco.dynamics import convective_accelerations
from ..engines.tmt import Compiled
from ..judge.agree import agree
from ..judge.entries import Entries, unit
from ..judge.scale import EPS, FACTOR
from ..robots import Robot
from ..robots.states import MOST_SPEEDS, Sample
from .setup import Setup


class Quantity(NamedTuple):
    """How a quantity is computed, and what its difference is measured by."""

    function: str  # of Dynamics and of tmt's compiled functions
    arguments: tuple[str, ...]  # of a Sample
    units: tuple[str, ...]  # for hinges and balls, for slides, for one of each; a single one for all
    scale: str  # of judge.entries
    part: int | None = None  # of a function that returns several arrays


QUANTITIES = {
    "x_b": Quantity("com_positions", ("q",), ("m",), "positions"),
    "omega_b": Quantity("angular_velocities", ("q", "qd"), ("rad/s",), "angular_velocities"),
    "T_b": Quantity("jacobians", ("q",), ("m/rad", "m/m"), "T", 0),
    "B_b": Quantity("jacobians", ("q",), ("",), "B", 1),
    "v_conv": Quantity("convective_terms", ("q", "qd"), ("m/s2",), "v_conv", 0),
    "w_conv": Quantity("convective_terms", ("q", "qd"), ("rad/s2",), "w_conv", 1),
    "Mbar": Quantity("mass_matrix", ("q",), ("kg m2", "kg", "kg m"), "mass_matrix"),
    "holding torque": Quantity("gravity_balance", ("q",), ("N m", "N"), "weight"),
    "spring torque": Quantity("spring_torque", ("q",), ("N m", "N"), "springs"),
    "bias": Quantity("bias", ("q", "qd"), ("N m", "N"), "bias"),
    "qdd": Quantity("acceleration", ("q", "qd", "tau"), ("rad/s2", "m/s2"), "acceleration"),
    "energy": Quantity("energy", ("q", "qd"), ("J",), "energy"),
    "potential energy": Quantity("potential_energy", ("q",), ("J",), "potential_energy"),
}


class Comparison:
    """Two engines, and tmt's compiled functions at random states, over a sample: each function is called once."""

    def __init__(self, setup: Setup, sample: Sample):
        self.sample, self.robot = sample, setup.robot
        self.engines = list(setup.compared().values())  # MuJoCo is the second
        is_small = self.robot.coordinates.nv <= MOST_SPEEDS  # code for more takes minutes to compile
        if sample is setup.random and is_small and not self.robot.own:
            self.engines.append(Compiled(self.robot.tree))
        self.scale = Entries(self.robot.tree, sample.q, sample.qd)
        self.returned = {}

    def values(self, name: str) -> list:
        """A quantity by each engine, (states, ...)."""
        function, part = QUANTITIES[name].function, QUANTITIES[name].part
        if function not in self.returned:
            states = [getattr(self.sample, argument) for argument in QUANTITIES[name].arguments]
            returned = self.returned[function] = [
                getattr(engine, function)(*states) for engine in self.engines
            ]
            if function == "convective_terms" and self.robot.coordinates.has_balls:
                # mj_jacDot of MuJoCo 4.0 leaves out what a ball does to a slide after it in the same body
                returned[1] = convective_accelerations(self.engines[1], *states)
        return [values if part is None else values[part] for values in self.returned[function]]

    def acceleration_size(self) -> np.ndarray:
        """The accelerations that scales are taken from: a user's own may be NaN."""
        return self.values("qdd")[bool(self.robot.own)]

    @cached_property
    def acceleration_scale(self) -> np.ndarray:
        return self.scale.acceleration(self.scale.force(self.sample.tau), self.acceleration_size())

    def agree(self, result: Result, *names: str) -> None:
        """A row and a check for each quantity of two engines, and of MuJoCo and the compiled functions."""
        for name in names:
            quantity, (ours, theirs, *compiled) = QUANTITIES[name], self.values(name)
            size = self.acceleration_scale if name == "qdd" else getattr(self.scale, quantity.scale)
            units = quantity.units
            named = units[0] if len(units) == 1 else unit(self.robot.tree, *units)
            exact = self.sample.exact(quantity.function, quantity.part)
            agree(result, self.sample, name, named, ours, theirs, size, exact)
            for values in compiled:
                agree(result, self.sample, f"{name}, compiled", named, values, theirs, size)


def compared(setup: Setup, experiment: str, *names: str) -> tuple[Result, list[Comparison]]:
    """The result of an experiment that compares these quantities at the named postures and at random states."""
    result = Result(experiment, label=LABELS[setup.robot.compared[0]])
    comparisons = [Comparison(setup, sample) for sample in (setup.named, setup.random)]
    for comparison in comparisons:
        comparison.agree(result, *names)
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
        found = {
            "joint": joint,
            "tolerance": least[worst],
            "largest": largest[worst],
            "others": len(wide) - 1,
        }
        result.not_judged("all states", "qdd", say(Finding("shared", "wide", found)))


def headline(result: Result) -> Finding | None:
    """The difference with the largest share of its tolerance; one that is not a number comes first."""
    rows = [
        row
        for row in result.rows
        if row["worst_difference"] is None or row["difference_over_bar"] is not None
    ]
    if not rows:
        return None
    top = max(rows, key=lambda row: np.inf if row["worst_difference"] is None else row["difference_over_bar"])
    values = {"difference": top["worst_difference"], "unit": top["unit"], "share": top["difference_over_bar"]}
    return Finding("shared", "agreement_headline", {"quantity": top["quantity"], **values})


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    drawn = [name for name in QUANTITIES if name in result.curves["random states"]]
    yield partial(draw_distances, result, drawn)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    """The picture of M, h and accelerations on the first screen, where one of them was compared."""
    from .figures_overview import agreements, draw_agreement

    if agreements(results):
        yield partial(draw_agreement, results)
