"""The quantities that both engines give at a state, one row each."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import tmt

from ..judge.entries import Entries, unit
from ..robots.states import Sample

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
