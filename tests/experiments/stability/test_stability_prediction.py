"""What is known of held postures and of one step of each method, without a run."""

import dataclasses

import numpy as np
import pytest

from compare.robots.arm import ARM
from compare.truth.linear import held
from compare.truth.postures import all_of_kind, kinds, of_kind
from compare.truth.steps import region

BENT, BALL = held(ARM, "bent"), held(ARM, "ball catch")


@pytest.mark.parametrize(
    "name, kind, rates",
    [
        ("zero", "marginal", [0.0, 0.0]),
        ("hanging", "centre", [10.995j, 4.975j, 4.867j]),
        ("upright", "saddle", [10.995, 4.975, 4.867]),
        ("ball catch", "saddle", [7.513, 5.300]),
        ("bent", "centre", [9.101j, 5.039j, 4.314j]),
    ],
)
def test_what_each_posture_is(name, kind, rates):
    at = held(ARM, name)
    assert at.kind == kind
    values = at.modes[0]
    for rate in rates:
        assert np.abs(values - rate).min() < 5e-4
    assert np.abs(values.sum()) < 1e-9  # undamped: they come in opposite pairs


def test_the_posture_that_stands_for_a_kind_is_the_robots_choice_or_the_first():
    assert all_of_kind(ARM, "centre") == ("bent", "hanging")
    assert all_of_kind(ARM, "saddle") == ("ball catch", "upright")
    other = dataclasses.replace(
        ARM, kinds={}, postures={name: ARM.postures[name] for name in ("upright", "ball catch")}
    )
    assert all_of_kind(other, "saddle") == ("upright", "ball catch")
    assert of_kind(other, "centre") is None and all_of_kind(other, "centre") == ()


def test_without_gravity_every_posture_is_marginal():
    floating = dataclasses.replace(ARM, tree=dataclasses.replace(ARM.tree, gravity=(0.0, 0.0, 0.0)))
    assert set(kinds(floating).values()) == {"marginal"}


@pytest.mark.parametrize(
    "name, imaginary, real",
    [
        ("semi_implicit_euler", 2.0, None),
        ("implicit", 2.0, None),
        ("rk4", 2.0 * np.sqrt(2.0), 2.785294),
        ("explicit_euler", 0.0, 2.0),
        ("implicit_midpoint", None, None),
        ("gauss_legendre_4", None, None),
    ],
)
def test_known_limits_on_the_axes(name, imaginary, real):
    beyond = np.linspace(1e-3, 20.0, 400)
    if imaginary is None:
        assert region(name, 1j * beyond).max() < 1.0 + 1e-12
    else:
        below, above = region(name, 1j * (imaginary + np.array([-1e-4, 1e-4])))
        assert above > 1.0 + 1e-9 and (below < 1.0 + 1e-12 or imaginary == 0.0)
    if real is None and imaginary is None:
        assert region(name, -beyond + 0j).max() < 1.0
    elif real is not None:
        assert region(name, np.array([-real + 1e-5 + 0j])) < 1.0 < region(name, np.array([-real - 1e-5 + 0j]))


@pytest.mark.parametrize("at", [BENT, held(ARM, "hanging")], ids=lambda at: at.name)
@pytest.mark.parametrize("name, swing", [("rk4", 2.0 * np.sqrt(2.0)), ("semi_implicit_euler", 2.0), ("implicit", 2.0)])
def test_limit_of_the_arm_is_that_of_its_fastest_mode(at, name, swing):
    kind, dt = at.limit(name)
    assert kind == "finite" and dt * np.abs(at.modes[0]).max() == pytest.approx(swing, rel=1e-6)


def test_damped_rk4_meets_its_real_limit_at_the_stiffest_mode():
    at = held(ARM, "bent", 50.0)
    kind, dt = at.limit("rk4")
    assert kind == "finite" and dt * np.abs(at.modes[0]).max() == pytest.approx(2.785294, rel=1e-6)


@pytest.mark.parametrize("name", ["implicit_midpoint", "gauss_legendre_4"])
def test_a_stable_methods_have_no_limit_but_on_a_saddle(name):
    assert BENT.limit(name) == ("never_fails", None)
    assert BALL.limit(name) == ("always_fails", None)


def test_explicit_euler_fails_on_a_centre_at_every_step():
    assert BENT.limit("explicit_euler") == ("always_fails", None)
