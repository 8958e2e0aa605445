"""Every subset of hinges locked: Mbar and the bias of what is left against the sub-blocks of the whole model."""

from functools import lru_cache
from itertools import combinations

import numpy as np

import tmt
from tmt.kernels import slope_source

from .agreement import EPS, FACTOR, SEED, bias_scale, largest, mass_scale
from .scenes import HINGES

STATES = 20  # of the free hinges, for each choice of the locked angles
UNITS = {"Mbar": "kg m2", "bias": "N m"}


def compare(result, engine, angles) -> None:
    """A check and a row of a table for each subset, quantity and pair of models, over random angles and states."""
    result.tables["reduction_subsets"] = []
    rng = np.random.default_rng(SEED)
    for locked in (names for count in range(1, len(HINGES)) for names in combinations(HINGES, count)):
        found = {}  # (quantity, parties): differences and scales, a pair of arrays for each choice of angles
        for _ in range(angles):
            q, qd = rng.uniform(-np.pi, np.pi, (STATES, 3)), rng.uniform(-10.0, 10.0, (STATES, 3))
            at = {name: float(q[0, HINGES.index(name)]) for name in locked}
            for quantity, parties, apart, scale in differences(engine, at, q, qd):
                found.setdefault((quantity, parties), []).append((apart, scale))
        counts = {
            "operations_whole": operations(tmt.ARM),
            "operations_locked_at_zero": operations(tmt.ARM.lock(dict.fromkeys(locked, 0.0))),
            "operations_locked_at_angles": operations(tmt.ARM.lock(at)),
        }
        for (quantity, parties), pairs in found.items():
            judge(result, locked, quantity, parties, *np.concatenate(pairs, axis=1), counts)


def judge(result, locked, quantity, parties, apart, scale, counts) -> None:
    """A check of the state that comes closest to its tolerance, 64 eps x scale, and a row. apart, scale: (states,)."""
    bar = FACTOR * EPS * scale
    worst = int(np.argmax(np.where(np.isfinite(apart), apart / bar, np.inf)))
    where = f"{' and '.join(locked)} locked"
    check = result.check(where, f"{quantity}, {parties}", apart[worst], bar[worst], UNITS[quantity], rounding=True)
    result.tables["reduction_subsets"].append(
        {
            "locked": " ".join(locked),
            "quantity": quantity,
            "parties": parties,
            "states": len(apart),
            "largest_difference": float(apart.max()) if np.isfinite(apart).all() else None,
            "unit": UNITS[quantity],
            "difference_over_bar": check.over_bar,
        }
        | counts
    )


def differences(engine, at, q, qd):
    """(quantity, parties, difference, scale) of the states q, qd with the hinges in `at`, {name: rad}, locked there."""
    free = [i for i, name in enumerate(HINGES) if name not in at]
    q, qd = q.copy(), qd.copy()
    for name, angle in at.items():
        q[:, HINGES.index(name)], qd[:, HINGES.index(name)] = angle, 0.0
    block = np.ix_(range(len(q)), free, free)
    tree, smaller = tmt.ARM.lock(at), engine.lock(at)
    state = q[:, free], qd[:, free]
    whole = {
        "Mbar": (tmt.mass_matrix(q)[block], engine.mass_matrix(q)[block]),
        "bias": (tmt.bias(q, qd)[:, free], engine.bias(q, qd)[:, free]),
    }
    left = {
        "Mbar": (tmt.mass_matrix(state[0], tree), smaller.mass_matrix(state[0])),
        "bias": (tmt.bias(*state, tree), smaller.bias(*state)),
    }
    for quantity, scale in (("Mbar", mass_scale(q)), ("bias", bias_scale(q, qd))):
        pairs = {
            "TMT, reduced to whole": (left[quantity][0], whole[quantity][0]),
            "MuJoCo, reduced to whole": (left[quantity][1], whole[quantity][1]),
            "reduced, TMT to MuJoCo": left[quantity],
        }
        for parties, (one, other) in pairs.items():
            yield quantity, parties, largest(one - other), scale


@lru_cache
def operations(tree, method="rk4") -> int:
    """Operations of one evaluation of the accelerations in the compiled code of a tree and a method."""
    return slope_source(tree, method)[1]
