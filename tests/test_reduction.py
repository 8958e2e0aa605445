"""Fewer hinges: locking on both sides, what a scene needs, motions that are known, costs in MuJoCo."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

import tmt
from compare import engine_cost, known_motion, reduction, sub_blocks, trajectory
from compare.agreement import Result, Setup
from compare.engine import Engine
from compare.engine_file import ARM_XML, parse
from compare.exact_motion import exact_swing, modes, pendulum, small_oscillation, stiffness, swing
from compare.scenes import SCENES, Scene, posture
from compare.smallest import needed, reduced
from tmt.reference import distance

SUBSETS = (("alpha",), ("beta",), ("gamma",), ("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma"))
SWING = next(scene for scene in SCENES if scene.name == "elbow swing")


def test_every_subset_agrees_and_a_wrong_lock_is_seen(engine):
    class Deleted(Engine):
        """Joints that are only deleted stay at zero."""

        def lock(self, angles):
            return engine.lock(dict.fromkeys(angles, 0.0))

    wrong = Deleted(engine.model, engine.hinges, engine.carriers, engine.source)
    right_result, wrong_result = Result("reduction"), Result("reduction")
    sub_blocks.compare(right_result, engine, angles=2)
    sub_blocks.compare(wrong_result, wrong, angles=2)
    assert len(right_result.checks) == 6 * 2 * 3 and all(check.passed for check in right_result.checks)
    failed = {check.scene for check in wrong_result.checks if not check.passed}
    assert failed == {f"{' and '.join(locked)} locked" for locked in SUBSETS}


# what a scene needs


def test_from_zero_beta_is_not_needed_and_a_held_posture_needs_nothing():
    stays = {scene.name: needed(scene).stays for scene in SCENES}
    assert stays.pop("zero, free") == ("beta",)
    held = {name for name, hinges in stays.items() if hinges == tmt.ARM.hinge_names}
    assert held == {"ball catch, held", "bent, held"}
    assert all(hinges == () for name, hinges in stays.items() if name not in held)


@pytest.mark.parametrize(
    "scene, stays",
    [
        (Scene("in its plane", (20, 0, 40), "free", speed=(30, 0, -50)), ("beta",)),
        (Scene("out of it by 1e-6 deg", (20, 1e-6, 40), "free"), ()),
        (Scene("beta has a speed", (20, 0, 40), "free", speed=(0, 1e-9, 0)), ()),
        (Scene("beta is pushed", (20, 0, 40), (0, 1e-30, 0)), ()),
        (Scene("sin of the double nearest to pi is not 0", (20, 180, 40), "free"), ()),
        (Scene("plane of a locked alpha", (30, 0, 0), "free", locked=("alpha",)), ("beta",)),
        (Scene("at rest without gravity", "bent", "free", gravity=False), tmt.ARM.hinge_names),
        (Scene("the rounded torque does not hold", "zero", (-2.20725, 0, -2.20725)), ("beta",)),
    ],
    ids=lambda value: value.name if isinstance(value, Scene) else "",
)
def test_needed(scene, stays):
    assert needed(scene).stays == stays


def test_what_does_not_fold_is_kept_and_named():
    """A round top on crossed hinges: alpha and gamma never move, but c (I s) - s (I c) does not fold to 0."""
    top = dataclasses.replace(
        tmt.ARM,
        parent=(-1, 0, 1),
        offset=np.zeros((3, 3)),
        axis=np.eye(3)[[1, 0, 2]],
        body_names=("top",),
        body_hinge=(2,),
        mass=(1.0,),
        com=((0.0, 0.0, -0.2),),
        inertia=(np.diag([0.01, 0.01, 0.002]),),
    )

    class Top(Scene):
        whole = property(lambda self: top)

    found = needed(Top("top", (0, 30, 40), "free"))
    assert found.stays == () and set(found.moves) == {"beta"} and found.undecided == ("alpha", "gamma")


# motions


def test_the_planar_arm_moves_as_the_whole_one(engine):
    scene = SCENES[0]
    result = Result("reduction", curves={"apart": {}})
    smaller = reduced(scene)
    assert smaller.hinges == ("alpha", "gamma")
    reduction.runs(result, scene, smaller, engine, "RK4")
    assert len(result.checks) == 6 and all(check.passed for check in result.checks)
    # a planar arm that starts elsewhere is another motion
    wrong = dataclasses.replace(smaller, posture=(0, 0, 1e-6))
    reduction.runs(result, scene, wrong, engine, "RK4")
    assert {check.quantity for check in result.checks if not check.passed} == {"smallest model to whole"}


def test_the_swing_is_its_elliptic_function():
    hanging, frequency = pendulum(SWING.model)
    assert hanging == pytest.approx(np.pi / 2) and frequency**2 == pytest.approx(
        41.8436, abs=5e-5
    )  # the assignment's f1
    t = np.linspace(0.0, 3.0, 61)
    for q, qd in ((0.0, 0.0), (0.3, 4.0), (2.0, -7.0), (8.0, 1.0)):
        exact = swing(t, q, qd, hanging, frequency)
        assert exact[0] == pytest.approx(q) and np.ptp(exact) > 0.3
        assert distance(exact, exact_swing(t, q, qd, hanging, frequency)).max() < 1e-14 * (1.0 + 30.0)
        _, path, _ = tmt.simulate([q], [qd], [0.0], 3.0 / 6000, 6000, model=SWING.model)
        assert np.abs(path[::100, 0] - exact).max() < 1e-10
    assert np.isnan(swing(t, 0.0, 20.0, hanging, frequency)).all()  # turns over


def test_a_pendulum_in_any_posture_of_the_locked_hinges():
    scene = Scene("tilted", (30, 20, 60), "free", speed=(0, 0, 100), locked=("alpha", "beta"))
    hanging, frequency = pendulum(scene.model)
    assert tmt.gravity_balance([hanging], scene.model)[0] == pytest.approx(0.0, abs=1e-14)
    assert frequency**2 == pytest.approx(
        (stiffness(scene.model, np.array([hanging])) / tmt.mass_matrix([0.0], scene.model))[0, 0]
    )


def test_both_engines_meet_the_elliptic_function_and_a_heavier_arm_does_not(engine):
    def failed(engine):
        result = Result("reduction", curves={"apart": {}, "swings": {}})
        known_motion.swings(result, engine, SCENES)
        assert len(result.checks) == 5
        return [check.scene for check in result.checks if not check.passed]

    assert failed(engine) == []
    heavier = parse(ARM_XML.read_text().replace('mass="1.5"', 'mass="1.50001"'))
    assert failed(heavier) == ["elbow swing, RK4, MuJoCo"]  # Euler's error hides it


def test_modes_and_small_oscillations():
    q = posture("hanging")
    frequencies, shapes = modes(tmt.ARM, q)
    assert np.allclose(shapes.T @ tmt.mass_matrix(q) @ shapes, np.eye(3), atol=1e-12)
    assert np.allclose(shapes.T @ stiffness(tmt.ARM, q) @ shapes, np.diag(frequencies**2), atol=1e-9)
    away = np.array([0.1, -0.2, 0.3])
    start = small_oscillation(np.array([0.0, 1e-4]), tmt.ARM, q, away)
    assert np.allclose(start[0] - q, away)
    assert np.allclose(
        (start[1] - start[0]) * 2e8, -np.linalg.solve(tmt.mass_matrix(q), stiffness(tmt.ARM, q) @ away), rtol=1e-3
    )


# scenes


@pytest.mark.parametrize(
    "wrong, says",
    [
        ({"posture": "sitting"}, "posture is 'sitting'; zero, hanging, upright, ball catch, bent or three numbers"),
        ({"posture": (1, 2)}, "one per hinge"),
        ({"torque": "pull"}, "torque is 'pull'; free, hold or three numbers"),
        ({"torque": (1, 2, np.inf)}, "in N m"),
        ({"speed": "fast"}, "in deg/s"),
        ({"damping": -1}, "damping is -1; at least 0"),
        ({"duration": 0}, "duration is 0; a time in s above 0"),
        ({"dt": 0.3}, "dt is 0.3; a step that divides 5 s"),
        ({"dt": 7.0}, "a step that divides 5 s"),
        ({"locked": ("wrist",)}, "locked is .'wrist',.; a tuple of at most two of alpha, beta, gamma"),
        ({"locked": "beta"}, "a tuple of at most two"),
        ({"locked": ("alpha", "beta", "gamma")}, "a tuple of at most two"),
        ({"locked": ("beta",), "speed": (0, 1, 0)}, "no speed of a locked hinge .beta."),
    ],
)
def test_what_cannot_be_a_scene_is_refused_in_one_line(wrong, says):
    with pytest.raises(ValueError, match=says) as error:
        Scene(**{"name": "mine", "posture": "zero", "torque": "free"} | wrong)
    assert str(error.value).startswith("scene 'mine': ") and "\n" not in str(error.value)


def test_the_scene_of_the_readme_runs(engine):
    readme = (Path(__file__).parent.parent / "README.md").read_text()
    line = re.search(r"^swing = Scene\(.*\)$", readme, re.MULTILINE).group()
    space = {"Scene": Scene}
    exec(line, space)
    scene = space["swing"]
    assert (scene.duration, scene.steps) == (2.0, 128)
    result = trajectory.follow(scene, engine, (64,))
    assert all(check.passed for check in result.checks), [str(c) for c in result.checks if not c.passed]
    assert {row["dt_s"] for row in result.rows} == {1 / 64}
    assert {row["scene"] for row in result.rows} == {"my swing", "my swing, beta locked"}


def test_a_torque_in_newton_metres_acts_on_the_free_hinges():
    scene = Scene("pushed", "bent", (1.0, 0.5, -1.0), locked=("beta",))
    assert scene.hinges == ("alpha", "gamma") and scene.tau.tolist() == [1.0, -1.0]
    assert np.allclose(scene.start[0], np.radians([30, 60])) and scene.angles == {"beta": np.radians(20.0)}
    held = Scene("held", "bent", "hold", locked=("beta",))
    assert np.allclose(tmt.acceleration(*held.start, held.tau, held.model), 0.0, atol=1e-12) and held.tau.any()


# costs in MuJoCo


def test_additions_are_there_and_only_a_touched_floor_changes_the_motion(engine):
    engines = engine_cost.with_additions(engine)
    sizes = {name: (e.model.ngeom, e.model.nsensor, e.model.nu) for name, e in engines.items()}
    assert sizes[engine_cost.NOTHING] == (0, 0, 0) and sizes["two capsules"] == (2, 0, 0)
    assert sizes["6 sensors"] == (0, 6, 0) and sizes["a motor"] == (0, 0, 1) and sizes[engine_cost.CONTACT] == (3, 0, 0)
    assert not engines[engine_cost.NOTHING].enabled("contact") and engines["contact stage"].enabled("contact")
    start = posture("bent"), np.zeros(3), np.zeros(3), 5 / 1024, 400
    paths = {name: e.trajectory(*start)[1] for name, e in engines.items()}
    changed = {name for name, path in paths.items() if not np.array_equal(path, paths[engine_cost.NOTHING])}
    assert changed == {engine_cost.CONTACT}
    assert engine_cost.contacts(engines[engine_cost.CONTACT], *start, "Euler") > 0.1
    assert engine_cost.contacts(engines["default flags + capsules"], *start, "Euler") == 0.0


def test_a_small_run_takes_every_path(small):
    result = small("reduction")
    rows = {(r["scene"], r["hinges"], r["engine"], r["integrator"]): r for r in result.rows}
    assert {scene for scene, *_ in rows} == {scene.name for scene in SCENES}
    planar, whole = (rows["zero, free", hinges, "TMT", "RK4"] for hinges in ("alpha gamma", "alpha beta gamma"))
    assert planar["nv"] == 2 and whole["nv"] == 3 and 0 < planar["operations"] < whole["operations"]
    assert (
        planar["ns_per_step"] > 0 and planar["max_difference_rad"] is not None and whole["max_difference_rad"] is None
    )
    stays = rows["bent, held", "none", "MuJoCo", "RK4"]
    assert stays["nv"] == 0 and stays["ns_per_step"] is None and 0.0 < stays["max_difference_rad"] < 1e-12


def test_a_run_without_timings_has_the_checks_only(engine):
    result = reduction.rows(Setup.small(engine), timed=False)
    assert len(result.checks) > 30 and all(check.passed for check in result.checks)
    assert result.rows == [] and [figure()[0] for figure in reduction.figures(result)] == [
        "reduction_elbow_swing", "reduction_modes"]  # fmt: skip


@pytest.mark.parametrize(
    "old, new, fails",
    [
        ("0 0 -9.81", "0 0 -1.62", "order of the error against the elliptic function, from 4"),
        ("-9.81", '-9.81" density="50" viscosity="1', "order of the error against the elliptic function, from 4"),
        ('axis="1 0 0"', 'axis="1 0 0" damping="0.1"', "power of the amplitude with which"),
        ('axis="1 0 0"', 'axis="1 0 0" armature="0.01"', "Mbar, reduced, TMT to MuJoCo"),
    ],
    ids=["moon", "air", "damping", "armature"],
)
def test_a_wrong_model_fails(old, new, fails):
    text = ARM_XML.read_text(encoding="utf-8")
    assert old in text
    checks = reduction.rows(Setup.small(parse(text.replace(old, new))), timed=False).checks
    assert any(check.quantity.startswith(fails) for check in checks if not check.passed)


def test_a_model_whose_hinge_cannot_be_locked_is_a_failed_check():
    tendon = '<tendon><fixed><joint joint="gamma" coef="1"/></fixed></tendon></mujoco>'
    result = reduction.rows(Setup.small(parse(ARM_XML.read_text(encoding="utf-8").replace("</mujoco>", tendon))))
    failed = [check for check in result.checks if not check.passed]
    assert [check.quantity for check in failed] == ["models whose hinges can be locked"]
    assert "gamma locked" in failed[0].note and list(reduction.figures(result)) == []
