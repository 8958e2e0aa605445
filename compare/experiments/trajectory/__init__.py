"""Motion by the same scheme on both sides: a method of tmt for every integrator of MuJoCo."""

from collections.abc import Iterator, Mapping
from functools import partial

from ...engines import LABELS, Engine, methods_in
from ...engines.mujoco.names import INTEGRATORS
from ...judge.check import Result
from ...judge.rounding import NARROW
from ...judge.run import MOVES, leaves_no_digits, movement_unit
from ...robots import Robot
from .. import Experiment
from ..setup import Setup
from . import many_digits, motion, true_motion
from .first_screen import headline as headline
from .plan import begin
from .rules import compare_derivatives

EXPERIMENT = Experiment(order=70, options=("--joints", "--scenes"), diagnosed=True, overview="scenes")


def claim_values(robot: Robot) -> dict:
    return {"narrow": NARROW, "moves": MOVES, "unit": movement_unit(robot.coordinates)}


def skipped(robot: Robot) -> str | None:
    """Why it does not apply to a robot, or None."""
    return leaves_no_digits(robot)


def rows(setup: Setup) -> Result:
    """Each scene, integrator and step: three levels of agreement; then drift, errors, many digits."""
    robot = setup.robot
    result = Result("trajectory", label=LABELS[robot.compared[0]], shown=[
        "scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
        "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s",
    ])  # fmt: skip
    if "trajectory" not in setup.background:
        begin(setup)
    work = setup.background.pop("trajectory")
    if not robot.own:
        compare_derivatives(result, robot, setup.engines)
    (drifts,) = work["drift"]
    result.checks, result.notes = [*result.checks, *drifts.checks], [*result.notes, *drifts.notes]
    result.curves |= drifts.curves | {"runs": {}, "drawn": []}
    for part, drawn in work["runs"]:
        result.rows += part.rows
        result.checks += part.checks
        result.notes += part.notes
        result.curves["runs"] |= part.curves
        result.curves["drawn"] += [drawn] if drawn else []
    result.curves["drawn"] = motion.in_order(result.curves["drawn"], robot)
    motion.tabulate_motion(result, robot)
    many_digits.many_digits(result, *work["exact"])
    others, result.notes = result.notes, []
    true_motion.find_departures(result, robot, setup.engines)
    true_motion.find_errors(result, robot, dict(zip(*work["true"])))
    find_schemes(result, robot, setup.engines["mujoco"])
    result.notes += work["left_out"] + others
    return result


def find_schemes(result: Result, robot: Robot, mujoco: Engine) -> None:
    """Which integrators are which scheme, also where a robot's own actuators act, and which have none."""
    missing = [] if robot.own else [name for name in INTEGRATORS if name not in mujoco.methods]
    result.find("schemes", own=robot.own, schemes=names_by_scheme(mujoco.methods), missing=missing, noun=robot.noun)
    ran = {scene for scene, *_ in result.curves["runs"]}
    driven = [case for case in robot.cases if case.controller and case.name in ran]
    if driven:
        schemes, left_out = names_by_scheme(methods_in(mujoco, driven[0])), driven[0].controller.left_out
        scenes = [case.name for case in driven]
        result.find("servos", noun=robot.noun, scenes=scenes, schemes=schemes, left_out=dict(left_out))


def names_by_scheme(methods: dict) -> dict[str, list[str]]:
    """The integrators of each scheme."""
    names = {}
    for method in methods.values():
        names.setdefault(method.scheme, []).append(method.name)
    return names


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """Those of the assignment that show a held posture, one for each scene, drift, and the motion."""
    from . import figures_motion_gif, figures_runs  # matplotlib is for the process that draws

    most = {}  # steps of a scene's runs
    for scene, _, steps in result.curves["runs"]:
        most[scene] = max(steps, most.get(scene, 0))
    cases = [case for case in robot.cases if case.name in most]
    numbers = robot.claims.figures if robot.claims else {}
    numbered = [case for case in cases if case.is_held and case.name in numbers]
    for case in numbered:
        yield partial(figures_runs.draw_held, result, case, numbers[case.name])
    for case in cases:
        if case not in numbered or most[case.name] > case.steps:  # a quick run has nothing more to show of those
            yield partial(figures_runs.draw_run, result, case)
    if result.curves["drift"]["drifts"]:
        yield partial(figures_runs.draw_drift, result)
    if result.curves.get("drawn"):
        yield partial(figures_motion_gif.draw_motion, result)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_scenes  # matplotlib is for the process that draws

    if results["trajectory"].rows:
        yield partial(draw_scenes, results["trajectory"], robot)
