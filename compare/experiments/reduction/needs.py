"""What a case needs of its model, in words; and its motion by the smallest model beside that by the whole one."""

from collections.abc import Sequence

import numpy as np

import tmt
from tmt.exact.values import DIGITS

from ...engines import LABELS
from ...judge.check import About, Result, closest
from ...judge.rounding import NARROW, band
from ...judge.run import check_movement, deviation, movement_unit, required_time, step_in_words
from ...judge.words import capital
from ...robots.case import Case, Coordinates
from ...robots.states import seconds
from ...truth.smallest import MOST_FOLDED, Needed, needed, reduced
from ..setup import Setup
from .times import TWO_INTEGRATORS, finer, method_of, scheme_of

# speeds of the robot of a file whose runs by both integrators are compared, of more those by the last
BOTH_INTEGRATORS = 6
JOINTS_NAMED, JOINTS_TABLE = 6, "tables/reduction_joints.csv"  # joints in a sentence
SECONDS_OF_STATE = 2.0  # of an evaluation with 50 digits
MOST_IN_A_BAND = 12  # speeds of the robot of a file whose runs are compared within a band of rounding


def of_case(result: Result, case: Case, setup: Setup, integrators: Sequence[str] = TWO_INTEGRATORS) -> list:
    """What the case needs, in words; runs of it and of a smaller model; the models to be timed, None for none at all."""
    need = needed(case) if case.is_held or seconds(case.robot) <= SECONDS_OF_STATE else not_decided(case)
    smaller = reduced(case, need)
    stays = len(need.stays) == len(case.joints)
    models = [(case.name, case.changed(locked=()))]
    if smaller or case.locked or stays:
        models.append((case.name, None if stays else smaller or case))
    result.curves["needs"][case.name] = {
        "locked": case.scene.locked,
        "stays": need.stays,
        "undecided": need.undecided,
    }
    if case.robot.is_read:
        result.tables.setdefault("reduction_joints", []).extend(joint_rows(case, need))
    result.notes.append(need_in_words(case, need))
    if (smaller or stays) and case.robot.is_read and case.coordinates.nv > MOST_IN_A_BAND:
        result.notes.append(
            f"{case.name}: runs of the smaller and the whole model are not compared, as a band of rounding of so many joints "
            "takes long; trajectory compares both engines in this scene."
        )
    elif smaller or stays:
        few = case.robot.is_read and case.coordinates.nv > BOTH_INTEGRATORS
        for integrator in integrators[-1:] if few else integrators:
            compare_smaller(result, case, smaller, setup, integrator)
    return models


def not_decided(case: Case) -> Needed:
    """Of a case whose evaluation with 50 digits takes too long: what moves at the start, and of the others nothing."""
    moves = {
        name: f"{name} has a speed at the start"
        for name, joint in zip(case.joints, case.coordinates.places.joints)
        if any(case.v[joint.qd])
    }
    return Needed((), moves, tuple(name for name in case.joints if name not in moves))


def joint_rows(case: Case, need: Needed) -> list[dict]:
    """A row for each joint of the robot: what the case has to do with it, and why."""
    rows = []
    for name in case.robot.joints:
        what, why = "needed", need.moves.get(name, "")
        if name in case.scene.locked:
            what = "declared locked"
        elif name in need.stays:
            what = "never moves"
        elif name in need.undecided:
            what, why = "not decided", why_not_decided(case)
        rows.append({"scene": case.name, "joint": name, "found": what, "why": why})
    return rows


def why_not_decided(case: Case) -> str:
    """Why of a joint neither can be said, that it moves or that it stays."""
    if not case.is_held and seconds(case.robot) > SECONDS_OF_STATE:
        return f"one evaluation with {DIGITS} digits takes about {seconds(case.robot):.0f} s"
    if case.coordinates.nv > MOST_FOLDED:
        return f"the acceleration is 0 with {DIGITS} digits, and the expressions of so many joints are not traced"
    return "the acceleration does not fold to 0"


def first_named(names: Sequence[str], kind: str = "") -> list[str]:
    """The first six of many, and how many more there are, which the table has."""
    if len(names) <= JOINTS_NAMED + 1:
        return list(names)
    return [*names[:JOINTS_NAMED], f"and {len(names) - JOINTS_NAMED} more{kind} ({JOINTS_TABLE})"]


def need_in_words(case: Case, need: Needed) -> str:
    """What a case needs and why, in a sentence."""
    names, locked = case.joints, case.scene.locked
    reasons = first_named(list(need.moves.values()), " of such joints" * bool(need.undecided))
    if need.undecided:
        reasons.append(f"of {', '.join(first_named(need.undecided))} it is not decided: {why_not_decided(case)}")
    why = "; ".join(reasons)
    why = f": {why}" if case.robot.is_read else f". {capital(why)}"  # no sentence begins with a name of a user
    if len(need.stays) == len(names):
        torque = " under the exact torque that holds" if case.scene.torque == "hold" else ""
        return (
            f"{case.name}: no {joint_word(case)} and no integrator. At the start and at rest every acceleration folds to "
            f"0{torque}, and is 0 with {DIGITS} digits: the exact solution stays."
        )
    declared = f" ({' and '.join(locked)} declared locked)" if locked else ""
    if not need.stays:
        one = joint_word(case)
        count = f"the one {one} that is free" if len(names) == 1 else f"all {len(names)} {one}s"
        return f"{case.name}: {count}{declared}{why}."
    left, stays = (
        " and ".join(first_named(of)) for of in ([name for name in names if name not in need.stays], need.stays)
    )
    never, vanish = "never moves: at its start and at rest its acceleration folds", "and is"
    if len(need.stays) > 1:
        never, vanish = "never move: at their start and at rest their accelerations fold", "and are"
    begins = f"There {stays}" if case.robot.is_read else capital(stays)
    return (
        f"{case.name}: {left}{declared}. {begins} {never} to 0 for all values of the others, {vanish} 0 "
        f"with {DIGITS} digits at random ones{why}."
    )


