"""Parameters of a robot's file, beside what the file states and beside a solution; and what is switched off."""

import mujoco
import numpy as np
import pytest
from helpers.edited import XML, setup_of, setup_of_file
from models import PATHS
from scipy.spatial.transform import Rotation

from compare.core.check import Result
from compare.engines.mujoco.parameters import Stated
from compare.experiments import parameters
from compare.experiments.parameters.causes import causes_of
from compare.experiments.parameters.numbers import compare_number, rows_of
from compare.experiments.setup import Setup, engines
from compare.run.reference import compared_with

TOTAL = """<mujoco><compiler settotalmass="3"/><worldbody>
  <body name="arm"><joint name="turn"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.2 0.25"/></body>
  <body name="rod"><joint name="lift" type="slide" damping="2"/><geom size="0.1" mass="0.5"/></body>
</worldbody></mujoco>"""
CART = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
<body name="cart"><joint name="x" type="slide" axis="1 0 0" damping="0.5"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
<body name="pole" pos="0 0 0.1"><joint name="tilt" axis="0 1 0" stiffness="3" springref="0.2"/>
<inertial pos="0 0 0.4" mass="1" diaginertia="0.1 0.2 0.3"/></body></body></worldbody>
<actuator><motor joint="x"/></actuator></mujoco>"""


def result_of(source, as_it_is=False):
    """The result of a small run on a file; as it is: nothing in it is switched off."""
    setup = setup_of_file(source)
    if as_it_is:
        mujoco = setup.engines["mujoco"]
        mujoco.bare, mujoco.model = False, setup.reading.model
    return parameters.rows(setup)


def failing(result):
    return [check.quantity for check in result.checks if not check.passed]


def test_a_force_of_what_is_switched_off_is_a_failed_check():
    assert "no forces of constraints and contacts" in failing(result_of(PATHS["arm6"], as_it_is=True))


def test_numbers_that_an_option_changes_are_no_checks_and_have_its_name():
    result = result_of(TOTAL)
    assert failing(result) == [] and not {"mass", "inertia"} & {check.quantity for check in result.checks}
    rows = {(row.of, row.quantity): row for row in result.rows if row.of != "file"}
    asked = {name: row.asked_by for name, row in rows.items()}
    assert asked["arm", "mass"] == asked["rod", "mass"] == asked["arm", "inertia"] == "settotalmass"
    assert asked["rod", "com"] and asked["rod", "com"] != "settotalmass" and asked["lift", "damping"] == ""
    changed = [row for row in result.rows if row.asked_by and row.difference]
    numbers = parameters.headline(result).values
    assert numbers["changed"] == len(changed) > 0 == numbers["off"]
    assert (rows["lift", "damping"].unit, rows["turn", "damping"].unit) == ("N s/m", "N m s/rad")


@pytest.mark.parametrize("quantity, stated", [
    ("mass", 2.0), ("com", np.array([0.0, -3.0, 1.0])), ("inertia", np.diag([1.0, 2.0, 2.5])),
])  # fmt: skip
@pytest.mark.parametrize("share, passes", [(0.9, True), (1.1, False)])
def test_a_number_may_be_off_by_its_tolerance(quantity, stated, share, passes):
    result, off = Result("parameters"), 1e-9
    number = Stated("arm", quantity, stated, stated + share * off, tolerance=off)
    causes = causes_of([compare_number(result, number, "")], ("here", "there"))
    assert (result.checks[0].passed, not causes) == (passes, passes)


def test_a_row_has_what_is_compiled_less_what_is_stated():
    stated, compiled = np.array([1.0, 2.0, -3.0]), np.array([1.5, 2.0, 3.0])
    rows = rows_of(Stated("arm", "com", stated, compiled), "m")
    found = [(row.stated, row.compiled, row.difference) for row in rows]
    assert found == [(1.0, 1.5, 0.5), (2.0, 2.0, 0.0), (-3.0, 3.0, 6.0)]
    assert rows_of(Stated("arm", "com", None, compiled), "m")[0].difference is None


@pytest.mark.parametrize(
    "compiled, rank, is_said", [([0.0, -0.6, -0.8], 1, True), ([0.0, -0.6, 0.8], 2, False)]
)
def test_an_axis_of_the_opposite_sense_is_a_convention_and_is_said(compiled, rank, is_said):
    number = Stated("elbow", "axis", np.array([0.0, 0.6, 0.8]), np.array(compiled), tolerance=1e-12)
    causes = causes_of([compare_number(Result("parameters"), number, "")], ("here", "there"))
    assert {cause.rank for cause in causes} == {rank}
    assert {"opposite sign" in cause.text for cause in causes} == {is_said}


def test_a_number_that_differs_for_no_reason_is_a_cause_as_is_one_that_is_none():
    mass = compare_number(Result("parameters"), Stated("arm", "mass", 2.0, 2.5), "kg")
    (cause,) = causes_of([mass], ("robot.xml", "right.xml"))
    assert (cause.rank, cause.place, cause.stated, cause.explains) == (2, "mass of arm", 2.0, 2.5)
    assert cause.text == "mass of arm: 2.5 kg in robot.xml, 2 kg in right.xml"
    result, vector = Result("parameters"), Stated("arm", "com", np.zeros(3), np.array([0.0, 0.0, np.nan]))
    (cause,) = causes_of([compare_number(result, vector, "m")], ("robot.xml", "right.xml"))
    assert (cause.place, cause.explains) == ("com z of arm", None) and failing(result) == ["com"]


@pytest.mark.parametrize("moved, passes", [(0.0, True), (1e-13, False), (-1e-13, False)])
def test_an_offset_stated_as_0_may_be_off_by_rounding_of_the_lengths_that_lead_there(moved, passes):
    """1e-13 m is about ten times the tolerance."""
    place, R = np.array([0.1, -0.2, 0.3]), np.zeros(9)
    mujoco.mju_quat2Mat(R, np.array([0.5, 0.1, -0.7, 0.5]))
    back = " ".join(map(repr, (moved - place @ R.reshape(3, 3)).tolist()))
    text = XML.replace('pos="0 0 0"', 'pos="0.1 -0.2 0.3" quat="0.5 0.1 -0.7 0.5"', 1)
    result = parameters.rows(setup_of(text.replace('type="hinge"', f'pos="{back}"', 2)))
    offset = next(check for check in result.checks if (check.scene, check.quantity) == ("alpha", "offset"))
    assert offset.passed == passes and offset.value > 0.0


def beside_solution(tmp_path, text, solution=CART):
    """The parameters of a file with a text beside a solution."""
    (tmp_path / "solution.xml").write_text(solution)
    (tmp_path / "file.xml").write_text(text)
    known = compared_with(str(tmp_path / "solution.xml"), str(tmp_path / "file.xml"))
    return parameters.rows(Setup.small(known.robot, engines(known.mujoco), reading=known.reading))


@pytest.mark.parametrize("old, new, causes", [
    ('mass="2"', 'mass="3"', [("mass of cart", 2, 3)]), ('axis="1 0 0"', 'axis="-1 0 0"', [("axis x of x", 1, -1)]),
    ('springref="0.2"', 'springref="0.3"', [("rest of tilt", 0.2, 0.3)]),
    ('damping="0.5"', 'damping="0.5" frictionloss="0.1"', [("frictionloss", 0, 1)]), ('<motor joint="x"/>', "", []),
    ('damping="0.5"', 'damping="0.5" springref="0.3"', []),  # of no spring
    ('stiffness="3"', 'stiffness="3" limited="true" range="-1 1"', []),  # may be others
    (' name="tilt"', "", []), ('"pole"', '"stick"', []), ("<mujoco>", "<mujoco>", []),  # a file is its own solution
])  # fmt: skip
def test_a_number_that_is_another_one_than_in_the_solution_is_the_cause(tmp_path, old, new, causes):
    result = beside_solution(tmp_path, CART.replace(old, new))
    found = [(cause.place, cause.stated, pytest.approx(cause.explains)) for cause in result.causes]
    assert found == causes
    assert len(failing(result)) == len(causes) and len(result.checks) > 20


CHAIN = {  # the joint of each body, and its place in the one before
    'a" axis="0 0 1': (0.0, 0.0, 0.2), 'b" axis="0 1 0': (0.05, 0.0, 0.15), 'c" axis="0 1 0': (0.0, 0.0, 0.45),
    'd" axis="1 0 0': (0.2, 0.0, 0.05), 'e" type="slide" axis="0 0 1': (0.22, 0.0, 0.0), 'f" axis="0 0.6 0.8': (0.08, 0.03, 0.0),
}  # fmt: skip


def chain(places):
    """Bodies in a row, each with its centre of mass off its joint."""
    inertial = '<inertial pos="0.03 0.02 0.05" mass="2" diaginertia="0.1 0.1 0.12"/>'
    bodies = (
        f'<body name="link {joint[0]}" pos="{" ".join(map(str, place))}"><joint name="{joint}"/>{inertial}'
        for joint, place in zip(CHAIN, places)
    )
    return f"<mujoco><worldbody>{''.join(bodies)}{'</body>' * len(CHAIN)}</worldbody></mujoco>"


@pytest.mark.parametrize("off", [0.01, 300.0])
@pytest.mark.parametrize("axis", range(3))
def test_the_place_of_one_joint_in_the_body_before_is_one_cause(tmp_path, axis, off):
    """Whatever it carries is moved with it; the first joint is that of a robot elsewhere."""
    right = np.array([*CHAIN.values()])
    for k, joint in enumerate(CHAIN):
        wrong = right.copy()
        wrong[k, axis] += off
        result = beside_solution(tmp_path, chain(wrong), chain(right))
        found = [
            (cause.place, *map(pytest.approx, (cause.stated, cause.explains))) for cause in result.causes
        ]
        assert found == [(f"offset {'xyz'[axis]} of {joint[0]}", right[k, axis], wrong[k, axis])] * (k > 0)
        assert len(failing(result)) == len(found)


def test_what_is_off_in_many_places_is_not_moved_to_where_some_are_near(tmp_path):
    """All in mm: the first joint is that of a robot elsewhere. An anchor beside the axis, of a body in its place."""
    right = np.array([*CHAIN.values()])
    in_mm = chain(1e3 * right).replace('"0.03 0.02 0.05"', '"30 20 50"')
    off = {check.scene for check in beside_solution(tmp_path, in_mm, chain(right)).checks if check.failed}
    assert off == {*"bcdef", *(f"link {joint[0]}" for joint in CHAIN)}
    beside = chain(right).replace('axis="0 0.6 0.8"', 'axis="0 0.6 0.8" pos="0.01 0.06 0.08"')
    assert sorted(failing(beside_solution(tmp_path, beside, chain(right)))) == ["com", "offset"]


@pytest.mark.parametrize("off, names", [(4e-15, []), (4e-14, ["com"])])
def test_a_centre_of_mass_is_that_of_the_solution_to_rounding_of_lengths(tmp_path, off, names):
    text = CART.replace('pos="0 0 0.4"', f'pos="0 0 {0.4 + off!r}"')
    assert failing(beside_solution(tmp_path, text)) == names


def test_a_small_body_beside_a_large_one_has_its_own_tolerance(tmp_path):
    large = CART.replace('mass="2" diaginertia="1 1 1"', 'mass="1e5" diaginertia="1e6 1e6 1e6"')
    small = large.replace('mass="1" diaginertia="0.1 0.2 0.3"', 'mass="1e-3" diaginertia="1e-9 1e-9 1e-9"')
    for old, new in (("1e-9 1e-9 1e-9", "1e-9 1.000001e-9 1e-9"), ('mass="1e-3"', 'mass="1.000000001e-3"')):
        assert len(failing(beside_solution(tmp_path, small.replace(old, new), small))) == 1
    assert failing(beside_solution(tmp_path, small, small)) == []


def test_joints_that_follow_each_other_in_another_order_are_compared_by_their_names(tmp_path):
    joints = '<joint name="yaw" axis="0 0 1"/>', '<joint name="pitch" axis="0 1 0"/>'
    link = '<body name="b">{}{}<inertial pos="0 0 -0.5" mass="2" diaginertia="1 1 1"/></body>'
    link = f"<mujoco><worldbody>{link}</worldbody></mujoco>"
    result = beside_solution(tmp_path, link.format(*joints), link.format(*joints[::-1]))
    assert {cause.place for cause in result.causes} == {"parent of yaw", "parent of pitch"}


def small_link(com, quat, diagonal):
    return f'<body name="b"><joint name="j"/><inertial pos="{com}" quat="{quat}" mass="2" diaginertia="{diagonal}"/></body>'


def test_what_a_saved_file_rounds_is_one_cause_beneath_a_number_that_is_wrong(tmp_path):
    """A file of many digits, saved by MuJoCo with six; then its com 1 % off."""
    right, saved, wrong = (tmp_path / name for name in ("right.xml", "saved.xml", "wrong.xml"))
    link = small_link(
        "0.123456789 0 -0.5", "0.87995812 0.04785356 -0.01442092 0.47241512", "0.11234567 0.09123456 0.04"
    )
    right.write_text(f"<mujoco><worldbody>{link}</worldbody></mujoco>")
    mujoco.mj_saveLastXML(str(saved), mujoco.MjModel.from_xml_path(str(right)))
    text = saved.read_text()
    assert "-0.5" in text
    wrong.write_text(text.replace("-0.5", "-0.505"))
    for file, places in ((saved, 1), (wrong, 2)):
        compared = compared_with(str(right), str(file))
        result = parameters.rows(
            Setup.quick(compared.robot, engines(compared.mujoco, None), reading=compared.reading)
        )
        assert "inertia" in failing(result) and len(result.causes) == places
        assert result.causes[-1].rank == 3 and "mj_saveLastXML" in result.causes[-1].text
    assert result.causes[0].place == "com of b" or result.causes[0].place.startswith("com")


@pytest.mark.parametrize("share, are_rounded", [(0.9, True), (1.1, False)])
def test_six_digits_move_a_number_by_no_more_than_their_tolerance(share, are_rounded):
    there, off = np.array([0.3, -2.0, 1.0]), share * 1e-5 * 2.0 * np.array([0.5, 1.0, 0.25])
    result = Result("parameters")
    com, axis = (Stated("b", name, there, there + off, tolerance=1e-15) for name in ("com", "axis"))
    causes = causes_of([compare_number(result, each, "") for each in (com, axis)], ("here", "there"))
    assert (len(causes) == 1 and causes[0].rank == 3) == are_rounded


MOMENTS = 1.0, 2.0, 2.5


def tensor(moments, degrees=0.0, axis=(0.0, 0.0, 1.0)):
    R = Rotation.from_rotvec(np.deg2rad(degrees) * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    return R @ np.diag(moments) @ R.T


STRAIGHT, TURNED, ALL = (
    tensor(MOMENTS),
    tensor(MOMENTS, 40, (1, -2, 3)),
    "inertia xx, xy, xz, yy, yz, zz of b",
)
SIXTH, SEVENTH = (tensor([1.0, 2.0, 2.5 * (1.0 + off)], 40, (1, -2, 3)) for off in (1.1e-5, 0.9e-5))


@pytest.mark.parametrize("there, here, place, degrees", [
    (STRAIGHT, TURNED, "inertia of b", 40), (TURNED, STRAIGHT, "inertia of b", 40),
    (STRAIGHT, tensor(MOMENTS, 30), "inertia of b", 30), (STRAIGHT, SEVENTH, "inertia of b", 40), (STRAIGHT, SIXTH, ALL, None),
    (tensor([2.0, 2.0, 0.5]), tensor([2.0, 2.0, 0.5], 130, (1, 1, 0)), "inertia of b", 50),  # of a rod
    (STRAIGHT, tensor([2.0, 1.0, 2.5]), "inertia xx, yy of b", None),  # exchanged
    (STRAIGHT + 1e-4 * (1.0 - np.eye(3)), STRAIGHT, "inertia xy, xz, yz of b", None),  # left out
])  # fmt: skip
def test_a_tensor_that_one_rotation_explains_is_turned(there, here, place, degrees):
    inertia = Stated("b", "inertia", there.ravel(), here.ravel(), tolerance=1e-15)
    com = Stated("b", "com", np.zeros(3), np.array([0.0, 0.1, 0.0]), tolerance=1e-15)
    result = Result("parameters")
    numbers = [compare_number(result, number, "") for number in (inertia, com)]
    causes = causes_of(numbers if degrees else numbers[:1], ("here", "there"))
    assert [cause.place for cause in causes] == [place, "com y of b"][: 1 + bool(degrees)]
    assert degrees is None or causes[0].explains == pytest.approx(degrees, rel=1e-4)


def test_an_inertial_frame_that_a_conversion_did_not_turn_is_one_cause(tmp_path):
    quat = "0.8 0.2 -0.4 0.4"
    link = f"<mujoco><worldbody>{small_link('0.1 0 -0.5', quat, '0.11 0.09 0.04')}</worldbody></mujoco>"
    (cause,) = beside_solution(tmp_path, link.replace(quat, "1 0 0 0"), link).causes
    assert cause.place == "inertia of b" and cause.explains == pytest.approx(2.0 * np.rad2deg(np.arccos(0.8)))
