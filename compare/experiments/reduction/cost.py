"""What each thing that is added to the minimal model costs in MuJoCo, and whether it changes the motion."""

import dataclasses
from collections.abc import Mapping

import numpy as np

import tmt

from ...engines import Setting
from ...engines.mujoco.additions import AGAIN, CAPSULES, MINIMAL, OFF_FLOOR, ON_FLOOR, contacts, with_additions
from ...judge.check import About, Result
from ...judge.run import movement_unit, step_in_words
from ...judge.scale import reaches
from ...judge.timing import fastest
from ...judge.units import renamed
from ...judge.words import capital
from ...robots import Robot
from ...robots.case import Case, Coordinates
from ..setup import Setup
from .times import TIMED_STEPS, TWO_INTEGRATORS

FALL_TIME, FALL_STEPS = 5.0, 1024  # s, long enough to come to rest on the floor; of the run whose bits are compared
SETTLED = 0.5  # N m s/rad, with which the robot comes to rest


def measure_costs(result: Result, setup: Setup, rounds: int) -> None:
    """A table: time of a step with each thing added, as a ratio to the minimal model, and bits of a fall."""
    case = fall_case(setup.robot)
    dt, timed = case.scene.dt, TIMED_STEPS["mujoco"]
    engines = with_additions(setup.engines["mujoco"], *sizes(setup.robot.tree))
    models = {name: engine.of(case) for name, engine in engines.items()}
    # all are timed from where the robot rests on the floor that is in reach, so that there the contact stays
    damped = engines[ON_FLOOR].of(case.changed(damping=np.add(case.scene.damping, SETTLED)))
    settled = damped.run(*case.start, case.tau, dt, FALL_STEPS, "Euler")
    rest = settled.q[-1], settled.v[-1], case.tau
    runs = {
        (name, integrator): dynamics.prepare(*rest, Setting(dt * timed, timed), integrator)[0]
        for name, dynamics in models.items()
        for integrator in TWO_INTEGRATORS
    }
    seconds = fastest(runs, rounds)
    paths, touching, pushed = {}, {}, set()
    for name, integrator in runs:
        fallen = *case.start, case.tau, dt, FALL_STEPS, integrator
        paths[name, integrator] = models[name].run(*fallen).states
        touching[name, integrator], _ = contacts(models[name], *rest, dt, timed, integrator)
        if name.startswith(CAPSULES) and contacts(models[name], *fallen)[1]:
            pushed.add((name, integrator))
    rows = cost_rows(seconds, paths, touching, case.coordinates)
    result.tables["cost_in_mujoco"] = renamed(rows, movement_unit(case.coordinates))
    check_bits(result, f"{case.name}, {step_in_words(case, FALL_STEPS)}", result.tables["cost_in_mujoco"], pushed)
    if OFF_FLOOR not in engines:
        result.notes.append(
            f"{capital(OFF_FLOOR)}: not looked at, for a robot whose slides nothing stops may fall to any floor."
        )
    if not pushed:
        result.notes.append(
            f"{case.name}: no contact pushes on a joint in this run, neither with the floor that is in reach nor between bodies."
        )


def fall_case(robot: Robot) -> Case:
    """The whole robot let go under gravity for five seconds.

    As in the scene where errors fall regularly, else in its first scene that lets it go, else from its first posture.
    """
    falls = [case for case in robot.cases if case.is_free and case.scene.gravity and not case.locked]
    regular = [case for case in falls if "regular" in case.scene.tags]
    case = (regular + falls + [robot.case("let go", posture=next(iter(robot.postures), ()))])[0]
    if robot.is_read:  # its own step, with which it is stable
        return case.changed(duration=FALL_STEPS * case.scene.dt, judged=None)
    return case.changed(duration=FALL_TIME, dt=FALL_TIME / FALL_STEPS, judged=None)


def sizes(tree: tmt.Tree) -> tuple[float, float, float | None]:
    """Radius of capsules, heights of a floor in reach and of one out of reach of a Tree, m; None: with slides none is.

    By the largest distance of a centre of mass from the base, to six digits, for the robot may reach twice as far; of the arm
    0.03, -0.4 and -2. At least by the largest radius of gyration: a centre of mass may be at the base.
    """
    base = [offset for parent, offset in zip(tree.parent, tree.offset) if parent < 0]
    offset = [(0.0, 0.0, 0.0) if parent < 0 else offset for parent, offset in zip(tree.parent, tree.offset)]
    gyration = [np.sqrt(np.max(inertia) / mass) for inertia, mass in zip(tree.inertia, tree.mass) if mass > 0.0]
    reach = max(reaches(dataclasses.replace(tree, offset=offset)).max(), *gyration)
    radius, near, far = (float(f"{part * reach:.6g}") for part in (1 / 15, 8 / 9, 40 / 9))
    lowest = min(height for *_, height in base)
    return radius, lowest - near, None if "slide" in tree.kind else lowest - far


def cost_rows(
    seconds: Mapping[tuple, float],
    paths: Mapping[tuple, np.ndarray],
    touching: Mapping[tuple, float],
    coordinates: Coordinates,
) -> list[dict]:
    """The rows, by integrator, from what is known of each (addition, integrator).

    seconds: of a timed run; paths: (steps + 1, nq + nv); touching: contacts in a step.
    """
    rows = []
    for name, integrator in sorted(paths, key=lambda key: TWO_INTEGRATORS.index(key[1])):
        path, minimal = paths[name, integrator], paths[MINIMAL, integrator]
        apart = np.abs(coordinates.difference(path[:, : coordinates.nq], minimal[:, : coordinates.nq])).max()
        taken = seconds[name, integrator]
        rows.append(
            {
                "added": name,
                "integrator": integrator,
                "ns_per_step": 1e9 * taken / TIMED_STEPS["mujoco"],
                "ratio": taken / seconds[MINIMAL, integrator],
                "contacts_per_step": touching[name, integrator],
                "same_bits": np.array_equal(path, minimal, equal_nan=True),
                "max_difference_rad": float(apart) if np.isfinite(apart) else None,
            }
        )
    return rows


def check_bits(result: Result, where: str, rows: list[dict], pushed: set[tuple]) -> None:
    """Checks: what exerts no force leaves the bits of the motion, and capsules that something pushes do not.

    pushed: of which (addition, integrator) that is so. The minimal model itself, which is timed twice, is not compared with its
    own copy.
    """
    for row in rows:
        name, integrator, changed = row["added"], row["integrator"], int(not row["same_bits"])
        scene, unit = f"{where}, {integrator}", "runs that differ"
        if (name, integrator) in pushed:
            result.check(scene, f"another motion with {name}", changed, 1, unit, rule="equal", about=About.PREDICTION)
        elif name not in (MINIMAL, AGAIN):
            result.check(scene, f"the same bits with {name}", changed, 0, unit, rule="equal", about=About.PREDICTION)
