"""Who takes part in speed: scenes, methods, steps and tolerances."""

import dataclasses

import pytest

from compare.case import Case, Scene
from compare.engines import Method
from compare.experiments.speed import settings
from compare.robots.arm import ARM
from tmt.methods import METHODS

OWN = Scene("my swing", (0, 0, 120), duration=2.0, dt=1 / 50, tags=("own",))
MINE = dataclasses.replace(ARM, scenes=(*ARM.scenes, OWN))
RK4 = Method("mujoco", "RK4", 4, "rk4")


def test_scenes_are_those_with_the_tag_and_a_users_own():
    names = [case.name for case in settings.scenes_of(MINE)]
    assert names == ["zero, free", "ball catch, free", "bent, free", "bent, damped", "my swing"]
    assert settings.regular_of(MINE).name == "bent, free"
    alone = dataclasses.replace(ARM, scenes=(OWN,))
    assert settings.regular_of(alone).name == "my swing"
    sizes = {"full": names, "quick": ["bent, free", "my swing"], "small": ["zero, free", "bent, free"]}
    for size, expected in sizes.items():
        assert [case.name for case in settings.followed(MINE, size)] == expected
        assert [case.name for case in settings.followed(alone, size)] == ["my swing"]


def test_methods_are_those_of_the_engines_that_are_there_or_the_same_schemes_of_both(engines):
    full, quick = (settings.methods(engines, size) for size in ("full", "quick"))
    there = [engine for engine in engines.values() if engine.unavailable() is None]
    assert full == settings.methods(engines, "small") == [m for engine in there for m in engine.methods.values()]
    assert quick == [m for m in full if m.engine in ("mujoco", "tmt")] and len(quick) < len(full)
    same = settings.methods(engines, "full", "same schemes")
    theirs = {m.name: m.scheme for m in same if m.engine == "mujoco"}
    assert set(theirs) == {"Euler", "implicit", "RK4"}
    assert {m.name for m in same if m.engine == "tmt"} == set(theirs.values())


@pytest.mark.parametrize(
    "engine, name, finest",
    [("mujoco", "Euler", 2**16), ("mujoco", "RK4", 2**17), ("tmt", "rk4", 2**18), ("tmt", "gauss_legendre_4", 2**15),
     ("another", "RK4", 2**15)],
)  # fmt: skip
def test_steps_are_halved_from_the_scenes_own_to_the_finest(bent, engine, name, finest):
    method = Method(engine, name, 4, "rk4")
    found = settings.settings_of(method, bent)
    assert [s.steps for s in found] == [64 << k for k in range(len(found))] and found[-1].steps == finest
    assert {(s.duration, s.tolerance) for s in found} == {(5.0, None)}
    assert settings.settings_of(method, bent, "quick") == found[: 2 if engine == "another" else 5]
    assert len(settings.settings_of(method, bent, "small")) == (2 if engine == "another" else 7)
    assert [s.steps for s in settings.settings_of(method, bent, "full", "same schemes")] == [512, 1024, 2048, 4096]


@pytest.mark.parametrize(
    "duration, dt, coarsest, last",
    [(2.0, 1 / 50, 128, 2**17), (0.25, 0.25 / 64, 64, 2**17), (0.25, 0.25, 64, 2**17), (5.0, 5 / 65, 128, 2**17),
     (5.0, 5.0 / 100_000, 100_032, 100_032), (5.0, 5.0 / 200_000, 200_000, 200_000)],
)  # fmt: skip
def test_steps_of_any_scene_are_multiples_of_the_grid(duration, dt, coarsest, last):
    case = Case(ARM, Scene("mine", duration=duration, dt=dt))
    found = settings.settings_of(RK4, case)
    assert settings.coarsest_steps(case) == found[0].steps == coarsest and found[-1].steps == last
    assert all(s.steps % 64 == 0 and s.duration == duration for s in found)
    assert settings.settings_of(RK4, case, "full", "same schemes")


@pytest.mark.parametrize(
    "name, first, last",
    [("dopri8_adaptive", 2, 14), ("RK45", 2, 12), ("DOP853", 2, 13), ("Radau", 2, 6), ("LSODA", 2, 12), ("Taylor", 4, 16),
     ("another", 2, 12)],
)  # fmt: skip
def test_tolerances_are_divided_by_ten(bent, name, first, last):
    engine = "tmt" if name in METHODS else "another"
    found = settings.settings_of(Method(engine, name, None, name, adaptive=True), bent)
    assert [s.tolerance for s in found] == [10.0**-k for k in range(first, last + 1)]
    assert {(s.duration, s.steps) for s in found} == {(5.0, None)}
