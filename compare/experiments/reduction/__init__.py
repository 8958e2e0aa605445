"""What each scene needs of the model: joints that can be locked with the same motion; exact swings."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from tmt.exact.tree import DIGITS

from ...core.check import About, Result
from ...engines import LABELS, same_scheme
from ...engines.mujoco import ModelError
from ...judge.order import check_order
from ...judge.run import MOVES
from ...judge.scale import FACTOR
from ...robots import Robot
from ...robots.case import Case
from ...truth.pendulum import pendulum, swing
from ...truth.smallest import Needed, needed
from .. import Experiment
from ..setup import Setup
from . import of_file
from .records import NeedRow
from .sub_blocks import compare_blocks

EXPERIMENT = Experiment(
    order=110,
    serves_own=False,
    first_screen=("answer",),
    options=("--scenes", "--posture", "--error", "--points", "--controls", "--write"),
)
COARSE, FINE = 32, 64  # multiples of the steps of the case
ORDER = 4  # of RK4
ROUNDED = 1e-11  # rad: smaller errors contain rounding


def claim_values(robot: Robot) -> dict[str, str | float]:
    joint = "hinge" if set(robot.coordinates.all_kinds) == {"hinge"} else "joint"
    return {"joint": joint, "digits": DIGITS, "eps": FACTOR}


def rows(setup: Setup) -> Result:
    """Sub-blocks with joints locked; what the motion of a file or each scene of the arm needs; swings."""
    result, robot, needs = Result("reduction"), setup.robot, dict[Case, Needed]()
    if driven := [case.name for case in robot.cases if case.controller and not robot.is_read]:
        result.find("driven", scenes=driven)
    try:
        if robot.is_stated or not setup.alone:  # else the locks of the smaller file are compared
            compare_blocks(result, setup, setup.of(10, 1 if robot.is_read else 3, 1))
        for case in robot.cases_of_torque:
            if not robot.is_read:
                needs[case] = needed(case)
            if is_pendulum(case):
                compare_swing(result, setup, case)
    except ModelError as error:
        if robot.is_read:
            result.top.append(result.finding("not_lockable", error=str(error)))
        else:
            quantity = "models whose hinges can be locked"
            result.check(
                "every subset", quantity, 0, 1, "models", str(error), rule="equal", about=About.PROGRAM
            )
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


def is_pendulum(case: Case) -> bool:
    """Whether one hinge is free and only gravity acts."""
    is_hinge = case.coordinates.all_kinds == ("hinge",)
    is_forced = any(case.tree.damping) or case.tree.has_springs
    return is_hinge and case.is_free and case.scene.gravity and not is_forced


def compare_swing(result: Result, setup: Setup, case: Case) -> None:
    """The error of RK4 falls at its order; not checked where the hinge turns over or hardly moves."""
    (q,), (v,), t = *case.start, np.linspace(0.0, case.duration, case.steps + 1)
    hanging, frequency = pendulum(case.tree)
    exact = swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)
    if not np.ptp(exact) >= MOVES:  # NaN where it turns over
        return
    engines: list[tuple[str, float | None, float]] = []
    twin: float | None = None
    for engine, dynamics in setup.compared(case).items():
        method = same_scheme(setup.engines, setup.engines["mujoco"].methods["RK4"], engine).name
        errors = []
        for finer in (COARSE, FINE):
            dt, steps = case.duration / case.steps / finer, finer * case.steps
            path = dynamics.run(*case.start, case.tau, dt, steps, method).q
            errors.append(float(np.abs(path[::finer, 0] - exact).max()))
        order = check_falling(result, f"{case.name}, RK4, {LABELS[engine]}", errors[0], errors[1], twin)
        if engine == "tmt":
            twin = order
        engines.append((LABELS[engine], order, errors[-1]))
    result.find("swing", scene=case.name, engines=engines)


def check_falling(
    result: Result, where: str, coarse: float, fine: float, twin: float | None = None
) -> float | None:
    """The order at which an error falls, rad, at half the step; None: it is rounding."""
    if fine <= ROUNDED:
        return None
    with np.errstate(divide="ignore"):
        order = float(np.log2(coarse / fine))
    check_order(result, where, ORDER, order, "error from the elliptic function", twin=twin)
    return order


def figures(result: Result, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_reduction  # matplotlib is for the process that draws

    if frontier := result.tables.get("reduction_frontier"):
        yield partial(figures_reduction.draw_frontier, result, frontier)
