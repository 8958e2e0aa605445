"""What each scene needs of the model: the joints that can be locked without changing its motion."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from tmt.exact.values import DIGITS

from ...core.check import About, Result
from ...core.finding import Finding
from ...engines.mujoco import ModelError
from ...judge.rounding import NARROW
from ...judge.run import movement_unit
from ...judge.scale import FACTOR
from ...robots import Robot
from .. import Experiment
from ..setup import Setup, nothing
from .exact_motion import compare_swing, pendulums
from .needs import joint_word, of_case
from .sub_blocks import compare_blocks
from .times import largest_gain, time_models

EXPERIMENT = Experiment(order=110, serves_own=False, options=("--scenes",), timed=True)
NO_GAIN = 1.05  # a smaller speedup is within the accuracy of the times


def claim_values(robot: Robot) -> dict:
    words = {"joint": joint_word(robot.coordinates), "unit": movement_unit(robot.coordinates)}
    return words | {"digits": DIGITS, "eps": FACTOR, "narrow": NARROW}


def begin(setup: Setup) -> Iterator:
    """Start everything that is not timed, in parallel with other work."""
    alone = replace(setup, map=map, quiet=nothing, progress=nothing, reading=None)
    return setup.map(untimed, [alone])


def rows(setup: Setup, work: Iterator | None = None) -> Result:
    """Sub-blocks with joints locked; what each case needs, its runs and times; exact solutions."""
    ((result, models),) = begin(setup) if work is None else work
    if models is not None:
        setup.quiet()
        time_models(result, models, setup, rounds=setup.of(64, 16, 2))
        best = largest_gain(result.rows, setup.robot.coordinates.nv)
        if best and best["speedup"] >= NO_GAIN:
            values = {"speedup": best["speedup"], "joints": best["hinges"].split(), "scene": best["scene"]}
            result.headline = result.finding("headline", **values)
    result.top += answers(result, setup.robot)
    return result


def answers(result: Result, robot: Robot) -> list[Finding]:
    """What scenes need, a finding for those that need the same; what can be locked comes last."""
    groups = {}
    for scene, need in result.curves["needs"].items():
        joints = {kind: tuple(names) for kind, names in need.items()}
        groups.setdefault(tuple(joints.values()), joints | {"scenes": []})["scenes"].append(scene)
    for group in groups.values():
        apart = [value for (scene, _), value in result.curves["apart"].items() if scene in group["scenes"]]
        group |= {"apart": max(apart, default=None), "unit": movement_unit(robot.coordinates)}
    found = [
        result.finding("answer", joint=joint_word(robot.coordinates), **group) for group in groups.values()
    ]
    return sorted(found, key=lambda one: bool(one.values["needed"] and one.values["stays"]))


def untimed(setup: Setup) -> tuple[Result, list[tuple] | None]:
    """The parts of `rows` that are not timed, and the models to be timed; None: no joint can be locked."""
    result, robot = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}}), setup.robot
    if driven := [case.name for case in robot.cases if case.controller]:
        result.find("driven", scenes=driven)
    try:
        compare_blocks(result, setup, setup.of(10, 1 if robot.is_read else 3, 1))
        models = [model for case in robot.cases_of_torque for model in of_case(result, case, setup)]
        for case in pendulums(robot.cases_of_torque):
            compare_swing(result, setup, case)
    except ModelError as error:
        add_not_lockable(result, robot, error)
        return result, None
    return result, models


def add_not_lockable(result: Result, robot: Robot, error: ModelError) -> None:
    """A finding for a robot from a file; a failed check for a stated one, whose joints can be locked."""
    if robot.is_read:
        result.top.append(result.finding("not_lockable", error=str(error)))
    else:
        quantity = "models whose hinges can be locked"
        result.check("every subset", quantity, 0, 1, "models", str(error), rule="equal", about=About.PROGRAM)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from . import figures_reduction  # matplotlib is for the process that draws

    needs = result.curves["needs"].values() if result.rows else ()  # empty if no joint can be locked
    if any(need["stays"] or need["locked"] or need["undecided"] for need in needs):
        yield partial(figures_reduction.draw_needs, result, robot)
    for scene in result.curves["swings"]:
        yield partial(figures_reduction.draw_swing, result, scene)
