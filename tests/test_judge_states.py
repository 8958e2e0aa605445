"""The states at which engines are compared, and how many of them a run of each size takes."""

import dataclasses

import numpy as np

from compare.experiment import Setup
from compare.robots.arm import ARM


def test_the_states_are_spread_and_the_same_in_every_run(engines):
    first, again = (Setup(ARM, engines, states=500).random for _ in range(2))
    assert np.array_equal(first.q, again.q) and np.array_equal(first.tau, again.tau)
    assert np.abs(first.q).max() <= np.pi and np.ptp(first.q, axis=0).min() > 6.0
    assert np.ptp(first.qd, axis=0).min() > 19.0 and np.ptp(first.tau, axis=0).min() > 19.0
    assert not np.array_equal(first.qd, first.tau)
    named = Setup(ARM, engines).named
    assert named.exact_states == len(named.q) == 5 and np.abs(named.qd).min() > 0.0
    assert [named.describe(k) for k in range(5)] == list(ARM.postures) == [single.name for single in named.each()]


def test_sizes_of_a_run(engines):
    full, quick, small = (make(ARM, engines) for make in (Setup, Setup.quick, Setup.small))
    assert [s.of("f", "q", "s") for s in (full, quick, small)] == ["f", "q", "s"]
    assert (full.states, full.exact_states, full.finer) == (10_000, 200, (1, 16, 128))
    assert full.is_quick is small.is_quick is False and quick.is_quick is True


def test_a_robot_without_postures_is_looked_at_where_all_its_joints_are_at_zero(engines):
    bare = dataclasses.replace(ARM, postures={}, scenes=())
    named = Setup(bare, engines).named
    assert (named.name, named.states, named.q.tolist()) == ("a posture", ("all joints at zero",), [[0.0, 0.0, 0.0]])
