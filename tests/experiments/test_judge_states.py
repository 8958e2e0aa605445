"""The states at which engines are compared, and how many of them a run of each size takes."""

import dataclasses

import numpy as np
from helpers.edited import setup_of_file

import tmt
from compare.experiments import derivatives
from compare.experiments import states as at_states
from compare.robots import states
from compare.robots.arm import ARM
from compare.run.examine import Setup


def test_the_states_are_spread_and_the_same_in_every_run(engines):
    first, again = (Setup(ARM, engines, states=500).random for _ in range(2))
    assert np.array_equal(first.q, again.q) and np.array_equal(first.tau, again.tau)
    assert np.abs(first.q).max() <= np.pi and np.ptp(first.q, axis=0).min() > 6.0
    assert np.ptp(first.qd, axis=0).min() > 19.0 and np.ptp(first.tau, axis=0).min() > 19.0
    named = Setup(ARM, engines).named
    assert named.exact_states == len(named.q) == 5 and np.abs(named.qd).min() > 0.0
    assert [named.describe(k) for k in range(5)] == list(ARM.postures)


def test_random_states_fill_the_ranges_of_joints_which_a_speed_passes_in_a_second():
    ranges = (-1.0, 2.0), None, (0.5, 0.75)
    robot = dataclasses.replace(ARM, ranges=ranges)
    widths = np.array([3.0, 2.0 * np.pi, 0.25])
    sample = states.random(robot, 500, 0)
    for spread in (np.ptp(sample.q, axis=0), np.ptp(sample.qd, axis=0) / 2.0):
        assert (spread <= widths).all() and (spread > 0.95 * widths).all()
    q = sample.q[:, [0, 2]]
    assert (q.min(axis=0) >= [-1.0, 0.5]).all() and (q.max(axis=0) <= [2.0, 0.75]).all()
    torques = states.largest_speeds_and_torques(robot)[1]
    assert np.allclose(torques, 10.0 * np.diag(tmt.mass_matrix(tmt.ARM, np.zeros(3))), rtol=1e-12)


def larger(joints):
    """The arm with this many times its joints and bodies, one chain."""
    tree, n = ARM.tree, 3 * joints
    repeated = ("offset", "axis", "damping", "mass", "com", "inertia")
    many = {name: getattr(tree, name) * joints for name in repeated}
    names = {"joint_names": [f"h{i}" for i in range(n)], "body_names": [f"b{i}" for i in range(2 * joints)]}
    many |= {"parent": range(-1, n - 1), "body_joint": [3 * k + i for k in range(joints) for i in (1, 2)]}
    rest = dict.fromkeys(("kind", "armature", "stiffness", "rest", "reference"), ())
    postures = {f"p{i}": (float(i),) * n for i in range(4)}
    tree = dataclasses.replace(tree, **many, **names, **rest)
    return dataclasses.replace(ARM, tree=tree, postures=postures)


def test_a_large_robot_gets_fewer_states_with_a_note():
    assert states.random(ARM, 10, 7).notes == () and states.random(ARM, 10, 7).exact_states == 7
    robot = larger(9)  # 27 joints, 18 bodies
    assert states.named(robot).exact_states == 4 and states.random(robot, 100, 50).exact_states == 50
    giant = larger(states.MOST_SPEEDS // 3 + 1)
    assert states.named(giant).exact_states == 0
    some = states.random(giant, 10_000, 5)
    assert some.exact_states == 0 and len(some.notes) == 2
    assert states.random(giant, 10, 5).notes == some.notes[1:]
    numbers = 3 * len(giant.tree.mass) * giant.coordinates.nv
    assert len(some.q) * numbers <= states.MOST_NUMBERS < (len(some.q) + 1) * numbers


GIMBAL = """<mujoco><worldbody><body><joint name="yaw" axis="0 0 1"/><joint name="tilt" axis="1 0 0"/>
<joint name="roll" axis="0 0 1"/><inertial pos="0 0.1 0.2" mass="1" diaginertia="0.01 0.02 0.03"/></body></worldbody></mujoco>"""


def test_at_positions_where_mbar_is_singular_accelerations_are_not_judged():
    """Of a gimbal whose outer and inner axes are the same at zero; everywhere else it agrees."""
    setup = setup_of_file(GIMBAL)
    for result in (at_states.rows("acceleration", setup), derivatives.rows(setup)):
        (check,) = [check for check in result.checks if not check.passed]
        assert not check.judged and "'yaw', 'roll'" in check.note
    assert at_states.rows("acceleration", setup).rows
