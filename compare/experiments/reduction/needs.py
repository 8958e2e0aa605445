"""Which joints a case needs, and its motion with the smallest model compared with the whole one."""

import numpy as np

import tmt

from ...core.check import About, Result
from ...engines import LABELS
from ...judge.agree import closest
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, required_time, step_in_words
from ...robots.case import Case, Coordinates
from ...robots.states import seconds
from ...truth.smallest import Needed, needed, reduced
from ..setup import Setup
from .times import finer, rk4_of

SECONDS_OF_STATE = 2.0  # that an evaluation with 50 digits may take
MOST_IN_A_BAND = 12  # nv up to which runs are compared within the band of rounding


def of_case(result: Result, case: Case, setup: Setup) -> list[tuple]:
    """Findings and checks of what the case needs; the models to be timed, (name, Case), None if it needs no model."""
    slow = not case.is_held and seconds(case.robot) > SECONDS_OF_STATE
    need = Needed((), {}) if slow else needed(case)
    smaller, rests = reduced(case, need), len(need.stays) == len(case.joints)
    models = [(case.name, case.changed(locked=()))]
    if smaller or case.locked or rests:
        models.append((case.name, None if rests else smaller or case))
    reasons = {name: need.moves[name] for name in case.joints if name in need.moves}
    rows = [{"scene": case.name, "joint": name, "why_needed": why} for name, why in reasons.items()]
    result.tables.setdefault("reduction_needs", []).extend(rows)
    joints = {"needed": reasons, "locked": case.scene.locked, "stays": need.stays}
    result.curves["needs"][case.name] = joints | {"undecided": case.joints if slow else ()}
    if (smaller or rests) and not (case.robot.is_read and case.coordinates.nv > MOST_IN_A_BAND):
        compare_smaller(result, case, smaller, setup)
    return models


def joint_word(coordinates: Coordinates) -> str:
    return "hinge" if set(coordinates.all_kinds) == {"hinge"} else "joint"


def compare_smaller(result: Result, case: Case, smaller: Case | None, setup: Setup) -> None:
    """RK4 runs of the case and of the smaller one (None: rest), within the band of rounding."""
    scheme, every = setup.engines["mujoco"].methods["RK4"].scheme, finer(case)
    steps, coordinates = every * case.steps, case.coordinates
    dt, nq, nv = case.duration / steps, coordinates.nq, coordinates.nv
    paths = states_of_run(case, setup)
    references = states_of_run(smaller, setup) if smaller else {}
    of_tmt = paths["tmt"][:, :nq], paths["tmt"][:, nq:]
    width = band(tmt.METHODS[scheme], case.tree, *of_tmt, case.tau, dt, every)
    t = dt * every * np.arange(len(width))
    for engine, path in paths.items():
        where = f"{case.name}, {LABELS[engine]}, RK4, {step_in_words(case, steps)}"
        reference = np.tile(np.concatenate(case.start), (steps + 1, 1))
        if smaller:
            reference[:, free_places(case, smaller)] = references[engine]
            if "own" not in case.scene.tags:  # a user's own scene may hardly move
                check_movement(result, where, deviation(path[:, :nq], path[0, :nq], coordinates))
        movements = coordinates.difference(path[:, :nq], reference[:, :nq])
        apart = np.abs(np.concatenate([movements, path[:, nq:] - reference[:, nq:]], axis=1))[::every]
        until = check_smaller(result, where, coordinates, t, apart, width, required_time(case, scheme, dt))
        result.curves["apart"][case.name, engine] = float(apart[t <= until, :nv].max())


def free_places(case: Case, smaller: Case) -> list[int]:
    """The columns of the smaller case's positions and speeds among those of the whole one."""
    whole, nq = dict(zip(case.joints, case.coordinates.places.joints)), case.coordinates.nq
    joints = [whole[name] for name in smaller.joints]
    positions = [i for joint in joints for i in range(joint.q.start, joint.q.stop)]
    return positions + [nq + i for joint in joints for i in range(joint.qd.start, joint.qd.stop)]


def check_smaller(
    result: Result, where: str, coordinates: Coordinates, t: np.ndarray, apart, width, required: float
) -> float:
    """The runs stay within the band of rounding while it is narrow, for the required time; until when they are judged, s.

    apart, width: (times, 2 nv), movements and speeds: the distance of the two runs, and the band.
    """
    n = coordinates.nv
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    apart, width = apart[judged], width[judged]
    k, i = closest(apart, width)
    place, unit = (
        f"{coordinates.speeds[i % n]} at t = {t[k]:.3f} s",
        coordinates.units[i % n] + ("", "/s")[i // n],
    )
    result.check(where, "smallest model to whole", apart[k, i], width[k, i], unit, place, True)
    until = float(t[judged][-1])
    result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)
    return until


def states_of_run(case: Case, setup: Setup) -> dict[str, np.ndarray]:
    """Positions and speeds of the case's joints by engine, each (steps + 1, nq + nv)."""
    steps, paths = finer(case) * case.steps, {}
    for engine, dynamics in setup.compared(case).items():
        method = rk4_of(setup.engines, engine).name
        paths[engine] = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).states
    return paths
