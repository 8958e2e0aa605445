"""A method of tmt that is not MuJoCo's scheme leaves the band of rounding: small errors of a scheme are seeded."""

import dataclasses

import pytest
from models import PATHS

from compare.case import Case, Scene
from compare.engines.mujoco import reading
from compare.experiments.trajectory.runs import follow
from compare.judge.scale import EPS
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import engines as engines_of
from tmt.methods import METHODS, RungeKutta, SemiImplicitEuler


@dataclasses.dataclass(frozen=True)
class Altered(SemiImplicitEuler):
    """A wrong scheme: damping explicit, or the derivative of the bias dropped."""

    drop: str = ""

    def matrix(self, tree, *arguments):
        if self.drop == "damping":
            tree = dataclasses.replace(tree, damping=(0.0, 0.0, 0.0))
        wanted = dataclasses.replace(self, implicit_bias=self.implicit_bias and self.drop != "bias")
        return SemiImplicitEuler.matrix(wanted, tree, *arguments)


@dataclasses.dataclass(frozen=True)
class Hasty(RungeKutta):
    """A wrong scheme: its step is a little too long."""

    def step(self, slope, q, qd, dt):
        return RungeKutta.step(self, slope, q, qd, dt * (1.0 + 1e6 * EPS))


RK4 = {"order": 4, "A": METHODS["rk4"].A, "b": METHODS["rk4"].b, "c": METHODS["rk4"].c}
WRONG_SCHEMES = {
    "damping explicit": ("semi_implicit_euler", Altered(False, drop="damping"), "bent, damped, Euler"),
    "derivative of the bias dropped": ("implicit", Altered(True, drop="bias"), "bent, free, implicit"),
    "stages swapped": ("rk4", RungeKutta(**RK4 | {"b": (1 / 3, 1 / 6, 1 / 6, 1 / 3)}), "bent, free, RK4"),
    "another method of order 4, Kutta's 3/8 rule": (
        "rk4",
        RungeKutta(
            4, ((), (1 / 3,), (-1 / 3, 1.0), (1.0, -1.0, 1.0)), (1 / 8, 3 / 8, 3 / 8, 1 / 8), (0.0, 1 / 3, 2 / 3, 1.0)
        ),
        "bent, free, RK4",
    ),
    "dt off by one ulp times 1e6": ("rk4", Hasty(**RK4), "bent, free, RK4"),
}


@pytest.mark.parametrize("scheme, wrong, where", WRONG_SCHEMES.values(), ids=WRONG_SCHEMES)
def test_a_wrong_scheme_leaves_the_band(scheme, wrong, where, engines, monkeypatch):
    case = next(case for case in ARM.cases if where.startswith(case.name))
    assert [str(check) for check in follow(case, engines, (1,)).checks if not check.passed] == []
    monkeypatch.setitem(METHODS, scheme, wrong)
    checks = follow(case, engines, (1,)).checks
    failed = {check.quantity for check in checks if not check.passed and check.scene.startswith(where)}
    assert {"one step, TMT to MuJoCo", "open loop, TMT to MuJoCo"} <= failed


def test_a_body_that_tumbles_tells_how_a_quaternion_is_moved(monkeypatch):
    """RK4 that turns it by the mean of its speeds, as MuJoCo did up to 3.17, or the other way round."""
    read = reading.read(PATHS["free_body"])
    engines, robot = engines_of(reading.engine(read)), robot_of(read, "free_body.xml")
    scene = Scene("tumbling", speed=(0.0, 0.0, 0.0, 200.0, 300.0, -100.0), duration=0.25, dt=1 / 64, judged=0.0)
    case, (scheme,) = Case(robot, scene), {engines["mujoco"].methods["RK4"].scheme}
    assert [str(check) for check in follow(case, engines, (1,)).checks if not check.passed] == []
    monkeypatch.setitem(METHODS, scheme, METHODS["rk4_mean_speed" if scheme == "rk4" else "rk4"])
    checks = follow(case, engines, (1,)).checks
    failed = {(check.scene.split(", ")[1], check.quantity) for check in checks if not check.passed}
    assert failed == {("RK4", "one step, TMT to MuJoCo"), ("RK4", "open loop, TMT to MuJoCo")}
