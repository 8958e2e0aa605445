"""Locked joints: Mbar and the bias of the reduced model compared with the sub-blocks of the whole model."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ...core.check import Result
from ...judge.agree import closest, worst_of_each
from ...judge.entries import Entries
from ...judge.run import number_or_none
from ...judge.scale import EPS, FACTOR
from ...robots.case import SEED, Case, Coordinates
from ...robots.states import seconds
from ..setup import Setup
from .needs import columns_of
from .records import SubsetRow

ALL_SUBSETS = 6  # joints up to which all subsets are locked; above, some joints, each alone
Differences = tuple[np.ndarray, np.ndarray]  # of the states, and the scale of each, (states,)
MOST_TO_LOCK = 2.0  # s that an exact state may take


def compare_blocks(result: Result, setup: Setup, angles: int) -> None:
    """A check and a row of a table for each subset, quantity and pair of models, over random angles and states."""
    result.tables["reduction_subsets"] = []
    robot, rng, states = setup.robot, np.random.default_rng(SEED), 20
    coordinates = robot.coordinates
    if robot.is_read and seconds(robot) > MOST_TO_LOCK:
        result.find("no_subsets", bodies=len(robot.tree.mass))
        return
    if len(robot.joints) > ALL_SUBSETS:
        angles, states = 1, setup.of(4, 2, 2)
    units = {"Mbar": "kg m2", "bias": "N m"}
    if "slide" in coordinates.all_kinds:
        units = {"Mbar": "kg m2, kg m or kg", "bias": "N m or N"}
    for locked in subsets(robot.joints, setup.of(12, 6, 4)):
        pairs: dict[
            tuple[str, str], list[Differences]
        ] = {}  # by quantity and pair: for each choice of angles
        for _ in range(angles):
            q = coordinates.random(rng, states)
            v = rng.uniform(-10.0, 10.0, (states, coordinates.nv))
            case = robot.case(scene_name(locked), posture=posture_of(coordinates, q[0]), locked=locked)
            for quantity, pair, values in sub_block_differences(setup, case, q, v):
                pairs.setdefault((quantity, pair), []).append(values)
        for (quantity, pair), choices in pairs.items():
            apart, scale = np.concatenate(choices, axis=1)
            check_blocks(result, locked, (quantity, pair, units[quantity]), apart, scale)


def subsets(joints: Sequence[str], most: int) -> list[tuple[str, ...]]:
    """The proper subsets of the joints, small ones first; of many joints at most `most`, each alone."""
    if len(joints) <= ALL_SUBSETS:
        return [names for count in range(1, len(joints)) for names in combinations(joints, count)]
    return [(name,) for name in joints[:: -(-len(joints) // most)]]


def posture_of(coordinates: Coordinates, q: np.ndarray) -> tuple[float, ...]:
    """A position (nq,) with hinges in deg, as in a scene."""
    posture = np.array(q, dtype=float)
    for joint in coordinates.places.joints:
        if joint.kind == "hinge":
            posture[joint.q] = np.degrees(posture[joint.q])
    return tuple(posture)


def scene_name(locked: Sequence[str]) -> str:
    return f"{' and '.join(locked)} locked"


def check_blocks(
    result: Result, locked: Sequence[str], names: tuple[str, str, str], apart: np.ndarray, scale: np.ndarray
) -> None:
    """A check of the state that comes closest to its tolerance, 64 eps x scale, and a row.

    names: quantity, pair of models, unit; apart, scale: (states,).
    """
    (quantity, pair, unit), tolerance = names, FACTOR * EPS * scale
    (worst,) = closest(apart, tolerance)
    name = f"{quantity}, {pair}"
    check = result.check(scene_name(locked), name, apart[worst], tolerance[worst], unit, rounding=True)
    about: dict[str, Any] = {"locked": " ".join(locked), "quantity": quantity, "parties": pair, "unit": unit}
    largest, share = number_or_none(apart.max()), check.over_tolerance
    row = SubsetRow(**about, states=len(apart), largest_difference=largest, difference_over_bar=share)
    result.tables["reduction_subsets"].append(row)


def sub_block_differences(
    setup: Setup, case: Case, q: np.ndarray, v: np.ndarray
) -> Iterator[tuple[str, str, Differences]]:
    """(quantity, pair, (differences, scales)) at states whose locked joints are set to the case's.

    The difference of a state is the one closest to its tolerance, with its scale, as in `mass` and `acceleration`.
    """
    q, v = q.copy(), v.copy()
    for name, position in case.locked.items():
        q[:, case.places[name].q], v[:, case.places[name].qd] = position, 0.0
    positions, speeds = columns_of(case, setup.robot.case())
    scale = Entries(setup.robot.tree, q, v)
    reduced, unlocked = setup.compared(case).values(), setup.compared().values()
    block, rows = np.ix_(range(len(q)), speeds, speeds), np.ix_(range(len(q)), speeds)
    free_q, free_v = q[:, positions], v[:, speeds]
    masses = (
        [engine.mass_matrix(free_q) for engine in reduced],
        [engine.mass_matrix(q)[block] for engine in unlocked],
    )
    biases = (
        [engine.bias(free_q, free_v) for engine in reduced],
        [engine.bias(q, v)[rows] for engine in unlocked],
    )
    for quantity, values, size in (
        ("Mbar", masses, scale.mass_matrix[block]),
        ("bias", biases, scale.bias[rows]),
    ):
        (of_tmt, of_mujoco), (whole_tmt, whole_mujoco) = values
        yield quantity, "TMT, reduced to whole", worst_of_each(of_tmt - whole_tmt, size)
        yield quantity, "MuJoCo, reduced to whole", worst_of_each(of_mujoco - whole_mujoco, size)
        yield quantity, "reduced, TMT to MuJoCo", worst_of_each(of_tmt - of_mujoco, size)
