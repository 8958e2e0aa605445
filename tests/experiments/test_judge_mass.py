"""The rules of the mass matrix: a value just inside and one just outside of each."""

import dataclasses

import numpy as np
import pytest
from crane import crane
from edited import XML, setup_of
from judged import verdicts

from compare.engines.mujoco import load
from compare.experiment import Setup, engines
from compare.experiments import mass
from compare.judge.check import Result
from compare.judge.words import ROWS_COMPILED
from compare.robots.arm import ARM

EPS = 2.0**-52


def test_a_mass_matrix_is_definite_by_more_than_rounding():
    for least, passes in ((1.01, True), (0.99, False), (0.0, False), (-1.0, False)):
        result = Result("mass")
        mass.check_definiteness(result, "TMT", np.array([np.eye(3), np.diag([1.0, 1.0, least * 64 * EPS])]))
        assert verdicts(result) == {"TMT: least eigenvalue of Mbar over the largest": passes}


def test_a_mass_matrix_is_symmetric_but_for_rounding():
    for share, passes in ((0.99, True), (1.01, False)):
        M, result = 2.0 * np.eye(3)[None], Result("mass")
        M[0, 0, 1] = share * 2.0 * 64 * EPS
        mass.check_symmetry(result, M)
        assert verdicts(result) == {"TMT: Mbar - Mbar' over its largest entry": passes}


def test_the_worst_posture_and_its_condition_number_are_those_of_the_stated_arm():
    largest = mass.largest_condition(ARM)
    assert pytest.approx(126.8333, abs=1e-4) == largest and "126.83" in mass.claim(ARM)
    right = largest, np.radians([-90.0, 90.0])
    bound = 64 * EPS * 126.8333**2
    for value, worst, passes in (
        (*right, [True, True]),
        (right[0] + 0.99 * bound, right[1], [True, True]),
        (right[0] + 1.01 * bound, right[1], [False, True]),
        (right[0], np.radians([90.0099, 90.0]), [True, True]),
        (right[0], np.radians([90.0101, 90.0]), [True, False]),
        (right[0], np.radians([90.0, 90.0101]), [True, False]),
        (right[0], np.radians([90.0, -90.0]), [True, False]),
    ):
        result = Result("mass")
        mass.check_conditioning(result, ARM, "MuJoCo", value, worst)
        assert [check.passed for check in result.checks] == passes


def test_every_rule_of_the_mass_matrix_is_applied_to_both_engines(small):
    found = {check.quantity for check in small("mass").checks}
    compared = "Mbar", "Mbar, compiled", "Mbar, TMT to exact", "Mbar, MuJoCo to exact"
    assert found == {*compared, "TMT: Mbar - Mbar' over its largest entry"} | {
        f"{name}: {what}" for name in ("TMT", "MuJoCo")
        for what in ("least eigenvalue of Mbar over the largest", "condition number - 126.83", "distance from (+-90, 90) deg")
    }  # fmt: skip


def test_a_gamma_axis_that_is_flipped_is_seen_in_the_worst_posture():
    flipped = setup_of(XML.replace('"gamma" type="hinge" axis="0 1 0"', '"gamma" type="hinge" axis="0 -1 0"'))
    failed = {check.quantity for check in mass.rows(flipped).checks if not check.passed}
    assert "MuJoCo: distance from (+-90, 90) deg" in failed and not any(name.startswith("TMT") for name in failed)


def test_each_largest_condition_number_is_its_engines_own():
    worst = mass.rows(setup_of(XML.replace('mass="1.5"', 'mass="2.5"'))).curves["worst"]
    assert worst["tmt"][0] == pytest.approx(126.83, abs=0.01) and worst["mujoco"][0] > 190.0


def test_a_robot_of_which_no_worst_posture_is_stated_is_judged_without_it(tmp_path):
    robot = crane(tmp_path)
    result = mass.rows(Setup.small(robot, engines(load(robot.mjcf, robot.tree))))
    assert all(check.passed for check in result.checks)
    rules = {f"{name}: least eigenvalue of Mbar over the largest" for name in ("TMT", "MuJoCo")}
    assert rules | {"TMT: Mbar - Mbar' over its largest entry"} <= {check.quantity for check in result.checks}
    assert not any("condition" in check.quantity for check in result.checks) and "condition" not in result.curves
    assert "condition" not in mass.claim(robot) + mass.tolerance(robot).replace("Definite", "")
    assert result.notes == [
        "Nothing is stated of where the condition number of Mbar of the crane is largest: that is neither checked nor drawn.",
        ROWS_COMPILED,
    ]
    assert [figure()[0] for figure in mass.figures(result, robot)] == ["mass_distances"]
    stated = ARM.conditioning._replace(worst=(45.0, 30.0))
    assert "+-45 deg, gamma = 30 deg" in mass.claim(dataclasses.replace(ARM, conditioning=stated))
