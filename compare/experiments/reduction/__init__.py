"""What each scene needs of the model: joints that can be locked with the same motion."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from tmt.exact.tree import DIGITS

from ...core.check import Result
from ...judge.scale import FACTOR
from ...robots import Robot
from ...robots.case import Case
from ...truth.smallest import Needed, needed
from .. import Experiment
from ..setup import Setup
from . import of_file
from .records import NeedRow

EXPERIMENT = Experiment(
    order=110,
    serves_own=False,
    first_screen=("answer",),
    options=("--scenes", "--posture", "--error", "--points", "--controls", "--write"),
)


def claim_values(robot: Robot) -> dict[str, str | float]:
    joint = "hinge" if set(robot.coordinates.all_kinds) == {"hinge"} else "joint"
    return {"joint": joint, "digits": DIGITS, "eps": FACTOR}


def rows(setup: Setup) -> Result:
    """What the motion of a file, or each scene of the arm, needs."""
    result, robot, needs = Result("reduction"), setup.robot, dict[Case, Needed]()
    if driven := [case.name for case in robot.cases if case.controller and not robot.is_read]:
        result.find("driven", scenes=driven)
    for case in robot.cases_of_torque:
        if not robot.is_read:
            needs[case] = needed(case)
    if setup.reading and not robot.is_stated and is_asked(setup):
        of_file.add(result, setup, setup.reading)
    add_needs(result, needs)
    return result


def is_asked(setup: Setup) -> bool:
    """Whether a run answers what a motion of the file needs: alone, in full, or with an option of it."""
    request = setup.request
    given = request.error, request.points, request.controls, request.write
    return setup.alone or setup.size == "full" or any(option is not None for option in given)


def add_needs(result: Result, needs: Mapping[Case, Needed]) -> None:
    """What scenes need: a row for each joint, a finding for equal scenes; joints to lock come last."""
    groups: dict[tuple[tuple[str, ...], ...], list[Case]] = {}
    for case, need in needs.items():
        names = tuple(name for name in case.joints if name in need.moves)
        rows = [NeedRow(case.name, name, need.moves[name]) for name in names]
        result.tables.setdefault("reduction_needs", []).extend(rows)
        groups.setdefault((names, case.scene.locked, need.stays), []).append(case)
    for numbers, cases in sorted(groups.items(), key=lambda group: bool(group[0][0] and group[0][2])):
        about, scenes = claim_values(cases[0].robot), [case.name for case in cases]
        moving, locked, stays = numbers
        result.top.append(
            result.finding("answer", scenes=scenes, needed=moving, locked=locked, stays=stays, about=about)
        )


def figures(result: Result, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_reduction  # matplotlib is for the process that draws

    if frontier := result.tables.get("reduction_frontier"):
        yield partial(figures_reduction.draw_frontier, result, frontier)
