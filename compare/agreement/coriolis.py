"""What is compared of a Coriolis matrix C, which Mbar and h do not determine: C qd, and C + C' = dMbar/dt.

The second says that dMbar/dt - 2 C is skew.
"""

from typing import Any

import numpy as np

from tmt import Tree, literal

from ..engines.own.functions import Quantity
from ..judge.entries import Entries

PRODUCT, SYMMETRIC = "C qd", "C + C'"
OF_CORIOLIS = {PRODUCT: Quantity(2, ("nv",)), SYMMETRIC: Quantity(2, ("nv", "nv"))}


def parts(C: np.ndarray, qd: np.ndarray) -> dict[str, np.ndarray]:
    """Both of C (states, nv, nv) at speeds qd (states, nv)."""
    return {PRODUCT: np.einsum("sij,sj->si", C, qd), SYMMETRIC: C + C.swapaxes(1, 2)}


def right_parts(mujoco: Any, tree: Tree, q: np.ndarray, qd: np.ndarray) -> dict[str, np.ndarray]:
    """MuJoCo's velocity part of h, and dMbar/dt by exact derivatives."""
    exact = parts(literal.coriolis_matrix(tree, q, qd), qd)
    return exact | {PRODUCT: mujoco.bias(q, qd) - mujoco.gravity_balance(q)}


def scales_of_parts(scale: Entries) -> dict[str, np.ndarray]:
    """Of the entries; the product is a difference from the weight."""
    C = scale.coriolis_matrix
    return {PRODUCT: np.einsum("sij,sj->si", C, np.abs(scale.qd)) + scale.weight, SYMMETRIC: 2.0 * C}
