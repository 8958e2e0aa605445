"""The numbers of a file beside those of a solution: each one that differs is named, of joints of every kind."""

import pytest
from models import PATHS

from compare.experiment import Setup, engines
from compare.experiments import module
from compare.reference import compared_with

CART = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
<body name="cart"><joint name="x" type="slide" axis="1 0 0" damping="0.5"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
<body name="pole" pos="0 0 0.1"><joint name="tilt" axis="0 1 0" stiffness="3" springref="0.2"/>
<inertial pos="0 0 0.4" mass="1" diaginertia="0.1 0.2 0.3"/></body></body></worldbody>
<actuator><motor joint="x"/></actuator></mujoco>"""


def found(tmp_path, text, solution=CART, name="parameters"):
    """What an experiment finds of a file with a text beside a solution."""
    (tmp_path / "solution.xml").write_text(solution)
    (tmp_path / "file.xml").write_text(text)
    known = compared_with(str(tmp_path / "solution.xml"), str(tmp_path / "file.xml"))
    return module(name).rows(Setup.small(known.robot, engines(known.mujoco), reading=known.reading))


@pytest.mark.parametrize("old, new, text", [
    ('mass="2"', 'mass="3"', "mass of cart: stated 2 kg, compiled 3 kg"),
    ('damping="0.5"', 'damping="0.6"', "damping of x: stated 0.5 N s/m, compiled 0.6 N s/m"),
    ('axis="1 0 0"', 'axis="-1 0 0"', "axis x of x: stated 1, compiled -1 (the opposite sign)"),
    ('stiffness="3"', 'stiffness="4"', "stiffness of tilt: stated 3 N m/rad, compiled 4 N m/rad"),
    ('springref="0.2"', 'springref="0.3"', "rest of tilt: stated 0.2 rad, compiled 0.3 rad"),
    ('pos="0 0 0.1"', 'pos="0 0 0.11"', "anchor z of tilt: stated 0.1 m, compiled 0.11 m"),
    ('damping="0.5"', 'damping="0.5" armature="0.1"', "armature of x: stated 0 kg, compiled 0.1 kg"),
    ("-9.81", "-9.8", "gravity z: stated -9.81 m/s2, compiled -9.8 m/s2"),
    ('damping="0.5"', 'damping="0.5" frictionloss="0.1"', "frictionloss: 0 in {}, 1 in this file"),
    ('<motor joint="x"/>', "", None), ('stiffness="3"', 'stiffness="3" limited="true" range="-1 1"', None),  # may be others
    (' name="tilt"', "", None),
    ('"pole"', '"stick"', None),
])  # fmt: skip
def test_a_number_that_is_another_one_than_in_the_solution_is_named(tmp_path, old, new, text):
    result = found(tmp_path, CART.replace(old, new))
    causes = [cause["text"] for cause in result.curves["causes"]]
    assert causes == ([text.format(tmp_path / "solution.xml")] if text else [])
    assert sum(not check.passed for check in result.checks) == len(causes) and len(result.checks) > 20


def test_what_no_equation_has_is_compared_by_its_numbers(tmp_path):
    rubbed = [CART.replace('damping="0.5"', f'damping="0.5" frictionloss="{size}"') for size in (0.1, 0.1, 9.0)]
    for text, failed in zip(rubbed[1:], ([], ["frictionloss, its numbers"])):
        result = found(tmp_path, text, rubbed[0])
        assert [check.quantity for check in result.checks if not check.passed] == failed


def test_values_are_compared_with_those_of_the_solution(tmp_path):
    for text, passes in ((CART, True), (CART.replace('mass="1"', 'mass="1.001"'), False)):
        assert all(check.passed for check in found(tmp_path, text, name="mass").checks) == passes


@pytest.mark.parametrize("name", ["mixed", "humanoid29_free", "loop"])
def test_a_file_is_its_own_solution(name):
    known = compared_with(str(PATHS[name]), str(PATHS[name]))
    result = module("parameters").rows(Setup.small(known.robot, engines(known.mujoco), reading=known.reading))
    assert all(check.passed for check in result.checks) and result.curves["causes"] == []
