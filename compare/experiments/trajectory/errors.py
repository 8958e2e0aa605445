"""How far the runs with the coarsest step of RK4 are from the true motion, where that is known."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from ...judge.check import Result
from ...judge.run import deviation, number_or_none
from ...robots import Robot
from ...robots.case import Case
from ...truth import reference

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")


def errors_when_held(result: Result, robot: Robot) -> dict[str, tuple]:
    """Of each held scene, whose true motion is rest: {scene: (TMT, MuJoCo)}, rad.

    The largest angle over the run; None of a run that has diverged.
    """
    return {
        case.name: tuple(deviations(case, curve).values())
        for case, curve in coarsest_runs(result, robot)
        if case.is_held
    }


def errors_when_free(
    result: Result, robot: Robot, known: Mapping[str, reference.Reference] = MappingProxyType({})
) -> dict[str, tuple]:
    """The same of the other scenes that all methods follow for speed, of which the true motion is known to many digits.

    known: references that were computed beside, by the name of the scene.
    """
    errors = {}
    for case, curve in coarsest_runs(result, robot):
        if is_followed(case):
            true = known.get(case.name) or reference.reference(case)
            joints = range(len(case.joints))
            of_run = (true.error(curve[name][0], joints).max() for name in robot.compared)
            errors[case.name] = tuple(map(number_or_none, of_run))
    return errors


def is_followed(case: Case) -> bool:
    """Whether the true motion of a case is asked for here: not of a file's robot, whose scenes have steps of their own."""
    return "speed" in case.scene.tags and not case.robot.is_read and case.steps == reference.RECORDS


def deviations(case: Case, curve: dict) -> dict[str, float | None]:
    """How far the runs of both engines go from where they start, rad or m; None of a run that has diverged."""
    paths = {name: curve[name][0] for name in case.robot.compared}
    return {name: number_or_none(deviation(q, q[0], case.coordinates)) for name, q in paths.items()}


def coarsest_runs(result: Result, robot: Robot) -> Iterator[tuple[Case, dict]]:
    """Each case that was run, with the curve of its coarsest step of RK4."""
    runs = result.curves["runs"]
    for case in robot.cases:
        if curve := coarsest_run(runs, case):
            yield case, curve


def coarsest_run(runs: dict, case: Case) -> dict | None:
    """The curve of the coarsest step of MuJoCo's RK4, whichever scheme that is here; None: there is none."""
    found = (runs.get((case.name, scheme, case.steps)) for scheme in SCHEMES_OF_RK4)
    return next((curve for curve in found if curve), None)
