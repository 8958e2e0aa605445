"""What is said of runs follows their numbers."""

import dataclasses

from trajectory_curves import CASES, FREE, HELD, run_of

from compare.experiments.trajectory import claim, sentences, tolerance
from compare.robots.arm import ARM


def test_what_is_said_of_a_claim_follows_the_run(engines):
    said = sentences.of_held(HELD, engines, run_of(HELD, 0.25, 0.5, left=(3.0, None)))
    assert said.startswith("Claim: held at ball catch") and " Here, under TMT's torque, in 5 s TMT's arm is 0.1" in said
    assert "in 5 s TMT's arm is 0.1 rad away at 3.00 s, MuJoCo's stays within 0.1 rad" in said
    assert "the farthest is TMT's 2.5e-01 rad and MuJoCo's 5.0e-01 rad" in said


def test_of_a_robot_without_claims_none_is_told(engines):
    robot = dataclasses.replace(ARM, name="crane", claims=None)
    case = next(case for case in robot.cases if case.name == HELD.name)
    said = sentences.of_held(case, engines, run_of(HELD))
    assert said.startswith(
        "Ball catch, held, under TMT's torque, in 5 s TMT's crane stays within 0.1 rad, MuJoCo's stays"
    )
    assert "alone the crane would" in said and "arm" not in said and "laim" not in said
    assert "RK4 is the classical one" in claim(robot) and "RK4 is the assignment's" in claim(ARM)
    assert "the stated crane's whole potential range" in tolerance(robot)


def test_what_is_said_of_errors_and_agreement_follows_the_numbers():
    runs = {("ball catch, held", "rk4", 64): run_of(HELD, 0.25, 0.26, until=2.5)}
    for ours, far in ((0.49, False), (0.51, True)):
        first, second = sentences.of_errors(runs, {"ball catch, held": (ours, 0.1)}, CASES)
        assert (
            f"ball catch, held (true: rest): TMT {ours:.1e} rad, MuJoCo 1.0e-01 rad, apart 5.0e-03 rad in the 2.50 s"
            in first
        )
        assert ("these scenes: ball catch, held." in second) == far and ("In none of these scenes" in second) == (
            not far
        )
    first, second = sentences.of_errors(runs, {"ball catch, held": (0.1, None)}, CASES)
    assert (
        "MuJoCo no number (it diverged)" in first and "In none" in second and sentences.of_errors(runs, {}, CASES) == []
    )


def test_steps_are_told_where_all_scenes_have_as_many():
    finer = HELD.changed(name="finer", dt=5 / 128)
    runs = {("ball catch, held", "rk4", 64): run_of(HELD), ("finer", "rk4", 128): run_of(HELD)}
    cases = {HELD.name: HELD, "finer": finer}
    for names, said in ((["finer"], "of 128 steps"), (cases, "of the coarsest steps")):
        assert said in sentences.of_errors(runs, dict.fromkeys(names, (0.1, 0.1)), cases)[0]
    of_order_1 = {
        (name, "implicit", steps): run_of(FREE, until=1.0) for name, steps in ((FREE.name, 64), ("finer", 128))
    }
    free = {FREE.name: FREE, "finer": FREE.changed(name="finer", dt=5 / 128)}
    assert sentences.of_first_order(of_order_1, free)[0].startswith("Order 1 at the coarsest step. ")


def test_what_is_said_of_order_1_follows_the_numbers():
    euler, implicit = (
        (name, scheme, 64) for name, scheme in (("bent, free", "semi_implicit_euler"), ("bent, free", "implicit"))
    )
    runs = {euler: run_of(FREE) | {"integrator": "Euler"}, implicit: run_of(FREE, until=0.3125, ended=(0.5, None))}
    (said,) = sentences.of_first_order(runs, CASES)
    assert (
        "is 0.31 s (bent, free, RK4). bent, free, RK4: judged for 0.31 s, diverges: TMT at 0.50 s, MuJoCo never."
        in said
    )
    (said,) = sentences.of_first_order({euler: runs[euler]}, CASES)
    assert "judged all along" in said and sentences.of_first_order({}, CASES) == []
    (said,) = sentences.of_first_order({implicit: run_of(FREE, until=3.0)}, CASES)
    assert "judged for 3.00 s, nothing diverges" in said


def test_what_is_left_out_is_said():
    fine = FREE.changed(name="fine", dt=5 / 1024)
    (said,) = sentences.of_left_out([FREE, fine], (1, 16, 128))
    assert said == "Runs of more than 8192 steps, finer than a scene's own, are left out: fine."
    assert sentences.of_left_out([FREE], (1, 16, 128)) == sentences.of_left_out([fine], (1,)) == []
