"""Every quantity of a state with 50 digits: what values in doubles are compared with."""

from typing import NamedTuple

import mpmath
import numpy as np

from tmt.equations import method
from tmt.equations.vectors import ZERO, solve
from tmt.exact.tree import exact_tree

DIGITS = 50


class Truth(NamedTuple):
    """Every quantity of one state as object arrays of mpmath numbers; names and units as in `tmt`."""

    com_positions: np.ndarray  # (m, 3)
    angular_velocities: np.ndarray  # (m, 3)
    T: np.ndarray  # (m, 3, nv)
    B: np.ndarray  # (m, 3, nv)
    v_conv: np.ndarray  # (m, 3)
    w_conv: np.ndarray  # (m, 3)
    mass_matrix: np.ndarray  # (nv, nv)
    bias: np.ndarray  # (nv,)
    gravity_balance: np.ndarray  # (nv,)
    acceleration: np.ndarray  # (nv,)
    potential_energy: np.ndarray  # ()
    energy: np.ndarray  # ()


def exact(tree, q, qd, tau) -> Truth:
    """Every TMT quantity at one state, from the same source as the floats, with 50 digits.

    q (nq,), qd, tau (nv,): rad, rad/s, N m. The numbers of the tree and of the state are taken as what their
    doubles are exactly; 0.1 means 0.1000000000000000055511151231257827...
    """
    with mpmath.workdps(DIGITS):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd, tau))
        tree = exact_tree(tree, mpmath.mpf)
        parts = method.bodies(tree, q, qd)
        at_rest = [b._replace(omega=ZERO, v_conv=ZERO, w_conv=ZERO) for b in parts]
        mass_matrix, h = method.mass_matrix(parts, tree.armature), method.bias(parts, tree.gravity)
        potential = method.potential(parts, tree.gravity) + method.spring_energy(tree, q)
        return Truth(
            com_positions=_array(b.x for b in parts),
            angular_velocities=_array(b.omega for b in parts),
            T=_array(zip(*b.T) for b in parts),
            B=_array(zip(*b.B) for b in parts),
            v_conv=_array(b.v_conv for b in parts),
            w_conv=_array(b.w_conv for b in parts),
            mass_matrix=_array(mass_matrix),
            bias=_array(h),
            gravity_balance=_array(method.bias(at_rest, tree.gravity)),
            acceleration=_array(solve(mass_matrix, method.reduced_force(tree, h, q, qd, tau))),
            potential_energy=_array(potential),
            energy=_array(potential + method.kinetic(parts, qd, tree.armature)),
        )


def _array(nested):
    """Nested iterables of numbers as an object array."""

    def lists(item):
        return [lists(i) for i in item] if hasattr(item, "__iter__") else item

    return np.array(lists(nested), dtype=object)


def distance(values, truth) -> np.ndarray:
    """|values - truth| as floats: the difference is taken exactly and rounded once."""
    return np.asarray(np.abs(np.asarray(values, dtype=float).astype(object) - truth), dtype=float)
