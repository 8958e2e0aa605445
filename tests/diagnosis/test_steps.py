"""What explains single steps."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import states

import tmt
from compare.diagnosis.steps import Altered, Steps, diagnose_steps, stepped_once, tolerance_of_step
from compare.engines.mujoco import load
from compare.robots.arm import ARM
from tmt.methods import method_named

DAMPED = replace(tmt.ARM, damping=(0.5, 0.2, 0.1))
DT = 0.01
Q, QD = states(DAMPED, count=12)
TAU = np.random.default_rng(1).uniform(-5.0, 5.0, QD.shape)


def steps(method, dt=DT):
    method = method_named(method) if isinstance(method, str) else method
    after = stepped_once(method, DAMPED, Steps(Q, QD, TAU, DT, Q, QD), dt)
    return Steps(Q, QD, TAU, DT, after[:, :3], after[:, 3:])


@pytest.mark.parametrize("scheme", ["rk4", "semi_implicit_euler", "implicit", "explicit_euler"])
def test_a_right_scheme_leaves_nothing(scheme):
    assert diagnose_steps(DAMPED, steps(scheme), scheme) == (0.0, ())


CASES = {
    "scheme: rk4 in place of semi_implicit_euler": ("rk4", DT, "semi_implicit_euler"),
    "scheme: semi_implicit_euler in place of implicit": ("semi_implicit_euler", DT, "implicit"),
    "dt: 0.02 s in place of 0.01": ("rk4", 0.02, "rk4"),
    "derivative of the bias in the implicit step: enters with the wrong sign": (Altered(True, of_bias=-1.0), DT, "implicit"),
    "damping in the implicit step: explicit": (Altered(False, of_damping=0.0), DT, "semi_implicit_euler"),
    "scheme: explicit_euler in place of semi_implicit_euler and dt: 0.005 s in place of 0.01": (
        "explicit_euler", 0.005, "semi_implicit_euler",
    ),
}  # fmt: skip


@pytest.mark.parametrize("text, how", CASES.items(), ids=CASES)
def test_what_is_wrong_is_named(text, how):
    method, dt, said = how
    ratio, (cause,) = diagnose_steps(DAMPED, steps(method, dt), said)
    assert ratio > 1e3 and cause.text == text and cause.left_over < 1e-6
    assert cause.rank == (3 if " and dt" in text else 1 if text.startswith("scheme") else 2)


def test_noise_has_no_culprit():
    right = steps("rk4")
    noisy = right._replace(after_qd=right.after_qd + 1e-6 * np.random.default_rng(0).normal(size=QD.shape))
    ratio, causes = diagnose_steps(DAMPED, noisy, "rk4")
    assert ratio > 1.0 and causes == ()


@pytest.mark.parametrize("share, differs", [(0.99, False), (1.01, True)])
def test_a_step_differs_beyond_its_tolerance(share, differs):
    right = steps("rk4")
    allowed = tolerance_of_step(DAMPED, right)
    moved = right.after_qd.copy()
    moved[4, 1] += share * allowed[4, 4]
    ratio, _ = diagnose_steps(DAMPED, right._replace(after_qd=moved), "rk4")
    assert (ratio > 1.0) is differs


def test_mujocos_integrators_are_what_they_are_said_to_be():
    mujoco = load(ARM.mjcf, ARM.tree)
    case = ARM.case("damped", damping=0.5)
    dynamics = mujoco.of(case)
    for name, method in mujoco.methods.items():
        motion = dynamics.run(Q, QD, TAU, DT, 1, name)
        ratio, _ = diagnose_steps(case.tree, Steps(Q, QD, TAU, DT, motion.q[:, 1], motion.v[:, 1]), method.scheme)
        assert ratio < 0.2
