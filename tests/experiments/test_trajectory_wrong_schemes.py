"""A method of tmt that is not MuJoCo's scheme leaves the band of rounding, also where servos act."""

import copy
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.edited import setup_of_file
from helpers.trajectory_curves import CASES
from models import PATHS

from compare.engines.own import Own
from compare.experiments.trajectory import cases_left_out
from compare.experiments.trajectory.runs import compare_case
from compare.judge.scale import EPS
from compare.robots.case import Case, Scene
from tmt.compiled import store
from tmt.compiled.machine import Library
from tmt.compiled.runner import cached_runner as compiled_runs
from tmt.methods import METHODS, SemiImplicitEuler, semi_implicit

STEPS = {"one step", "open loop"}
GEARED = PATHS["gripper"].read_text(encoding="utf-8").replace('kp="60" kv="6"', 'kp="6" kv="0.6" gear="3"')
FOR = {"duration": 1 / 16, "dt": 1 / 256, "judged": 1 / 16}
SHORT = Scene("step", "open", "servos", targets=(6.0, 6.0, 0.02, 0.02), **FOR)


def failing(case, engines, *integrators) -> set:
    """(integrator, level) of the checks that fail; of these integrators, or of all."""
    mujoco, known = copy.copy(engines["mujoco"]), engines["mujoco"].methods_in(case)
    mujoco.methods_in = lambda _: {name: known[name] for name in integrators or known}
    checks = compare_case(case, engines | {"mujoco": mujoco}, (1,)).checks
    named = [(check.scene.split(", ")[-2], *check.quantity.split(", "), check.passed) for check in checks]
    compared = [(integrator, level, passed) for integrator, level, *_, passed in named if level in STEPS]
    assert {level for _, level, _ in compared} == STEPS
    return {(integrator, level) for integrator, level, passed in compared if not passed}


@dataclasses.dataclass(frozen=True)
class ExplicitDamping(SemiImplicitEuler):
    def stiffness_and_damping(self, tree):
        return SemiImplicitEuler.stiffness_and_damping(
            self, dataclasses.replace(tree, damping=(0.0, 0.0, 0.0))
        )


HASTY = METHODS["rk4"].b + 1e6 * EPS * np.array([1.0, 0.0, 0.0, -1.0])
NO_BIAS, EVERY_GAIN = SemiImplicitEuler(implicit_bias=False), SemiImplicitEuler(False, implicit_gains=True)
WRONG_SCHEMES = {
    "damping explicit": ("semi_implicit_euler", ExplicitDamping(False), "bent, damped", "Euler"),
    "derivative of the bias dropped": ("implicit", NO_BIAS, "bent, free", "implicit"),
    "weights off by 1e6 ulp": ("rk4", dataclasses.replace(METHODS["rk4"], b=HASTY), "bent, free", "RK4"),
}


@pytest.mark.parametrize("scheme, wrong, scene, integrator", WRONG_SCHEMES.values(), ids=WRONG_SCHEMES)
def test_a_wrong_scheme_leaves_the_band(scheme, wrong, scene, integrator, engines, monkeypatch):
    assert failing(CASES[scene], engines, integrator) == set()
    monkeypatch.setitem(METHODS, scheme, wrong)
    assert failing(CASES[scene], engines, integrator) >= {(integrator, level) for level in STEPS}


@pytest.fixture(scope="module")
def gripper():
    """A case of its servos, and the engines; its tendon pulls two fingers, its first servo has a gear."""
    setup = setup_of_file(GEARED)
    return Case(setup.robot, SHORT), setup.engines


def test_every_integrator_is_its_scheme_in_a_step(gripper):
    assert failing(*gripper) == set()


@pytest.mark.slow
def test_every_integrator_is_its_scheme_where_servos_hold_a_free_body():
    setup = setup_of_file(PATHS["quadruped"])
    assert failing(setup.robot.cases[-1].changed(**FOR), setup.engines) == set()


WRONG_GAINS = {
    "velocity gains implicit": (METHODS, "semi_implicit_euler", EVERY_GAIN, "Euler"),
    "a tendon's cross term": (vars(semi_implicit), "on_one_path", lambda _: [[True] * 4] * 4, "implicitfast"),
    "position gains explicit": (METHODS, "discrete", METHODS["implicitfast"], "discrete"),
}


@pytest.mark.parametrize("of, name, wrong, integrator", WRONG_GAINS.values(), ids=WRONG_GAINS)
def test_wrong_gains_leave_the_band(of, name, wrong, integrator, gripper, monkeypatch):
    if integrator not in gripper[1]["mujoco"].methods:
        pytest.skip("this MuJoCo has no such integrator")
    monkeypatch.setitem(of, name, wrong)
    monkeypatch.setattr(store, "library", lambda source, *what: Library(source()))
    compiled_runs.cache_clear()
    found = failing(*gripper, integrator)
    compiled_runs.cache_clear()
    assert found == {(integrator, level) for level in STEPS}


@pytest.mark.parametrize("seconds, left_out", [(1e-6, []), (2.0, ["open, let go", "open, let go, damped"])])
def test_equations_of_ones_own_have_no_servos_and_follow_what_there_is_time_for(seconds, left_out, gripper):
    equations = SimpleNamespace(has=lambda name: True, times={"acceleration": seconds * 1e-2})
    own, cases = Own(equations), gripper[0].robot.cases
    found = cases_left_out(SimpleNamespace(own=own, size="full"), cases)
    servos = [case.name for case in cases if case.controller]
    assert [name for name, taken in found.items() if taken is None] == servos
    assert [name for name, taken in found.items() if taken] == left_out
    assert own.methods_in(cases[-1]) == {} and own.methods_in(cases[0])
