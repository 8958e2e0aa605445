"""What a file states beside what the compiler made of it: the same, or an option of the file asks for the change."""

import mujoco
import numpy as np
import pytest
from files import PLAIN, URDF, mjcf
from models import PATHS

from compare.engines.mujoco import Source
from compare.engines.mujoco.parameters import stated_numbers
from compare.judge.scale import EPS

SMALL = 1e-14  # relative; of a tensor up to MuJoCo 3.10: its principal moments are found to about 1e-6
DIGITS = {"inertia": 1e-6}
FRAMES = """<frame pos="0.1 0.2 0.3" euler="10 20 30"><body name="b" pos="1 2 3" euler="40 50 60">
<inertial pos="0.2 0 0.1" mass="1" diaginertia="0.02 0.03 0.04" euler="10 20 30"/>
<frame pos="0.3 0 0" euler="0 90 0"><joint name="j" axis="1 2 0" pos="0.1 0.2 0.3" damping="2" stiffness="3"/></frame>
</body></frame>"""
INERTIAL = """<body name="b"><frame pos="0.1 0.2 0.3" euler="10 20 30"><frame pos="0.3 0 0" euler="0 90 0">
<joint name="j" damping="2" stiffness="3"/>
<inertial pos="0.2 0 0.1" mass="1" fullinertia="0.02 0.03 0.04 0.001 0.002 0.003"/></frame></frame></body>"""
TURNED = pytest.mark.skipif(mujoco.mj_version() < 4_000_000, reason="MuJoCo 3.10 leaves out the rpy")
SOURCES = [PATHS["mixed"], mjcf(FRAMES, '<compiler eulerseq="zyx"/>'), mjcf(INERTIAL), mjcf()]
SOURCES += [pytest.param(URDF, marks=TURNED)]
BODY = '<body name="b"><joint name="j"/><inertial pos="0.1 0 0" mass="1" diaginertia="{}"/>{}</body>'
OPTIONS = {  # the quantities that it changes: of a file with these principal moments and something in its body
    'boundmass="2"': ({"mass"}, "1 1 1", ""), 'boundinertia="1.9"': ({"inertia"}, "1 1.5 2", ""),
    'balanceinertia="true"': ({"inertia"}, "1 1 3", ""), 'settotalmass="3"': ({"mass", "inertia"}, "1 1 1", ""),
    'inertiafromgeom="true"': ({"mass", "com", "inertia"}, "1 1 1", '<geom size="0.1" pos="0 0.2 0"/>'),
    'springdamper="1 0.5"': ({"damping", "stiffness"}, "1 1 1", ""), 'boundmass="0.5"': (set(), "1 1.5 2", ""),
    'boundinertia="0.5"': (set(), "1 1.5 2", ""), 'settotalmass="1"': (set(), "1 1.5 2", ""),
    'balanceinertia="true" settotalmass="1"': (set(), "1 1.5 2", ""),
}  # fmt: skip


def difference(row):
    """Of a row that states something, relative to what was compiled."""
    return np.abs(np.subtract(row.stated, row.compiled)).max() / max(np.abs(row.compiled).max(), 1e-3)


def rows_of(text):
    return {(row.place, row.quantity): row for row in stated_numbers(Source(text))}


@pytest.mark.parametrize("source", SOURCES)
def test_a_file_that_asks_for_no_change_states_what_is_compiled(source):
    rows = rows_of(source)
    known = {"pos", "mass", "com", "inertia", "axis", "armature", "damping", "stiffness"}
    assert known <= {quantity for _, quantity in rows}
    for row in rows.values():
        if row.stated is None:
            assert row.why == "inertia from geoms"
        else:
            assert difference(row) <= DIGITS.get(row.quantity, SMALL) and not row.why


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_that_asks_for_a_change_is_named_where_it_changes_something(option):
    (quantities, *body), name = OPTIONS[option], option.split("=")[0]
    of_joint = name == "springdamper"
    text = BODY.format(*body).replace('name="j"', f'name="j" {option if of_joint else ""}')
    rows = rows_of(mjcf(text, "" if of_joint else f"<compiler {option}/>"))
    assert {row.quantity for row in rows.values() if row.why == name} == quantities
    for row in rows.values():
        assert row.why in ("", name) and (difference(row) > 0.1) == (row.quantity in quantities)


def test_the_mass_of_geoms_is_stated_where_each_has_one():
    heavy = PLAIN.replace('name="g"', 'name="g" mass="2"')
    row = rows_of(mjcf(heavy))["b", "mass"]
    assert (row.stated, row.compiled, row.why) == (2.0, 2.0, "")
    assert rows_of(mjcf())["b", "mass"].stated is None


def test_a_tensor_may_be_off_by_rounding_of_the_sum_of_its_moments():
    row = rows_of(mjcf(BODY.format("1 1.5 2", "")))["b", "inertia"]
    assert row.tolerance == pytest.approx(64 * EPS * 4.5)
