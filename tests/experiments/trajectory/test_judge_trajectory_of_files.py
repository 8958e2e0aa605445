"""What is said of runs of a file's robot: those that nothing judges, a start that is one ulp away, what stays."""

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


def test_a_zero_is_one_ulp_of_1_away_and_the_arms_is_the_next_number():
    start = np.array([0.0, 1.0, -0.5])
    np.testing.assert_array_equal(runs.nudged(start, True), [2.0**-52, 1.0 + 2.0**-52, -0.5 + 2.0**-54])
    np.testing.assert_array_equal(runs.nudged(start, False), np.nextafter(start, np.inf))


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
