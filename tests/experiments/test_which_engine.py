"""Which engine: servos, batches, times, the reference, the cheapest method, --engines."""

import dataclasses
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from compare import experiments
from compare.core.errors import Refused
from compare.engines import RECORDS
from compare.engines.outside import Outside, servos_of
from compare.engines.outside.bodies import numbers_of
from compare.engines.outside.file import EngineError, TooLong
from compare.engines.outside.model import FROM_FILE
from compare.experiments.engines import integrators, rows, servos
from compare.experiments.engines.answer import cheapest_engine, cheapest_of
from compare.experiments.engines.integrators import step_of
from compare.experiments.engines.motion import free_scene
from compare.experiments.engines.readings import compare_numbers
from compare.experiments.engines.tables import EnginesResult, MethodRow
from compare.experiments.setup import Setup, engines
from compare.robots.arm import ARM
from compare.run.examine import not_chosen
from compare.run.reference import compared_with

LEG = """<mujoco><option timestep="0.004"/><worldbody><body pos="0 0 1"><joint name="hip" axis="0 1 0" damping="0.2"/>
<inertial pos="0 0 -0.3" mass="1" diaginertia="0.03 0.03 0.01"/></body></worldbody>
<actuator><position joint="hip" kp="60" kv="4"/></actuator></mujoco>"""


@pytest.fixture(scope="module")
def setup(tmp_path_factory):
    path = tmp_path_factory.mktemp("leg") / "leg.xml"
    path.write_text(LEG)
    compared = compared_with("model", str(path))
    return Setup(compared.robot, engines(compared.mujoco), reading=compared.reading)


def test_what_each_integrator_takes_explicitly_in_a_servo(setup):
    result = EnginesResult("engines", tables={"engines_servos": []})
    servos.follow_step(result, setup, setup.engines["mujoco"])
    why = {row.method: row.why for row in result.tables["engines_servos"]}
    assert why == {"Euler": "damping_of_servo_explicit", "implicitfast": "damping_implicit",
                   "discrete": "springs_implicit", "RK4": "error_of_the_method"}  # fmt: skip
    deviations = {row.method: row.deviation for row in result.tables["engines_servos"]}
    assert deviations["RK4"] < 1e-5 < 1e-4 < deviations["implicitfast"] < deviations["Euler"]
    servos.add_sentences(result)
    assert [note.kind for note in result.notes] == ["response"] * 4


def test_a_torque_that_is_held_is_told_from_one_that_is_not(setup, monkeypatch):
    """And a response that is like none is not explained."""
    case, method = servos.scene_of(setup), setup.engines["mujoco"].methods["RK4"]
    path = servos.held(case, 256)
    assert servos.explanation(case, setup.engines["mujoco"], method, 256, path)[0] == "held"
    another = path + np.linspace(0.0, 1.0, len(path))[:, None]
    run = SimpleNamespace(error=np.ones(65))  # with half of the step: it does not fall
    monkeypatch.setattr(servos, "follow", lambda *arguments: run)
    assert servos.explanation(case, setup.engines["mujoco"], method, 256, another)[0] == ""


@pytest.mark.parametrize("damping, why", ((0.2, "damping_implicit"), (1.0, "reading")))
def test_a_response_is_explained_by_what_was_read_where_that_changes_it(setup, damping, why):
    result, case = EnginesResult("engines", tables={"engines_servos": []}), servos.scene_of(setup)
    engine = setup.engines["mujoco"]
    method = engine.methods["implicitfast"]
    row = servos.add_response(result, setup, case, engine, method)
    more = dataclasses.replace(case, scene=dataclasses.replace(case.scene, damping=damping - 0.2))
    servos.add_as_read(result, case, engine.of(more), method, row)
    assert [row.why for row in result.tables["engines_servos"]] == ["damping_implicit", why]


def test_the_law_that_other_engines_get_is_that_of_the_actuators(setup):
    case = servos.scene_of(setup)
    law = servos_of(case)
    assert law.position_gain == pytest.approx(60.0) and law.speed_gain == pytest.approx(4.0)
    assert servos_of(free_scene(setup)) is None


def row(method, error, seconds, alone=None):
    return MethodRow(
        scene="s", engine="E", method=method, scheme="", dt=0.01, tolerance=None, worst_error=error, seconds=seconds,
        seconds_alone=alone, scatter=1.0, steady=True, seconds_prepared=None, ended=None, order=1,
    )  # fmt: skip


def test_the_cheapest_method_is_that_of_the_engines_own_time():
    """Just inside 1e-3; the time of the steps alone counts; a motion of 2 s; the floor is the smallest error."""
    rows = [row("fast", 1.1e-3, 1.0), row("slow", 0.9e-3, 9.0), row("alone", 1e-3, 99.0, 4.0)]
    fields = cheapest_of(rows, 2.0)
    assert (fields["within_1e_3"], fields["within_1e_3_cost"]) == ("alone", 2000.0)
    assert fields["within_1e_6"] is None and (fields["floor"], fields["floor_method"]) == (0.9e-3, "slow")


