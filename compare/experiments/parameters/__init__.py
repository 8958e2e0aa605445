"""The compiled model beside the stated numbers, those of a solution, or those that its file states."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

import tmt

from ...core.check import Result
from ...core.finding import Finding
from ...core.text import block
from ...engines.mujoco import Reading
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.mujoco.inventory import LEFT_OUT, MODELLED
from ...engines.mujoco.parameters import STATED_FLAGS, Stated, lengths, parameters, stated_numbers
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.coordinates import Coordinates
from ...robots.placement import places_of
from ..setup import Setup
from .causes import causes_of
from .numbers import (
    ABSENT,
    OF_BODIES,
    OF_FORCES,
    UNITS,
    Compared,
    FeatureRow,
    NumberRow,
    check_forces,
    compare_number,
    rows_of,
    unit_of,
)

SHOWN = ["of", "quantity", "component", "stated", "compiled", "unit"]
FINER = 8  # steps in one of the scene, in which contacts are looked for
# numbers of the whole file; the others are of bodies and joints
OF_WORLD = (*STATED_FLAGS, "gravity", "density", "viscosity", "other mass", "tendon armature", *ABSENT)
# these act at some states only: causes come after those that always act
AT_TIMES = ("limited", "contact pairs")
# the equations of motion without them do not depend on these
MAY_DIFFER = ("contact", "limit", "clamp", "actuator")


class Touch(NamedTuple):
    """Two geoms that touch."""

    geoms: tuple[str, str]
    scene: str  # "": at a random state alone
    time: float  # s, the first in that scene
    q: list[float]  # rad


def rows(setup: Setup) -> Result:
    """One row for each number; one check for each quantity of each joint or body; the causes that follow."""
    robot, reading = setup.robot, cast(Reading, setup.reading)
    is_of_file, file = not robot.is_stated, robot.mjcf.name
    result = Result("parameters", shown=[*SHOWN, "asked_by"] if is_of_file else SHOWN)
    dynamics = cast(MujocoDynamics, setup.compared()["mujoco"])
    joints = dict(enumerate(("the world", *robot.joints), start=-1))
    slides = {name for name, kind in zip(robot.joints, robot.tree.kind) if kind == "slide"}
    touching = touches(setup, dynamics) if not robot.is_read else []
    compared = []
    for number in stated_numbers(reading.source) if is_of_file else beside_stated(setup, dynamics):
        if number.quantity == "contact pairs":
            number = number._replace(compiled=[float(len(touching))])
        # the first part of a free joint is a slide
        unit = unit_of(number.quantity, bool(slides & {number.place, f"{number.place} x"}))
        result.rows += rows_of(number, unit, number.why if is_of_file else None)
        if number.stated is not None and not number.why:
            words = joints if number.quantity == "parent" else {}
            compared.append(compare_number(result, number, unit, words))
    if robot.stated_in:
        compared += compare_features(result, robot)
    differing = {number.quantity for number in compared if number.differs.any()}
    forces = check_forces(result, setup.random, dynamics, bool(differing & {*OF_FORCES}))
    if robot.is_read:
        result.tables["inventory"] = [FeatureRow.of(feature) for feature in robot.features]
    else:
        compared += forces
    if is_of_file:
        for name, value, unit in (("integrator", reading.integrator, ""), ("timestep", reading.dt, "s")):
            result.rows.append(NumberRow(of="file", quantity=name, compiled=value, unit=unit))
    sides = (f"{file} as compiled", file) if is_of_file else (file, Path(robot.stated_in or robot.name).name)
    texts = {"contact pairs": block("parameters", "touching", touching=touching[:3])} if touching else {}
    if extra := dynamics.additional_bodies():
        texts["other mass"] = block("parameters", "additional", bodies=extra)
    causes = [
        replace(cause, text=texts.get(cause.quantity, cause.text)) for cause in causes_of(compared, sides)
    ]
    result.causes = sorted(causes, key=lambda cause: (cause.rank, cause.quantity in AT_TIMES, -cause.size))
    return result


def touches(setup: Setup, dynamics: MujocoDynamics) -> list[Touch]:
    """The pairs of geoms that touch, each where it first does: in a scene by MuJoCo, at a random state."""
    if not dynamics.may_touch:
        return []
    found: dict[tuple[str, str], Touch] = {}
    for case in setup.robot.cases_of_torque:
        acting = cast(MujocoDynamics, setup.engines["mujoco"].of(case))
        motion = acting.run(case.q, case.v, case.tau, case.scene.dt / FINER, case.steps * FINER, "RK4")
        q = motion.q[np.isfinite(motion.q).all(axis=1)]
        for time, state, pairs in zip(motion.t.tolist(), q, acting.touching(q)):
            for pair in pairs - found.keys():
                found[pair] = Touch(pair, case.name, time, case.positions_of_all(state).tolist())
    for state, pairs in zip(setup.random.q, dynamics.touching(setup.random.q)):
        for pair in pairs - found.keys():
            found[pair] = Touch(pair, "", 0.0, state.tolist())
    return list(found.values())


def beside_stated(setup: Setup, dynamics: MujocoDynamics) -> Iterator[Stated]:
    """The numbers of the robot, stated here or in a solution, beside those that MuJoCo compiled."""
    tree, added = setup.robot.tree, lengths(dynamics)
    if setup.robot.stated_in:  # a solution: its joints and bodies are looked up in the file
        reading = cast(Reading, setup.reading)
        joints = [reading.tree.joint_names.index(name) for name in tree.joint_names]
        bodies = [reading.bodies.index(body) for body in dynamics.bodies]
        stated = numbers_of(tree, range(len(joints)), range(len(bodies)))
        compiled = numbers_of(reading.tree, joints, bodies)
        reach = max(np.abs(stated[name]).max() for name in added)  # sums of lengths of the solution
        added = {name: values + reach for name, values in added.items()}
    else:
        stated, compiled = stated_of_hinges(tree), parameters(dynamics)
    left_out = {"anchor", "offset"} - {place_of_joints(stated, compiled, added)}
    for quantity in (name for name in UNITS if name in compiled and name not in left_out):
        values = np.asarray(compiled[quantity], dtype=float)
        right = np.broadcast_to(np.asarray(stated.get(quantity, 0.0), dtype=float), values.shape)
        names = owners(tree, quantity)
        right, values = right.reshape(len(names), -1), values.reshape(len(names), -1)
        sizes = added.get(quantity, np.abs(right).max(axis=1))
        for owner, number, value, size in zip(names, right, values, sizes):
            yield Stated(owner, quantity, number, value, tolerance=FACTOR * EPS * size)


def place_of_joints(stated: dict[str, Any], compiled: dict[str, Any], added: dict[str, np.ndarray]) -> str:
    """ "anchor", in the world; where some differ, "offset", from the anchor before, if no more of these do."""
    of_offsets, of_anchors = (
        np.sum(np.abs(np.subtract(stated[name], compiled[name])).max(axis=1) > FACTOR * EPS * added[name])
        for name in ("offset", "anchor")
    )
    return "offset" if 0 < of_offsets <= of_anchors else "anchor"


def numbers_of(tree: tmt.Tree, joints: Sequence[int], bodies: Sequence[int]) -> dict[str, Any]:
    """The numbers of a Tree by quantity, for these joints, their speeds and positions, and bodies."""
    anchors, _ = places_of(tree)
    places = [tree.coordinates.joints[j] for j in joints]
    counts = [place.q.stop - place.q.start for place in places]
    positions, speeds = np.r_[tuple(place.q for place in places)], np.r_[tuple(place.qd for place in places)]
    chosen: dict[str, Any] = dict.fromkeys(("reference", "stiffness"), np.array(joints))
    chosen["rest"] = positions
    chosen |= dict.fromkeys(("axis", "damping", "armature"), speeds)
    chosen |= dict.fromkeys(("mass", "com", "inertia"), np.array(bodies))
    numbers = {name: np.array(getattr(tree, name))[at] for name, at in chosen.items()}
    numbers["rest"] = numbers["rest"] * np.repeat(numbers["stiffness"] > 0.0, counts)
    number_of_joint = {-1: -1} | {j: i for i, j in enumerate(joints)}
    parents = np.array([number_of_joint[tree.parent[j]] for j in joints])
    numbers |= {"anchor": anchors[joints], "offset": np.array(tree.offset)[joints]}
    numbers |= {"parent": parents, "gravity": np.array(tree.gravity)}
    return numbers | {"ref": numbers.pop("reference")}


def stated_of_hinges(tree: tmt.Tree) -> dict[str, Any]:
    """The quantities of `parameters` by the stated numbers of hinges; the others are 0."""
    joints, bodies = range(len(tree.joint_names)), range(len(tree.body_names))
    return dict.fromkeys(STATED_FLAGS, 1.0) | {"order": joints} | numbers_of(tree, joints, bodies)


def owners(tree: tmt.Tree, quantity: str) -> tuple[str, ...]:
    """The names of the bodies, joints, speeds or positions that have a quantity, or "world"."""
    coordinates = Coordinates(tree.joint_names, tree.kind)
    if quantity in OF_WORLD:
        return ("world",)
    if quantity in ("axis", "damping", "armature"):
        return coordinates.speeds
    if quantity == "rest":
        return coordinates.positions
    return tree.body_names if quantity in OF_BODIES else tree.joint_names


def compare_features(result: Result, robot: Robot) -> list[Compared]:
    """Checks that features without a term in the equations are as many as in the solution."""
    here = {feature.feature: feature for feature in robot.features}
    there = {feature.feature: feature for feature in robot.features_stated}
    compared = []
    for name, feature in (there | here).items():
        if feature.treatment in (MODELLED, LEFT_OUT) or name in MAY_DIFFER:
            continue
        count, stated = (np.array([float(side[name].count if name in side else 0)]) for side in (here, there))
        result.check("file", f"{name}, how many", count[0], stated[0], "", rule="equal")
        compared.append(Compared("world", name, "", count, stated, count != stated, 1.0, 2))
    return compared


def headline(result: Result) -> Finding | None:
    """What is not as stated, and how many numbers are equal to the stated ones to the last bit."""
    stated = [row for row in result.rows if row.stated is not None]
    unchanged = [row for row in stated if not row.asked_by]
    if not unchanged:
        return None
    off = sum(row.difference != 0.0 for row in unchanged)
    changed = sum(row.difference != 0.0 for row in stated) - off
    failing = [f"{check.quantity} ({check.scene})" for check in result.checks if check.failed]
    return result.finding("headline", numbers=len(unchanged), off=off, changed=changed, failing=failing)


def figures(result: Result, robot: Robot) -> Iterator[partial[Any]]:
    from ..figures_sketch import draw_sketch  # matplotlib is for the process that draws

    yield partial(draw_sketch, robot)
