"""The compiled model of the arm beside its stated numbers: each one that differs fails its own check and is the cause."""

import re

import pytest
from edited import XML, setup_of

from compare.experiment import Setup, new_causes
from compare.experiments import parameters
from compare.report.verdict import Section

ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge"' for name in ("alpha", "beta", "gamma"))
FOREARM = '<inertial pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"/>'
BODY = '<body name="forearm" pos="0 0 -0.3"'
ON_THE_WORLD = XML.replace('<body name="fore', '</body><body name="fore').replace("</body>\n    </body>", "</body>")
STAGES_OFF = 'contact="disable" constraint="disable"'
GEOM = '<geom size="0.001" pos="0.2 0.2 0.2"/>'
TOUCHING = XML.replace("</worldbody>", f"{GEOM}</worldbody>").replace(FOREARM, FOREARM + GEOM)
TABLE = '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>'
TENDON = '<tendon><fixed armature="0.1"><joint joint="beta" coef="1"/></fixed></tendon>'

DIFFERS = {  # by quantity: what is replaced by what; the causes: rank, place, stated, compiled
    "flag gravity": ("<flag", '<flag gravity="disable"', [(1, "flag gravity", 1, 0)]),
    "flag damper": ("<flag", '<flag damper="disable"', [(1, "flag damper", 1, 0)]),
    "flag eulerdamp": ("<flag", '<flag eulerdamp="disable"', [(1, "flag eulerdamp", 1, 0)]),
    "order": (f'{ALPHA} axis="0 1 0"/>\n      {BETA} axis="1 0 0"/>', f'{BETA} axis="1 0 0"/>\n      {ALPHA} axis="0 1 0"/>',
              [(1, "order of alpha", 0, 1), (1, "order of beta", 1, 0)]),
    "parent": (XML, ON_THE_WORLD, [(1, "parent of gamma", 1, -1)]),
    "ref": (GAMMA, f'{GAMMA} ref="0.5"', [(1, "ref of gamma", 0, 0.5)]),
    "axis": (f'{BETA} axis="1', f'{BETA} axis="-1', [(1, "axis x of beta", 1, -1)]),
    "anchor": (BETA, f'{BETA} pos="0.01 0 0"', [(2, "anchor x of beta", 0, 0.01), (2, "com x of upper arm", 0, -0.01)]),
    "damping": (BETA, f'{BETA} damping="0.1"', [(2, "damping of beta", 0, 0.1)]),
    "armature": (ALPHA, f'{ALPHA} armature="0.1"', [(2, "armature of alpha", 0, 0.1)]),
    "frictionloss": (BETA, f'{BETA} frictionloss="0.2"', [(2, "frictionloss of beta", 0, 0.2)]),
    "stiffness": (BETA, f'{BETA} stiffness="0.1"', [(2, "stiffness of beta", 0, 0.1)]),
    "limited": (GAMMA, f'{GAMMA} limited="true" range="-9 9"', [(2, "limited of gamma", 0, 1)]),
    "mass": ('mass="1.5"', 'mass="1.50000000001"', [(2, "mass of forearm", 1.5, 1.50000000001)]),
    "com": ('pos="0.15 0 0"', 'pos="0.151 0 0"', [(2, "com x of forearm", 0.15, 0.151)]),
    "inertia": ('"0.001 0.019 0.019"', '"0.002 0.019 0.019"', [(2, "inertia xx of forearm", 0.001, 0.002)]),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="1"', [(2, "gravcomp of forearm", 0, 1)]),
    "gravity": ("-9.81", "-1.62", [(2, "gravity z", -9.81, -1.62)]),
    "density": ("<option", '<option density="1.2"', [(1, "density", 0, 1.2)]),
    "viscosity": ("<option", '<option viscosity="0.1"', [(1, "viscosity", 0, 0.1)]),
    "other mass": ("</worldbody>", TABLE, [(2, "other mass", 0, 2)]),
    "contact pairs": (XML, TOUCHING.replace(STAGES_OFF, ""), [(1, "contact pairs", 0, 1)]),
    "damping beyond linear": (BETA, f'{BETA} damping="0 0.1"', [(2, "damping beyond linear", 0, 0.1)]),
    "stiffness beyond linear": (BETA, f'{BETA} stiffness="0 0.1"', [(2, "stiffness beyond linear", 0, 0.1)]),
    "actuator damping": ("</mujoco>", '<actuator><motor joint="beta" damping="0.1"/></actuator></mujoco>',
                         [(2, "actuator damping", 0, 0.1)]),
    "actuator armature": ("</mujoco>", '<actuator><motor joint="beta" armature="0.1"/></actuator></mujoco>',
                          [(2, "actuator armature", 0, 0.1)]),
    "tendon armature": ("</worldbody>", f"</worldbody>{TENDON}", [(2, "tendon armature", 0, 0.1)]),
}  # fmt: skip
OF_A_SOLUTION = "rest"  # compared with a solution alone


