"""Errors of both engines against the true motion, where that is known; and why a held robot leaves its posture.

The prediction of a departure: the initial acceleration under the holding torque, amplified by RK4's own linear map.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from tmt.methods import METHODS, amplification

from ...engines import LABELS, Engine, compared
from ...judge.check import Result
from ...judge.rounding import slope_rounding
from ...judge.run import LEFT, deviation, moved_from, movement_unit, number_or_none
from ...judge.words import scene_begins
from ...robots import Robot
from ...robots.case import Case
from ...truth import reference

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")
SAYS_NOTHING = 100  # times the difference of the engines: their agreement says nothing about a larger error
NO_TIME = 1e-6  # s: a step in which nothing moves
STEADY = 1e-3  # per second: a slower growth has no effect in these runs
NEAR_PREDICTION = 2  # steps: if the departure is this close to the prediction from rounding, rounding is the cause


# errors


def coarsest_run(runs: dict, case: Case) -> dict | None:
    """The curve of the coarsest step of MuJoCo's RK4, with either of its schemes; None: there is none."""
    curves = (runs.get((case.name, scheme, case.steps)) for scheme in SCHEMES_OF_RK4)
    return next((curve for curve in curves if curve), None)


def coarsest_runs(result: Result, robot: Robot) -> Iterator[tuple[Case, dict]]:
    """Each case that was run, with the curve of its coarsest step of RK4."""
    for case in robot.cases:
        if curve := coarsest_run(result.curves["runs"], case):
            yield case, curve


def has_reference(case: Case) -> bool:
    """Whether the true motion of a case is computed here: not of a file's robot, whose scenes have steps of their own."""
    return "speed" in case.scene.tags and not case.robot.is_read and case.steps == reference.RECORDS


def deviations(case: Case, curve: dict) -> dict[str, float | None]:
    """The largest movement of each engine's run from its start, rad or m; None of a run that has diverged."""
    paths = {name: curve[name][0] for name in case.robot.compared}
    return {name: number_or_none(deviation(q, q[0], case.coordinates)) for name, q in paths.items()}


def find_errors(result: Result, robot: Robot, references: Mapping[str, reference.Reference]) -> None:
    """The largest error of the coarsest run of RK4 of both engines in each scene, and the scenes where it is far larger
    than the engines' difference. references: by the name of the scene; the true motion of a held scene is rest.
    """
    errors, lines, far = {}, [], []
    for case, curve in sorted(coarsest_runs(result, robot), key=lambda pair: not pair[0].is_held):
        if case.is_held:
            errors[case.name] = tuple(deviations(case, curve).values())
        elif has_reference(case):
            true, joints = references.get(case.name) or reference.reference(case), range(len(case.joints))
            values = (true.error(curve[name][0], joints).max() for name in robot.compared)
            errors[case.name] = tuple(map(number_or_none, values))
        else:
            continue
        difference = difference_while_judged(curve, case)
        about = {
            "scene": case.name,
            "true": "rest" if case.is_held else "series",
            "unit": movement_unit(case.coordinates),
        }
        about |= dict(zip(("first", "second"), errors[case.name]))
        lines.append(about | {"difference": difference, "judged": curve["judged_until_s"]})
        if is_far(errors[case.name], difference):
            far.append(case.name)
    result.curves["errors"] = errors
    if any(line["true"] == "series" for line in lines):  # held scenes have their own findings
        steps = {case.steps for case in robot.cases if case.name in errors}
        labels = [LABELS[name] for name in robot.compared]
        count = steps.pop() if len(steps) == 1 else None
        result.find("errors", labels=labels, steps=count, scenes=lines, far=far, times=SAYS_NOTHING)


def is_far(errors: tuple, difference: float) -> bool:
    """Whether the larger error is so large that the engines' difference says nothing about it."""
    return None not in errors and max(errors) > SAYS_NOTHING * difference


def difference_while_judged(curve: dict, case: Case) -> float:
    """The largest difference of the engines while they are judged, rad or m."""
    last = int(np.searchsorted(curve["t"], curve["judged_until_s"] * (1 + 1e-9), side="right"))
    states = slice(0, last, curve["every"])
    return float(moved_from(*(curve[name][0][states] for name in case.robot.compared), case.coordinates).max())


# departures


