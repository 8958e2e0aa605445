"""What is known of postures of the arm and of a step of each method, the same in runs."""

import dataclasses

import numpy as np
import pytest
from helpers.edited import setup_of_file
from models import PATHS

import tmt
from compare.engines.mujoco.engine import METHODS as OF_MUJOCO
from compare.engines.tmt import Tmt
from compare.experiments import stability
from compare.experiments.setup import Setup
from compare.experiments.stability import departure, limits
from compare.experiments.stability.subjects import MOST_POSTURES, subjects_of
from compare.robots.arm import ARM
from compare.stability.equilibrium import equilibrium

METHODS = Tmt().methods
BENT, BALL = equilibrium(ARM, "bent"), equilibrium(ARM, "ball catch")
SWING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody>{keys}</mujoco>"""
CART_POLE = """<mujoco><worldbody><body><joint name="rail" type="slide" axis="1 0 0" damping="1"/>
  <geom type="sphere" size="0.1" mass="1"/><body><joint name="pole" axis="0 1 0" damping="0.1"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("name, kind, rates", [
    ("zero", "marginal", [0.0, 0.0]), ("hanging", "centre", [10.995j, 4.975j, 4.867j]),
    ("upright", "saddle", [10.995, 4.975, 4.867]), ("ball catch", "saddle", [7.513, 5.300]),
    ("bent", "centre", [9.101j, 5.039j, 4.314j]),
])  # fmt: skip
def test_what_each_posture_is(name, kind, rates):
    at = equilibrium(ARM, name)
    values = at.modes[0]
    assert at.kind == kind and all(np.abs(values - rate).min() < 5e-4 for rate in rates)
    assert np.abs(values.sum()) < 1e-9  # undamped: they come in opposite pairs


def test_known_limits_of_undamped_modes_and_of_methods_that_are_stable_but_on_a_saddle():
    for name, limit in {"semi_implicit_euler": 2.0, "implicit": 2.0, "rk4": 2.0 * np.sqrt(2.0)}.items():
        kind, dt = BENT.limit(name)
        assert kind == "finite" and dt * np.abs(BENT.modes[0]).max() == pytest.approx(limit, rel=1e-6)
    for name in ("implicit_midpoint", "gauss_legendre_4"):
        assert BENT.limit(name) == ("never_fails", None) and BALL.limit(name) == ("always_fails", None)


def test_of_many_keyframes_the_first_are_looked_at():
    keys = "".join(f'<key name="k{i}" qpos="{0.3 * i}"/>' for i in range(9))
    seen = subjects_of(setup_of_file(SWING.format(keys=f"<keyframe>{keys}</keyframe>")).robot)
    assert tuple(seen.robot.postures) == tuple(f"k{i}" for i in range(MOST_POSTURES))
    body = setup_of_file(PATHS["free_body"]).robot
    assert not subjects_of(body).centres and equilibrium(body, "qpos0").sizes[3:].tolist() == [1.0, 1.0, 1.0]


def test_a_cart_with_a_pole_leaves_as_predicted_and_its_column_names_both_units(result):
    setup = setup_of_file(CART_POLE)
    robot, known = setup.robot, setup.engines
    rows = departure.departures(
        1 / 512, equilibrium(robot, "qpos0"), known, (known["mujoco"].methods["RK4"],)
    )
    assert "perturbation_m_or_rad" in rows[0].record() and "unit" not in rows[0].record()
    far = [row for row in rows if 1e-7 < row.perturbation < 1e-2]  # less is rounding, more is not linear
    departure.check_departures(result, far)
    assert len(far) == 2 and all(check.passed for check in result.checks)


def test_predicted_and_observed_limits_agree(engines):
    ours = [METHODS[scheme] for scheme in ("semi_implicit_euler", "implicit_midpoint")]
    rows = limits.limit_rows(BENT, engines, (*ours, OF_MUJOCO["RK4"]))
    kinds = ["finite", "never_fails", "finite"]
    assert [found.kind for found in rows] == [found.row.limit for found in rows] == kinds
    for row, *_ in (rows[0], rows[2]):
        assert row.observed_dt == pytest.approx(row.predicted_dt, rel=limits.LIMIT_TOLERANCE)
    # a forearm of another mass has another one
    heavy = equilibrium(dataclasses.replace(ARM, tree=dataclasses.replace(tmt.ARM, mass=(1.9, 1.65))), "bent")
    assert abs(rows[2].row.observed_dt / heavy.limit("rk4")[1] - 1.0) > 2.0 * limits.LIMIT_TOLERANCE
    # growth beyond the limit is slow with little damping: 100-fold in 2000 steps comes 6 % later
    ((row, kind, _),) = limits.limit_rows(
        equilibrium(ARM, "bent", 0.5), engines, (METHODS["explicit_euler"],)
    )
    assert kind == "finite" and row.observed_dt == pytest.approx(row.predicted_dt, rel=5e-4)


@pytest.mark.slow
def test_a_small_run_fills_every_table(small):
    small = small("stability")
    assert set(small.tables) == {"departure", "stability_claims"}
    notes = {note.kind: note.values.get("reproduced") for note in small.notes}
    assert [notes[f"claim_{k}"] for k in (1, 2, 3)] == [True, "yes", "bounded"]


@pytest.mark.parametrize("posture, without, drawn", [
    ("upright", "centres", ["stability_departure"]), ("hanging", "saddles", ["stability_limits"]),
])  # fmt: skip
def test_what_a_robot_lacks_is_left_out_with_a_reason(engines, posture, without, drawn):
    postures = {"one": ARM.postures[posture]}
    robot = dataclasses.replace(ARM, claims=None, kinds={}, scenes=(), postures=postures)
    result = stability.rows(Setup.quick(robot, engines))
    assert result.checks and all(check.passed for check in result.checks)
    (examined,) = (note.values for note in result.notes if note.kind == "examined")
    assert not examined[without]
    assert [figure()[0] for figure in stability.figures(result, robot)] == drawn
