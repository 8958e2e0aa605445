"""The motion by which the integrators of engines are compared, and a reference as exact as engines can be."""

import dataclasses
from functools import lru_cache

import numpy as np

from tmt.exact.motion import OTHER_ORDER, followed

from ...robots.case import Case
from ...truth.kept import kept
from ...truth.reference import RECORDS, Reference, first_steps, has_no_reference, in_doubles, times
from ..setup import Setup

# of the series, and the error of a step in units of 1 + |value|: a thousandth of the rounding of a double
ORDERS, TOLERANCE = (18, 14), 1e-18
# of all steps, each with (order / OTHER_ORDER)^2 of the work of a full series: some 20 s
MOST_OPERATIONS = 20_000_000 * (OTHER_ORDER // ORDERS[0] + 2) ** 2
MANY = 20  # speeds; more: the motion is shorter
BRIEF = 0.25  # s


def free_scene(setup: Setup) -> Case | None:
    """The first scene without locked joints and servos, better a regular one, its beginning if there are many speeds.

    None: no reference.
    """
    cases = [case for case in setup.robot.cases_of_torque if not case.scene.locked and not case.is_held]
    if has_no_reference(setup.robot):
        return None
    regular = [case for case in cases if "regular" in case.scene.tags]
    return brief(next(iter([*regular, *cases]), None))


def brief(case: Case | None) -> Case | None:
    """A case, or its first quarter of a second, for a robot with many speeds."""
    if case is None or case.coordinates.nv <= MANY or case.duration <= BRIEF:
        return case
    steps = max(RECORDS, round(case.steps * BRIEF / case.duration))
    return dataclasses.replace(case, scene=dataclasses.replace(case.scene, duration=BRIEF, dt=BRIEF / steps))


@lru_cache(maxsize=16)  # all engines need the same
def reference(case: Case) -> Reference:
    """The motion with an error below the rounding of doubles, and its difference from a second run of another order.

    A run in doubles where a series takes too many steps; ValueError if no run reaches the end.
    """
    runs = [by_series(case, order) for order in ORDERS]
    if any(len(path) <= RECORDS for path, _ in runs):
        return in_doubles(case)
    (path, steps), (other, _) = runs
    apart = float(np.abs(path - other).sum(axis=1).max())
    return Reference(times(case), path[:, 0], path[:, 1], apart, steps, case.coordinates)


def by_series(case: Case, order: int) -> tuple[np.ndarray, int]:
    """The records (<= 65, 2, nq + nv) of a run as far as it goes, and its steps; computed once and kept."""
    q, v, tau = (values.tolist() for values in (*case.start, case.tau))
    count = first_steps(case)
    start = q, v, tau, case.duration / count, count, count // RECORDS
    how = "composite", order, TOLERANCE, MOST_OPERATIONS

    def computed() -> list[np.ndarray]:
        path, steps, _ = followed(case.tree, *start, *how)
        return [path, np.array(steps)]

    path, steps = kept(computed, case.tree, "series", start, how)
    return path, int(steps)
