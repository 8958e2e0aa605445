"""Other engines: what is found in what one has read, in its equations and in its integrators; one that errs fails, and alone."""

import csv
import dataclasses
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from edited import setup_of, setup_of_file
from trees import tree_of_kinds

from compare import engines
from compare.core.check import About, Result
from compare.engines import EngineRecord
from compare.engines.outside import OutsideDynamics
from compare.engines.outside.bodies import Body, combined, links_of, numbers_of, size_of
from compare.engines.outside.file import File
from compare.engines.outside.model import FROM_FILE, ReadModel
from compare.engines.outside.order import Order
from compare.engines.tmt import TmtDynamics
from compare.experiments.engines import EnginesResult, compare_numbers, compare_quantities, integrators
from compare.experiments.engines.motion import free_scene
from compare.judge.entries import Entries
from compare.judge.scale import FACTOR
from compare.robots.arm import ARM

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = [name for name, record in engines.RECORDS.items() if record.reads_file]
RECORDS = {name: EngineRecord(order=1, label="Other", precision=name) for name in ("float64", "float32")}
TWO_LINKS = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0" armature="0.01" damping="0.1"/>
<inertial pos="0.1 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/><body pos="0 0 -1"><joint name="knee" axis="1 0 0"/>
<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/></body></body></worldbody></mujoco>"""
AGAIN = '''"""tmt in a process of its own, which reads the file by MuJoCo."""

import dataclasses

import numpy as np

import tmt

from . import EngineRecord
from .outside.bodies import numbers_of
from .outside.model import ReadModel
from .outside.order import Order

ENGINE = EngineRecord(order=90, label="{label}", reads_file=True, precision="{precision}")
METHODS = {{"rk4": (4, "rk4"), "Euler": (1, "semi_implicit_euler"), "free": (None, "own")}}


class Model(ReadModel):
    def __init__(self, file, precision):
        from .mujoco import read

        self.file, tree = file, read(file.path).tree
        self.order = Order(file, {{0: (0, 0), 1: (1, 1)}})
        self.tree = dataclasses.replace(tree, {wrong})

    def fields(self):
        told = numbers_of(self.tree)
        return {{name: told[name] for name in told if name not in ("about_origin", "{untold}")}}

    def set_field(self, name, values):
        if name == "gravity":
            self.tree = dataclasses.replace(self.tree, gravity=values)
        return name == "gravity"

    def mass_matrix(self, at):
        return tmt.mass_matrix(at.x, self.tree)

    def bias(self, at):
        return tmt.bias(at.x, at.u, self.tree)

    def acceleration(self, at, force):
        return tmt.acceleration(at.x, at.u, force, dataclasses.replace(self.tree, damping=[0.0] * len(force)))

    def run(self, course):
        q, v, tau, times, steps, method, tolerance, _ = course
        method = {{"Euler": "{euler}", "free": "dopri8_adaptive"}}.get(method, method)
        steps = steps or len(times) - 1
        m = tmt.simulate(q, v, tau, times[-1] / steps, steps, method, self.tree, tolerance)
        return np.hstack([m.q, m.qd])[:: steps // (len(times) - 1)], m.evaluations
'''
NAMES = {"mass_matrix": "Mbar", "bias": "bias", "acceleration": "qdd"}
RIGHT = {"label": "Right", "precision": "float64", "wrong": "", "untold": "", "euler": "semi_implicit_euler"}
ENGINES = {
    "again": {}, "heavy": {"label": "Heavy", "wrong": "mass=[1.0, 1.001]"},
    "tilted": {"label": "Tilted", "wrong": "axis=[(0.0, 1.0, 0.0), (1.0, 1e-6, 0.0)]"},
    "upside": {"label": "Upside", "wrong": "gravity=(0.0, 0.0, 9.81)"},
    "bare": {"label": "Bare", "wrong": "armature=[0.0, 0.0]", "untold": "armature"},
    "later": {"label": "Later", "euler": "explicit_euler"}, "blind": {"label": "Blind", "wrong": "**{}[0]"},
    "slow": {"label": "Slow", "wrong": "mass=__import__('time').sleep(60.0)"},
}  # fmt: skip
ASKED = """import numpy as np
from compare.engines import outside
from compare.run.reference import compared_with

