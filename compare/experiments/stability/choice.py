"""What is looked at: a free motion of the robot, and which methods; and how these are called."""

from collections.abc import Mapping, Sequence

import numpy as np

import tmt

from ...engines import LABELS, Engine, Method, one_of_each_scheme
from ...judge.scale import gravity_scale
from ...robots import Robot
from ...robots.case import Case
from ...truth.linear import NEGLIGIBLE, held
from ...truth.postures import all_that_stay

DAMPINGS = (0.0, 0.5, 50.0)  # N m s/rad, added
FEW_SCHEMES = ("rk4", "explicit_euler", "semi_implicit_euler", "implicit_midpoint")  # of a quick run, by tmt's names


def all_methods(engines: Mapping[str, Engine]) -> tuple[Method, ...]:
    """Every method of tmt and of MuJoCo whose step is fixed."""
    return tuple(m for name in ("tmt", "mujoco") for m in engines[name].methods.values() if not m.adaptive)


def explicit(methods: Sequence[Method]) -> tuple[Method, ...]:
    """Those whose stages solve no equation."""
    return tuple(m for m in methods if m.engine != "tmt" or not tmt.METHODS[m.name].solves_stages)


def of_schemes(engines: Mapping[str, Engine], schemes: Sequence[str] | None = None) -> tuple[Method, ...]:
    """tmt's methods of these names (none: each whose step is fixed), and MuJoCo's, one of each scheme that is among them."""
    known = {m.scheme: m for m in engines["tmt"].methods.values() if not m.adaptive}
    schemes = tuple(known) if schemes is None else schemes
    theirs = tuple(m for m in one_of_each_scheme(engines["mujoco"]) if m.scheme in schemes)
    return tuple(known[scheme] for scheme in schemes) + theirs


def implicit_methods(engines: Mapping[str, Engine]) -> tuple[Method, ...]:
    """tmt's methods whose stages solve an equation."""
    return tuple(m for m in engines["tmt"].methods.values() if tmt.METHODS[m.name].solves_stages)


def free_motion(robot: Robot) -> Case | None:
    """The robot let go at a centre, the first at which it moves: a scene of its own if it has one; None: no centre.

    Of a robot that is read from a file the first of its scenes in which it moves freely.
    """
    if robot.is_read:
        return next((case for case in robot.cases if case.is_free and not np.any(case.scene.damping)), None)
    centres = all_that_stay(robot)
    if not centres:
        return None
    least = NEGLIGIBLE * gravity_scale(robot.tree)
    centre = next((name for name in centres if np.abs(held(robot, name).tau).max() > least), centres[0])
    known = (case for case in robot.cases if case.scene.posture == centre and is_let_go(case))
    return next(known, robot.case(f"{centre}, free", posture=centre))


def is_let_go(case: Case) -> bool:
    """Whether a case is the robot as it is, at rest at the start, under no torque."""
    scene = case.scene
    return case.is_free and scene.gravity and not (scene.damping or scene.locked or any(scene.speed))


def coarsest_case(robot: Robot) -> Case:
    """The case whose step is the coarsest that is looked at: the free motion, or what a scene takes if nothing is said."""
    return free_motion(robot) or robot.case()


def fraction(duration: float, dt: float) -> str:
    """A step, s, that divides a run, in words: 5/64."""
    return f"{duration:g}/{round(duration / dt)}"


def step_text(case: Case, dt: float) -> str:
    """A step, s, in a figure: as a fraction if it is the case's own."""
    return fraction(case.duration, dt) if dt == case.scene.dt else f"{dt:g}"


def who(row: dict) -> str:
    """The engine and the method of a row."""
    return f"{LABELS[row['engine']]} {row['method']}"


def dampings_of(robot: Robot) -> tuple[float, ...]:
    """What damping is added, N m s/rad; a robot that is read from a file has its own alone."""
    return DAMPINGS[:1] if robot.is_read else DAMPINGS


def unit_of_movements(robot: Robot) -> str:
    """The unit of movements."""
    return " or ".join(dict.fromkeys(robot.coordinates.units))


def joint_of(robot: Robot) -> str:
    """What the joints are called."""
    return "hinge" if set(robot.tree.kind) == {"hinge"} else "joint"


def damped(robot: Robot, damping: float) -> str:
    """What damping is added, N m s/rad, in words."""
    if damping:
        return f"damping {damping:g}"
    return "with its own damping" if any(robot.tree.damping) else "undamped"
