"""The quantities that both engines give at a state, one row of a table each, and their comparison over a sample of states."""

from typing import NamedTuple

import numpy as np

from ..engines.tmt import Compiled
from ..judge.check import Result, agreement_headline
from ..judge.entries import scales, unit
from ..robots.states import Sample
from .setup import Setup


class Quantity(NamedTuple):
    """How a quantity is computed, and what its difference is measured by."""

    function: str  # of Dynamics and of tmt's compiled functions
    arguments: tuple[str, ...]  # of a Sample
    units: tuple[str, ...]  # for hinges and balls, for slides, for one of each; a single one for all
    scale: str  # of judge.entries
    truth: str  # a field of tmt.exact.values.Truth
    part: int | None = None  # of a function that returns several arrays


QUANTITIES = {
    "x_b": Quantity("com_positions", ("q",), ("m",), "positions", "com_positions"),
    "omega_b": Quantity("angular_velocities", ("q", "qd"), ("rad/s",), "angular_velocities", "angular_velocities"),
    "T_b": Quantity("jacobians", ("q",), ("m/rad", "m/m"), "T", "T", 0),
    "B_b": Quantity("jacobians", ("q",), ("",), "B", "B", 1),
    "v_conv": Quantity("convective_terms", ("q", "qd"), ("m/s2",), "v_conv", "v_conv", 0),
    "w_conv": Quantity("convective_terms", ("q", "qd"), ("rad/s2",), "w_conv", "w_conv", 1),
    "Mbar": Quantity("mass_matrix", ("q",), ("kg m2", "kg", "kg m"), "mass_matrix", "mass_matrix"),
    "holding torque": Quantity("gravity_balance", ("q",), ("N m", "N"), "weight", "gravity_balance"),
    "bias": Quantity("bias", ("q", "qd"), ("N m", "N"), "bias", "bias"),
    "qdd": Quantity("acceleration", ("q", "qd", "tau"), ("rad/s2", "m/s2"), "acceleration", "acceleration"),
    "energy": Quantity("energy", ("q", "qd"), ("J",), "energy", "energy"),
    "potential energy": Quantity("potential_energy", ("q",), ("J",), "potential_energy", "potential_energy"),
}


class Comparison:
    """Two engines, and tmt's compiled functions at random states, over a sample: each function is called once."""

    def __init__(self, setup: Setup, sample: Sample):
        self.sample, self.robot = sample, setup.robot
        self.engines = list(setup.compared().values())  # MuJoCo is the second
        if sample is setup.random and not self.robot.own:
            self.engines.append(Compiled(self.robot.tree))
        self.scale = scales(self.robot.tree, self.robot.is_read, sample.q, sample.qd)
        self.returned = {}

    def values(self, name: str) -> list:
        """A quantity by each engine, (states, ...)."""
        quantity = QUANTITIES[name]
        if quantity.function not in self.returned:
            states = [getattr(self.sample, argument) for argument in quantity.arguments]
            self.returned[quantity.function] = [getattr(engine, quantity.function)(*states) for engine in self.engines]
        returned = self.returned[quantity.function]
        return returned if quantity.part is None else [values[quantity.part] for values in returned]

    def acceleration_size(self) -> np.ndarray:
        """The accelerations that scales are taken from: a user's own may be NaN."""
        return self.values("qdd")[bool(self.robot.own)]

    def agree(self, result: Result, *names: str) -> None:
        """A row and a check for each quantity of two engines, and of MuJoCo and the compiled functions."""
        for name in names:
            quantity, (ours, theirs, *compiled) = QUANTITIES[name], self.values(name)
            size, units = getattr(self.scale, quantity.scale), quantity.units
            if name == "qdd":
                size = size(self.scale.force(self.sample.tau), self.acceleration_size())
            named = units[0] if len(units) == 1 else unit(self.robot.tree, *units)
            result.agree(self.sample, name, named, ours, theirs, size, truth=quantity.truth)
            for values in compiled:
                result.agree(self.sample, f"{name}, compiled", named, values, theirs, size)


def add_notes(result: Result, setup: Setup) -> None:
    """Add the notes of the samples, the note on compiled rows, and the headline."""
    result.notes += [*setup.named.notes, *setup.random.notes]
    if not setup.robot.own:
        result.find("rows_compiled", of="shared")
    result.headline = agreement_headline(result)