if __name__ == "__main__":  # processes of engines begin with this file
    case, q = compared_with("model", "robot.xml").robot.case(), np.array([[0.3, 0.4]])
    dies, other = (outside.Outside(name).of(case) for name in ("mortal", "again"))
    readings = set()  # by the seconds that they took
    for _ in range(2):
        readings.add(other.ask(outside.attrgetter("reading"))["seconds"])
        print(dies.bias(q, q).shape, other.mass_matrix(q).shape, len(readings))
        try:
            dies.mass_matrix(q)
        except outside.EngineError as error:
            print(error)
"""


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of a copy of the package with these engines, and what it prints; its exit status is 1."""
    root = tmp_path_factory.mktemp("copy")
    for name in ("compare", "mjcf", "tmt"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in INSTALLED:  # what is installed here does not count
        shutil.rmtree(root / "compare/engines" / name, ignore_errors=True)
        (root / "compare/engines" / f"{name}.py").unlink(missing_ok=True)
    for name, of in ENGINES.items():
        (root / "compare/engines" / f"{name}.py").write_text(AGAIN.format(**(RIGHT | of)))
    answers = root / "compare/engines/outside/answers.py"
    answers.write_text(answers.read_text().replace("LIMIT = 120.0", "LIMIT = 6.0"))
    (root / "robot.xml").write_text(TWO_LINKS)
    run = subprocess.run(
        [sys.executable, "-m", "compare", "engines", "--quick", "--mjcf", "robot.xml", "--out", "report"], cwd=root,
        env=os.environ | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 1, run.stdout + run.stderr
    return root / "report", run.stdout


def table(folder, name):
    return list(csv.DictReader((folder / "tables" / f"{name}.csv").read_text().splitlines()))


def test_each_seeded_error_fails_its_own_checks_and_no_others(report):
    checks = json.loads((report[0] / "results.json").read_text())["checks"]
    failed = {}
    for check in checks:
        if not check["passed"]:
            assert check["scene"], check
            failed.setdefault(check["scene"].split()[0].rstrip(","), set()).add(check["quantity"])
    assert "Right" not in failed and "Upside" not in failed
    assert failed["Heavy"] == {"mass as read", "Mbar to exact", "bias to exact", "qdd to exact"}
    assert {"Mbar to exact", "bias to exact", "qdd to exact"} <= failed["Tilted"]
    assert "mass as read" not in failed["Tilted"]
    assert {"Mbar to exact", "qdd to exact"} <= failed["Bare"] and "bias to exact" not in failed["Bare"]
    assert failed["Later"] == {"one step of Euler, compared with tmt's semi_implicit_euler"}


def test_what_is_read_differently_is_a_row_and_says_whether_it_was_set(report):
    rows = {(row["engine"], row["number"], row["of"]): row for row in table(report[0], "engines_read")}
    assert rows["Upside", "gravity", "z"]["set_by_this_program"] == "true"
    (heavy,) = (row for (engine, number, _), row in rows.items() if (engine, number) == ("Heavy", "mass"))
    numbers = float(heavy["read"]), float(heavy["compared"]), heavy["set_by_this_program"]
    assert numbers == (1.001, 1.0, "false")
    assert ("Blind", "", "") in rows and rows["Blind", "", ""]["why_not"]  # it cannot read the file
    (axis,) = (row for (engine, number, _), row in rows.items() if (engine, number) == ("Tilted", "axis"))
    assert float(axis["read"]) == pytest.approx(1e-6)  # of its three numbers that which differs
    assert {engine for engine, *_ in rows} == {"Upside", "Heavy", "Blind", "Tilted", "Slow"}


def test_two_verdicts_stand_side_by_side(report):
    """As read, and as set: gravity can be set, mass and axis cannot; who takes no part is not counted among those who agree."""
    rows = {row["engine"]: row for row in table(report[0], "engines_answer")}
    verdicts = {"Right": ("same", "same"), "Upside": ("gravity", "same"), "Heavy": ("mass", "not set")}
    assert {label: (rows[label]["as_read"], rows[label]["as_set"]) for label in verdicts} == verdicts
    assert rows["Later"]["as_set"] == "same" and "Blind" not in rows
    shares = {(row["engine"], row["quantity"]): row for row in table(report[0], "engines")}
    assert float(shares["Upside", "bias"]["as_read_over_bar"]) > 1e6
    assert float(shares["Upside", "bias"]["difference_over_bar"]) < 1.0
    assert rows["Right"]["within_1e_9"] and float(rows["Right"]["floor_rad"]) < 1e-9


def test_orders_are_measured_and_what_does_not_answer_or_cannot_be_set_does_not_run(report):
    assert "Slow: no answer within 6 s" in (report[0] / "report.md").read_text()
    rows = table(report[0], "engines_methods")
    assert {row["engine"] for row in rows} == {"Right", "Upside", "Bare", "Later", "MuJoCo", "TMT"}
    errors = {row["dt_s"]: float(row["worst_error_rad"]) for row in rows
              if row["engine"] == "Right" and row["method"] == "rk4"}  # fmt: skip
    assert len(errors) > 2 and min(errors.values()) < max(errors.values()) / 100.0
    said = " ".join(report[1].split())
    assert "Upside, as read: gravity differs; as set: the same equations" in said
    assert "Heavy, as read: mass differs; as set: it cannot all be set" in said


def other(lacking="", **functions):
    """tmt as another engine, without a function, or with others."""
    dynamics = TmtDynamics(ARM.case())
    vars(dynamics).update(functions, has=lambda quantity: quantity != lacking)
    return dynamics


@pytest.mark.parametrize("precision", RECORDS)
@pytest.mark.parametrize("share, fails", [(0.9, False), (1.1, True)])
@pytest.mark.parametrize("quantity, name", NAMES.items())
def test_a_quantity_just_inside_and_just_outside_its_tolerance(quantity, name, precision, share, fails):
    """A float32 engine is allowed what its own eps allows, and no more."""
    record, right, result = RECORDS[precision], getattr(other(), quantity), Result("engines")

    def wrong(*state):
        values, scale = right(*state), Entries(ARM.tree, *state[:2])
        size = getattr(scale, quantity)
        if quantity == "acceleration":
            size = scale.acceleration(scale.force(state[2]), values)
        return values + share * FACTOR * record.eps * size

    compare_quantities(result, setup_of(), record, other(**{quantity: wrong}))
    assert [check.quantity for check in result.checks if not check.passed] == [f"{name} to exact"] * fails
    assert all(check.about is About.ENGINE for check in result.checks)
    assert result.rows[0].as_read_over_bar == result.rows[0].difference_over_bar  # nothing is set


def test_an_engine_without_a_function_is_not_judged_by_it():
    result = Result("engines")
    compare_quantities(result, setup_of(), RECORDS["float64"], other("bias"))
    assert [check.quantity for check in result.checks] == ["Mbar to exact", "qdd to exact"]


@pytest.mark.parametrize("number", ("mass", "moments", "gravity", "armature"))
def test_a_number_as_read_just_inside_and_just_outside(number):
    """Masses and moments are checked; a number that an engine drops or sets otherwise is a finding."""
    stated = numbers_of(ARM.tree)
    for off, differs in ((60.0, False), (70.0, True)):
        result, read = EnginesResult("engines"), {name: values.copy() for name, values in stated.items()}
        result.tables["engines_read"] = []
        size = size_of(stated, number) or 1.0
        is_none = not stated[number].any()
        read[number][..., -1] += off * RECORDS["float64"].eps * size * (differs or not is_none)
        reading = {"read": read, "stated": stated, "mended": {number: True} if differs else {}, "copied": None,
                   "way": FROM_FILE, "lacking": (), "unwritten": ()}  # fmt: skip
        compare_numbers(result, ARM, RECORDS["float64"], reading)
        failed = [f"{number} as read"] * (differs and number in ("mass", "moments"))
        assert [check.quantity for check in result.checks if not check.passed] == failed
        assert [row.number for row in result.tables["engines_read"][:1]] == [number] * differs


def test_a_process_that_ends_is_that_of_its_own_engine_alone_and_the_next_reads_again(report):
    root, ends = report[0].parent, "__import__('os')._exit(3)"
    mortal = AGAIN.replace("return tmt.mass_matrix(at.x, self.tree)", ends)
    (root / "compare/engines/mortal.py").write_text(mortal.format(**RIGHT))
    (root / "asked.py").write_text(ASKED)
    command, environment = [sys.executable, "asked.py"], os.environ | {"PYTHONPATH": str(root)}
    run = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    assert run.stdout.splitlines() == ["(1, 2) (1, 2, 2) 1", "its process was killed"] * 2, run.stderr


class OfTree(ReadModel):
    """A Tree as an engine that tells where its bodies are."""

    has_links = True

    def __init__(self, tree):
        self.tree, self.stated = tree, numbers_of(tree)
        self.file = File(ROOT, tree.joint_names, tree.kind)
        joints = self.file.coordinates.places.joints
        self.order = Order(self.file, {k: (joint.q.start, joint.qd.start) for k, joint in enumerate(joints)})

    def fields(self):
        return {}

    def links(self, at):
        return links_of(self.tree, at.x)

    mass_matrix = bias = acceleration = None


@pytest.mark.parametrize("number", ("axis", "offset", "mass"))
def test_axes_anchors_and_masses_are_those_by_which_the_bodies_move(number):
    """Of joints of all kinds; and with another axis, another place of a joint, another mass."""
    right = tree_of_kinds(np.random.default_rng(3))
    model = OfTree(right)
    for name, values in model.numbers().items():
        size = max(1.0, size_of(model.stated, name))
        assert np.abs(values - model.stated[name]).max() <= 1e-13 * size, name
    wrong = {"axis": np.roll(right.axis, 1, axis=1), "offset": np.add(right.offset, 0.1)}
    wrong["mass"] = np.multiply(right.mass, 2.0)
    model.tree = dataclasses.replace(right, **{number: wrong[number].tolist()})
    read = {"offset": "anchor"}.get(number, number)
    assert np.abs(model.numbers()[read] - model.stated[read]).max() > 1e-3


def test_bodies_that_move_as_one():
    """Two points of 1 kg at 1 m from each other: 2 kg, and moments 0, 1/2, 1/2 kg m2 about their centre."""
    mass, _, inertia = combined([Body(1.0, np.array([0.0, 0.0, z]), np.zeros((3, 3))) for z in (1.0, 2.0)])
    assert mass == 2.0 and np.linalg.eigvalsh(inertia) == pytest.approx([0.0, 0.5, 0.5])
    with_armature = dataclasses.replace(ARM.tree, armature=[0.1, 0.2, 0.3])
    assert numbers_of(with_armature)["armature"] == pytest.approx([0.1, 0.2, 0.3])


HANGING = """<mujoco><worldbody><body><joint axis="0 1 0"/>
<inertial pos="0 0 -0.25" mass="1" diaginertia="0.02 0.02 0.001"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("scheme, order", [("semi_implicit_euler", 2.0), ("rk4", 4.0), ("own", None)])
def test_where_an_order_is_higher_tmts_same_scheme_has_it(scheme, order):
    """A pendulum that is set going where no force acts: semi-implicit Euler's leading error vanishes."""
    setup = setup_of_file(HANGING)
    case, method = free_scene(setup), engines.Method("other", "a", 1, scheme)
    assert integrators.order_of_twin(setup, case, method) == (order and pytest.approx(order, abs=0.1))


@pytest.mark.parametrize("order", (1, 4))
def test_an_order_is_taken_from_regular_errors_above_the_floor(order):
    steps = [0.1 / 2**k for k in range(4)]
    errors = [2e-2 / 2 ** (order * k) for k in range(4)]
    assert integrators.order_of(steps, errors, 2.2e-16).order == pytest.approx(order)
    assert integrators.order_of(steps[:3], errors[:3], 2.2e-16) is None  # two orders have not settled
    assert integrators.order_of(steps, [*errors[:3], 1e-14], 2.2e-16) is None  # rounding
    assert integrators.order_of(steps, errors, 1e-2) is None
    finer = [2.0**-k for k in range(7, 14)]
    assert integrators.order_of(finer, [2e-16 / dt for dt in finer], 2.2e-16) is None  # an eps of each step


def test_damping_that_acts_is_what_was_read_where_nothing_is_set():
    for is_set, damping in ((True, 0.1), (False, 0.5)):
        of = OutsideDynamics("none", ARM.case(damping=0.1), is_set)
        vars(of)["reading"] = {"read": {"damping": np.full(3, 0.5)}, "lacking": ("stiffness",)}
        assert of.acting.damping == (damping,) * 3