def joint_word(case: Case) -> str:
    """What its joints are called: hinges, where there is nothing else."""
    return "hinge" if set(case.robot.coordinates.all_kinds) == {"hinge"} else "joint"


def compare_smaller(result: Result, case: Case, smaller: Case | None, setup: Setup, integrator: str) -> None:
    """Runs of the case and of the smaller one (None: it stays), by the same method, within the band of rounding."""
    scheme, every = scheme_of(setup.engines, integrator), finer(case)
    steps, coordinates = every * case.steps, case.coordinates
    dt, nq, nv, unit = case.duration / steps, coordinates.nq, coordinates.nv, movement_unit(coordinates)
    paths = states_of_run(case, setup, integrator)
    references = states_of_run(smaller, setup, integrator) if smaller else dict.fromkeys(paths)
    of_tmt = paths["tmt"][:, :nq], paths["tmt"][:, nq:]
    width = band(tmt.METHODS[scheme], case.tree, *of_tmt, case.tau, dt, every)
    t = dt * every * np.arange(len(width))
    until = None
    for engine, path in paths.items():
        where = f"{case.name}, {LABELS[engine]}, {integrator}, {step_in_words(case, steps)}"
        reference = np.tile(np.concatenate(case.start), (steps + 1, 1))
        if smaller:
            reference[:, free_places(case, smaller)] = references[engine]
            if "own" not in case.scene.tags:  # of a user's own nothing is expected
                check_movement(result, where, deviation(path[:, :nq], path[0, :nq], coordinates))
        apart = np.concatenate(
            [coordinates.difference(path[:, :nq], reference[:, :nq]), path[:, nq:] - reference[:, nq:]], axis=1
        )
        apart = np.abs(apart)[::every]
        until = check_smaller(result, where, coordinates, t, apart, width, required_time(case, scheme, dt))
        result.curves["apart"][case.name, engine, integrator] = float(apart[t <= until, :nv].max())
    if not smaller:
        moved = {LABELS[engine]: result.curves["apart"][case.name, engine, integrator] for engine in paths}
        result.notes.append(
            f"{case.name}, {integrator}, with the torque in doubles: in the {until:.2f} s that are judged "
            f"{moved_in_words(moved, unit)}."
        )


def moved_in_words(moved: dict[str, float], unit: str) -> str:
    """How far a joint moves at most in the run of each engine that should stay."""
    if not any(moved.values()):
        return f"no joint moves, by {' or '.join(moved)}"
    words = (
        f"{f'{m:.1e}' if m else '0'} {unit} by {name}" if np.isfinite(m) else f"unknown by {name}, which diverges"
        for name, m in moved.items()
    )
    return f"the largest movement of a joint is {' and '.join(words)}"


def free_places(case: Case, smaller: Case) -> list[int]:
    """Where the positions and speeds of the smaller case stand among those of the whole one."""
    whole, nq = dict(zip(case.joints, case.coordinates.places.joints)), case.coordinates.nq
    joints = [whole[name] for name in smaller.joints]
    return [i for joint in joints for i in range(joint.q.start, joint.q.stop)] + [
        nq + i for joint in joints for i in range(joint.qd.start, joint.qd.stop)
    ]


def check_smaller(
    result: Result,
    where: str,
    coordinates: Coordinates,
    t: np.ndarray,
    apart: np.ndarray,
    width: np.ndarray,
    required: float,
) -> float:
    """Checks: the runs stay within the band of rounding while it is narrow, and that is long enough; until when, s.

    apart, width: (times, 2 nv), movements and speeds, the distance of the smaller model's run from the whole one's, and the band.
    """
    n = coordinates.nv
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    apart, width = apart[judged], width[judged]
    k, i = closest(apart, width)
    place, unit = f"{coordinates.speeds[i % n]} at t = {t[k]:.3f} s", coordinates.units[i % n] + ("", "/s")[i // n]
    result.check(where, "smallest model to whole", apart[k, i], width[k, i], unit, place, True)
    until = float(t[judged][-1])
    result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)
    return until


def states_of_run(case: Case, setup: Setup, integrator: str) -> dict[str, np.ndarray]:
    """Positions and speeds of the case's joints by engine, each (steps + 1, nq + nv)."""
    steps, paths = finer(case) * case.steps, {}
    for engine, dynamics in setup.compared(case).items():
        method = method_of(setup.engines, integrator, engine)
        paths[engine] = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).states
    return paths
