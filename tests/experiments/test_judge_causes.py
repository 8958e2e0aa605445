"""Where a model differs from the stated one, the number that differs is named."""

import pytest

import tmt
from compare.engines.mujoco import parse
from compare.experiment import Setup, engines, new_causes
from compare.experiments import parameters
from compare.report.verdict import Section
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")


def found(text):
    """What the experiment finds of a model in MJCF text."""
    return parameters.rows(Setup(ARM, engines(parse(text, tmt.ARM)), states=20))


def causes(old, new):
    assert XML.count(old) == 1
    result = found(XML.replace(old, new))
    failed = [check for check in result.checks if not check.passed]
    assert bool(failed) == bool(result.curves["causes"])
    return [(cause["rank"], cause["text"]) for cause in result.curves["causes"]]


ALPHA, BETA, GAMMA = (f'<joint name="{name}" type="hinge" axis="' for name in ("alpha", "beta", "gamma"))
NAMED = {
    "armature of the first": (f"{ALPHA}0", f'{ALPHA}0'.replace("type", 'armature="0.1" type'),
                              [(2, "armature of alpha: stated 0 kg m2, compiled 0.1 kg m2")]),
    "anchor along its own axis": (BETA, BETA.replace("type", 'pos="0.01 0 0" type'),
                                  [(2, "anchor x of beta: stated 0 m, compiled 0.01 m"),
                                   (2, "com x of upper arm: stated 0 m, compiled -0.01 m")]),
    "two numbers": (XML, XML.replace('mass="1.5"', 'mass="1.501"').replace("-9.81", "-9.8"),
                    [(2, "gravity z: stated -9.81 m/s2, compiled -9.8 m/s2"),
                     (2, "mass of forearm: stated 1.5 kg, compiled 1.501 kg")]),
    "last digits": ('mass="1.5"', 'mass="1.50000000001"', [(2, "mass of forearm: stated 1.5 kg, compiled 1.50000000001 kg")]),
    "forearm on the world": (XML, XML.replace('<body name="fore', '</body><body name="fore')
                             .replace("</body>\n    </body>", "</body>"),
                             [(1, "parent of gamma: stated beta, compiled the world")]),
    "nothing": ("</mujoco>", "</mujoco>", []),
    "com": ('pos="0.15 0 0"', 'pos="0.151 0 0"', [(2, "com x of forearm: stated 0.15 m, compiled 0.151 m")]),
    "ref": (GAMMA, GAMMA.replace("type", 'ref="0.5" type'), [(1, "ref of gamma: stated 0 rad, compiled 0.5 rad")]),
    "sign": (f"{BETA}1", f"{BETA}-1", [(1, "axis x of beta: stated 1, compiled -1 (the opposite sign)")]),
    "gravity flag": ("<flag ", '<flag gravity="disable" ', [(1, "flag gravity: stated enable, compiled disable")]),
    "gravity": ("-9.81", "-1.62", [(2, "gravity z: stated -9.81 m/s2, compiled -1.62 m/s2")]),
    "frictionloss": (BETA, BETA.replace("type", 'frictionloss="0.2" type'),
                     [(2, "frictionloss of beta: stated 0 N m, compiled 0.2 N m")]),
    "gravcomp": ('<body name="forearm"', '<body name="forearm" gravcomp="1"', [(2, "gravcomp of forearm: stated 0, compiled 1")]),
    "limit": (GAMMA, GAMMA.replace("type", 'limited="true" range="-1 1" type'), [(2, "limited of gamma: stated 0, compiled 1")]),
    "damping": (GAMMA, GAMMA.replace("type", 'damping="0.1" type'),
                [(2, "damping of gamma: stated 0 N m s/rad, compiled 0.1 N m s/rad")]),
    "density": ("<option ", '<option density="1.2" ', [(1, "density: stated 0 kg/m3, compiled 1.2 kg/m3")]),
    "order": (f'{ALPHA}0 1 0"/>\n      {BETA}1 0 0"/>', f'{BETA}1 0 0"/>\n      {ALPHA}0 1 0"/>',
              [(1, "order of alpha: stated 0, compiled 1"), (1, "order of beta: stated 1, compiled 0")]),
    "table": ("</worldbody>", '<body pos="1 0 0"><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>',
              [(2, "other mass: stated 0 kg, compiled 2 kg")]),
}  # fmt: skip


@pytest.mark.parametrize("old, new, named", NAMED.values(), ids=NAMED)
def test_the_number_that_differs_is_named(old, new, named):
    assert causes(old, new) == named


