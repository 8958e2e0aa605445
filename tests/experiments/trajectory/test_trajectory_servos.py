"""Servo-held and step-response scenes: they agree in both engines, and errors of how servos are counted make checks fail."""

import dataclasses
from types import SimpleNamespace

import pytest
from models import PATHS

from compare.actuators import Actuator
from compare.case import Scene
from compare.engines.mujoco import engine, read
from compare.engines.own import Own
from compare.experiments.trajectory import own_runs, sentences
from compare.experiments.trajectory.runs import follow
from compare.robots.file import robot_of
from compare.setup import engines as engines_of
from tmt.compiled import Library, store
from tmt.compiled.runner import known as compiled_runs
from tmt.methods import METHODS, SemiImplicitEuler, semi_implicit

LEVELS = {"derivative, TMT to MuJoCo", "one step, TMT to MuJoCo", "open loop, TMT to MuJoCo"}
GEARED = PATHS["gripper"].read_text(encoding="utf-8").replace('kp="60" kv="6"', 'kp="6" kv="0.6" gear="3"')
SHORT = Scene("step", "open", "servos", targets=(6.0, 6.0, 0.02, 0.02), duration=1 / 16, dt=1 / 256, judged=1 / 16)


@pytest.fixture(scope="module")
def gripper():
    """Its robot and the engines; its tendon pulls two fingers, its first servo has a gear."""
    reading = read(GEARED)
    return robot_of(reading, "gripper.xml"), engines_of(engine(reading))


def failing(robot, known, scene=SHORT):
    """{(integrator, level)} of the checks that fail."""
    case = dataclasses.replace(robot, scenes=(scene,)).cases[0]
    checks = follow(case, known, (1,)).checks
    assert {check.quantity for check in checks} >= LEVELS
    return {(check.scene.split(", ")[1], check.quantity) for check in checks if not check.passed}


@pytest.fixture
def altered(monkeypatch):
    """Replace a part of tmt, and let nothing that was compiled before stand for it."""

    def replace(of, name, value):
        (monkeypatch.setitem if isinstance(of, dict) else monkeypatch.setattr)(of, name, value)
        monkeypatch.setattr(store, "library", lambda source, *what: Library(source()))
        compiled_runs.clear()

    yield replace
    compiled_runs.clear()


def test_every_integrator_is_its_scheme_held_and_in_a_step(gripper):
    robot, known = gripper
    for scene in (
        SHORT,
        dataclasses.replace(SHORT, name="held", targets=0.0),
        dataclasses.replace(SHORT, gravity=False),
    ):
        assert failing(robot, known, scene) == set()


def test_a_sentence_names_scenes_schemes_and_what_is_left_out(gripper):
    robot, known = gripper
    drive = dataclasses.replace(
        robot.drive, actuators=(*robot.drive.actuators, Actuator("pull", "", None)), controls={}
    )
    for changed, left in (
        (robot, ""),
        (dataclasses.replace(robot, drive=drive), "pull, its lever turns with the posture"),
    ):
        (said,) = sentences.of_servos(changed.cases, known["mujoco"])
        assert "in: open, held by servos; open, step of the servos. " in said and "implicitfast: implicitfast" in said
        assert said.partition("Left out in both: ")[2].rstrip(".") == left
    assert sentences.of_servos(robot.cases_of_torque, known["mujoco"]) == []


def test_velocity_gains_implicit_under_euler_leave_the_band(gripper, altered):
    altered(METHODS, "semi_implicit_euler", SemiImplicitEuler(implicit_bias=False, implicit_gains=True))
    assert failing(*gripper) == {("Euler", "one step, TMT to MuJoCo"), ("Euler", "open loop, TMT to MuJoCo")}


def test_a_tendons_cross_terms_counted_implicit_leave_the_band(gripper, altered):
    altered(semi_implicit, "on_one_path", lambda tree: [[True] * len(tree.axis)] * len(tree.axis))
    wrong = {"implicitfast", "implicit"}
    assert failing(*gripper) == {
        (name, f"{level}, TMT to MuJoCo") for name in wrong for level in ("one step", "open loop")
    }


def test_position_gains_explicit_under_discrete_leave_the_band(gripper, altered):
    if "discrete" not in gripper[1]["mujoco"].methods:
        pytest.skip("this MuJoCo has no integrator discrete")
    altered(METHODS, "discrete", METHODS["implicitfast"])
    assert {name for name, _ in failing(*gripper)} == {"discrete"}


def test_a_gear_that_is_not_squared_and_an_armature_that_is_forgotten_leave_the_band(gripper):
    robot, known = gripper
    servo = robot.drive.actuators[0]
    once = dataclasses.replace(servo, bias=(0.0, servo.bias[1] / 3.0, servo.bias[2] / 3.0))
    drive = dataclasses.replace(robot.drive, actuators=(once, *robot.drive.actuators[1:]))
    bare = dataclasses.replace(robot.tree, armature=(0.0, *robot.tree.armature[1:]))
    for wrong in ({"drive": drive}, {"tree": bare}):
        failed = failing(dataclasses.replace(robot, **wrong), known)
        assert failed >= {(name, level) for name in known["mujoco"].methods for level in LEVELS}


def test_equations_of_ones_own_have_no_servos(gripper):
    robot, known = gripper
    equations = SimpleNamespace(has=lambda name: True, times={"acceleration": (1e-6,)})
    setup = SimpleNamespace(engines={"own": SimpleNamespace(equations=equations)}, size="full", finer=(1,))
    able, _, said = own_runs.within_time(setup, robot.cases, 1_000_000)
    assert [case.name for case in able] == ["open, held", "open, let go", "open, let go, damped"]
    assert said == [
        "Your equations have no actuators; scenes in which these act are left out: open, held by servos; open, step of the "
        "servos."
    ]
    step = robot.cases[-1]
    assert Own(equations).methods_in(step) == {} and Own(equations).methods_in(able[0])
    with_own = dataclasses.replace(robot, own=("acceleration",), scenes=(SHORT,)).cases[0]
    assert follow(with_own, known | {"own": Own(equations)}, (1,), {with_own: None}).rows == []
