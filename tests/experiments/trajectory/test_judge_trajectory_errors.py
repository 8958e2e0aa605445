"""How far runs are from the true motion."""

import numpy as np
import pytest
from trajectory_curves import CASES, FREE, HELD, run_of

import tmt
from compare.experiments.trajectory import errors
from compare.judge.check import Result
from compare.robots.arm import ARM


def test_the_error_of_a_held_scene_is_its_distance_from_the_start():
    result = Result("trajectory", curves={"runs": {
        ("ball catch, held", "rk4", 64): run_of(HELD, 0.25, np.nan), ("ball catch, held", "rk4", 128): run_of(HELD, 9.0, 9.0),
        ("ball catch, held", "implicit", 64): run_of(HELD, 9.0, 9.0), ("bent, free", "rk4", 64): run_of(FREE, 9.0, 9.0),
    }})  # fmt: skip
    assert errors.errors_when_held(result, ARM) == {"ball catch, held": (0.25, None)}


def test_the_error_of_a_free_scene_is_its_distance_from_many_digits():
    runs = {}
    for name in ("zero, free", "ball catch, free", "bent, free"):
        case = CASES[name]
        path = tmt.simulate(*case.start, case.tau, 5 / 64, 64, "rk4", case.tree).q
        runs[name, "rk4", 64] = run_of(case) | {"tmt": [path, path], "mujoco": [path + 100.0, path]}
    of_runs = errors.errors_when_free(Result("trajectory", curves={"runs": runs}), ARM)
    found = {name: ours for name, (ours, _) in of_runs.items()}
    assert found == pytest.approx({"zero, free": 1.6, "ball catch, free": 10.2, "bent, free": 0.27}, rel=0.03)
    assert all(theirs > 90.0 for _, theirs in of_runs.values())
