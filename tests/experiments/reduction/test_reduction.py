"""The whole experiment: a small run, one without timings, wrong models, and other robots."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from shown import blocks
from trees import mjcf

import tmt
from compare import experiment, scene_file
from compare.case import Scene
from compare.engines.mujoco import Mujoco, load, parse
from compare.experiments import reduction, trajectory
from compare.judge.check import Result
from compare.robots import Robot
from compare.robots.arm import ARM


def setup_of(engine) -> experiment.Setup:
    return experiment.Setup.small(ARM, experiment.engines(engine))


def failed(result) -> list:
    return [check for check in result.checks if not check.passed]


def test_a_small_run_takes_every_path(small):
    result = small("reduction")
    rows = {(r["scene"], r["hinges"], r["engine"], r["integrator"]): r for r in result.rows}
    assert {scene for scene, *_ in rows} == {scene.name for scene in ARM.scenes}
    planar, whole = (rows["zero, free", hinges, "tmt", "RK4"] for hinges in ("alpha gamma", "alpha beta gamma"))
    assert planar["nv"] == 2 and whole["nv"] == 3 and 0 < planar["operations"] < whole["operations"]
    assert planar["ns_per_step"] > 0
    assert planar["max_difference_rad"] is not None and whole["max_difference_rad"] is None
    stays = rows["bent, held", "none", "mujoco", "RK4"]
    assert stays["nv"] == 0 and stays["ns_per_step"] is None and 0.0 < stays["max_difference_rad"] < 1e-12


def test_the_scene_that_the_help_shows_runs(engines, tmp_path):
    (text,) = blocks("toml")
    (tmp_path / "my.toml").write_text(text)
    scenes = scene_file.read_scenes(tmp_path / "my.toml", ARM)
    (case,) = dataclasses.replace(ARM, scenes=scenes).cases
    assert (case.duration, case.steps) == (2.0, 64)
    result = reduction.rows(experiment.Setup.small(ARM, engines), [case], timed=False)
    assert failed(result) == [] and result.curves["needs"]["my swing"]["stays"] == ("beta",)
    result = trajectory.runs.follow(case, engines, (1, 2))
    assert failed(result) == []
    assert {row["dt_s"] for row in result.rows} == {1 / 32, 1 / 64}
    assert {row["scene"] for row in result.rows} == {"my swing", "my swing, beta locked"}


@pytest.mark.parametrize(
    "old, new, fails",
    [
        ("-9.81", '-9.81" density="50" viscosity="1', "order of the error against the elliptic function, from 4"),
        ('axis="1 0 0"', 'axis="1 0 0" armature="0.01"', "Mbar, reduced, TMT to MuJoCo"),
        (
            "</mujoco>",
            '<tendon><fixed><joint joint="alpha" coef="1"/><joint joint="gamma" coef="1"/></fixed></tendon></mujoco>',
            "models whose hinges can be locked",
        ),
    ],
    ids=["air", "armature", "a tendon that cannot go with one joint"],
)
def test_a_wrong_model_fails(old, new, fails):
    text = ARM.mjcf.read_text(encoding="utf-8")
    assert old in text
    result = reduction.rows(setup_of(parse(text.replace(old, new), ARM.tree)), timed=False)
    assert fails in {check.quantity for check in failed(result)}


class DampedWhereLocked(Mujoco):
    """MuJoCo, whose model with locked joints has damping."""

    def changed(self, case):
        model = super().changed(case)
        model.dof_damping[:] += 0.1 if case.locked else 0.0
        return model


def test_a_smaller_model_of_one_engine_that_is_wrong_is_seen():
    wrong = load(ARM.mjcf, ARM.tree)
    wrong.__class__ = DampedWhereLocked
    found = failed(reduction.rows(setup_of(wrong), timed=False))
    where = {check.scene for check in found if check.quantity == "smallest model to whole"}
    assert "zero, free, MuJoCo, RK4, dt = 5/1024 s" in where and not any("TMT" in scene for scene in where)


# another robot


LEG = tmt.Tree(
    hinge_names=("yaw", "hip", "roll", "knee"),
    parent=(-1, 0, 1, 2),
    offset=((0.1, 0, 0.5), (0, 0, -0.05), (0, 0, -0.25), (0, 0, -0.2)),
    axis=((0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 0)),
    damping=(0, 0, 0, 0),
    body_names=("base", "thigh", "shank"),
    body_hinge=(0, 1, 3),
    mass=(2.0, 1.5, 0.8),
    com=((0.02, 0, 0), (0, 0, -0.12), (0, 0, -0.1)),
    inertia=(np.diag([0.01, 0.01, 0.008]), np.diag([0.012, 0.012, 0.002]), np.diag([0.004, 0.004, 0.001])),
    gravity=(0, 0, -9.81),
)
SHORT = {"duration": 0.25, "dt": 1 / 64}
SCENES = (
    Scene("drop", "folded", **SHORT),
    Scene("rest", "sideways", "hold", **SHORT),
    Scene("knee swing", (0, 0, 0, 60), locked=("yaw", "hip", "roll"), **SHORT),
    Scene("plane", (0, 50, 0, 20), tags=("fewer joints",), **SHORT),
    Scene(
        "own",
        (10, 20, 0, 40),
        (0.5, 0, 0, 0.1),
        (0, 10, 0, 0),
        damping=0.2,
        locked=("roll",),
        judged=0.0,
        tags=("own",),
        **SHORT,
    ),
)


def leg():
    """The result of a robot of four hinges, captions by the names of its figures, and what is said of it in general."""
    postures = {"straight": (0, 0, 0, 0), "folded": (20, 40, -10, 80), "sideways": (90, 0, 30, 20)}
    robot = Robot("leg", Path("leg.xml"), LEG, postures, SCENES)
    result = reduction.rows(experiment.Setup.small(robot, experiment.engines(parse(mjcf(LEG), LEG))))
    drawn = {name: caption for name, _, caption in (figure() for figure in reduction.figures(result, robot))}
    result.curves = {}  # which need not be sent
    return result, drawn, [reduction.claim(robot), reduction.tolerance(robot)]


def test_a_robot_of_four_hinges_goes_through_with_figures(shared):
    result, drawn, general = shared(leg)
    assert [str(check) for check in failed(result)] == []
    assert len(result.tables["reduction_subsets"]) == (2**4 - 2) * 6
    smallest = {row["scene"]: row["hinges"] for row in result.rows}
    assert list(smallest.values()) == ["yaw hip roll knee", "none", "knee", "hip knee", "yaw hip knee"]
    assert list(drawn) == ["reduction_needs", "reduction_knee_swing", "reduction_cost_in_mujoco"]  # yaw never swings
    said = " ".join([*result.notes, *drawn.values(), *general])
    assert not any(f" {word} " in said for word in ("arm", "alpha", "beta", "gamma", "bent", "nan"))


TWO = dataclasses.replace(tmt.ARM.lock({"alpha": 0.3}), hinge_names=("a", "b"))
ONE = tmt.Tree(
    hinge_names=("a",),
    parent=(-1,),
    offset=((0, 0, 1),),
    axis=((0, 1, 0),),
    damping=(0.1,),
    body_names=("rod",),
    body_hinge=(0,),
    mass=(1,),
    com=((0, 0, -0.3),),
    inertia=(np.eye(3) / 100,),
    gravity=(0, 0, -9),
)


@pytest.mark.parametrize("tree", [TWO, ONE], ids=["two hinges", "one"])
def test_a_robot_of_few_hinges_without_postures_and_scenes_goes_through(tree):
    bare = Robot("bare", Path("bare.xml"), tree, {}, ())
    result = reduction.rows(experiment.Setup.small(bare, experiment.engines(parse(mjcf(tree), tree))))
    assert [str(check) for check in failed(result)] == []
    assert [figure()[0] for figure in reduction.figures(result, bare)] == ["reduction_cost_in_mujoco"]


def test_nothing_is_timed_before_all_else_has_ended_and_what_was_begun_is_not_done_again(setup, monkeypatch):
    log = []

    def untimed(setup, *more):
        log.append("computed")
        return Result("reduction", notes=["computed"]), []

    monkeypatch.setattr(reduction, "untimed", untimed)
    monkeypatch.setattr(reduction, "time_models", lambda *given: log.append("timed"))
    monkeypatch.setattr(reduction, "measure_costs", lambda *given: log.append("measured"))
    setup = dataclasses.replace(setup, quiet=lambda: log.append("quiet"), background={})
    for ahead in (False, True):
        log.clear()
        if ahead:
            reduction.begin(setup)
        assert reduction.rows(setup).notes == ["computed"] and setup.background == {}
        assert log == ["computed", "quiet", "timed", "measured"]
    reduction.begin(setup)
    log.clear()
    reduction.rows(setup, timed=False)
    assert log == ["computed"]  # of another kind than what was begun