def found(text):
    """What the experiment finds of a model in MJCF text."""
    result = parameters.rows(setup_of(text, make=Setup, states=20))
    failed = {check.quantity for check in result.checks if not check.passed}
    assert bool(failed) == bool(result.curves["causes"])
    return failed, result.curves["causes"]


def edited(*edits):
    text = XML
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def places(text):
    return [cause["place"] for cause in found(text)[1]]


def test_every_quantity_is_one_that_can_differ():
    assert DIFFERS.keys() == parameters.QUANTITIES.keys() - {OF_A_SOLUTION}
    assert found(XML) == (set(), [])


@pytest.mark.parametrize("quantity", DIFFERS)
def test_a_number_that_differs_fails_its_own_check_and_is_the_cause(quantity):
    old, new, causes = DIFFERS[quantity]
    try:
        failed, known = found(edited((old, new)))
    except ValueError:
        if quantity == "flag damper":  # one flag for springs and dampers before there were two
            failed, known = found(edited((old, '<flag passive="disable"')))
        elif quantity in parameters.NOT_HAD:
            pytest.skip("this MuJoCo does not have it")
        else:
            raise
    assert quantity in failed
    assert [(c["rank"], c["place"], c["stated"], pytest.approx(c["found"], rel=1e-14)) for c in known] == causes


def test_the_sentence_of_a_cause_has_its_place_the_stated_number_and_the_compiled_one():
    for mass in ("1.501", "1.50000000001"):
        (cause,) = found(edited(('mass="1.5"', f'mass="{mass}"')))[1]
        assert cause["place"] in cause["text"] and re.findall(r"\d\.\d+", cause["text"]) == ["1.5", mass]


@pytest.mark.parametrize("off, fails", [(60, False), (70, True)])
def test_a_parameter_is_compared_within_64_eps(off, fails):
    mass = 1.5 * (1.0 + off * 2.0**-52)
    assert bool(found(edited(('mass="1.5"', f'mass="{mass!r}"')))[0]) is fails


def test_causes_come_by_rank_then_by_size():
    """Not in the order in which numbers are read: mass, CoM, air."""
    edits = (
        ('mass="1.9"', 'mass="1.9000001"'),
        ('pos="0.15 0 0"', 'pos="0.151 0 0"'),
        ("<option ", '<option density="1.2" '),
    )
    assert places(edited(*edits)) == ["density", "com x of forearm", "mass of upper arm"]


def test_a_force_that_no_number_explains_is_the_cause():
    servo = "</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>'
    assert places(edited(servo)) == ["forces of actuators"]
    assert set(places(edited(servo, ('mass="1.5"', 'mass="1.501"')))) == {"forces of actuators", "mass of forearm"}
    held = "</mujoco>", '<equality><joint joint1="gamma" polycoef="0.3 0 0 0 0"/></equality></mujoco>'
    assert places(edited(held, ('constraint="disable" ', ""))) == ["forces of constraints and contacts"]


def test_geoms_that_can_touch_are_named_though_they_do_not_at_the_states():
    """Excluded, or without the contact stage, they cannot."""
    excluded = '<contact><exclude body1="world" body2="forearm"/></contact></mujoco>'
    for text in (
        TOUCHING.replace(STAGES_OFF, 'contact="disable"'),
        TOUCHING.replace(STAGES_OFF, 'constraint="disable"'),
        TOUCHING.replace(STAGES_OFF, "").replace("</mujoco>", excluded),
    ):
        assert places(text) == []


@pytest.mark.parametrize("edits, causes", [
    ([(BODY, f'{BODY} euler="0 90 0"')], ["zero of gamma"]),  # 90 degrees where radians are meant
    ([('"0.015 0.014 0.002"', '"0.002 0.014 0.015"')], ["axes x and z of the inertia of upper arm exchanged"]),
    ([('mass="1.9"', 'mass="3.9"'), ('pos="0.15 0 0"', 'pos="0.16 0 0"')], ["mass of upper arm", "com x of forearm"]),
    ([(BODY, f'{BODY} euler="0 90 0"'), (GAMMA, f'{GAMMA} damping="0.1"')], ["zero of gamma", "damping of gamma"]),
    ([(GAMMA, f'{GAMMA} damping="0.1" limited="true" range="-9 9"')], ["damping of gamma", "limited of gamma"]),
])  # fmt: skip
def test_one_convention_or_slip_stands_for_the_numbers_that_follow_from_it(edits, causes):
    setup = setup_of(edited(*edits), make=Setup, states=20)
    sections = [Section("parameters", "", "", "", parameters.rows(setup))]
    assert [cause["place"] for cause in new_causes(setup, sections, [])] == causes