@pytest.mark.parametrize(
    "errors, is_floor",
    (
        ((1e-3, 5e-4), False),
        ((1e-3, 6e-4), True),
        ((1e-5, 2e-5, 1e-6), True),
        ((1.0, 1.0, 1e-3), False),
        ((1e-6,), False),
    ),
)
def test_a_floor_is_where_errors_fall_no_further(errors, is_floor):
    """Else the smallest error is that of the last run; whether a finer one was left out is said of it."""
    rows = [row("m", error, 1.0) for error in errors]
    rows[-1].finer_left_out = True
    fields = cheapest_of(rows, 1.0)
    assert fields["floor"] == min(errors) and fields["floor_reached"] == is_floor
    assert fields["finer_left_out"] == (not is_floor)


def test_the_cheapest_engine_is_that_of_the_least_cost_among_those_that_reach_an_error():
    costs = {None: 1.0, "rk4": 3.0, "RK4": 2.0}
    rows = [SimpleNamespace(within_1e_3=name, within_1e_3_cost=cost) for name, cost in costs.items()]
    assert (
        cheapest_engine(rows, "1e_3") == (rows[2], "RK4", 2.0) and cheapest_engine(rows[:1], "1e_3") is None
    )


def test_an_engine_that_does_not_answer_in_time_is_asked_nothing_more(setup, monkeypatch):
    """Another error of a method is said, and the next method tried."""
    asked, result = [], EnginesResult("engines")
    monkeypatch.setattr(integrators, "compare_steps", lambda *arguments: None)
    methods = len(setup.engines["mujoco"].methods)
    for error, count in ((EngineError("no"), methods), (TooLong("late"), methods + 1)):

        def fail(*arguments, error=error):
            asked.append(arguments)
            raise error

        monkeypatch.setattr(integrators, "add_runs", fail)
        with pytest.raises(TooLong) if isinstance(error, TooLong) else nullcontext():
            integrators.compare_methods(result, setup, setup.engines["mujoco"])
        assert len(asked) == count


@pytest.mark.parametrize("dt, step", [(0.003, 2.0**-9), (0.002, 2.0**-9), (0.1, 2.0**-7)])
def test_a_single_step_is_a_power_of_two_and_no_longer_than_the_files(dt, step):
    assert step_of(SimpleNamespace(reading=SimpleNamespace(dt=dt))) == step


def test_engines_are_chosen_by_their_names():
    others = not_chosen("drake,mjx")
    assert "mjx_float32" in others and not others & {"drake", "mjx", "mujoco"}
    with pytest.raises(Refused, match="draek is not an engine that reads"):
        not_chosen("draek")


def test_without_an_extra_mujoco_and_tmt_are_compared(mujoco, monkeypatch):
    """They take part in each run: nothing else needs to be installed."""
    monkeypatch.setattr(Outside, "unavailable", lambda engine: "not installed")
    assert experiments.skipped("engines", ARM, "mujoco,drake").kind == "none_installed"
    assert experiments.skipped("engines", ARM, "mujoco,tmt") is None
    others = not_chosen("mujoco,tmt")
    chosen = {name: engine for name, engine in engines(mujoco).items() if name not in others}
    result = rows(Setup.small(ARM, chosen))
    assert len(result.checks) >= 5 and all(check.passed for check in result.checks)
    steps = [check.tolerance for check in result.checks if check.quantity.startswith("one step")]
    assert len(steps) > 2 and max(steps) < 1e-11  # rounding alone
    assert [row.engine for row in result.tables["engines_answer"]] == ["MuJoCo", "TMT"]


def test_a_cause_is_named_where_the_engine_has_what_follows_from_it(tmp_path):
    """A gravity that was ignored; another one is not explained by that. Other joints are no refusal."""
    path = tmp_path / "robot.xml"
    path.write_text(LEG.replace("<worldbody>", '<option gravity="1 2 -3"/><worldbody>'))
    robot, named = compared_with("model", str(path)).robot, []
    stated = numbers_of(robot.tree)
    copied = ("Refused", ""), ("OtherJoints", "")
    for gravity, why in zip(((0.0, 0.0, -9.81), (1.0, 2.0, 3.0)), copied):
        reading = {"read": stated | {"gravity": np.array(gravity)}, "stated": stated, "mended": {"gravity": True}, "copied": why,
                   "way": FROM_FILE, "lacking": (), "unwritten": ()}  # fmt: skip
        result = EnginesResult("engines", tables={"engines_read": []})
        compare_numbers(result, robot, RECORDS["newton"], reading)
        (cause,) = {row.cause for row in result.tables["engines_read"]}
        named.append((cause, result.readers["Newton"].differing))
    assert named == [("option_gravity gravity", ["refused", "gravity"]), (None, ["joints", "gravity"])]
