"""What is examined of a robot: postures, methods of both engines, added damping."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...engines import Engine, Method
from ...robots import Robot
from ...robots.case import Case
from ...stability.equilibrium import equilibrium

DAMPINGS = (0.0, 0.5, 50.0)  # N m s/rad, added
SCHEMES = ("rk4", "explicit_euler", "semi_implicit_euler", "implicit", "implicit_midpoint")  # tmt's names
MOST_POSTURES = 6  # the first of the named postures


class Subjects(NamedTuple):
    robot: Robot  # with the examined postures alone
    centres: tuple[str, ...]  # postures at which a small deviation stays small, the robot's example first
    saddles: tuple[str, ...]


@lru_cache(maxsize=64)
def subjects_of(robot: Robot) -> Subjects:
    """What is examined of a robot whose numbers are stated."""
    names = list(robot.postures)[:MOST_POSTURES]
    robot = replace(robot, postures={name: robot.postures[name] for name in names})
    at = {name: equilibrium(robot, name) for name in names}
    centres = [name for name in at if at[name].stays and not at[name].without_stiffness.all()]
    saddles = [name for name in at if at[name].kind == "saddle"]
    centres.sort(key=lambda name: name != robot.kinds.get("centre"))
    saddles.sort(key=lambda name: name != robot.kinds.get("saddle"))
    return Subjects(robot, tuple(centres), tuple(saddles))


def methods_of(
    engines: Mapping[str, Engine], robot: Robot, schemes: tuple[str, ...] = ()
) -> tuple[Method, ...]:
    """The fixed-step methods of tmt and of MuJoCo.

    schemes: only these, and of MuJoCo's methods that are the same scheme only the first.
    """
    ours, mujoco = engines["tmt"].methods.values(), engines["mujoco"]
    return tuple(
        method
        for method in (*ours, *(one_of_each_scheme(mujoco) if schemes else mujoco.methods.values()))
        if not method.adaptive and (not schemes or method.scheme in schemes)
    )


def rk4_of_both(engines: Mapping[str, Engine]) -> tuple[Method, Method]:
    rk4 = same_scheme(engines, engines["mujoco"].methods["RK4"], "tmt")
    return rk4, same_scheme(engines, rk4, "mujoco")


def coarsest_case(robot: Robot) -> Case:
    """The first free motion without damping, else the robot's default; its step is the coarsest."""
    cases = (case for case in robot.cases if case.is_free and not np.any(case.scene.damping))
    return next(cases, robot.case())


# names


def fraction(duration: float, dt: float) -> str:
    """A step that divides a run, as a fraction: 5/64."""
    return f"{duration:g}/{round(duration / dt)}"


def unit_of_movements(robot: Robot) -> str:
    """rad, m, or both."""
    return " or ".join(dict.fromkeys(robot.coordinates.units))


def same_scheme(engines: Mapping[str, Engine], method: Method, engine: str) -> Method:
    """The first method of an engine that is the same scheme as a given one."""
    return next(m for m in engines[engine].methods.values() if m.scheme == method.scheme)


def one_of_each_scheme(engine: Engine) -> tuple[Method, ...]:
    """Of methods of one engine that are the same scheme the first."""
    first: dict[str, Method] = {}
    for method in engine.methods.values():
        first.setdefault(method.scheme, method)
    return tuple(first.values())
