"""A check that never failed on a seeded error is not a check: slides, balls, armature, springs and reference positions."""

import inspect

import pytest
from jointed import CART, STONE, setup_between

from compare.experiments import module
from tmt.equations import method
from tmt.model import coordinates
from tmt.model.tree import coordinates_of  # the one that trees ask, with what it has kept

IN_THE_MJCF = {
    "a slide's axis 1e-6 off": (
        CART,
        'axis="1 0.2 0"',
        'axis="1 0.200001 0"',
        ["kinematics T_b", "mass Mbar", "gravity holding torque"],
    ),
    "a slide's damping": (
        CART,
        'damping="0.4"',
        'damping="0.400001"',
        ["acceleration qdd", "acceleration tau from", "acceleration dp_rail/dt"],
    ),
    "the armature of a slide": (
        CART,
        'armature="0.3"',
        'armature="0.300001"',
        ["mass Mbar", "acceleration energy", "acceleration dE/dt"],
    ),
    "the armature of a hinge": (CART, 'armature="0.02"', 'armature="0.02000001"', ["mass Mbar", "acceleration energy"]),
    "the armature of a ball": (CART, 'armature="0.01"', 'armature="0.01000001"', ["mass Mbar", "acceleration qdd"]),
    "the spring of a slide": (
        CART,
        'stiffness="20"',
        'stiffness="20.0001"',
        ["gravity holding torque, springs", "gravity qdd", "acceleration qdd", "acceleration potential"],
    ),
    "where a slide's spring rests": (
        CART,
        'springref="0.1"',
        'springref="0.100001"',
        ["gravity holding torque, springs", "acceleration potential"],
    ),
    "a slide's reference": (CART, 'ref="0.05"', 'ref="0.050001"', ["kinematics x_b", "mass Mbar"]),
    "the spring of a hinge": (
        CART,
        'stiffness="5"',
        'stiffness="5.00001"',
        ["gravity holding torque, springs", "acceleration tau from"],
    ),
    "the spring of a ball": (
        CART,
        'stiffness="2"',
        'stiffness="2.00001"',
        ["gravity holding torque, springs", "acceleration energy"],
    ),
    "a hinge's reference": (CART, 'ref="0.4"', 'ref="0.400001"', ["kinematics x_b", "mass Mbar"]),
    "a ball's centre": (CART, 'pos="0 0.01 0"', 'pos="0 0.010001 0"', ["kinematics T_b", "acceleration bias"]),
    "the inertia of a ball's body": (
        CART,
        "0.002 0.003 0.004",
        "0.002 0.003 0.00400001",
        ["mass Mbar", "acceleration bias"],
    ),
    "a free body's mass": (
        STONE,
        'mass="2"',
        'mass="2.000001"',
        ["mass Mbar", "gravity holding torque", "acceleration dlinear momentum"],
    ),
    "a free body's centre of mass": (
        STONE,
        "0.02 0.01 0.03",
        "0.020001 0.01 0.03",
        ["kinematics x_b", "acceleration dangular momentum"],
    ),
}

IN_THE_METHOD = {
    "armature left out of Mbar": (
        method,
        "rotor if rotor else M[i][i]",
        "0.0 if rotor else M[i][i]",
        ["mass Mbar", "acceleration qdd"],
    ),
    "armature left out of the energy": (
        method,
        "0.5 * rotor *",
        "0.0 * rotor *",
        ["acceleration energy", "acceleration dE/dt"],
    ),
    "a slide's convective term once": (
        method,
        "(qd[by.start] * 2.0)",
        "(qd[by.start] * 1.0)",
        ["kinematics v_conv", "acceleration bias", "acceleration dE/dt"],
    ),
    "a slide that turns its body": (
        method,
        "ZERO if not moved or f.slides else",
        "ZERO if not moved else",
        ["kinematics B_b", "mass Mbar"],
    ),
    "a slide from zero": (
        method,
        "own[0] * (q[at.start] - tree.reference[i])",
        "own[0] * (q[at.start] - tree.reference[i] + 1e-9)",
        ["kinematics x_b", "mass Mbar"],
    ),
    "the spring's sign": (method, "[Q - s for Q, s in", "[Q + s for Q, s in", ["acceleration qdd"]),
    "springs from half their rest": (
        method,
        "tree.coordinates.difference(q, tree.rest) if tree",
        "tree.coordinates.difference(q, [x * 0.5 for x in tree.rest]) if tree",
        ["gravity holding torque, springs", "gravity TMT: torque", "acceleration qdd"],
    ),
    "half the energy of springs": (
        method,
        "0.5 * k * (x * x)",
        "0.25 * k * (x * x)",
        ["gravity TMT: torque", "acceleration potential", "acceleration dE/dt"],
    ),
    "a ball's axes that stay": (
        method,
        "axes = [turn @ axis for axis in own]",
        "axes = [p.turn @ axis for axis in own]",
        ["kinematics T_b", "acceleration bias"],
    ),
    "a ball that turns backward": (
        coordinates,
        "product(conjugate(q0[at]), q1[at])",
        "product(conjugate(q1[at]), q0[at])",
        ["gravity holding torque, springs", "acceleration qdd"],
    ),
}


def failing(setup, names=("kinematics", "mass", "gravity", "acceleration")) -> list[str]:
    """The checks of these experiments that fail, as 'experiment quantity'."""
    return [f"{name} {c.quantity}" for name in names for c in module(name).rows(setup).checks if not c.passed]


def assert_all_fail(setup, expected):
    found = failing(setup, dict.fromkeys(named.split()[0] for named in expected))
    for named in expected:
        assert any(name.startswith(named) for name in found), f"{named!r} did not fail; these did: {found}"


@pytest.mark.parametrize("text", [CART, STONE], ids=["cart", "stone"])
def test_without_an_error_all_checks_pass(text):
    assert failing(setup_between(text)) == []


@pytest.mark.parametrize("text, old, new, expected", IN_THE_MJCF.values(), ids=IN_THE_MJCF)
def test_error_in_a_file_of_any_joints(text, old, new, expected):
    assert text.count(old) == 1
    assert_all_fail(setup_between(text, text.replace(old, new)), expected)


@pytest.mark.parametrize("where, old, new, expected", IN_THE_METHOD.values(), ids=IN_THE_METHOD)
def test_error_in_the_method_of_any_joints(where, old, new, expected):
    text = inspect.getsource(where)
    assert text.count(old) == 1
    setup = setup_between(CART)
    try:
        exec(compile(text.replace(old, new), where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
        assert_all_fail(setup, expected)
    finally:
        exec(compile(text, where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
