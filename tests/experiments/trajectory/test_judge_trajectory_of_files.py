"""What is said of runs of a file's robot: those that nothing judges, a start that is eps away, what stays."""

import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import reading
from compare.experiments.trajectory import leaving, runs
from compare.robots.file import robot_of
from compare.setup import engines


@pytest.fixture(scope="module")
def arm():
    found = reading.read(PATHS["arm6"])
    return robot_of(found, "arm6.xml"), engines(reading.engine(found))


def test_a_start_is_moved_by_eps_of_a_radian_and_by_more_where_a_number_has_no_such_place():
    eps = 2.0**-52
    np.testing.assert_array_equal(runs.nudged(np.array([0.0, 1.0, -0.5])), [eps, 1.0 + eps, -0.5 + eps])
    np.testing.assert_array_equal(runs.nudged(np.array([6.0, -6.0])), [6.0 + 4 * eps, -6.0 + 4 * eps])


@pytest.mark.parametrize("entries, said", [(0, True), (100_000, False)])
def test_a_run_of_which_nothing_is_judged_is_said(arm, entries, said):
    robot, known = arm
    case = robot.cases[0].changed(duration=1 / 64, dt=1 / 512)
    result = runs.follow(case, known, (1,), entries=entries)
    notes = [note for note in result.notes if "no state of a run but its start is judged" in note]
    assert bool(notes) is said and (not said or "RK4, 8 steps" in notes[0])


def test_what_stays_is_said_once(arm):
    robot, known = arm
    held = next(case for case in robot.cases if case.is_held).changed(duration=0.1, dt=0.1 / 64)
    stays = {"tmt": None, "mujoco": None}
    words = leaving.stays_in_words(held, known, stays)
    assert (words.count("stays within 0.1 rad") == 1 and "no small deviation" in words) or "grow by up to" in words
    assert leaving.stays_in_words(held, known, stays | {"mujoco": 0.05}) is None
