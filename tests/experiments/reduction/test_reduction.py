"""The whole experiment: a small run, wrong models, a robot of another kind, what is timed when; and what additions cost."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from edited import XML, setup_of
from trees import mjcf

import tmt
from compare.case import Scene
from compare.engines.mujoco import ModelError, additions, engine, parse, read
from compare.experiment import Setup, engines
from compare.experiments import reduction
from compare.experiments.reduction import cost
from compare.judge.check import Result
from compare.robots import Robot
from compare.robots.arm import ARM
from compare.robots.file import robot_of


def test_a_small_run_takes_every_path_and_every_figure_has_numbers(small):
    result = small("reduction")
    rows = {(r["scene"], r["hinges"], r["engine"], r["integrator"]): r for r in result.rows}
    assert {scene for scene, *_ in rows} == {scene.name for scene in ARM.scenes}
    planar, whole = (rows["zero, free", hinges, "tmt", "RK4"] for hinges in ("alpha gamma", "alpha beta gamma"))
    assert 0 < planar["operations"] < whole["operations"] and planar["ns_per_step"] > 0
    stays = rows["bent, held", "none", "mujoco", "RK4"]
    assert stays["ns_per_step"] is None and 0.0 < stays["max_difference_rad"] < 1e-12
    drawn = {name: caption for name, _, caption in (figure() for figure in reduction.figures(result, ARM))}
    names = ["reduction_needs", "reduction_elbow_swing", "reduction_modes", "reduction_cost_in_mujoco"]
    assert list(drawn) == names and not any("nan" in caption for caption in drawn.values())
    assert "elliptic" in reduction.claim(ARM) and "1e-" not in reduction.tolerance(ARM)


@pytest.mark.parametrize(
    "old, new, fails",
    [
        ("-9.81", '-9.81" density="50" viscosity="1', "order of the error against the elliptic function, from 4"),
        (
            "</mujoco>",
            '<tendon><fixed><joint joint="alpha" coef="1"/><joint joint="gamma" coef="1"/></fixed></tendon></mujoco>',
            "models whose hinges can be locked",
        ),
    ],
    ids=["air", "a tendon that cannot go with one joint"],
)
def test_a_wrong_model_fails(old, new, fails):
    result = reduction.rows(setup_of(XML.replace(old, new)), timed=False)
    assert fails in {check.quantity for check in result.checks if not check.passed}


def test_a_robot_of_two_hinges_without_postures_and_scenes_goes_through():
    tree = dataclasses.replace(tmt.ARM.lock({"alpha": 0.3}), hinge_names=("a", "b"))
    bare = Robot("bare", Path("bare.xml"), tree, {}, ())
    result = reduction.rows(Setup.small(bare, engines(parse(mjcf(tree), tree))))
    assert [str(check) for check in result.checks if not check.passed] == []
    assert [figure()[0] for figure in reduction.figures(result, bare)] == ["reduction_cost_in_mujoco"]


def test_nothing_is_timed_before_all_else_has_ended_and_what_was_begun_is_not_done_again(setup, monkeypatch):
    log = []
    for name, said in (("untimed", "computed"), ("time_models", "timed"), ("measure_costs", "measured")):
        given = Result("reduction"), []
        monkeypatch.setattr(reduction, name, lambda *_, said=said, given=given: log.append(said) or given)
    setup = dataclasses.replace(setup, quiet=lambda: log.append("quiet"), background={})
    for begun in (False, True):
        if begun:
            reduction.begin(setup)
        reduction.rows(setup)
        assert log == ["computed", "quiet", "timed", "measured"] and setup.background == {}
        log.clear()
    reduction.begin(setup)
    log.clear()
    reduction.rows(setup, timed=False)
    assert log == ["computed"]  # of another kind than what was begun


# what additions cost


def changing(engines, case, steps=256) -> set:
    """The additions with which the motion of a case has other bits."""
    paths = {name: e.of(case).run(*case.start, case.tau, 1 / 200, steps, "Euler").q for name, e in engines.items()}
    return {name for name, path in paths.items() if not np.array_equal(path, paths[additions.MINIMAL])}


def test_additions_are_there_and_only_a_touched_floor_changes_the_motion(mujoco):
    engines, case = additions.with_additions(mujoco, *cost.sizes(ARM.tree)), ARM.case("falls", posture="bent")
    models = {name: engine.of(case) for name, engine in engines.items()}
    sizes = {name: (d.model.ngeom, d.model.nsensor, d.model.nu) for name, d in models.items()}
    assert sizes[additions.MINIMAL] == (0, 0, 0) and sizes["two capsules"] == (2, 0, 0)
    assert sizes["6 sensors"] == (0, 6, 0) and sizes["a motor"] == (0, 0, 1) and sizes[additions.ON_FLOOR] == (3, 0, 0)
    assert not models[additions.MINIMAL].enabled("contact") and models["contact stage"].enabled("contact")
    assert changing(engines, case, 400) == {additions.ON_FLOOR}
    run = *case.start, case.tau, 1 / 200, 400, "Euler"
    many, pushed = additions.contacts(models[additions.ON_FLOOR], *run)
    assert many > 0.1 and pushed and additions.contacts(models[additions.CAPSULES], *run) == (0.0, False)
    with pytest.raises(ModelError, match="beta"):
        engines[additions.ON_FLOOR].of(ARM.case("locked", locked=("beta",)))


def test_a_body_that_falls_with_its_centre_of_mass_at_its_base_has_a_size_and_reaches_any_floor():
    reading = read('<mujoco><worldbody><body><freejoint/><geom size="0.1"/></body></worldbody></mujoco>')
    radius, near, far = cost.sizes(reading.tree)
    assert radius == pytest.approx(np.sqrt(0.4) * 0.1 / 15, rel=1e-5) and near < 0.0 and far is None
    engines = additions.with_additions(engine(reading), radius, near, far)
    assert additions.ON_FLOOR in engines and additions.OFF_FLOOR not in engines
    assert engines["a capsule"].model.ngeom == 1


def test_what_is_added_takes_nothing_from_the_default_classes_of_the_file():
    """A motor that were a servo would push, and geoms that may not touch would never do."""
    reading = read(
        '<mujoco><default><position kp="80"/><geom contype="0" conaffinity="0" margin="9"/></default><worldbody><body>'
        '<joint name="j" axis="0 1 0"/><inertial pos="0.2 0 0" mass="1" diaginertia=".01 .01 .01"/></body></worldbody></mujoco>'
    )
    robot = robot_of(reading, "robot.xml")
    engines = additions.with_additions(engine(reading), *cost.sizes(robot.tree))
    assert changing(engines, robot.case("let go")) == {additions.ON_FLOOR}


def test_the_fall_is_the_regular_scene_else_a_free_one_else_a_posture():
    others = Scene("weightless", gravity=False), Scene("held", torque="hold"), Scene("locked", locked=("beta",))
    assert cost.fall_case(ARM).name == "bent, free"
    assert cost.fall_case(dataclasses.replace(ARM, scenes=(*others, Scene("free")))).name == "free"
    fall = cost.fall_case(dataclasses.replace(ARM, scenes=others))
    assert fall.scene.posture == "zero" and fall.is_free and fall.duration == 5.0  # time enough to come to rest
