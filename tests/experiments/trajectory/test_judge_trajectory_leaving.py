"""Why a held arm leaves: the linear map, what rounding can do, and what is said of it."""

import numpy as np
import pytest
from trajectory_curves import CASES, HELD

import tmt
from compare.engines.mujoco import parse
from compare.experiments.trajectory import leaving
from compare.judge.run import departure
from compare.robots.arm import ARM


def test_the_linear_map_says_when_a_torque_that_is_off_makes_the_arm_leave():
    for size in (1e-3, 1e-9):
        push = size * np.array([1.0, 0.5, -1.0])
        tau = HELD.tau + tmt.mass_matrix(HELD.q) @ push
        t, q, _ = tmt.simulate(*HELD.start, tau, 5 / 64, 64, "rk4")
        assert leaving.predicted_leaving(HELD, push) == pytest.approx(departure(t, q), abs=5 / 64)
    assert leaving.predicted_leaving(CASES["bent, held"], 1e-9 * np.ones(3)) is None


def test_rounding_is_the_cause_only_of_what_rounding_can_do():
    may = leaving.allowed(HELD)
    assert 1e-13 < may < 1e-11
    for size, at, left, said in (
        (0.999 * may, 4.69, 4.69, ": the cause is rounding of the torque"),
        (1.001 * may, 4.69, 4.69, ": that is no rounding"),
        (0.5 * may, 4.69 + 2.4 * 5 / 64, 4.69, ": the cause is rounding of the torque"),
        (0.5 * may, 4.69 - 2.6 * 5 / 64, 4.69, ": rounding of the torque alone does not explain it"),
        (0.5 * may, None, 4.69, ": rounding of the torque alone does not explain it"),
        (9.0 * may, 0.1, None, ""),
    ):
        assert leaving.cause_in_words(HELD, size, may, at, left) == said


def test_what_is_said_of_a_held_arm_follows_its_numbers(engines):
    moon = engines | {"mujoco": parse(ARM.mjcf.read_text().replace("0 0 -9.81", "0 0 -1.62"), tmt.ARM)}
    earth, other = (leaving.causes_in_words(HELD, e, {"tmt": None, "mujoco": 4.69}) for e in (engines, moon))
    assert earth[0] == "The linear map of RK4 lets small deviations grow by up to e^7.5 per second."
    assert earth[1].startswith("TMT: ") and earth[1].endswith("it stays within 0.1 rad.")
    assert earth[2].endswith("it is 0.1 rad away at 4.69 s: the cause is rounding of the torque.")
    assert other[1] == earth[1] and other[2].endswith(": that is no rounding.") and "3.8e+01 rad/s2" in other[2]
    bent = CASES["bent, held"]
    still = leaving.causes_in_words(bent, engines, {"tmt": None, "mujoco": None})
    assert still[0].endswith("lets no small deviation grow.")
