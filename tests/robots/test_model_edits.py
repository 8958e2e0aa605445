"""Edits of the arm's MJCF: each number that differs fails its own check and is the cause. Others: test_judge_compared."""

from dataclasses import replace
from math import pi

import pytest
from helpers.edited import XML, edited, setup_of

from compare.experiments import parameters
from compare.report.verdict import Section
from compare.robots.arm import ARM
from compare.run.examine import Setup, causes

ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge"' for name in ("alpha", "beta", "gamma"))
FOREARM = '<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"/>'
STAGES_OFF = 'contact="disable" constraint="disable"'
BESIDE = XML.replace('<body name="fore', '</body><body name="fore')
ON_THE_WORLD = BESIDE.replace("</body>\n    </body>", "</body>")
FLOOR = '<geom name="floor" type="plane" size="1 1 1" pos="0 0 {}"/>'
GEOM = '<geom size="0.001" pos="0.2 0.2 0.2"/>'
TOUCHING = XML.replace("</worldbody>", FLOOR.format(-0.3) + "</worldbody>").replace(FOREARM, FOREARM + GEOM)
TABLE = '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>'
TENDON = '<tendon><fixed armature="0.1"><joint joint="beta" coef="1"/></fixed></tendon>'

EDITS = {  # by quantity: what is replaced by what; the causes: rank, place, stated, compiled
    "flag gravity": ("<flag", '<flag gravity="disable"', [(1, "flag gravity", 1, 0)]),
    "flag damper": ("<flag", '<flag damper="disable"', [(1, "flag damper", 1, 0)]),
    "flag eulerdamp": ("<flag", '<flag eulerdamp="disable"', [(1, "flag eulerdamp", 1, 0)]),
    "order": (f'{ALPHA} axis="0 1 0"/>\n      {BETA} axis="1 0 0"/>', f'{BETA} axis="1 0 0"/>\n      {ALPHA} axis="0 1 0"/>',
              [(1, "order of the joints", "alpha, beta, gamma", "beta, alpha, gamma")]),
    "parent": (XML, ON_THE_WORLD, [(1, "parent of gamma", 1, -1)]),
    "ref": (GAMMA, f'{GAMMA} ref="0.5"', [(1, "ref of gamma", 0, 0.5)]),
    "axis": (f'{BETA} axis="1', f'{BETA} axis="-1', [(1, "axis x of beta", 1, -1)]),
    "offset": ('pos="0 0 -0.3"', 'pos="0 0 -0.301"', [(2, "offset z of gamma", -0.3, -0.301)]),
    "offset of all": ('name="upper_arm" pos="0 0 0"', 'name="upper_arm" pos="0 0 0.01"',
                      [(2, "offset z of alpha", 0, 0.01)]),
    "anchor": (BETA, f'{BETA} pos="0.01 0 0"', [(2, "anchor x of beta", 0, 0.01), (2, "com x of upper arm", 0, -0.01)]),
    "damping": (BETA, f'{BETA} damping="0.1"', [(2, "damping of beta", 0, 0.1)]),
    "armature": (ALPHA, f'{ALPHA} armature="0.1"', [(2, "armature of alpha", 0, 0.1)]),
    "frictionloss": (BETA, f'{BETA} frictionloss="0.2"', [(2, "frictionloss of beta", 0, 0.2)]),
    "stiffness": (BETA, f'{BETA} stiffness="1"', [(2, "stiffness of beta", 0, 1)]),
    "limited": (GAMMA, f'{GAMMA} limited="true" range="-1 1"', [(2, "limited of gamma", 0, 1)]),
    "mass": ('mass="1.5"', 'mass="1.515"', [(2, "mass of forearm", 1.5, 1.515)]),
    "com": ('pos="0.15 0 0"', 'pos="0.151 0 0"', [(2, "com x of forearm", 0.15, 0.151)]),
    "inertia": ("0.001 0.019 0.019", "0.001 0.01919 0.019", [(2, "inertia yy of forearm", 0.019, 0.01919)]),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="1"', [(2, "gravcomp of forearm", 0, 1)]),
    "gravity": ("-9.81", "-9.80665", [(2, "gravity z", -9.81, -9.80665)]),
    "density": ("<option", '<option density="100"', [(1, "density", 0, 100)]),
    "viscosity": ("<option", '<option viscosity="1"', [(1, "viscosity", 0, 1)]),
    "other mass": ("</worldbody>", TABLE, [(2, "other mass", 0, 2)]),
    "contact pairs": (XML, TOUCHING.replace(STAGES_OFF, ""), [(1, "contact pairs", 0, 1)]),
    "damping beyond linear": (BETA, f'{BETA} damping="0 0.1"', [(2, "damping beyond linear", 0, 0.1)]),
    "stiffness beyond linear": (BETA, f'{BETA} stiffness="0 0.1"', [(2, "stiffness beyond linear", 0, 0.1)]),
    "actuator damping": ("</mujoco>", '<actuator><motor joint="beta" damping="0.1"/></actuator></mujoco>',
                         [(2, "actuator damping", 0, 0.1)]),
    "actuator armature": ("</mujoco>", '<actuator><motor joint="beta" armature="0.1"/></actuator></mujoco>',
                          [(2, "actuator armature", 0, 0.1)]),
    "tendon armature": ("</worldbody>", f"</worldbody>{TENDON}", [(2, "tendon armature", 0, 0.1)]),
    "no forces of actuators": ("</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>',
                               [(2, "forces of actuators (actuator 0 on beta)", 0, pytest.approx(3.0 * pi, rel=0.05))]),
}  # fmt: skip


