"""Who takes part in speed: scenes, engines, methods, steps and tolerances, of the arm and of robots of files."""

import dataclasses

import numpy as np
import pytest
from models import PATHS

from compare.case import Case, Scene
from compare.engines import Method
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import engine, read
from compare.experiments import speed
from compare.experiments.speed import evaluations, settings
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup
from compare.setup import engines as engines_of
from tmt.methods import METHODS

OWN = Scene("my swing", (0, 0, 120), duration=2.0, dt=1 / 50, tags=("own",))
MINE = dataclasses.replace(ARM, scenes=(*ARM.scenes, OWN))
RK4 = Method("mujoco", "RK4", 4, "rk4")


def robot_in(name):
    return robot_of(read(PATHS[name]), f"{name}.xml")


GRIPPER, HUMANOID = robot_in("gripper"), robot_in("humanoid29_free")


def test_scenes_are_those_with_the_tag_and_a_users_own():
    names = [case.name for case in settings.scenes_of(MINE)]
    assert names == ["zero, free", "ball catch, free", "bent, free", "bent, damped", "my swing"]
    alone = dataclasses.replace(ARM, scenes=(OWN,))
    assert (settings.regular_of(MINE).name, settings.regular_of(alone).name) == ("bent, free", "my swing")
    sizes = {"full": names, "quick": ["bent, free", "my swing"], "small": ["zero, free", "bent, free"]}
    for size, expected in sizes.items():
        assert [case.name for case in settings.followed(MINE, size)] == expected
    # held scenes of a file are not followed
    assert [case.name for case in settings.followed(GRIPPER, "full")] == ["open, let go", "open, step of the servos"]
    assert [case.name for case in settings.followed(GRIPPER, "quick")] == ["open, let go"]
    assert speed.skipped(ARM) is None and "bare" in speed.skipped(dataclasses.replace(ARM, scenes=(), name="bare"))


def test_methods_are_those_of_the_engines_that_are_there_or_the_same_schemes_of_both(engines):
    full, quick = (settings.methods(engines, size) for size in ("full", "quick"))
    there = [engine for engine in engines.values() if engine.unavailable() is None]
    assert full == settings.methods(engines, "small") == [m for engine in there for m in engine.methods.values()]
    assert quick == [m for m in full if m.engine in ("mujoco", "tmt")] and len(quick) < len(full)
    same = settings.methods(engines, "full", "same schemes")
    theirs = {m.name: m.scheme for m in same if m.engine == "mujoco"}
    assert set(theirs) == {"Euler", "implicit", "RK4"}
    assert {m.name for m in same if m.engine == "tmt"} == set(theirs.values())


class Elsewhere:
    """An engine that cannot take part."""

    name = "own"
    methods = {name: Method("own", name, 4, "rk4") for name in ("RK4", "Heun")}  # noqa: RUF012

    def unavailable(self):
        return "own.py is not there"


def test_who_is_not_there_has_a_row_with_the_reason_but_in_a_quick_run(engines):
    rows = settings.unavailable(Setup.small(ARM, engines | {"own": Elsewhere()}), ["bent, free"])
    assert {"scene": "bent, free", "engine": "own", "method": "RK4, Heun", "why_not": "own.py is not there"} in rows
    assert settings.unavailable(Setup.quick(ARM, engines | {"own": Elsewhere()}), ["bent, free"]) == []


def test_a_step_response_is_followed_from_coarse_steps_on_by_the_schemes_that_it_has():
    known = engines_of(engine(read(PATHS["gripper"])))
    free, step = settings.scenes_of(GRIPPER)
    stiff = robot_in("arm7").cases[-1]
    assert settings.coarsest_steps(stiff) == 64 < stiff.steps and settings.coarsest_steps(free) == free.steps
    of_step, of_free = (
        {(m.engine, m.name): m.scheme for m in settings.methods(known, "full", "all", GRIPPER, case)}
        for case in (step, free)
    )
    schemes = [of["mujoco", "implicitfast"] for of in (of_step, of_free)]
    assert schemes == ["implicitfast", "semi_implicit_euler"]
    assert ("tmt", "implicitfast") in of_step and ("tmt", "implicitfast") not in of_free
    setup = Setup(GRIPPER, known)
    names = [(method.engine, method.name) for method in settings.methods_following(setup, [free, step], "all")]
    assert len(names) == len(set(names)) and set(names) == {*of_step, *of_free}


def test_what_takes_too_long_is_left_out(engines):
    assert Heyoka().too_long(HUMANOID.tree) and Heyoka().too_long(ARM.tree) is None
    slow = settings.left_out(engines, "full", HUMANOID)
    assert slow and not {(m.engine, m.name) for m in settings.methods(engines, "full", "all", HUMANOID)} & set(slow)
    implicit, arm7 = ("tmt", "implicit_midpoint"), robot_in("arm7")
    assert [implicit in settings.left_out(engines, size, arm7) for size in ("quick", "full")] == [True, False]
    rk4 = Method("tmt", "rk4", 4, "rk4")
    few, fewer = (settings.halvings(rk4, settings.regular_of(robot))[-1].steps for robot in (GRIPPER, HUMANOID))
    assert 2**15 <= few > 8 * fewer


@pytest.mark.parametrize("engine, name, finest", [
    ("mujoco", "Euler", 2**16), ("mujoco", "RK4", 2**17), ("tmt", "rk4", 2**18), ("tmt", "gauss_legendre_4", 2**15),
    ("another", "RK4", 2**15),
])  # fmt: skip
def test_steps_are_halved_from_the_scenes_own_to_the_finest(bent, engine, name, finest):
    method = Method(engine, name, 4, "rk4")
    found = settings.settings_of(method, bent)
    assert [s.steps for s in found] == [64 << k for k in range(len(found))] and found[-1].steps == finest
    assert settings.settings_of(method, bent, "quick") == found[: 2 if engine == "another" else 5]
    assert [s.steps for s in settings.settings_of(method, bent, "full", "same schemes")] == [512, 1024, 2048, 4096]


@pytest.mark.parametrize("duration, dt, coarsest, last", [
    (2.0, 1 / 50, 128, 2**17), (0.25, 0.25, 64, 2**17), (5.0, 5.0 / 100_000, 100_032, 100_032),
])  # fmt: skip
def test_steps_of_any_scene_are_multiples_of_the_grid(duration, dt, coarsest, last):
    found = settings.settings_of(RK4, Case(ARM, Scene("mine", duration=duration, dt=dt)))
    assert (found[0].steps, found[-1].steps) == (coarsest, last)
    assert all(s.steps % 64 == 0 and s.duration == duration for s in found)


@pytest.mark.parametrize("name, first, last", [("dopri8_adaptive", 2, 14), ("Radau", 2, 6), ("another", 2, 12)])
def test_tolerances_are_divided_by_ten(bent, name, first, last):
    engine = "tmt" if name in METHODS else "another"
    found = settings.settings_of(Method(engine, name, None, name, adaptive=True), bent)
    assert [s.tolerance for s in found] == [10.0**-k for k in range(first, last + 1)]


def test_states_of_any_joints_are_evaluated():
    q, qd, _ = evaluations.states_of(robot_in("free_body").coordinates, np.random.default_rng(1), 5)
    assert q.shape == (5, 7) and qd.shape == (5, 6) and np.allclose(np.linalg.norm(q[:, 3:], axis=1), 1.0)
    assert [evaluations.most_states(robot.tree) for robot in (HUMANOID, ARM)] == [10_000, 1_000_000]
