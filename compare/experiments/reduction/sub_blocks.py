"""Locked joints: Mbar and the bias of the reduced model compared with the sub-blocks of the whole model."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ...core.check import Result
from ...judge.agree import closest, worst_of_each
from ...judge.entries import Entries
from ...judge.scale import EPS, FACTOR
from ...robots.case import SEED, Case, Coordinates
from ...robots.states import seconds
from ..setup import Setup

ALL_SUBSETS = 6  # joints up to which all subsets are locked; above, some joints, each alone
MOST_TO_LOCK = 2.0  # s that an exact state may take


def compare_blocks(result: Result, setup: Setup, angles: int) -> None:
    """A check and a row of a table for each subset, quantity and pair of models, over random angles and states."""
    result.tables["reduction_subsets"] = []
    robot, rng = setup.robot, np.random.default_rng(SEED)
    coordinates = robot.coordinates
    if robot.is_read and seconds(robot) > MOST_TO_LOCK:
        result.find("no_subsets", bodies=len(robot.tree.mass))
        return
    sets, states = subsets(robot.joints, setup.of(12, 6, 4)), 20
    if len(robot.joints) > ALL_SUBSETS:
        angles, states = 1, setup.of(4, 2, 2)
    has_slides = "slide" in coordinates.all_kinds
    unit_of_mass, unit_of_force = ("kg m2, kg m or kg", "N m or N") if has_slides else ("kg m2", "N m")
    for locked in sets:
        pairs = {}  # (quantity, pair): differences and scales, a pair of arrays for each choice of angles
        for _ in range(angles):
            q = coordinates.random(rng, states)
            v = rng.uniform(-10.0, 10.0, (states, coordinates.nv))
            case = robot.case(scene_name(locked), posture=posture_of(coordinates, q[0]), locked=locked)
            for quantity, pair, apart, scale in sub_block_differences(setup, case, q, v):
                pairs.setdefault((quantity, pair), []).append((apart, scale))
        for (quantity, pair), arrays in pairs.items():
            unit = unit_of_mass if quantity == "Mbar" else unit_of_force
            check_blocks(result, locked, quantity, pair, *np.concatenate(arrays, axis=1), unit)


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
    result: Result,
    locked: Sequence[str],
    quantity: str,
    pair: str,
    apart: np.ndarray,
    scale: np.ndarray,
    unit: str,
) -> None:
    """A check of the state that comes closest to its tolerance, 64 eps x scale, and a row. apart, scale: (states,)."""
    tolerance = FACTOR * EPS * scale
    (worst,) = closest(apart, tolerance)
    name = f"{quantity}, {pair}"
    check = result.check(scene_name(locked), name, apart[worst], tolerance[worst], unit, rounding=True)
    row = {"locked": " ".join(locked), "quantity": quantity, "parties": pair, "states": len(apart)}
    row["largest_difference"] = float(apart.max()) if np.isfinite(apart).all() else None
    row |= {"unit": unit, "difference_over_bar": check.over_tolerance}
    result.tables["reduction_subsets"].append(row)


def sub_block_differences(
    setup: Setup, case: Case, q: np.ndarray, v: np.ndarray
) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """(quantity, pair, differences, scales), (states,) each, at states whose locked joints are set to the case's.

    The difference of a state is the one closest to its tolerance, with its scale, as in `mass` and `acceleration`.
    """
    places, robot = dict(zip(setup.robot.joints, setup.robot.coordinates.places.joints)), setup.robot
    q, v = q.copy(), v.copy()
    for name, position in case.locked.items():
        q[:, places[name].q], v[:, places[name].qd] = position, 0.0
    free_q = [i for name in case.joints for i in range(places[name].q.start, places[name].q.stop)]
    free = [i for name in case.joints for i in range(places[name].qd.start, places[name].qd.stop)]
    scale = Entries(robot.tree, q, v)
    whole, left = (list(setup.compared(of).values()) for of in (None, case))
    block, rows = np.ix_(range(len(q)), free, free), np.ix_(range(len(q)), free)
    masses = [(a.mass_matrix(q[:, free_q]), b.mass_matrix(q)[block]) for a, b in zip(left, whole)]
    biases = [(a.bias(q[:, free_q], v[:, free]), b.bias(q, v)[rows]) for a, b in zip(left, whole)]
    found = ("Mbar", masses, scale.mass_matrix[block]), ("bias", biases, scale.bias[rows])
    for quantity, (of_tmt, of_mujoco), size in found:
        yield quantity, "TMT, reduced to whole", *worst_of_each(np.subtract(*of_tmt), size)
        yield quantity, "MuJoCo, reduced to whole", *worst_of_each(np.subtract(*of_mujoco), size)
        yield quantity, "reduced, TMT to MuJoCo", *worst_of_each(of_tmt[0] - of_mujoco[0], size)
