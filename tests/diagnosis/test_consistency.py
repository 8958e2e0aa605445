"""Conditions on Mbar and h that need no reference."""

from dataclasses import replace

import numpy as np
import pytest
from models import PATHS

import tmt
from compare.diagnosis.consistency import STEP, conditions
from compare.engines.mujoco import reading
from compare.judge.scale import EPS, FACTOR
from compare.robots.coordinates import Coordinates

ARM = tmt.ARM
HEAVY, SKEW = replace(ARM, mass=(2.0, 1.5)), 1e-6 * np.outer(*np.eye(3)[:2])
READ = [reading.read(PATHS[name]).tree for name in ("gripper", "free_body")]
SYMMETRIC, DEFINITE, GRADIENT, EVEN, QUADRATIC, POWER = range(6)  # in the order in which they are asked


def asked(mass_matrix=tmt.mass_matrix, bias=tmt.bias, tree=ARM):
    coordinates, rng = Coordinates(tree.joint_names, tree.kind), np.random.default_rng(0)
    q = coordinates.move(np.tile(tree.zero, (12, 1)), rng.uniform(-2.0, 2.0, (12, coordinates.nv)))
    return conditions(mass_matrix, bias, coordinates, q, rng.uniform(-3.0, 3.0, (12, coordinates.nv)))


@pytest.mark.parametrize("tree", [ARM, *READ])
def test_right_equations_meet_all(tree):
    found = asked(lambda q: tmt.mass_matrix(q, tree), lambda q, qd: tmt.bias(q, qd, tree), tree)
    assert all(one.is_met for one in found) and len(found) >= 5
    assert all(one.value < 0.5 * one.tolerance for one in found if one.rule == "at most")


def single(quantity):
    """As it is in single precision."""
    return lambda *states: quantity(*states).astype(np.float32).astype(float)


FAULTS = {  # of an M that is not symmetric the power is not asked
    "not symmetric": (lambda q: tmt.mass_matrix(q) + SKEW, tmt.bias, [SYMMETRIC]),
    "not definite": (lambda q: tmt.mass_matrix(q) - 0.1 * np.eye(3), tmt.bias, [DEFINITE]),
    "no gradient": (tmt.mass_matrix, lambda q, qd: tmt.bias(q, qd) + 1e-5 * q[:, 1:2] * [1, 0, 0], [GRADIENT]),
    "damping": (tmt.mass_matrix, lambda q, qd: tmt.bias(q, qd) + 1e-9 * qd, [EVEN]),
    "cubic": (tmt.mass_matrix, lambda q, qd: tmt.bias(q, qd) + 1e-6 * qd**4, [QUADRATIC, POWER]),
    "another mass": (tmt.mass_matrix, lambda q, qd: tmt.bias(q, qd, HEAVY), [POWER]),
    "single precision, which is not blamed": (single(tmt.mass_matrix), single(tmt.bias), []),
}  # fmt: skip


@pytest.mark.parametrize("mass_matrix, bias, expected", FAULTS.values(), ids=FAULTS)
def test_each_condition_is_broken_by_its_fault(mass_matrix, bias, expected):
    found = asked(mass_matrix, bias)
    assert [k for k, condition in enumerate(found) if not condition.is_met] == expected


@pytest.mark.parametrize("share, is_met", [(0.97, True), (1.03, False)])
def test_the_power_is_that_of_M_to_the_rounding_of_its_difference_quotient(share, is_met):
    """Of a constant M: (1 + 0.5)^2 times 64 eps of its largest entry over the step; a power of h of that size is just beyond."""
    allowed, qd = 1.5**2 * FACTOR * EPS * 2.0 / STEP, np.array([[1.0, 0.5]])
    of_slides = Coordinates(("x", "y"), ("slide", "slide"))
    *_, power = conditions(
        lambda q: np.tile(np.diag([2.0, 1.0]), (len(q), 1, 1)), lambda q, qd: share * allowed * qd**2 * [1.0, 0.0],
        of_slides, np.zeros((1, 2)), qd,
    )  # fmt: skip
    assert power.unit == "W" and power.is_met is is_met
    assert power.tolerance == pytest.approx(allowed, rel=1e-6)