def test_a_servo_is_named_by_its_force():
    servo = '<actuator><position joint="beta" kp="3"/></actuator></mujoco>'
    ((rank, text),) = causes("</mujoco>", servo)
    assert rank == 2 and text.startswith("forces of actuators: none stated, up to ")


def test_a_force_that_no_number_explains_is_named_beside_a_number():
    both = XML.replace('mass="1.5"', 'mass="1.501"')
    both = both.replace("</mujoco>", '<actuator><position joint="beta" kp="3"/></actuator></mujoco>')
    known = found(both).curves["causes"]
    assert {cause["place"] for cause in known} == {"forces of actuators", "mass of forearm"}


def test_geoms_that_can_touch_are_named_though_they_do_not():
    """Two spheres that meet nowhere at the states that are compared; excluded, or without the contact stage, they cannot."""
    sphere = '<geom size="0.001" pos="0.2 0.2 0.2"/>'
    text = XML.replace("</worldbody>", f"{sphere}</worldbody>").replace(
        '<inertial pos="0.15', f'{sphere}<inertial pos="0.15'
    )
    for flags, places in (("", ["contact pairs"]), ('contact="disable"', []), ('constraint="disable"', [])):
        edited = text.replace('contact="disable" constraint="disable"', flags)
        assert [c["place"] for c in found(edited).curves["causes"]] == places
    apart = text.replace('contact="disable" constraint="disable"', "").replace(
        "</mujoco>", '<contact><exclude body1="world" body2="forearm"/></contact></mujoco>')  # fmt: skip
    assert found(apart).curves["causes"] == []


def test_causes_come_by_rank_then_by_size():
    """Not in the order in which numbers are read: mass, CoM, air."""
    edits = (
        ('mass="1.9"', 'mass="1.9000001"'),
        ('pos="0.15 0 0"', 'pos="0.151 0 0"'),
        ("<option ", '<option density="1.2" '),
    )
    text = XML
    for old, new in edits:
        text = text.replace(old, new)
    known = found(text).curves["causes"]
    assert [cause["place"] for cause in known] == ["density", "com x of forearm", "mass of upper arm"]


def test_touching_is_named_by_its_force():
    """Two bodies welded by a constraint that the file has switched on."""
    weld = '<equality><joint joint1="gamma" polycoef="0.3 0 0 0 0"/></equality></mujoco>'
    text = XML.replace("</mujoco>", weld).replace('constraint="disable" ', "")
    known = found(text).curves["causes"]
    assert [cause["place"] for cause in known] == ["forces of constraints and contacts"]


@pytest.mark.parametrize("off, fails", [(60, False), (70, True)])
def test_a_parameter_is_compared_within_64_eps(off, fails):
    mass = 1.5 * (1.0 + off * 2.220446049250313e-16)
    assert bool(causes('mass="1.5"', f'mass="{mass!r}"')) is fails


FOREARM = '<body name="forearm" pos="0 0 -0.3"'


@pytest.mark.parametrize("edits, places", [
    ([(FOREARM, f'{FOREARM} euler="0 90 0"')], ["zero of gamma"]),  # 90 degrees where radians are meant
    ([('"0.015 0.014 0.002"', '"0.002 0.014 0.015"')], ["axes x and z of the inertia of upper arm exchanged"]),
    ([('mass="1.9"', 'mass="3.9"')], ["mass of upper arm"]),
    ([('mass="1.9"', 'mass="3.9"'), ('pos="0.15 0 0"', 'pos="0.16 0 0"')], ["mass of upper arm", "com x of forearm"]),
    ([(GAMMA, GAMMA.replace("type", 'damping="0.1" limited="true" range="-9 9" type'))],
     ["damping of gamma", "limited of gamma"]),
    ([(FOREARM, f'{FOREARM} euler="0 90 0"'), (GAMMA, GAMMA.replace("type", 'damping="0.1" type'))],
     ["zero of gamma", "damping of gamma"]),
])  # fmt: skip
def test_one_convention_or_slip_stands_for_the_numbers_that_follow_from_it(edits, places):
    text = XML
    for old, new in edits:
        text = text.replace(old, new)
    setup = Setup(ARM, engines(parse(text, tmt.ARM)), states=20)
    sections = [Section("parameters", "", "", "", parameters.rows(setup))]
    assert [cause["place"] for cause in new_causes(setup, sections, [])] == places
