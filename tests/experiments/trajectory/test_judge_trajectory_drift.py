"""Drift of what should be constant: orders, shares, and which quantities are constant."""

import dataclasses

import numpy as np
import pytest
from trajectory_curves import CASES

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS
from compare.experiments.trajectory import drift
from compare.experiments.trajectory.figures_drift import draw_drift as draw
from compare.experiments.trajectory.figures_drift import drift_caption
from compare.judge.check import Result
from compare.robots.arm import ARM


def drifts(order=1.0, euler=1.0, share=1e-4, engine="tmt") -> dict:
    """Drifts of one scene; MuJoCo's or TMT's falls at another order, or RK4's is another share of Euler's."""
    good = {METHODS["Euler"]: [4.0, 2.0, 1.0], METHODS["RK4"]: [256e-5, 16e-5, 1e-5]}
    made = {method: {name: list(values) for name in ("tmt", "mujoco")} for method, values in good.items()}
    made[METHODS["Euler"]][engine] = [4.0, 2.0**order * euler, euler]
    made[METHODS["RK4"]][engine] = [256 * share, 16 * share, share]
    return {("bent, free", "energy", "J"): made}


@pytest.mark.parametrize("engine, label", [("tmt", "TMT"), ("mujoco", "MuJoCo")])
def test_drift_falls_at_the_order_of_the_scheme_and_rk4s_is_far_below_that_of_euler(engine, label):
    order = f"order of the drift of energy, from 1 bent, free, Euler, {label}, 1 s"
    share = f"drift of energy over that of Euler bent, free, RK4, {label}, 1 s"
    for made, failed in (
        ({}, set()), ({"order": 1.149}, set()), ({"order": 1.151}, {order}), ({"order": 0.849}, {order}),
        ({"order": 0.851}, set()),
        ({"share": 0.999e-3}, set()), ({"share": 1.001e-3}, {share}),
        ({"euler": np.nan}, {order, share}), ({"euler": 0.0}, {order, share}),
    ):  # fmt: skip
        result = Result("trajectory")
        drift.check_drifts(result, drifts(engine=engine, **made), {})
        assert len(result.checks) == 6
        assert {f"{check.quantity} {check.scene}" for check in result.checks if not check.passed} == failed


def test_an_engine_that_does_not_drift_is_named(engines):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    rests = parse(ARM.mjcf.read_text().replace("0 0 -9.81", "0 0 0"), tmt.ARM)
    result = Result("trajectory")
    drift.measure_drift(result, ARM, engines | {"mujoco": rests}, {1: (32, 64), 4: (32, 64)})
    for name in ("Euler", "RK4"):
        of = result.curves["drift"]["drifts"]["bent, free", "energy", "J"][METHODS[name]]
        assert of["mujoco"] == [0.0, 0.0] and min(of["tmt"]) > 0.0
    quantities = [(scene, quantity) for scene, quantity, _ in result.curves["drift"]["drifts"]]
    assert ("bent, damped", "energy") not in quantities and ("bent, held", "energy") not in quantities
    assert [scene for scene, quantity in quantities if quantity == "alpha-momentum"] == ["thrown, no gravity"]


def test_momentum_about_the_first_hinge_is_constant_where_nothing_turns_the_arm():
    case = CASES["thrown, no gravity"]
    (_, energy), (_, momentum) = drift.constants(case).items()
    _, q, v = tmt.simulate(*case.start, case.tau, 1 / 4096, 2048, "rk4", case.tree)
    assert np.ptp(momentum(q, v)) < 1e-9 < abs(momentum(q, v)[0]) and np.ptp(energy(q, v)) < 1e-8
    assert ("alpha-momentum", "N m s") not in drift.constants(case.changed(speed=(), locked=("alpha",)))


def test_a_robot_without_a_free_scene_has_no_drift_and_the_notes_say_so(engines):
    still, result = dataclasses.replace(ARM, scenes=(CASES["bent, held"].scene,)), Result("trajectory")
    drift.measure_drift(result, still, engines, drift.FEW_DRIFT_STEPS)
    assert result.checks == [] and result.curves["drift"]["drifts"] == {}
    assert result.notes == ["No scene of this arm is free and without damping: there is no drift to measure."]


def test_the_figure_of_drift_says_whose_drift_falls_how():
    made = drifts()
    of = made["bent, free", "energy", "J"]
    of[METHODS["implicit"]] = {"tmt": [8.0, 4.0, 2.0], "mujoco": [16.0, 4.0, 1.0]}
    steps = {method: drift.DRIFT_STEPS[method.order] for method in of}
    result = Result("trajectory", curves={"drift": {"drifts": made, "steps": steps}})
    name, fig, caption = draw(result)
    assert name == "trajectory_drift" and "implicit: TMT 1.00 to 1.00, MuJoCo 2.00 to 2.00" in caption
    assert "implicit at dt = 1/8192 s: TMT 2.0e+00 J, MuJoCo 1.0e+00 J" in caption
    assert "MuJoCo's drift over TMT's: 0.1 to 2." in caption
    lines = {line.get_label(): line for line in fig.axes[0].lines}
    assert lines["implicit, TMT"].get_ydata().tolist() == [8.0, 4.0, 2.0]
    assert [line.get_ydata().tolist() for line in fig.axes[0].lines if line.get_marker() == "D"] == [[16.0, 4.0, 1.0]]
    for engine in ("tmt", "mujoco"):  # nothing moves: no order, no ratio, and no error
        for values in of.values():
            values[engine] = [0.0, 0.0, 0.0]
    assert "TMT no number, MuJoCo no number" in drift_caption(made, steps)
