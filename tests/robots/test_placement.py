"""A file that models a stated robot otherwise: placed elsewhere, with welded bodies or links without mass."""

import numpy as np
import pytest
from helpers.edited import CART, XML, edited

import tmt
from compare.engines.mujoco import read
from compare.engines.mujoco.inventory import contact_pairs
from compare.engines.mujoco.source import Source
from compare.robots.arm import ARM
from compare.robots.placement import placed
from compare.run.reference import compared_with

UPPER = '<body name="upper_arm" pos="0 0 0"'
FOREARM = '<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"/>'
STATES = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 8, 3))
# the forearm's mass, centre of mass and tensor in two bodies, of which one is turned
SPLIT = """<inertial pos="0.12 0 0" mass="1" diaginertia="0.0006 0.012 0.012"/><body name="hand" pos="0.21 0 0" euler="0 0 0.7">
<inertial pos="0 0 0" euler="0 0 -0.7" mass="0.5" diaginertia="0.0004 0.0043 0.0043"/></body>"""
STAND = (
    '<body name="stand" pos="0 0 2"><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/></body></worldbody>'
)
YOKE = '<body name="yoke"><joint name="alpha" type="hinge" axis="0 1 0"/>'
GAMMA, REF = 'name="gamma"', 'name="gamma" ref="1.5707963267948966"'
ALONG = edited((GAMMA, f'{GAMMA} pos="0 0.07 0"'), ('name="alpha"', 'name="alpha" pos="0 -0.02 0"'))
AS_LINKS = edited(('<joint name="alpha" type="hinge" axis="0 1 0"/>', ""), (UPPER, f"{YOKE}{UPPER}"),
                  ("</worldbody>", "</body></worldbody>"))  # fmt: skip
BY_LINK = '<inertial pos="0 0 0" mass="1e-9" diaginertia="{0} {0} {0}"/>'
TAG = '<body name="tag" pos="0.1 0 0"><inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/></body>'
# the forearm hangs, and that is called 90 degrees
HANGING = edited(
    (GAMMA, REF), (FOREARM, '<inertial pos="0 0 -0.15" mass="1.5" diaginertia="0.019 0.019 0.001"/>')
)


def moved(more):
    return edited((UPPER, UPPER.replace('pos="0 0 0"', more)))


OTHERWISE = {  # how, the file, and what is said
    "moved": (moved('pos="0.2 0.1 1.4"'), "moved by (0.2, 0.1, 1.4) m"),
    "turned": (moved('pos="0 0 0" euler="0 0 0.6"'), "turned by 34.3775 deg about (0, 0, 1), gravity with it"),
    "y up": (edited(("0 0 -9.81", "0 -9.81 0"), text=moved('euler="-1.5707963267948966 0 0"')), "gravity with it"),
    "drawn": (HANGING, "drawn at another position (ref) of gamma"),
    "along": (ALONG, "anchor elsewhere on the axis of alpha and gamma"),
    "welded": (edited((FOREARM, SPLIT)), "one (hand on forearm)"),
    "stand": (edited(("</worldbody>", STAND)), "fixed to the world, without motion: stand"),
    "massless": (AS_LINKS, "links without mass: yoke"),
    "negligible": (AS_LINKS.replace(YOKE, YOKE + BY_LINK.format(1e-9)), "below 1e-6 of what it carries: yoke"),
    "tag": (edited((FOREARM, FOREARM + TAG)), "below 1e-6 of what it carries: tag"),
}  # fmt: skip


@pytest.mark.parametrize(
    "name, reference", [*((name, "arm") for name in OTHERWISE), ("turned", str(ARM.mjcf))]
)
def test_what_moves_as_stated_is_compared_in_its_place_and_said_to_be_otherwise(name, reference, tmp_path):
    text, says = OTHERWISE[name]
    (tmp_path / "file.xml").write_text(text)
    compared = compared_with(reference, str(tmp_path / "file.xml"))
    lines = compared.reference.lines
    assert says in " ".join(lines) and lines[1:] == compared.reference.otherwise
    tree, mujoco, (q, qd, tau) = compared.robot.tree, compared.mujoco.of(compared.robot.case()), STATES
    for mine in (tmt.ARM, tree):  # which is moved, and has the same equations
        assert np.abs(mujoco.mass_matrix(q) - tmt.mass_matrix(mine, q)).max() < 1e-14
        assert np.abs(mujoco.acceleration(q, qd, tau) - tmt.acceleration(mine, q, qd, tau)).max() < 1e-11
    if name != "massless":
        assert np.abs(mujoco.com_positions(q) - tmt.com_positions(tree, q)).max() < 1e-14
        energies = mujoco.energy(q, qd) - tmt.energy(tree, q, qd)
        assert np.abs(energies).max() < 1e-12


