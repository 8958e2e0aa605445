"""Locked joints: Mbar and the bias of the reduced model compared with the sub-blocks of the whole model."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ...core.check import Result
from ...judge.agree import closest, worst_of_each
from ...judge.entries import Entries
from ...judge.run import number_or_none
from ...judge.scale import EPS, FACTOR
from ...robots.case import SEED, Case
from ...robots.coordinates import Coordinates
from ...robots.states import seconds
from ..setup import Setup
from .records import SubsetRow

ALL_SUBSETS = 6  # joints up to which all subsets are locked; above, some joints, each alone
MOST_TO_LOCK = 2.0  # s that an exact state may take
Both = tuple[np.ndarray, np.ndarray]
Differences = dict[tuple[str, str], Both]  # by quantity and pair: of states, and their scales


def compare_blocks(result: Result, setup: Setup, angles: int) -> None:
    """A check and a row for each subset, quantity and pair of models, over random angles and states."""
    robot, rng, states = setup.robot, np.random.default_rng(SEED), 20
    coordinates = robot.coordinates
    result.tables["reduction_subsets"] = []
    if robot.is_read and seconds(robot) > MOST_TO_LOCK:
        result.find("no_subsets", bodies=len(robot.tree.mass))
        return
    if len(robot.joints) > ALL_SUBSETS:
        angles, states = 1, setup.of(4, 2, 2)
    units, degree = units_of(coordinates), coordinates.from_degrees(np.ones(coordinates.nq), positions=True)
    for locked in subsets(robot.joints, setup.of(12, 6, 4)):
        choices, scene = [], f"{' and '.join(locked)} locked"
        for _ in range(angles):  # at which they are locked
            q, v = coordinates.random(rng, states), rng.uniform(-10.0, 10.0, (states, coordinates.nv))
            posture = np.where(degree == 1.0, q[0], np.degrees(q[0]))
            case = robot.case(scene, posture=tuple(posture), locked=locked)
            choices.append(sub_block_differences(setup, case, q, v))
        for quantity, pair in choices[0]:
            apart, scale = np.concatenate([choice[quantity, pair] for choice in choices], axis=1)
            row = SubsetRow(locked=" ".join(locked), quantity=quantity, parties=pair, unit=units[quantity])
            check_blocks(result, scene, row, apart, scale)


def units_of(coordinates: Coordinates) -> dict[str, str]:
    if "slide" in coordinates.all_kinds:
        return {"Mbar": "kg m2, kg m or kg", "bias": "N m or N"}
    return {"Mbar": "kg m2", "bias": "N m"}


def subsets(joints: Sequence[str], most: int) -> list[tuple[str, ...]]:
    """The proper subsets of the joints, small ones first; of many joints at most `most`, each alone."""
    if len(joints) <= ALL_SUBSETS:
        return [names for count in range(1, len(joints)) for names in combinations(joints, count)]
    return [(name,) for name in joints[:: -(-len(joints) // most)]]


def check_blocks(result: Result, where: str, row: SubsetRow, apart: np.ndarray, scale: np.ndarray) -> None:
    """A check of the state closest to its tolerance, 64 eps x scale, and the row. apart, scale: (states,)."""
    tolerance = FACTOR * EPS * scale
    (worst,) = closest(apart, tolerance)
    name = f"{row.quantity}, {row.parties}"
    check = result.check(where, name, apart[worst], tolerance[worst], row.unit, rounding=True)
    row.states, row.largest_difference = len(apart), number_or_none(apart.max())
    row.difference_over_bar = check.over_tolerance
    result.tables.setdefault("reduction_subsets", []).append(row)


def sub_block_differences(setup: Setup, case: Case, q: np.ndarray, v: np.ndarray) -> Differences:
    """At states whose locked joints are set to the case's.

    The difference of a state is the one closest to its tolerance, with its scale, as in `mass`.
    """
    speeds, states, free_q = case.indices("qd"), np.arange(len(q)), q[:, case.indices("q")]
    rows, block = np.ix_(states, speeds), np.ix_(states, speeds, speeds)
    q, free_v, still = case.positions_of_all(free_q), v[rows], np.zeros_like(v)
    still[rows] = free_v
    scale = Entries(setup.robot.tree, q, still)
    of_case, of_whole = setup.compared(case).values(), setup.compared().values()
    reduced = [(engine.mass_matrix(free_q), engine.bias(free_q, free_v)) for engine in of_case]
    whole = [(engine.mass_matrix(q)[block], engine.bias(q, still)[rows]) for engine in of_whole]
    pairs = {
        "TMT, reduced to whole": (reduced[0], whole[0]),
        "MuJoCo, reduced to whole": (reduced[1], whole[1]),
        "reduced, TMT to MuJoCo": (reduced[0], reduced[1]),
    }
    return differences(pairs, (scale.mass_matrix[block], scale.bias[rows]))


def differences(pairs: Mapping[str, Sequence[Both]], scales: Both) -> Differences:
    """Of pairs of Mbar and the bias at states, by the pairs' names; scales: of the entries of both."""
    found: Differences = {}
    for place, quantity in enumerate(("Mbar", "bias")):
        for name, (values, others) in pairs.items():
            found[quantity, name] = worst_of_each(values[place] - others[place], scales[place])
    return found
