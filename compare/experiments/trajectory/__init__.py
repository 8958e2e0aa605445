"""Motion by the same scheme on both sides: a method of tmt for every integrator of MuJoCo."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from ...core.check import Result, largest_known
from ...core.finding import Finding
from ...core.pictures import Pictures
from ...engines import LABELS, Engine
from ...engines.mujoco.names import INTEGRATORS
from ...judge.rounding import NARROW
from ...judge.run import MOVES, leaves_no_digits, movement_unit
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import RECORDS, reference
from .. import Experiment
from ..setup import Setup
from . import energy, motion, true_motion
from .runs import follow, recorded

EXPERIMENT = Experiment(order=70, options=("--joints", "--scenes"), diagnosed=True, overview="scenes")
SECONDS_OF_OWN = {
    "full": 20.0,
    "quick": 4.0,
    "small": 2.0,
}  # of all runs of a user's own equations together, about
OVERHEAD_OF_OWN = 1e-4  # s of an evaluation in a run, about, beyond the equations themselves
STAGES_OF_RK4 = 4  # evaluations in a step of RK4
skipped = leaves_no_digits


def claim_values(robot: Robot) -> dict:
    return {"narrow": NARROW, "moves": MOVES, "unit": movement_unit(robot.coordinates)}


def begin(setup: Setup) -> dict:
    """Start the long work, in parallel, while other experiments compute. A quick run takes fewer scenes."""
    robot, engines = setup.robot, setup.engines
    cases = [case for case in robot.cases if not (setup.is_quick and "full only" in case.scene.tags)]
    spread, finer, left_out = setup.map, setup.finer, []
    if robot.own:  # whose equations stay in this process
        spread, finer = map, setup.finer[:1]
        cases, left_out = within_time(setup, cases)
    # not of a file's robot, whose scenes have steps of their own
    true = [
        case for case in cases if "speed" in case.scene.tags and not robot.is_read and case.steps == RECORDS
    ]
    steps = setup.of(energy.STEPS, energy.FEW_STEPS, energy.FEW_STEPS)
    return {
        "runs": spread(partial(follow, engines=engines, finer=finer), cases),
        "energy": spread(partial(energy.measure_energy, engines=engines, steps=steps), [robot]),
        "true": ([case.name for case in true], spread(reference, true)),
        "left_out": left_out,
    }


def within_time(setup: Setup, cases: Sequence[Case]) -> tuple[list[Case], list[Finding]]:
    """The scenes that a user's own equations have and can follow in time, and a finding about the others."""
    equations, seconds = setup.engines["own"].equations, SECONDS_OF_OWN[setup.size]
    parts = ("acceleration",) if equations.has("acceleration") else ("mass_matrix", "bias")
    each = OVERHEAD_OF_OWN + sum(equations.times[part][0] for part in parts)
    able, unlike, slow, left = [], [], [], seconds
    for case in cases:
        if case.controller or not case.scene.gravity:
            unlike.append(case.name)
            continue
        left -= each * STAGES_OF_RK4 * (case.steps + recorded(case))
        if left >= 0.0:
            able.append(case)
        else:
            slow.append(case.name)
    values = {"unlike": unlike, "slow": slow, "seconds": seconds}
    return able, [Finding("trajectory", "own_left_out", values)] if unlike or slow else []


def rows(setup: Setup, work: dict | None = None) -> Result:
    """Each scene, integrator and step: single steps and open loop; then departures, errors and the drift of the energy."""
    robot = setup.robot
    result = Result("trajectory", label=LABELS[robot.compared[0]], shown=[
        "scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
        "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s",
    ])  # fmt: skip
    work = begin(setup) if work is None else work
    (drifts,) = work["energy"]
    result.checks, result.tables["energy"] = drifts.checks, drifts.tables["energy"]
    runs = result.curves["runs"] = {}
    for part in work["runs"]:
        result.rows += part.rows
        result.checks += part.checks
        runs |= part.curves
    with np.errstate(over="ignore", invalid="ignore"):  # in runs that diverge
        drawn = [motion.drawn_motion(case, runs) for case in robot.cases]
    result.curves["drawn"] = motion.in_order([each for each in drawn if each], robot)
    true_motion.find_departures(result, robot, setup.engines)
    true_motion.find_errors(result, robot, dict(zip(*work["true"])))
    find_schemes(result, robot, setup.engines["mujoco"])
    result.notes += work["left_out"]
    return result


def find_schemes(result: Result, robot: Robot, mujoco: Engine) -> None:
    """Which integrators are which scheme, which have none, and which of a robot's own actuators are left out."""
    schemes = {}
    for method in mujoco.methods.values():
        schemes.setdefault(method.scheme, []).append(method.name)
    missing = [] if robot.own else [name for name in INTEGRATORS if name not in mujoco.methods]
    result.find("schemes", own=robot.own, schemes=schemes, missing=missing, noun=robot.noun)
    ran = {scene for scene, *_ in result.curves["runs"]}
    driven = [case for case in robot.cases if case.controller and case.name in ran]
    if driven:
        scenes, left_out = [case.name for case in driven], dict(driven[0].controller.left_out)
        result.find("servos", noun=robot.noun, scenes=scenes, left_out=left_out)


def headline(result: Result) -> Finding | None:
    """The largest share of the band of rounding, and the number of scenes."""
    share = largest_known([row["difference_over_band"] for row in result.rows])
    scenes = len({row["scene"] for row in result.rows})
    return None if share is None else result.finding("headline", scenes=scenes, share=share)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """The assignment's figures of held postures, one figure for each scene, and the motion."""
    from . import figures_motion_gif, figures_runs  # matplotlib is for the process that draws

    ran = {scene for scene, *_ in result.curves["runs"]}
    cases = [case for case in robot.cases if case.name in ran]
    numbers = robot.claims.figures if robot.claims else {}
    for case in cases:
        if case.is_held and case.name in numbers:
            yield partial(figures_runs.draw_held, result, case, numbers[case.name])
    for case in cases:
        yield partial(figures_runs.draw_run, result, case)
    if result.curves["drawn"]:
        yield partial(figures_motion_gif.draw_motion, result)


def scenes_drawn(result: Result) -> Sequence[Pictures]:
    return result.curves.get("drawn", ())


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_scenes  # matplotlib is for the process that draws

    if results["trajectory"].rows:
        yield partial(draw_scenes, results["trajectory"], robot)
