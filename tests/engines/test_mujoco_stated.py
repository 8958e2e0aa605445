"""What a file states beside what the compiler made of it: the same, or an option of the file asks for the change."""

import numpy as np
import pytest
from files import EVERYTHING, PLAIN, mjcf

from compare.engines.mujoco import read
from compare.engines.mujoco.stated import stated_numbers
from compare.robots.arm import ARM

SMALL = 1e-14  # relative; of a tensor up to MuJoCo 3.10: its principal moments are found to about 1e-6
DIGITS = {"inertia": 1e-6}


def difference(row):
    """Of a row that states something, relative to what was compiled."""
    return np.abs(np.subtract(row.stated, row.compiled)).max() / max(np.abs(row.compiled).max(), 1e-3)


def rows_of(text):
    return {(row.place, row.quantity): row for row in stated_numbers(read(text))}


@pytest.mark.parametrize("text", [EVERYTHING, ARM.mjcf], ids=["everything", "arm"])
def test_a_file_that_asks_for_no_change_states_what_is_compiled(text):
    rows = stated_numbers(read(text))
    assert {"pos", "mass", "com", "inertia", "axis", "armature", "damping", "stiffness"} <= {
        row.quantity for row in rows
    }
    for row in rows:
        if row.stated is None:
            assert row.why == "inertia from geoms"
        else:
            assert difference(row) <= DIGITS.get(row.quantity, SMALL) and not row.why


BODY = '<body name="b"><joint name="j"/><inertial pos="0.1 0 0" mass="1" diaginertia="1 1 1"/>{}</body>'
OPTIONS = {  # option: file, and the quantities that it changes
    "boundmass": (mjcf(BODY.format(""), '<compiler boundmass="2"/>'), {"mass"}),
    "boundinertia": (
        mjcf(BODY.format("").replace("1 1 1", "1 1.5 2"), '<compiler boundinertia="1.9"/>'),
        {"inertia"},
    ),
    "balanceinertia": (
        mjcf(BODY.format("").replace("1 1 1", "1 1 3"), '<compiler balanceinertia="true"/>'),
        {"inertia"},
    ),
    "settotalmass": (mjcf(BODY.format(""), '<compiler settotalmass="3"/>'), {"mass", "inertia"}),
    "inertiafromgeom": (
        mjcf(BODY.format('<geom size="0.1" pos="0 0.2 0"/>'), '<compiler inertiafromgeom="true"/>'),
        {"mass", "com", "inertia"},
    ),
    "springdamper": (
        mjcf(BODY.format("").replace('name="j"', 'name="j" springdamper="1 0.5"')),
        {"damping", "stiffness"},
    ),
}


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_that_asks_for_a_change_is_named_where_it_changes(option):
    text, quantities = OPTIONS[option]
    rows = rows_of(text)
    assert {row.quantity for row in rows.values() if row.why == option} == quantities
    for row in rows.values():
        assert row.why in ("", option)
        assert (difference(row) > 0.1) == (row.quantity in quantities)


def test_the_mass_of_geoms_is_stated_where_each_has_one():
    rows = rows_of(mjcf(PLAIN.replace('name="g"', 'name="g" mass="2"')))
    assert (rows["b", "mass"].stated, rows["b", "mass"].compiled, rows["b", "mass"].why) == (2.0, 2.0, "")
    assert rows_of(mjcf())["b", "mass"].stated is None
    rows = rows_of(mjcf(PLAIN.replace('name="g"', 'name="g" mass="2"'), '<compiler settotalmass="3"/>'))
    assert (rows["b", "mass"].stated, rows["b", "mass"].compiled, rows["b", "mass"].why) == (2.0, 3.0, "settotalmass")


def test_an_attached_model_keeps_its_own_settings(tmp_path):
    part = mjcf(
        '<body name="p"><frame euler="0.1 0.2 0.3"><joint name="pj" pos="0 0 0.1" axis="0 2 1"/></frame>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 2 2.5" euler="0.5 0.2 0"/></body>',
        '<compiler angle="radian" eulerseq="zyx" boundmass="5"/>',
    )
    (tmp_path / "part.xml").write_text(part)
    whole = mjcf(
        '<frame euler="10 20 30" pos="1 0 0">'
        + BODY.format('<attach model="part" body="p" prefix="a_"/>')
        + "</frame>",
        '<compiler boundmass="0.5"/><asset><model name="part" file="part.xml"/></asset>',
    )
    path = tmp_path / "whole.xml"
    path.write_text(whole)
    rows = rows_of(path)
    assert rows["a_p", "mass"].why == "boundmass" and not rows["b", "mass"].why
    for key, row in rows.items():
        assert key == ("a_p", "mass") or difference(row) <= DIGITS.get(row.quantity, SMALL)


def test_a_number_that_differs_without_an_option_is_found():
    reading = read(mjcf(BODY.format("")))
    reading.model.body_mass[1] = 1.5
    reading.model.dof_damping[0] = 0.1
    wrong = [row for row in stated_numbers(reading) if not row.why and difference(row) > SMALL]
    assert [(row.place, row.quantity, row.stated, row.compiled) for row in wrong] == [
        ("b", "mass", 1.0, 1.5),
        ("j", "damping", 0.0, 0.1),
    ]