MOTOR = """</worldbody><actuator><general name="drive" joint="gamma" gear="{}" ctrlrange="0 5"
  biastype="affine" biasprm="0 -20 {}"/></actuator>"""
LIMITED = GAMMA + ' range="0 {}"'


@pytest.mark.parametrize("limit, gear, kv, says", [
    (1, 5, -2, ()), (2, 5, -2, ("not compared, and not as in the solution: limits of gamma",)),
    (1, 6, -2, ("not compared, and not as in the solution: actuators (drive)",)),
    (1, 5, -3, ("not compared, and not as in the solution: actuators (drive)",)),
])  # fmt: skip
def test_limits_and_actuators_that_differ_from_a_solution_are_told(limit, gear, kv, says, tmp_path):
    for name, numbers in {"file.xml": (limit, gear, kv), "solution.xml": (1, 5, -2)}.items():
        changes = (GAMMA, LIMITED.format(numbers[0])), ("</worldbody>", MOTOR.format(*numbers[1:]))
        (tmp_path / name).write_text(edited(*changes))
    compared = compared_with(str(tmp_path / "solution.xml"), str(tmp_path / "file.xml"))
    assert compared.reference.otherwise == says


@pytest.mark.parametrize("text", [
    edited(('name="beta" type="hinge" axis="1 0 0"', 'name="beta" type="hinge" axis="-1 0 0"')),
    XML.replace('axis="0 1 0"', 'axis="0 -1 0"'), edited(("0 0 -9.81", "0 0 9.81")),
    edited(('pos="0 0 -0.3"', 'pos="0 0 -0.31"')),
    edited((GAMMA, REF)),
    edited(('axis="1 0 0"', 'axis="0 0 1"')), edited((FOREARM, FOREARM.replace("0.15", "-0.15"))),
])  # fmt: skip
def test_what_moves_otherwise_is_not_moved_nor_turned(text):
    tree = read(text).tree
    placement = placed(tmt.ARM, tree)
    assert placement.is_same and placement.tree is tmt.ARM and placement.remarks() == []


@pytest.mark.parametrize("sideways, is_with", [(0.0, True), (0.002, False)])
def test_gravity_is_turned_with_a_robot_or_is_another(sideways, is_with):
    turned = edited(("0 0 -9.81", f"{sideways} 0 -9.81"), text=moved('pos="0 0 0" euler="0 0 0.6"'))
    placement = placed(tmt.ARM, read(turned).tree)
    assert placement.is_turned and placement.is_with_gravity is is_with


def test_the_anchor_of_a_slide_may_be_anywhere_that_of_a_ball_may_not():
    tree, q = read(CART).tree, np.array([0.3, 0.7, 0.5, 0.5, -0.5, 0.5])
    wrist = CART.replace('pos="0 0.01 0"', 'pos="0 0.02 0"')
    placement = placed(tree, read(CART.replace('name="rail"', 'name="rail" pos="0 1 2"')).tree)
    assert placement.along == ("rail",) and not placement.is_moved and not placement.is_turned
    assert np.abs(tmt.mass_matrix(placement.tree, q) - tmt.mass_matrix(tree, q)).max() < 1e-14
    assert placed(tree, read(wrist).tree).is_same


def test_locked_joints_make_no_contacts_that_the_file_does_not_have():
    """Of neighbours of which one stands still; others stay."""
    capsule = '<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>'
    floor = '<geom type="plane" size="1 1 1" pos="0 0 -2"/>'
    text = edited((FOREARM, FOREARM + capsule), ('contact="disable" constraint="disable" ', ""))
    text = text.replace('<inertial pos="0 0 -0.15"', f'{capsule}<inertial pos="0 0 -0.15"')
    for more, pairs in {"": 0, floor: 1}.items():
        source = Source(text.replace("</worldbody>", f"{more}</worldbody>"))
        model = source.without({"alpha": 0.3, "beta": 0.2})
        assert len(contact_pairs(model)) == pairs and model.ngeom == source.model.ngeom == 2 + pairs
    assert len(contact_pairs(source.model)) == 2  # with the upper arm too, which moves there
