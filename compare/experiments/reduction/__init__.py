"""What each scene needs of the model: the joints that can be locked without changing its motion."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

from tmt.exact.values import DIGITS

from ...core.check import About
from ...core.finding import Finding
from ...engines.mujoco import ModelError
from ...judge.rounding import NARROW
from ...judge.run import movement_unit
from ...judge.scale import FACTOR
from ...robots import Robot
from .. import Experiment
from ..setup import Setup, nothing
from . import of_file
from .exact_motion import compare_swing, is_pendulum
from .needs import compare_case, joint_word
from .records import Need, ReductionResult
from .sub_blocks import compare_blocks
from .times import largest_gain, time_models

EXPERIMENT = Experiment(
    order=110,
    serves_own=False,
    options=("--scenes", "--posture", "--error", "--points", "--controls", "--write"),
    timed=True,
)
NO_GAIN = 1.05  # a smaller speedup is within the accuracy of the times


def claim_values(robot: Robot) -> dict[str, str | float]:
    words = {"joint": joint_word(robot.coordinates), "unit": movement_unit(robot.coordinates)}
    return words | {"digits": DIGITS, "eps": FACTOR, "narrow": NARROW}


def begin(setup: Setup) -> Iterable[ReductionResult]:
    """Start everything that is not timed, in parallel with other work."""
    alone = replace(setup, map=map, quiet=nothing, progress=nothing, reading=None)
    return setup.map(untimed, [alone])


def rows(setup: Setup, work: Iterable[ReductionResult] | None = None) -> ReductionResult:
    """Sub-blocks with joints locked; what each case needs, its runs and times; exact solutions."""
    (result,) = begin(setup) if work is None else work
    if setup.alone and setup.reading and not setup.robot.is_stated:
        of_file.add(result, setup, setup.reading)
    if result.models is not None:
        setup.quiet()
        time_models(result, setup, rounds=setup.of(64, 16, 2))
        best = largest_gain(result.rows, setup.robot.coordinates.nv)
        if best and (best.speedup or 0.0) >= NO_GAIN:
            values: dict[str, Any] = {
                "speedup": best.speedup,
                "joints": best.hinges.split(),
                "scene": best.scene,
            }
            result.headline = result.finding("headline", **values)
    result.top += answers(result, setup.robot)
    return result


def answers(result: ReductionResult, robot: Robot) -> list[Finding]:
    """What scenes need, a finding for those that need the same; what can be locked comes last."""
    groups: dict[Need, list[str]] = {}
    for scene, need in result.needs.items():
        groups.setdefault(need, []).append(scene)
    about = {"joint": joint_word(robot.coordinates), "unit": movement_unit(robot.coordinates)}
    findings = []
    for need, scenes in sorted(groups.items(), key=lambda group: bool(group[0].needed and group[0].stays)):
        apart = max((value for (scene, _), value in result.apart.items() if scene in scenes), default=None)
        findings.append(result.finding("answer", scenes=scenes, apart=apart, **need._asdict(), **about))
    return findings


def untimed(setup: Setup) -> ReductionResult:
    """The parts of `rows` that are not timed, and the models to be timed."""
    result, robot = ReductionResult("reduction"), setup.robot
    if driven := [case.name for case in robot.cases if case.controller]:
        result.find("driven", scenes=driven)
    try:
        if not (robot.is_read and setup.alone):  # there the locks of the smaller file are compared
            compare_blocks(result, setup, setup.of(10, 1 if robot.is_read else 3, 1))
        models = [model for case in robot.cases_of_torque for model in compare_case(result, case, setup)]
        for case in robot.cases_of_torque:
            if is_pendulum(case):
                compare_swing(result, setup, case)
        result.models = models
    except ModelError as error:
        add_not_lockable(result, robot, error)
    return result


def add_not_lockable(result: ReductionResult, robot: Robot, error: ModelError) -> None:
    """A finding for a robot from a file; a failed check for a stated one, whose joints can be locked."""
    if robot.is_read:
        result.top.append(result.finding("not_lockable", error=str(error)))
    else:
        quantity = "models whose hinges can be locked"
        result.check("every subset", quantity, 0, 1, "models", str(error), rule="equal", about=About.PROGRAM)


def figures(result: ReductionResult, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_reduction  # matplotlib is for the process that draws

    if frontier := result.tables.get("reduction_frontier"):
        yield partial(figures_reduction.draw_frontier, result, frontier)
    needs = result.needs.values() if result.rows else ()  # empty if no joint can be locked
    if any(need.stays or need.locked or need.undecided for need in needs):
        yield partial(figures_reduction.draw_needs, result, robot)
    for scene in result.swings:
        yield partial(figures_reduction.draw_swing, result, scene)
