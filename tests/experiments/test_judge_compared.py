"""Each quantity is compared with what the other engine and the compiled code say of it: one that is off fails its own checks."""

from types import SimpleNamespace

import numpy as np
import pytest
from edited import setup_of

import tmt
from compare.core.check import Result
from compare.experiments import acceleration, gravity, kinematics, mass
from compare.experiments.quantities import QUANTITIES, check_wide
from compare.run.examine import Setup
from tmt import literal

OF_MUJOCO = [  # the experiment, what is off (of a pair which), the checks of both engines that fail
    (kinematics, "com_positions", {}, {"x_b"}), (kinematics, "angular_velocities", {}, {"omega_b"}),
    (kinematics, "jacobians", {"place": 0}, {"T_b"}), (kinematics, "jacobians", {"place": 1}, {"B_b"}),
    (kinematics, "convective_terms", {"place": 0}, {"v_conv"}),
    (kinematics, "convective_terms", {"place": 1}, {"w_conv"}), (mass, "mass_matrix", {}, {"Mbar"}),
    (gravity, "gravity_balance", {}, {"holding torque"}), (acceleration, "bias", {}, {"bias"}),
    (acceleration, "acceleration", {}, {"qdd", "tau from MuJoCo's qdd by TMT", "dE/dt - tau.qd at MuJoCo's qdd"}),
    (acceleration, "inverse", {}, {"tau from TMT's qdd by mj_inverse"}),
    (acceleration, "energy", {}, {"energy"}), (acceleration, "potential_energy", {}, {"potential energy"}),
]  # fmt: skip
EXPERIMENTS = [kinematics, mass, gravity, acceleration]


def off(values, place=None):
    """Values that are a little off; of a pair only the one at the place, or both."""
    if isinstance(values, tuple):
        return tuple(off(part) if place in (None, k) else part for k, part in enumerate(values))
    return values * (1 + 1e-6) + 1e-6


class Off:
    """MuJoCo, or its dynamics of a case, that gives one quantity a little off."""

    name = "mujoco"

    def __init__(self, right, quantity, place=None):
        self.right, self.changed = right, (quantity, place)

    def of(self, case):
        return Off(self.right.of(case), *self.changed)

    def __getattr__(self, name):
        given, (quantity, place) = getattr(self.right, name), self.changed
        return given if name != quantity else lambda *states: off(given(*states), place)


def failing(experiment, mujoco) -> set:
    """The quantities whose comparison of both engines fails."""
    result = experiment.rows(setup_of(mujoco, make=Setup, states=10, exact_states=0, size="small"))
    failed = [check.quantity for check in result.checks if not check.passed]
    return {quantity for quantity in failed if not quantity.endswith("to exact")}


@pytest.mark.parametrize("experiment, quantity, which, expected", OF_MUJOCO)
def test_a_quantity_of_mujoco_that_is_off_fails_its_own_checks(mujoco, experiment, quantity, which, expected):
    compiled = {f"{name}, compiled" for name in expected & QUANTITIES.keys()}
    assert failing(experiment, Off(mujoco, quantity, **which)) == expected | compiled


def test_a_mass_matrix_of_mujoco_that_is_not_definite_fails_its_own_check(mujoco, monkeypatch):
    monkeypatch.setitem(globals(), "off", lambda values, place: -values)
    (definiteness,) = failing(mass, Off(mujoco, "mass_matrix")) - {"Mbar", "Mbar, compiled"}
    assert definiteness.startswith("MuJoCo: least eigenvalue")


def test_a_joint_whose_accelerations_are_all_smaller_than_their_tolerance_is_not_judged(setup):
    """At all states together: 3 rad/s2 of alpha, 1 rad/s2 of beta, whose least tolerance is just below or above; gamma rests."""
    sizes, robot = [np.array([[3.0, 0.5, 0.0]]), np.array([[2.0, np.nan, 0.0], [0.0, 1.0, 0.0]])], setup.robot
    for least, judged in ((0.999, True), (1.001, False)):
        scales = [np.array([[4.0, 2.0, 1.0]]), np.array([[2.999, 3.0, 1.0], [9.0, least, 1.0]])]
        result, comparisons = Result("acceleration"), []
        for size, scale in zip(sizes, scales):
            of = {"robot": robot, "values": lambda name, size=size: [size, -size, None]}
            comparisons.append(SimpleNamespace(acceleration_scale=scale / (64 * 2.0**-52), **of))
        check_wide(result, comparisons)
        said = [("beta" in check.note, check.judged) for check in result.checks]
        assert said == [(True, False)] * (not judged)


def test_accelerations_of_tmt_that_are_off_fail_their_own_checks(mujoco, monkeypatch):
    right = literal.acceleration
    monkeypatch.setattr(literal, "acceleration", lambda *states, **named: off(right(*states, **named)))
    expected = {"qdd", "tau from TMT's qdd by mj_inverse", "dE/dt - tau.qd at TMT's qdd"}
    assert failing(acceleration, mujoco) == expected


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda module: module.__name__.rpartition(".")[2])
def test_an_error_of_the_compiled_functions_alone_fails_their_own_check(mujoco, experiment, monkeypatch):
    assert failing(experiment, mujoco) == set()
    checks = {(quantity, name) for of, quantity, _, names in OF_MUJOCO if of is experiment
              for name in names & QUANTITIES.keys()}  # fmt: skip
    for quantity in dict(checks):
        right = getattr(tmt, quantity)
        monkeypatch.setattr(tmt, quantity, lambda *given, right=right, **named: off(right(*given, **named)))
    assert failing(experiment, mujoco) == {f"{name}, compiled" for _, name in checks}
