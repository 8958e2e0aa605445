"""What is examined of a robot: postures, a free motion, methods of both engines, added damping."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

import tmt

from ...engines import LABELS, Engine, Method, one_of_each_scheme, same_scheme
from ...judge.finding import Finding
from ...judge.scale import gravity_scale
from ...robots import Robot
from ...robots.case import Case
from ...truth.conserved import floats
from ...truth.linear import NEGLIGIBLE, Held, held
from ...truth.postures import all_of_kind, all_that_stay, posture_names
from ...truth.rest import at_rest

DAMPINGS = (0.0, 0.5, 50.0)  # N m s/rad, added
QUICK_SCHEMES = ("rk4", "explicit_euler", "semi_implicit_euler", "implicit_midpoint")  # tmt's names
MOST_POSTURES = 6  # the first of the named postures
MANY_SPEEDS = 7  # beyond, the runs of a file's robot are at one stable posture
REST = "at rest"  # the posture at which a file's robot rests without torque


class Subjects(NamedTuple):
    """What is examined of a robot; None where it has none."""

    robot: Robot  # with the examined postures alone
    centres: tuple[str, ...]  # postures at which a small deviation stays small
    saddles: tuple[str, ...]
    centre: Held | None  # the first
    saddle: Held | None
    free: Case | None  # a free motion from the centre
    left_out: tuple[Finding, ...]


@lru_cache(maxsize=64)
def subjects_of(robot: Robot) -> Subjects:
    """What is examined of a robot."""
    left_out = []

    def leave_out(kind: str, **values) -> None:
        left_out.append(Finding("stability", kind, values))

    robot = with_rest(robot, leave_out)
    noun, is_read = robot.noun, robot.is_read
    stable, saddles = tuple(all_that_stay(robot)), tuple(all_of_kind(robot, "saddle"))
    flat = [name for name in stable if held(robot, name).without_stiffness.all()]
    centres = tuple(name for name in stable if name not in flat)
    if is_read and robot.coordinates.nv > MANY_SPEEDS and len(centres) > 1:
        leave_out("first_stable_posture_only", most=MANY_SPEEDS, first=centres[0], others=centres[1:])
        centres = centres[:1]
    if flat:
        leave_out("all_rates_zero", posture=flat[0])
    if is_read:
        leave_out("reduced_for_files", noun=noun, has_stable=bool(stable))
    elif not centres:
        leave_out("no_centre", noun=noun)
    if not saddles:
        leave_out("no_saddle", noun=noun)
    free = free_motion(robot)
    if is_read and (set(robot.tree.kind) != {"hinge"} or robot.tree.has_springs):
        free = None
        leave_out("no_silent_failures")
    centre, saddle = (held(robot, names[0]) if names else None for names in (centres, saddles))
    return Subjects(robot, centres, saddles, centre, saddle, free, tuple(left_out))


def with_rest(robot: Robot, leave_out) -> Robot:
    """The robot with the examined postures alone; of a file also the one to which it sinks from the first of them."""
    names = posture_names(robot)
    if len(names) > MOST_POSTURES:
        leave_out("first_postures_only", count=len(names), names=names[:MOST_POSTURES])
        names = names[:MOST_POSTURES]
        postures, positions = ({n: of[n] for n in names if n in of} for of in (robot.postures, robot.positions))
        robot = replace(robot, postures=postures, positions=positions)
    if not robot.is_read:
        return robot
    if floats(robot.tree):
        if np.any(robot.tree.gravity):
            leave_out("no_gravity", noun=robot.noun)
        return robot
    rest = at_rest(robot.tree, robot.posture(names[0]))
    if rest is None:
        leave_out("no_rest", noun=robot.noun)
        return robot
    apart = [np.abs(robot.coordinates.difference(rest, robot.posture(name))).max() for name in names]
    if min(apart) < 1e-6:
        return robot
    name = REST if REST not in names else f"{REST} without torque"
    leave_out("rest_found", noun=robot.noun, start=names[0], name=name)
    return replace(robot, positions={**robot.positions, name: tuple(map(float, rest))})


def free_motion(robot: Robot) -> Case | None:
    """The robot released at the first centre at which it moves, a scene of its own if there is one; None: no centre.

    Of a file's robot the first of its scenes in which it moves freely.
    """
    if robot.is_read:
        return next((case for case in robot.cases if case.is_free and not np.any(case.scene.damping)), None)
    centres = all_that_stay(robot)
    if not centres:
        return None
    least = NEGLIGIBLE * gravity_scale(robot.tree)
    centre = next((name for name in centres if np.abs(held(robot, name).tau).max() > least), centres[0])
    for case in robot.cases:
        scene = case.scene
        changed = scene.damping or scene.locked or any(scene.speed) or not scene.gravity
        if scene.posture == centre and case.is_free and not changed:
            return case
    return robot.case(f"{centre}, free", posture=centre)


def places(centres: Sequence[str], saddles: Sequence[str], dampings: Sequence[float]) -> list[tuple[str, float]]:
    """Postures with the damping that is added, N m s/rad: centres with each, saddles with none."""
    return [*product(centres, dampings), *((name, 0.0) for name in saddles)]


def dampings_of(robot: Robot) -> tuple[float, ...]:
    """The damping that is added, N m s/rad; a file's robot has its own alone."""
    return DAMPINGS[:1] if robot.is_read else DAMPINGS


# methods


def all_methods(engines: Mapping[str, Engine]) -> tuple[Method, ...]:
    """Every fixed-step method of tmt and of MuJoCo."""
    return tuple(m for name in ("tmt", "mujoco") for m in engines[name].methods.values() if not m.adaptive)


def explicit(methods: Sequence[Method]) -> tuple[Method, ...]:
    """Those whose stages solve no equation."""
    return tuple(m for m in methods if m.engine != "tmt" or not tmt.METHODS[m.name].solves_stages)


def of_schemes(engines: Mapping[str, Engine], schemes: Sequence[str]) -> tuple[Method, ...]:
    """tmt's methods of these names, and one of MuJoCo for each of these schemes that it has."""
    ours = tuple(engines["tmt"].methods[scheme] for scheme in schemes)
    return ours + tuple(m for m in one_of_each_scheme(engines["mujoco"]) if m.scheme in schemes)


def rk4_of_both(engines: Mapping[str, Engine]) -> tuple[Method, Method]:
    """RK4 of tmt and of MuJoCo."""
    rk4 = same_scheme(engines, engines["mujoco"].methods["RK4"], "tmt")
    return rk4, same_scheme(engines, rk4, "mujoco")


# names


def coarsest_case(robot: Robot) -> Case:
    """The case whose step is the coarsest: the free motion, else the robot's default."""
    return free_motion(robot) or robot.case()


def fraction(duration: float, dt: float) -> str:
    """A step that divides a run, as a fraction: 5/64."""
    return f"{duration:g}/{round(duration / dt)}"


def who(row: dict) -> str:
    """The engine and the method of a row."""
    return f"{LABELS[row['engine']]} {row['method']}"


def unit_of_movements(robot: Robot) -> str:
    """rad, m, or both."""
    return " or ".join(dict.fromkeys(robot.coordinates.units))


def damped(robot: Robot, damping: float) -> str:
    """The damping, N m s/rad, as a title."""
    if damping:
        return f"damping {damping:g}"
    return "with its own damping" if any(robot.tree.damping) else "undamped"
