"""Errors of both engines against the true motion, where that is known; and why a held robot leaves its posture."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from tmt.methods import METHODS

from ...core.check import Result
from ...engines import LABELS, Engine, compared
from ...judge.rounding import slope_rounding
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import Reference

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")
SAYS_NOTHING = 100  # times the difference of the engines: their agreement says nothing about a larger error
NO_TIME = 1e-6  # s: a step in which nothing moves


def coarsest_runs(result: Result, robot: Robot) -> Iterator[tuple[Case, dict]]:
    """Each case that was run, with the curve of its coarsest step of MuJoCo's RK4."""
    for case in robot.cases:
        for scheme in SCHEMES_OF_RK4:
            if curve := result.curves["runs"].get((case.name, scheme, case.steps)):
                yield case, curve


def deviations(case: Case, curve: dict) -> dict[str, float | None]:
    """The largest movement of each engine's run from its start, rad or m; None of a run that has diverged."""
    paths = {name: curve[name][0] for name in case.robot.compared}
    return {name: number_or_none(deviation(q, q[0], case.coordinates)) for name, q in paths.items()}


def find_errors(result: Result, robot: Robot, references: Mapping[str, Reference]) -> None:
    """The largest error of both engines with the coarsest step of RK4 in each scene, and where it is far above their difference.

    references: by the name of the scene; the true motion of a held scene is rest.
    """
    errors, scenes = {}, []
    for case, curve in sorted(coarsest_runs(result, robot), key=lambda pair: not pair[0].is_held):
        if case.is_held:
            first, second = deviations(case, curve).values()
        elif case.name in references:
            true, joints = references[case.name], range(len(case.joints))
            first, second = (
                number_or_none(true.error(curve[name][0], joints).max()) for name in robot.compared
            )
        else:
            continue
        errors[case.name] = first, second
        difference, unit = difference_while_judged(curve, case), movement_unit(case.coordinates)
        about = {"scene": case.name, "first": first, "second": second, "difference": difference, "unit": unit}
        scenes.append(about | {"far": is_far(errors[case.name], difference)})
    result.curves["errors"] = errors
    if errors:
        result.answer = result.finding("answer", errors=errors, steps=coarsest_steps(result, errors))
    if any(name in references for name in errors):  # held scenes have their own findings
        result.find(
            "errors", labels=[LABELS[name] for name in robot.compared], scenes=scenes, times=SAYS_NOTHING
        )


def coarsest_steps(result: Result, scenes: Iterable[str]) -> int | None:
    """The number of the coarsest steps of scenes, if they all have as many."""
    runs = result.curves["runs"]
    counts = {min(steps for name, _, steps in runs if name == scene) for scene in scenes}
    return counts.pop() if len(counts) == 1 else None


def is_far(errors: tuple, difference: float) -> bool:
    """Whether the larger error is so large that the engines' difference says nothing about it."""
    return None not in errors and max(errors) > SAYS_NOTHING * difference


def difference_while_judged(curve: dict, case: Case) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(curve["t"], curve["judged_until_s"] * (1 + 1e-9), side="right"))
    states = slice(0, last, curve["every"])
    return float(
        moved_from(*(curve[name][0][states] for name in case.robot.compared), case.coordinates).max()
    )


def find_departures(result: Result, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """When each engine leaves the posture of each held scene, and whether its torque holds it within rounding."""
    claims = robot.claims.of_scenes if robot.claims else {}
    for case, curve in coarsest_runs(result, robot):
        if case.is_held:
            values = departures(case, engines, curve["left"], deviations(case, curve))
            about = {"scene": robot.scene_begins(case.name), "claim": claims.get(case.name), "limit": LEFT}
            unit, stated = movement_unit(case.coordinates), robot.compared[0] == "tmt"
            result.find("held", **about, duration=case.duration, unit=unit, stated=stated, **values)


def departures(case: Case, engines: Mapping[str, Engine], left: Mapping, farthest: Mapping) -> dict:
    """The initial acceleration of each engine under the torque that should hold, and what rounding can cause, rad/s2.

    Both of the joint whose acceleration is the largest share of what rounding can cause in it.

    left: of each engine the time when it left, s, None: it stays; farthest: its largest movement, rad or m.
    """
    dt, ((name, ours), (other, theirs)) = case.duration / case.steps, compared(engines, case).items()
    allowed = slope_rounding(METHODS["rk4"], case.tree, case.q[None], case.v[None], case.tau, dt)[2][0]
    initial = {
        name: ours.run(*case.start, case.tau, NO_TIME, 1, "rk4").v[1] / NO_TIME,
        other: theirs.acceleration(*case.start, case.tau),
    }
    each, joint = [], int(np.argmax(np.max(np.abs([*initial.values()]), axis=0) / allowed))
    for engine, acceleration in initial.items():
        push = number_or_none(np.abs(acceleration[joint]))
        about = {"label": LABELS[engine], "left": left[engine], "farthest": farthest[engine], "push": push}
        each.append(about | {"holds": push is not None and push <= allowed[joint]})
    return {"allowed": float(allowed[joint]), "engines": each}
