"""What does a motion not need: elements that never act, for nothing, and joints, for an error that is allowed?"""

import os
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

import tmt
from tmt import Tree

from ...core.check import About, Result
from ...core.text import block
from ...core.timing import fastest
from ...engines.mujoco import Mujoco
from ...engines.mujoco.reading import Reading, read
from ...engines.mujoco.smaller import Smaller, of_parts
from ...engines.mujoco.written import files_of
from ...judge.agree import closest, worst_of_each
from ...judge.entries import Entries
from ...judge.run import movement_unit
from ...judge.scale import EPS, FACTOR
from ...process.files import assets_of, draft_of, move
from ...robots import Robot
from ...robots.case import SEED
from ...robots.coordinates import Coordinates
from ...stability.answer import joint_of
from ...stability.push import Pushed
from ...stability.runs import Trial
from ..options import ReductionOptions
from ..setup import Setup
from .records import JointRow, ModelRow, UseRow
from .scene import Scene, scene_of, scene_of_case
from .search import TEXT, Locks, lockable, take_out, written

ERROR = 1e-3  # rad or m, if none is asked for
STATES = 5  # random ones, at which the locked models are compared
ROUNDS = 6  # of timing
QUANTITY, UNSTABLE = "a motion with fewer joints", "the file is not stable at its own step"


def claim_values(robot: Robot) -> dict[str, float]:
    return {"error": ERROR, "eps": FACTOR}


def rows(setup: Setup) -> Result:
    """What the motion of a file, or each scene of the arm, needs."""
    result = Result("reduction")
    if setup.reading:
        add_file(result, setup, setup.reading)
    elif not setup.robot.is_read:
        add_scenes(result, setup)
    return result


def add_scenes(result: Result, setup: Setup) -> None:
    """The joints that each scene of the arm needs; a finding for equal scenes, those with joints to lock last."""
    source, rows = cast(Mujoco, setup.engines["mujoco"]).source, list[JointRow]()
    groups: dict[tuple[tuple[str, ...], ...], list[str]] = {}
    if driven := [case.name for case in setup.robot.cases if case.controller]:
        result.find("driven", scenes=driven)
    for case in setup.robot.cases_of_torque:
        scene = scene_of_case(case, source)
        locks = lockable(scene, ERROR)
        needed = tuple(row.joint for row in locks.rows if row.why_needed)
        stays = tuple(row.joint for row in locks.rows if not row.why_needed)
        groups.setdefault((needed, case.scene.locked, stays), []).append(case.name)
        rows += locks.rows
        if locks.names:
            add_checks(result, scene, locks, locks.models[-1][2], ERROR)
    locks_last = sorted(groups.items(), key=lambda group: bool(group[0][0] and group[0][2]))
    for (needed, locked, stays), scenes in locks_last:
        found = result.finding("needs", scenes=scenes, needed=needed, locked=locked, stays=stays)
        result.top.append(found)
    result.tables["reduction_joints"] = rows


def add_file(result: Result, setup: Setup, reading: Reading) -> None:
    """Rows, checks and the answer of a motion of a file; the smaller file is written."""
    asked = setup.asked(ReductionOptions)
    allowed, write = asked.error or ERROR, asked.write
    try:
        scene, motions = scene_of(setup, reading)
    except ValueError as reason:
        result.not_judged("", QUANTITY, str(reason), about=About.PROGRAM)
        return
    for motion in motions:
        pushed = Pushed(motion, reading.dt, reading.integrator)
        pushed.find_truth()
        is_judged = pushed.judged_by not in ("", "falls")
        own = Trial(pushed.push, reading.dt, reading.integrator)
        verdict = pushed.verdict(own) if is_judged else None
        if (verdict and verdict.why) or not scene.is_finite:
            limit = pushed.limit(pushed.push, reading.integrator).stable_up_to if verdict else None
            joint = joint_of(pushed.model, verdict.dof) if verdict and verdict.dof >= 0 else ""
            about = {"scene": motion.name, "dt": reading.dt, "integrator": reading.integrator, "joint": joint}
            result.top.append(result.finding("unstable", about=about, verdict=verdict, limit=limit))
            result.not_judged(motion.name, QUANTITY, UNSTABLE, about=About.STEP)
            return
    free = take_out(scene)
    locks = lockable(scene, allowed)
    made = {
        "source": shown_path(str(reading.source)),
        "scene": scene.name,
        "duration": scene.duration,
        "allowed": allowed,
    }
    with draft_of(Path(write) if write else None) as draft:
        names, model, _ = locks.models[-1]
        comment = block(TEXT, "comment", about=made, names=names, command=setup.command)
        error = scene.error(written(scene, names, draft, comment), from_keys=True)
        add_checks(result, scene, locks, error, allowed)
        is_written = bool(write) and all(check.passed for check in result.checks)
        if write and is_written:
            move(draft, Path(write))
            result.repeated["smaller"] = scene.recipe(model, shown_path(write), error)
    for row in locks.rows:
        row.locked = row.joint in names
    setup.quiet()
    models = timed_models(scene, locks, sum(row.taken_out for row in free if row.same_bits))
    models[-1].error = error
    kept = {each.name for each in model.spec.actuators}
    actuators = [each.name for each in scene.whole.spec.actuators if each.name not in kept]
    result.tables |= {"reduction_models": models, "reduction_free": free, "reduction_joints": locks.rows}
    used = scene.use.parts(scene.whole.model).items()
    result.tables["reduction_use"] = [
        UseRow(part, count, len(of), ", ".join(sorted(of))) for part, (count, of) in used
    ]
    result.top.append(result.finding(
        "answer", about=made, unit=movement_unit(coordinates_of(scene)), names=names, moved=scene.use.moved,
        models=models, free=[row for row in free if row.same_bits], actuators=actuators, error=error,
        written=shown_path(write) if write and is_written else "", refused=write and not is_written,
        assets=assets_of(draft).name if files_of(model.spec) else "",
    ))  # fmt: skip