def find_departures(result: Result, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """When each engine leaves the posture of each held scene, and why."""
    claims = robot.claims.of_scenes if robot.claims else {}
    for case, curve in coarsest_runs(result, robot):
        if case.is_held:
            scene, claim = scene_begins(case.name, robot), claims.get(case.name)
            values = departures(case, engines, curve["left"], deviations(case, curve))
            result.find("held", scene=scene, claim=claim, duration=case.duration, **values)


def departures(case: Case, engines: Mapping[str, Engine], left: Mapping, farthest: Mapping) -> dict:
    """Why each engine leaves the posture of a case when it does, or stays.

    left: of each engine the time when it left, s, None: it stays; farthest: its largest movement, rad or m.
    """
    allowed, each = allowed_acceleration(case), []
    for name, push in initial_accelerations(case, engines).items():
        finite = bool(np.isfinite(push).all())
        size, predicted = float(np.abs(push).max()), predicted_departure(case, push) if finite else None
        why = cause(case, size, allowed, predicted, left[name])
        values = {"left": left[name], "farthest": farthest[name], "push": size, "predicted": predicted, "cause": why}
        each.append({"label": LABELS[name], "finite": finite, **values})
    rate = growth_rate(case)
    return {
        "rate": rate if rate > STEADY else None,
        "allowed": allowed,
        "limit": LEFT,
        "unit": movement_unit(case.coordinates),
        "stated": case.robot.compared[0] == "tmt",
        "stays": all(engine["finite"] and engine["left"] is engine["predicted"] is None for engine in each),
        "engines": each,
    }


def cause(case: Case, size: float, allowed: float, predicted: float | None, left: float | None) -> str | None:
    """Why a robot leaves under an acceleration of this size, rad/s2: "torque", "rounding" or "unexplained"; None: it stays."""
    if left is None:
        return None
    if not size <= allowed:
        return "torque"
    steps = np.inf if predicted is None else abs(left - predicted) * case.steps / case.duration
    return "rounding" if steps < NEAR_PREDICTION + 0.5 else "unexplained"


def initial_accelerations(case: Case, engines: Mapping[str, Engine]) -> dict[str, np.ndarray]:
    """The acceleration at the start in each engine under the torque that should hold, rad/s2, (nv,)."""
    (name, ours), (other, theirs) = compared(engines, case).items()
    return {
        name: ours.run(*case.start, case.tau, NO_TIME, 1, "rk4").v[1] / NO_TIME,
        other: theirs.acceleration(*case.start, case.tau),
    }


def allowed_acceleration(case: Case) -> float:
    """The largest initial acceleration that rounding can cause, rad/s2."""
    dt = case.duration / case.steps
    return float(slope_rounding(METHODS["rk4"], case.tree, case.q[None], case.v[None], case.tau, dt)[2][0])


def linear_map(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """J and G of x+ = J x + G a: one step of RK4 of the linear motion about the start, pushed by a constant a, rad/s2.

    x: deviations of positions, as movements, and of speeds; J (2 nv, 2 nv), G (2 nv, nv). A = dxd/dx is exact: an explicit step
    of Euler's method of 1 s is 1 + A.
    """
    n, dt = case.coordinates.nv, case.duration / case.steps
    A = amplification(METHODS["explicit_euler"], case.tree, case.q, case.v, case.tau, 1.0) - np.eye(2 * n)
    Z = dt * A
    pushed = dt * (np.eye(2 * n) + Z / 2 + Z @ Z / 6 + Z @ Z @ Z / 24)
    return np.eye(2 * n) + A @ pushed, pushed[:, n:]


def predicted_departure(case: Case, push: np.ndarray) -> float | None:
    """When the linear map has the robot 0.1 rad, or m, away under a constant push, rad/s2: s; None: not in this scene."""
    J, G = linear_map(case)
    state = np.zeros(len(J))
    for k in range(1, case.steps + 1):
        state = J @ state + G @ push
        if np.abs(state[: len(push)]).max() > LEFT:
            return k * case.duration / case.steps
    return None


def growth_rate(case: Case) -> float:
    """The growth of the fastest small deviation by the linear map of RK4, 1/s; below 0: it shrinks."""
    J, _ = linear_map(case)
    return float(np.log(np.abs(np.linalg.eigvals(J)).max()) / (case.duration / case.steps))
