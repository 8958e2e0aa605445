"""Every subset of joints locked: Mbar and the bias of what is left against the sub-blocks of the whole model."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

import tmt

from ...judge.check import Result, closest, worst_of_each
from ...judge.entries import scales
from ...judge.scale import EPS, FACTOR
from ...robots.case import SEED, Case, Coordinates
from ...robots.states import seconds
from ..setup import Setup
from .times import operations

STATES_OF_SUBSET = 20  # of the free joints, for each choice of the locked angles
# joints up to which all subsets are locked; of more each alone and so many at random
ALL_SUBSETS, RANDOM_SUBSETS = 6, 20
MOST_TO_LOCK = 2.0  # s that an exact state takes, up to which subsets are locked
LARGE = 12  # speeds, of more fewer states are taken, and subsets in a run that is not full
BLOCK_UNITS = {"Mbar": "kg m2", "bias": "N m"}
WITH_SLIDES = {"Mbar": "kg m2, kg m or kg", "bias": "N m or N"}  # of a robot that has slides


def compare_blocks(result: Result, setup: Setup, angles: int) -> None:
    """A check and a row of a table for each subset, quantity and pair of models, over random angles and states."""
    result.tables["reduction_subsets"] = []
    robot, rng = setup.robot, np.random.default_rng(SEED)
    coordinates, many = robot.coordinates, len(robot.joints) > ALL_SUBSETS
    if robot.is_read and seconds(robot) > MOST_TO_LOCK:
        result.notes.append(
            f"No joints are locked: with the literal sum over {len(robot.tree.mass)} bodies each of so many subsets takes long."
        )
        return
    counted = setup.of(True, not robot.is_read, True) and not many  # tracing takes half of the time
    sets, states = subsets(robot.joints), STATES_OF_SUBSET
    if many:
        large = coordinates.nv > LARGE
        angles, states = 1, setup.of(4 if large else STATES_OF_SUBSET, 2 if large else 4, 2)
        stride = setup.of(1, 6 if large else 3, 6)
        sets = sets[::stride]
        listed = f"each of the {len(robot.joints)} joints alone, and {RANDOM_SUBSETS} sets of them chosen at random"
        result.notes.append(
            f"Not all sets of joints are locked in turn, but {listed}."
            if stride == 1
            else f"Not all sets of joints are locked in turn, but {len(sets)}, 1 in {stride} of those of a full run: {listed}."
        )
    for locked in sets:
        found = {}  # (quantity, pair): differences and scales, a pair of arrays for each choice of angles
        for _ in range(angles):
            q = coordinates.random(rng, states)
            v = rng.uniform(-10.0, 10.0, (states, coordinates.nv))
            case = robot.case(words_of(locked), posture=posture_of(coordinates, q[0]), locked=locked)
            for quantity, pair, apart, scale in sub_block_differences(setup, case, q, v):
                found.setdefault((quantity, pair), []).append((apart, scale))
        trees = robot.tree, robot.tree.lock(at_zero(robot.tree, locked)), case.tree
        names = "operations_whole", "operations_locked_at_zero", "operations_locked_at_angles"
        counts = {name: operations(tree) if counted else None for name, tree in zip(names, trees)}
        units = WITH_SLIDES if "slide" in coordinates.all_kinds else BLOCK_UNITS
        for (quantity, pair), arrays in found.items():
            check_blocks(result, locked, quantity, pair, *np.concatenate(arrays, axis=1), counts, units[quantity])


def subsets(joints: Sequence[str]) -> list[tuple[str, ...]]:
    """The sets of joints to be locked, the small ones first: all but none and all; of many joints each alone and 20 at random."""
    if len(joints) <= ALL_SUBSETS:
        return [names for count in range(1, len(joints)) for names in combinations(joints, count)]
    rng, chosen = np.random.default_rng(SEED), {(name,): None for name in joints}
    while len(chosen) < len(joints) + RANDOM_SUBSETS:
        places = rng.choice(len(joints), rng.integers(2, len(joints)), replace=False)
        chosen[tuple(joints[i] for i in sorted(places))] = None
    return sorted(chosen, key=len)


def posture_of(coordinates: Coordinates, q: np.ndarray) -> tuple[float, ...]:
    """A position (nq,) as a scene has it: hinges in deg."""
    posture = np.array(q, dtype=float)
    for kind, at, _ in coordinates.places.joints:
        if kind == "hinge":
            posture[at] = np.degrees(posture[at])
    return tuple(posture)


def at_zero(tree: tmt.Tree, names: Sequence[str]) -> dict[str, float | tuple]:
    """The reference positions of some joints of a Tree by their names."""
    places = dict(zip(tree.hinge_names, tree.coordinates.joints))
    return {
        name: tree.zero[places[name].q] if places[name].kind == "ball" else tree.zero[places[name].q.start]
        for name in names
    }


def words_of(locked: Sequence[str]) -> str:
    return f"{' and '.join(locked)} locked"


def check_blocks(
    result: Result,
    locked: Sequence[str],
    quantity: str,
    pair: str,
    apart: np.ndarray,
    scale: np.ndarray,
    counts: Mapping[str, int | None],
    unit: str | None = None,
) -> None:
    """A check of the state that comes closest to its tolerance, 64 eps x scale, and a row. apart, scale: (states,)."""
    tolerance = FACTOR * EPS * scale
    (worst,) = closest(apart, tolerance)
    unit, name = unit or BLOCK_UNITS[quantity], f"{quantity}, {pair}"
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


def sub_block_differences(setup: Setup, case: Case, q: np.ndarray, v: np.ndarray) -> Iterator[tuple]:
    """(quantity, pair of models, difference, scale) of the states q, v of all joints, those locked in the case set to it.

    Of each state the difference that is closest to its tolerance, and its scale, as `mass` and `acceleration` have it.
    """
    joints, tree = setup.robot.joints, setup.robot.tree
    places = dict(zip(joints, setup.robot.coordinates.places.joints))
    q, v = q.copy(), v.copy()
    for name, position in case.locked.items():
        q[:, places[name].q], v[:, places[name].qd] = position, 0.0
    free_q = [i for name in case.joints for i in range(places[name].q.start, places[name].q.stop)]
    free = [i for name in case.joints for i in range(places[name].qd.start, places[name].qd.stop)]
    block, state = np.ix_(range(len(q)), free, free), (q[:, free_q], v[:, free])
    whole, left = setup.compared(), setup.compared(case)
    of_whole = {
        "Mbar": [whole[name].mass_matrix(q)[block] for name in ("tmt", "mujoco")],
        "bias": [whole[name].bias(q, v)[:, free] for name in ("tmt", "mujoco")],
    }
    of_left = {
        "Mbar": [left[name].mass_matrix(state[0]) for name in ("tmt", "mujoco")],
        "bias": [left[name].bias(*state) for name in ("tmt", "mujoco")],
    }
    of_states = scales(tree, setup.robot.is_read, q, v)
    of_quantities = ("Mbar", of_states.mass_matrix, block), ("bias", of_states.bias, np.ix_(range(len(q)), free))
    for quantity, scale, left_of in of_quantities:
        scale = scale[left_of] if np.ndim(scale) > 1 else scale
        pairs = {
            "TMT, reduced to whole": (of_left[quantity][0], of_whole[quantity][0]),
            "MuJoCo, reduced to whole": (of_left[quantity][1], of_whole[quantity][1]),
            "reduced, TMT to MuJoCo": of_left[quantity],
        }
        for pair, (one, other) in pairs.items():
            yield quantity, pair, *worst_of_each(one - other, scale)