OF_A_SOLUTION = "rest"  # compared with a solution alone
BODY = '<body name="forearm" pos="0 0 -0.3"'


def found(text):
    result = parameters.rows(setup_of(text, make=Setup, states=20))
    failed = {check.quantity for check in result.checks if not check.passed}
    assert bool(failed) == bool(result.causes)
    return failed, result.causes


def places(text):
    return [cause.place for cause in found(text)[1]]


def test_every_quantity_is_one_that_can_differ():
    assert EDITS.keys() >= parameters.UNITS.keys() - {OF_A_SOLUTION, "pos"}
    assert found(XML) == (set(), [])


@pytest.mark.parametrize("quantity", EDITS)
def test_a_number_that_differs_fails_its_own_check_and_is_the_cause(quantity):
    old, new, causes = EDITS[quantity]
    try:
        failed, known = found(edited((old, new)))
    except ValueError:
        if quantity == "flag damper":  # one flag for springs and dampers before there were two
            failed, known = found(edited((old, '<flag passive="disable"')))
        elif quantity in parameters.ABSENT:
            pytest.skip("this MuJoCo does not have it")
        else:
            raise
    assert quantity.removesuffix(" of all") in failed
    assert [(c.rank, c.place, c.stated) for c in known] == [tuple(cause[:3]) for cause in causes]
    for cause, (*_, number) in zip(known, causes):
        is_number = isinstance(number, int | float)
        assert cause.explains == (pytest.approx(number, rel=1e-14) if is_number else number)


def test_causes_come_by_rank_then_by_size():
    """Not in the order in which numbers are read: mass, CoM, air."""
    mass, com = ('mass="1.9"', 'mass="1.9000001"'), ('pos="0.15 0 0"', 'pos="0.151 0 0"')
    causes = found(edited(mass, com, ("<option ", '<option density="1.2" ')))[1]
    assert [cause.place for cause in causes] == ["density", "com x of forearm", "mass of upper arm"]
    assert "0.151 m in arm.xml" in causes[1].text and "0.15 m in arm" in causes[1].text


def test_contacts_are_a_cause_if_geoms_touch_in_a_scene_or_at_a_random_state():
    (cause,) = found(TOUCHING.replace(STAGES_OFF, ""))[1]
    assert all(word in cause.text for word in ("floor and a geom of forearm touch", " s of zero, free"))
    setup = setup_of(TOUCHING.replace(STAGES_OFF, ""), make=Setup, states=20)
    (cause,) = parameters.rows(replace(setup, robot=replace(ARM, scenes=()))).causes
    assert " at q = (" in cause.text and "zero, free" not in cause.text
    beneath = TOUCHING.replace(STAGES_OFF, "").replace(FLOOR.format(-0.3), FLOOR.format(-0.7))
    assert found(beneath) == (set(), [])


