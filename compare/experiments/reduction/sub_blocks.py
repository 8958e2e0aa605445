"""Every subset of joints locked: Mbar and the bias of what is left against the sub-blocks of the whole model."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from ...case import SEED, Case
from ...judge.check import Result, closest, largest
from ...judge.scale import EPS, FACTOR, bias_scale, mass_scale
from ...setup import Setup
from .times import operations

STATES_OF_SUBSET = 20  # of the free joints, for each choice of the locked angles
MOST_SUBSETS = 126  # all of seven joints; of more joints so many are chosen at random
BLOCK_UNITS = {"Mbar": "kg m2", "bias": "N m"}


def compare_blocks(result: Result, setup: Setup, angles: int) -> None:
    """A check and a row of a table for each subset, quantity and pair of models, over random angles and states."""
    result.tables["reduction_subsets"] = []
    robot, rng = setup.robot, np.random.default_rng(SEED)
    for locked in subsets(robot.joints):
        found = {}  # (quantity, pair): differences and scales, a pair of arrays for each choice of angles
        for _ in range(angles):
            q = robot.case().coordinates.random(rng, STATES_OF_SUBSET)
            v = rng.uniform(-10.0, 10.0, q.shape)
            case = robot.case(words_of(locked), posture=tuple(np.degrees(q[0])), locked=locked)
            for quantity, pair, apart, scale in differences(setup, case, q, v):
                found.setdefault((quantity, pair), []).append((apart, scale))
        counts = {
            "operations_whole": operations(robot.tree),
            "operations_locked_at_zero": operations(robot.tree.lock(dict.fromkeys(locked, 0.0))),
            "operations_locked_at_angles": operations(case.tree),
        }
        for (quantity, pair), arrays in found.items():
            check_blocks(result, locked, quantity, pair, *np.concatenate(arrays, axis=1), counts)


def subsets(joints: Sequence[str]) -> list[tuple[str, ...]]:
    """The sets of joints to be locked, the small ones first: all but none and all, or so many of them chosen at random."""
    if 2 ** len(joints) - 2 <= MOST_SUBSETS:
        return [names for count in range(1, len(joints)) for names in combinations(joints, count)]
    rng, chosen = np.random.default_rng(SEED), {}
    while len(chosen) < MOST_SUBSETS:
        places = rng.choice(len(joints), rng.integers(1, len(joints)), replace=False)
        chosen[tuple(joints[i] for i in sorted(places))] = None
    return sorted(chosen, key=len)


def words_of(locked: Sequence[str]) -> str:
    return f"{' and '.join(locked)} locked"


def check_blocks(
    result: Result,
    locked: Sequence[str],
    quantity: str,
    pair: str,
    apart: np.ndarray,
    scale: np.ndarray,
    counts: Mapping[str, int],
) -> None:
    """A check of the state that comes closest to its tolerance, 64 eps x scale, and a row. apart, scale: (states,)."""
    tolerance = FACTOR * EPS * scale
    (worst,) = closest(apart, tolerance)
    unit, name = BLOCK_UNITS[quantity], f"{quantity}, {pair}"
    check = result.check(words_of(locked), name, apart[worst], tolerance[worst], unit, rounding=True)
    result.tables["reduction_subsets"].append(
        {
            "locked": " ".join(locked),
            "quantity": quantity,
            "parties": pair,
            "states": len(apart),
            "largest_difference": float(apart.max()) if np.isfinite(apart).all() else None,
            "unit": unit,
            "difference_over_bar": check.over_tolerance,
        }
        | counts
    )


def differences(setup: Setup, case: Case, q: np.ndarray, v: np.ndarray) -> Iterator[tuple]:
    """(quantity, pair of models, difference, scale) of the states q, v of all joints, those locked in the case set to it."""
    joints, tree = setup.robot.joints, setup.robot.tree
    free = [i for i, name in enumerate(joints) if name in case.joints]
    q, v = q.copy(), v.copy()
    for name, angle in case.locked.items():
        q[:, joints.index(name)], v[:, joints.index(name)] = angle, 0.0
    block, state = np.ix_(range(len(q)), free, free), (q[:, free], v[:, free])
    whole, left = setup.compared(), setup.compared(case)
    of_whole = {
        "Mbar": [whole[name].mass_matrix(q)[block] for name in ("tmt", "mujoco")],
        "bias": [whole[name].bias(q, v)[:, free] for name in ("tmt", "mujoco")],
    }
    of_left = {
        "Mbar": [left[name].mass_matrix(state[0]) for name in ("tmt", "mujoco")],
        "bias": [left[name].bias(*state) for name in ("tmt", "mujoco")],
    }
    for quantity, scale in (("Mbar", mass_scale(tree, q)), ("bias", bias_scale(tree, q, v))):
        pairs = {
            "TMT, reduced to whole": (of_left[quantity][0], of_whole[quantity][0]),
            "MuJoCo, reduced to whole": (of_left[quantity][1], of_whole[quantity][1]),
            "reduced, TMT to MuJoCo": of_left[quantity],
        }
        for pair, (one, other) in pairs.items():
            yield quantity, pair, largest(one - other), scale
