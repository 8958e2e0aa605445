"""What each scene needs of the model: the fewest joints, an integrator at all; and what the rest costs."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from tmt.exact.values import DIGITS

from ...engines.mujoco import ModelError
from ...judge.check import About, Result
from ...judge.entries import has_own_scales
from ...judge.rounding import NARROW
from ...judge.run import movement_unit
from ...judge.scale import FACTOR
from ...robots import Robot
from ...robots.case import Case
from .. import Experiment
from ..setup import Setup, nothing
from . import exact_motion, sub_blocks
from .cost import measure_costs
from .first_screen import headline as headline
from .needs import MOST_IN_A_BAND, of_case
from .times import TWO_INTEGRATORS, time_models

EXPERIMENT = Experiment(order=110, serves_own=False, options=("--scenes",), timed=True)


def claim(robot: Robot) -> str:
    """What is claimed."""
    one, joints = "hinge" if set(robot.coordinates.all_kinds) == {"hinge"} else "joint", robot.coordinates
    runs = not robot.is_read or joints.nv <= MOST_IN_A_BAND
    held = any(case.is_held for case in robot.cases)
    swings = [case for case in exact_motion.pendulums(robot.cases_of_torque) if exact_motion.is_compared(case)]
    return (
        f"A {one} may be locked if, with it at its start value and at rest, its acceleration vanishes for all values of the "
        f"other {one}s. The program finds these {one}s on the expressions of the traced method, which fold to the number 0, and "
        f"confirms them with {DIGITS} digits at random states. "
        + "The model without them has the same motion, in both engines. " * runs
        + "A held posture needs no integrator: it stays. " * held
        + "A single free hinge is a physical pendulum, whose angle is an elliptic function of time. " * bool(swings)
        + "And whatever else is added in MuJoCo costs time, and changes nothing unless something is touched."
    )


def tolerance(robot: Robot) -> str:
    """What the differences are compared with."""
    movements = movement_unit(robot.coordinates)
    scales = f"{FACTOR} eps x the largest entry of Mbar, and {FACTOR} eps x the sum of the absolute terms of the bias,"
    if has_own_scales(robot.tree, robot.is_read):
        scales = "as in mass and acceleration, each entry its own,"
    return (
        f"Sub-blocks of Mbar and bias: {scales} of the whole model. Runs of the smaller and the whole model, by the same "
        f"method: the band of rounding of the whole one (see trajectory), judged while it is below {NARROW:g} {movements}, for "
        "as long as the scene states. "
        "Errors against an exact solution fall with the step at the method's order, and with the square of the amplitude where "
        "the solution is linear. Additions that exert no force leave the same bits. Timings are no checks."
    )


def begin(setup: Setup) -> None:
    """Begin with all that is not timed, beside other work."""
    alone = replace(setup, map=map, quiet=nothing, progress=nothing, background={}, reading=None)
    setup.background["reduction"] = setup.map(untimed, [alone])


def rows(setup: Setup, cases: Sequence[Case] | None = None, timed: bool = True) -> Result:
    """Sub-blocks for every subset; for each case what it needs, runs and times; exact solutions; costs in MuJoCo.

    cases: the robot's, if none are given. timed=False: one choice of angles, the scenes with fewer joints, and the exact
    solutions, in a few tenths of a second: enough to see a wrong model.
    """
    begun = setup.background.pop("reduction", None) if timed and cases is None else None
    result, models = next(iter(begun)) if begun else untimed(setup, cases, timed)
    try:
        if timed and models is not None:
            setup.quiet()
            rounds = setup.of(160, 16, 2)
            time_models(result, models, setup, rounds)
            measure_costs(result, setup, rounds)
    except ModelError as error:
        say_not_lockable(result, setup.robot, error)
    return result


def untimed(setup: Setup, cases: Sequence[Case] | None = None, timed: bool = True) -> tuple[Result, list[tuple] | None]:
    """What of `rows` is no timing, and the models whose steps are to be timed; None: nothing can be locked."""
    result = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})
    if left_out := [case.name for case in setup.robot.cases if case.controller]:
        result.notes.append(f"Scenes in which actuators act are not reduced: {'; '.join(left_out)}.")
    cases = cases or [case for case in setup.robot.cases_of_torque if timed or "fewer joints" in case.scene.tags]
    try:
        return result, fill(result, setup, cases, timed)
    except ModelError as error:
        say_not_lockable(result, setup.robot, error)
        return result, None


def say_not_lockable(result: Result, robot: Robot, error: ModelError) -> None:
    """Of a model with something that cannot be taken out with its joint: a note, or a failed check where it should be there."""
    if robot.is_read:
        result.notes.append(f"Nothing is reduced: {error}.")
    else:
        quantity = "models whose hinges can be locked"
        result.check("every subset", quantity, 0, 1, "models", str(error), rule="equal", about=About.PROGRAM)


def fill(result: Result, setup: Setup, cases: Sequence[Case], timed: bool) -> list[tuple]:
    """All parts of `rows` that are no timing, one after the other; the models that are to be timed."""
    angles = setup.of(10, 1 if setup.robot.is_read else 3, 1) if timed else 1
    sub_blocks.compare_blocks(result, setup, angles)
    integrators = TWO_INTEGRATORS if timed else TWO_INTEGRATORS[-1:]
    models = [model for case in cases for model in of_case(result, case, setup, integrators)]
    exact_motion.swings(result, setup, cases)
    few = () if timed else (exact_motion.AMPLITUDES[-2:], exact_motion.LESS_FINE)
    exact_motion.small_oscillations(result, setup, *few)
    return models


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """What each scene needs and how fast that is; exact swings; small oscillations; costs: calls that draw one figure."""
    from . import figures_motion, figures_needs  # matplotlib is for the process that draws

    needs = result.curves["needs"].values() if result.rows else ()  # none of a model that cannot be locked
    if any(found["stays"] or found["locked"] or found.get("undecided") for found in needs):
        yield partial(figures_needs.draw_needs, result, robot)
    for scene in result.curves["swings"]:
        yield partial(figures_motion.draw_swing, result, scene)
    if "small" in result.curves:
        yield partial(figures_motion.draw_small_oscillations, result, robot)
    if "cost_in_mujoco" in result.tables:
        yield partial(figures_needs.draw_costs, result)