FINGERTIP = FOREARM.replace("0.15", "0.225").replace("1.5", "1.2")


@pytest.mark.parametrize("edits, place, numbers", [
    ([('inertiafromgeom="false"', 'inertiafromgeom="false" settotalmass="3.5"')], "all masses and inertias", "1.02941 times"),
    ([('mass="1.9"', 'mass="1900"'), ('mass="1.5"', 'mass="1500"')], "all masses", "in arm.xml 1000 times those in arm"),
    ([('pos="0 0 -0.15"', 'pos="0 0 -150"'), ('pos="0 0 -0.3"', 'pos="0 0 -300"'), ('pos="0.15 0', 'pos="150 0')],
     "all distances of joints and centres of mass", "1000 times"),
    ([("0.015 0.014 0.002", "0.002 0.014 0.015")], "inertia xx, zz of upper arm",
     "(0.002, 0.015) kg m2 in arm.xml, (0.015, 0.002) kg m2 in arm"),
    ([("<worldbody>", '<default><joint armature="0.01"/></default><worldbody>')],
     "armature of alpha, beta and gamma", "0.01 kg m2 in arm.xml, 0 kg m2 in arm"),
    ([("0 0 -9.81", "0 -9.81 0")], "gravity", "(0, -9.81, 0) m/s2 in arm.xml, (0, 0, -9.81) m/s2 in arm"),
    ([(BETA + ' axis="1 0 0"', BETA + ' axis="0 0 1"')], "axis of beta", "(0, 0, 1) in arm.xml, (1, 0, 0) in arm"),
    ([(FOREARM, FINGERTIP)], "forearm", "mass 1.2 kg, com x 0.225 m in arm.xml; mass 1.5 kg, com x 0.15 m in arm"),
])  # fmt: skip
def test_numbers_of_a_body_and_numbers_that_differ_alike_are_one_cause(edits, place, numbers):
    (cause,) = found(edited(*edits))[1]
    assert cause.place == place == cause.text.partition(":")[0] and numbers in cause.text


def test_a_slip_that_explains_several_numbers_is_the_cause_in_their_place():
    upper_arm = '<inertial pos="0 0 -0.15" mass="1.9" diaginertia="0.015 0.014 0.002"/>'
    setup = setup_of(edited((upper_arm, "@"), (FOREARM, upper_arm), ("@", FOREARM)), states=20, make=Setup)
    result = parameters.rows(setup)
    ((cause,), _) = causes(setup, [Section("parameters", "", "", "", result)])
    assert len(result.causes) == 2 and cause.place == "masses, CoMs and inertias of upper arm and forearm"


def test_what_is_wrong_for_another_reason_stays_another_cause():
    """One of three joints, a mass by another factor."""
    edits = (BETA, f'{BETA} armature="0.1"'), (GAMMA, f'{GAMMA} armature="0.2"')
    assert {*places(edited(*edits))} == {"armature of beta", "armature of gamma"}
    assert len(places(edited(('mass="1.9"', 'mass="3.8"'), ('mass="1.5"', 'mass="3.1"')))) == 2


@pytest.mark.parametrize("edits, places", [
    # 90 degrees where radians are meant
    ([(BODY, f'{BODY} euler="0 90 0"'), (GAMMA, f'{GAMMA} damping="0.1"')], ["zero of gamma", "damping of gamma"]),
    ([(BETA, f'{BETA} pos="0.01 0 0"')], ["anchor x of beta", "com x of upper arm"]),
])  # fmt: skip
def test_one_convention_or_slip_stands_for_the_numbers_that_follow_from_it(edits, places):
    setup = setup_of(edited(*edits), make=Setup, states=20)
    sections = [Section("parameters", "", "", "", parameters.rows(setup))]
    assert [cause.place for cause in causes(setup, sections)[0]] == places
