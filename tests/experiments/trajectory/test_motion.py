"""The table of the motion: which rows and columns there are, and that its values are those of the runs."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from trajectory_curves import CASES, FREE

from compare.coordinates import Coordinates
from compare.engines import GRID
from compare.experiments.trajectory import motion
from compare.experiments.trajectory.runs import follow
from compare.judge.check import Result
from compare.report.files import csv
from compare.robots.arm import ARM

ABOUT = ["scene", "engine", "integrator", "dt_s", "t_s"]
OF_ARM = [f"q_{name}_rad" for name in ARM.joints] + [f"qd_{name}_rad_per_s" for name in ARM.joints]


def table_of(curves, robot=ARM) -> tuple[Result, pd.DataFrame]:
    """The result, and its table as a reader of the file has it."""
    result = Result("trajectory", curves={"runs": curves})
    motion.tabulate_motion(result, robot)
    return result, pd.DataFrame(result.tables["motion"], columns=ABOUT + motion.motion_columns(robot.coordinates))


@pytest.fixture(scope="module")
def curves(engines):
    """Of two scenes, one in which a method of order 1 diverges, one with locked joints; the first with finer steps too."""
    found = {}
    for name, finer in (("ball catch, free", (1, 2)), ("elbow swing", (1,))):
        found |= follow(CASES[name], engines, finer).curves
    return found


def test_every_run_of_a_scene_has_65_equal_times_its_own_values_and_none_after_it_has_diverged(
    curves, engines, tmp_path
):
    result, table = table_of(curves)
    assert list(table.columns) == ABOUT + OF_ARM and result.filed == ("motion",) and result.notes == []
    methods = engines["mujoco"].methods
    schemes = {method.scheme for method in methods.values()}
    assert len(table) == 2 * (len(methods) + len(schemes)) * (GRID + 1)
    for _, run in table.groupby(["scene", "engine", "integrator"]):
        assert run["dt_s"].unique().tolist() == [5.0 / 64]  # of the two steps that were run the scene's own
        np.testing.assert_array_equal(run["t_s"], np.arange(GRID + 1) * (5.0 / 64))
    for scheme, integrator in (("rk4", "RK4"), ("semi_implicit_euler", "Euler")):
        curve = curves["ball catch, free", scheme, 64]
        for engine, name in (("tmt", scheme), ("mujoco", integrator)):
            run = table[(table.scene == "ball catch, free") & (table.engine == engine) & (table.integrator == name)]
            alive = curve["t"] < (np.inf if curve["ended"][engine] is None else curve["ended"][engine])
            assert alive.all() == (scheme == "rk4") and alive[0]
            expected = np.where(alive[:, None], np.concatenate(curve[engine], axis=1), np.nan)
            np.testing.assert_array_equal(run[OF_ARM].to_numpy(float), expected)
    swing = table[table.scene == "elbow swing"]
    assert (swing[OF_ARM[:2]].to_numpy(float) == CASES["elbow swing"].posture[:2]).all()
    assert (swing[OF_ARM[3:5]] == 0.0).all(axis=None) and np.ptp(swing[OF_ARM[2]].to_numpy(float)) > 1.0
    (tmp_path / "motion.csv").write_text(csv(result.tables["motion"]), encoding="utf-8")
    read = pd.read_csv(tmp_path / "motion.csv")  # which has all digits, and empty cells
    np.testing.assert_array_equal(read[OF_ARM].to_numpy(float), table[OF_ARM].to_numpy(float))
    assert read[OF_ARM].isna().any(axis=None) and "nan" not in (tmp_path / "motion.csv").read_text().lower()


def test_a_run_ends_in_the_table_at_the_very_state_at_which_it_has_diverged():
    t, ones = np.linspace(0.0, 5.0, 2 * GRID + 1), np.ones((2 * GRID + 1, 3))
    for ended, alive in ((None, 65), (5.0, 64), (t[4], 2), (t[3], 2), (t[5], 3)):
        _, values = motion.at_equal_times(FREE, t, ones, ones, ended)
        assert np.isfinite(values).all(axis=1).sum() == alive and np.isfinite(values[:alive]).all()
    broken = ones.copy()
    broken[8, 1] = np.nan  # that is no number though nobody says that it has diverged
    _, values = motion.at_equal_times(FREE, t, broken, ones, None)
    assert np.isnan(values[4]).all() and np.isfinite(values[5]).all()


def test_a_scene_whose_steps_do_not_fall_on_the_times_says_which_run_it_shows_or_that_there_is_none(engines):
    odd = FREE.changed(name="odd", dt=5.0 / 12)
    robot, runs = dataclasses.replace(ARM, scenes=(odd.scene,)), follow(odd, engines, (1, 16)).curves
    result, table = table_of(runs, robot)
    assert table["dt_s"].unique().tolist() == [5.0 / 192] and "odd" in result.notes[0] and "192" in result.notes[0]
    result, table = table_of({key: run for key, run in runs.items() if key[2] == 12}, robot)
    assert len(table) == 0 and "odd" in result.notes[0]


def test_columns_of_every_kind_of_joint_and_of_names_that_differ_in_signs_alone():
    names = ("root x", "root y", "root z", "root turn", "hip", "lift", "my knee")
    of = Coordinates(names, ("slide", "slide", "slide", "ball", "ball", "slide", "hinge"))
    assert motion.motion_columns(of) == [
        "q_root_x_m", "q_root_y_m", "q_root_z_m", "q_root_w", "q_root_x", "q_root_y", "q_root_z",
        "q_hip_w", "q_hip_x", "q_hip_y", "q_hip_z", "q_lift_m", "q_my_knee_rad",
        "qd_root_x_m_per_s", "qd_root_y_m_per_s", "qd_root_z_m_per_s",
        "qd_root_x_rad_per_s", "qd_root_y_rad_per_s", "qd_root_z_rad_per_s",
        "qd_hip_x_rad_per_s", "qd_hip_y_rad_per_s", "qd_hip_z_rad_per_s", "qd_lift_m_per_s", "qd_my_knee_rad_per_s",
    ]  # fmt: skip
    columns = motion.motion_columns(Coordinates(("a-b", "a b", "a_b", "x turn")))
    assert len(set(columns)) == 8 and columns[0] == "q_a_b_rad" and columns[3] == "q_x_turn_rad"