def shown_path(path: str) -> str:
    """A path below the current folder from there."""
    relative = os.path.relpath(path)
    return path if relative.startswith(os.pardir) else relative


def timed_models(scene: Scene, locks: Locks, elements: int) -> list[ModelRow]:
    """The models on the way, and the time of a step of each; elements: how many never act."""
    models = [("the file", scene.whole, 0.0, list[str]())]
    models += [(f"without what never acts ({elements})", scene.left, 0.0, [])] if elements else []
    models += [(f"and {names[-1]} locked", model, error, names) for names, model, error in locks.models[1:]]
    calls = {number: scene.timed(small) for number, (_, small, *_) in enumerate(models)}
    seconds = fastest(calls, ROUNDS, time.thread_time)  # other programs may wait for the processor, too
    of_step = 1e6 * scene.stepper.dt / scene.duration
    rows = [ModelRow(name, len(names), error, ", ".join(names)) for name, _, error, names in models]
    for number, row in enumerate(rows):
        row.step = of_step * seconds[number]
    return rows


def add_checks(result: Result, scene: Scene, locks: Locks, error: float, allowed: float) -> None:
    """A smaller model is within the error, what is taken out changes no bit, and locks are those of tmt."""
    names, model, _ = locks.models[-1]
    unit, note = movement_unit(coordinates_of(scene)), f"locked: {', '.join(names)}"
    changed = scene.error(Smaller(scene.left.spec.copy()))
    result.check(scene.name, "motion without what never acts", changed, 0.0, unit, rule="equal")
    result.check(
        scene.name, "motion of the smaller model", error, allowed, unit, note, about=About.PREDICTION
    )
    if names:
        tree = scene.tree.lock(of_parts(scene.whole.model, {name: scene.use.middle[name] for name in names}))
        compare_locked(result, f"{scene.name}, {note}", tree, read(model.model).tree)


def coordinates_of(scene: Scene) -> Coordinates:
    return Coordinates(scene.tree.joint_names, scene.tree.kind)


def compare_locked(result: Result, where: str, tree: Tree, smaller: Tree) -> None:
    """Mbar and the bias of a Tree with joints locked, and of the smaller model, at random states."""
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(SEED)
    q, v = coordinates.random(rng, STATES), rng.uniform(-1.0, 1.0, (STATES, coordinates.nv))
    bodies, others = tree.body_joint, smaller.body_joint
    fused = np.array([bodies.count(joint) - others.count(joint) + 1 for joint in bodies])
    scale, is_mixed = Entries(tree, q, v, np.maximum(1, fused)), "slide" in coordinates.all_kinds
    masses, forces = zip(*((tmt.mass_matrix(model, q), tmt.bias(model, q, v)) for model in (tree, smaller)))
    for name, unit, (locked, other), scales in (
        ("Mbar", "kg m2, kg m or kg" if is_mixed else "kg m2", masses, scale.mass_matrix),
        ("bias", "N m or N" if is_mixed else "N m", forces, scale.bias),
    ):
        apart, largest = worst_of_each(locked - other, scales)
        (worst,) = closest(apart, largest)
        quantity, tolerance = f"{name}, lock of tmt to the smaller model", FACTOR * EPS * largest[worst]
        result.check(where, quantity, apart[worst], tolerance, unit, rounding=True)


def figures(result: Result, robot: Robot) -> Iterator[partial[Any]]:
    from .figures_reduction import draw_models  # matplotlib is for the process that draws

    if models := result.tables.get("reduction_models"):
        yield partial(draw_models, result, models)
