"""The compiled model of the arm beside its stated numbers: each one that differs fails its own check and is the cause."""

import pytest
from edited import XML, setup_of
from model_edits import BETA, EDITS, GAMMA, STAGES_OFF, TOUCHING, edited

from compare.experiment import Setup, new_causes
from compare.experiments import parameters
from compare.report.verdict import Section

OF_A_SOLUTION = "rest"  # compared with a solution alone
BODY = '<body name="forearm" pos="0 0 -0.3"'
SERVO = EDITS["no forces of actuators"][:2]


def found(text):
    """What the experiment finds of a model in MJCF text."""
    result = parameters.rows(setup_of(text, make=Setup, states=20))
    failed = {check.quantity for check in result.checks if not check.passed}
    assert bool(failed) == bool(result.curves["causes"])
    return failed, result.curves["causes"]


def places(text):
    return [cause["place"] for cause in found(text)[1]]


def test_every_quantity_is_one_that_can_differ():
    assert EDITS.keys() >= parameters.QUANTITIES.keys() - {OF_A_SOLUTION}
    assert found(XML) == (set(), [])


@pytest.mark.parametrize("quantity", EDITS)
def test_a_number_that_differs_fails_its_own_check_and_is_the_cause(quantity):
    old, new, causes, _ = EDITS[quantity]
    try:
        failed, known = found(edited((old, new)))
    except ValueError:
        if quantity == "flag damper":  # one flag for springs and dampers before there were two
            failed, known = found(edited((old, '<flag passive="disable"')))
        elif quantity in parameters.NOT_HAD:
            pytest.skip("this MuJoCo does not have it")
        else:
            raise
    assert quantity.removesuffix(" of all") in failed
    assert [(c["rank"], c["place"], c["stated"], pytest.approx(c["found"], rel=1e-14)) for c in known] == causes


@pytest.mark.parametrize("off, fails", [(60, False), (70, True)])
def test_a_parameter_is_compared_within_64_eps_and_told_with_all_its_digits(off, fails):
    mass = 1.5 * (1.0 + off * 2.0**-52)
    failed, causes = found(edited(('mass="1.5"', f'mass="{mass!r}"')))
    assert bool(failed) is fails
    assert all(cause["text"].index("1.5 kg") < cause["text"].index(repr(mass)) for cause in causes)


def test_causes_come_by_rank_then_by_size():
    """Not in the order in which numbers are read: mass, CoM, air."""
    edits = (
        ('mass="1.9"', 'mass="1.9000001"'),
        ('pos="0.15 0 0"', 'pos="0.151 0 0"'),
        ("<option ", '<option density="1.2" '),
    )
    assert places(edited(*edits)) == ["density", "com x of forearm", "mass of upper arm"]


def test_a_force_that_no_number_explains_is_the_cause():
    assert set(places(edited(SERVO, ('mass="1.5"', 'mass="1.501"')))) == {"forces of actuators", "mass of forearm"}
    held = "</mujoco>", '<equality><joint joint1="gamma" polycoef="0.3 0 0 0 0"/></equality></mujoco>'
    assert places(edited(held, ('constraint="disable" ', ""))) == ["forces of constraints and contacts"]


def test_geoms_that_cannot_touch_are_no_cause():
    """They are excluded, or MuJoCo has no contact stage."""
    excluded = '<contact><exclude body1="world" body2="forearm"/></contact></mujoco>'
    for stages, end in (('contact="disable"', "</mujoco>"), ('constraint="disable"', "</mujoco>"), ("", excluded)):
        assert places(TOUCHING.replace(STAGES_OFF, stages).replace("</mujoco>", end)) == []


@pytest.mark.parametrize("edits, causes", [
    ([('"0.015 0.014 0.002"', '"0.002 0.014 0.015"')], ["axes x and z of the inertia of upper arm exchanged"]),
    ([('mass="1.9"', 'mass="3.9"'), ('pos="0.15 0 0"', 'pos="0.16 0 0"')], ["mass of upper arm", "com x of forearm"]),
    # 90 degrees where radians are meant
    ([(BODY, f'{BODY} euler="0 90 0"'), (GAMMA, f'{GAMMA} damping="0.1"')], ["zero of gamma", "damping of gamma"]),
    ([(BETA, f'{BETA} pos="0.01 0 0"')], ["anchor x of beta", "com x of upper arm"]),
])  # fmt: skip
def test_one_convention_or_slip_stands_for_the_numbers_that_follow_from_it(edits, causes):
    setup = setup_of(edited(*edits), make=Setup, states=20)
    sections = [Section("parameters", "", "", "", parameters.rows(setup))]
    assert [cause["place"] for cause in new_causes(setup, sections, [])] == causes
