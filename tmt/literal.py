"""The public functions in the literal form: the method as it stands in method.py, with NumPy, nothing compiled.

It answers small requests, and says what is wrong with what is given. Comparisons ask for it by name: what the functions of the
package return is compared with it. Arguments, results and errors are those of the functions of the same names in `tmt`.
"""

from collections.abc import Callable

import numpy as np

from tmt.arm import ARM
from tmt.derivation.quantities import QUANTITIES, State
from tmt.model import singular
from tmt.model.arguments import quantity, states


def literal(name: str) -> Callable:
    """The quantity of that name as a function of q, qd, tau (as far as it takes them) and a model."""
    takes, of, parts = QUANTITIES[name].takes, QUANTITIES[name].of, QUANTITIES[name].parts

    def function(*given, model=ARM):
        if len(given) > len(takes):
            *given, model = given
        if len(given) != len(takes):
            raise TypeError(f"{name} takes {', '.join(takes)} and a model")
        arrays = states(model, **dict(zip(takes, given)))
        state, batch = State(model, *arrays), arrays[0][0].shape
        if name == "acceleration" and not model.never_singular:
            check_regular(model, state, batch)
        found = of(state)
        if parts:
            return tuple(gather(part, batch) for part in found)
        return gather(found, batch, overflow=np.inf if name == "energy" else None)

    function.__name__ = function.__qualname__ = name
    return quantity(function)


def check_regular(model, state, batch) -> None:
    """Raise ValueError where Mbar is singular."""
    n = len(state.qd)
    angles = gather(state.q, batch).reshape(-1, len(state.q))
    if found := singular.first(model, angles, gather(state.mass_matrix, batch).reshape(-1, n, n)):
        at = ", ".join(f"{angle:.6g}" for angle in angles[found[0]])
        unit = " rad" if set(model.kind) == {"hinge"} else ""
        raise ValueError(f"Mbar is singular at q = ({at}){unit}: {found[1]}")


def gather(nested, batch, overflow=None) -> np.ndarray:
    """Nested iterables of scalars, each of the batch shape or constant, as one array with that shape in front.

    overflow: what stands for what is not finite, since all that was given is; None: it is a ValueError.
    """

    def lists(item):
        return (
            [lists(i) for i in item]
            if not isinstance(item, (float, np.ndarray))
            else np.broadcast_to(item, batch)
        )

    array = np.array(lists(nested), dtype=float)
    finite = np.isfinite(array)
    if not finite.all():
        if overflow is None:
            raise ValueError(
                "the result is beyond the largest double; smaller numbers in the state or model are expected"
            )
        array = np.where(finite, array, overflow)
    own = array.ndim - len(batch)
    return np.moveaxis(array, range(own), range(-own, 0)).copy()


com_positions = literal("com_positions")
angular_velocities = literal("angular_velocities")
jacobians = literal("jacobians")
convective_terms = literal("convective_terms")
mass_matrix = literal("mass_matrix")
bias = literal("bias")
gravity_balance = literal("gravity_balance")
spring_torque = literal("spring_torque")
acceleration = literal("acceleration")
potential_energy = literal("potential_energy")
energy = literal("energy")
