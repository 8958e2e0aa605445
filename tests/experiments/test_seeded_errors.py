"""A check that never failed on a seeded error is not a check: each error must make named ones fail."""

import inspect

import pytest
from edited import CART, STONE, XML, setup_between, setup_of

from compare.experiment import Setup
from compare.experiments import module
from tmt.equations import method
from tmt.model import coordinates
from tmt.model.tree import coordinates_of  # the one that trees ask, with what it has kept

# the text, what is replaced in it, the checks that must fail; model_edits.py has errors of the arm
IN_THE_MJCF = {
    "a slide's axis 1e-6 off": (
        CART, 'axis="1 0.2 0"', 'axis="1 0.200001 0"', ["kinematics T_b", "mass Mbar", "gravity holding torque"]),
    "the armature of a ball": (CART, 'armature="0.01"', 'armature="0.01000001"', ["mass Mbar", "acceleration qdd"]),
    "where a slide's spring rests": (
        CART, 'springref="0.1"', 'springref="0.100001"',
        ["gravity holding torque, springs", "gravity qdd", "acceleration qdd", "acceleration potential"]),
    "a ball's centre": (CART, 'pos="0 0.01 0"', 'pos="0 0.010001 0"', ["kinematics T_b", "acceleration bias"]),
    "a free body's centre of mass": (
        STONE, "0.03 -0.02 0.05", "0.030001 -0.02 0.05",
        ["kinematics x_b", "acceleration dlinear momentum", "acceleration dangular momentum"]),
}  # fmt: skip

IN_THE_METHOD = {  # the equations of which model, what is replaced in the code, the checks that must fail
    "Rb for Rb'": (
        XML, "to_body = frame.turn.transposed", "to_body = frame.turn", ["kinematics omega_b", "kinematics B_b"]),
    "rotations in the wrong order": (
        XML, "p.turn @ rotation(tree.axis[by.start], q[at.start] - tree.reference[i])",
        "rotation(tree.axis[by.start], q[at.start] - tree.reference[i]) @ p.turn", ["kinematics x_b"]),
    "Newton's convective term missing": (
        XML, "b.v_conv - g)", "ZERO - g)", ["acceleration bias", "acceleration dE/dt"]),
    "convective rotation missing": (
        XML, "p.omega_conv + p.omega.cross(spin)", "p.omega_conv", ["kinematics w_conv", "acceleration bias"]),
    "gyroscopic term missing": (
        XML, " + b.omega.cross(b.inertia @ b.omega) for b in parts]", " for b in parts]",
        ["acceleration bias", "acceleration dp_alpha/dt"]),
    "gravity sign": (XML, "b.v_conv - g)", "b.v_conv + g)", ["gravity holding torque", "published c"]),
    "rotational inertia missing": (XML, " + b.B[i].dot(moment)", "", ["mass Mbar", "published g"]),
    "potential sign": (
        XML, "* -1.0).dot(b.x)", "* 1.0).dot(b.x)", ["gravity TMT: torque - dV/dq", "acceleration potential"]),
    "half a kinetic energy": (XML, "result + 0.5 *", "result + 0.25 *", ["acceleration energy"]),
    "joint torque dropped": (XML, "[t - d * v - hi for", "[-d * v - hi for", ["acceleration qdd"]),
    "armature left out of Mbar": (
        CART, "rotor if rotor else M[i][i]", "0.0 if rotor else M[i][i]", ["mass Mbar", "acceleration qdd"]),
    "a slide's convective term once": (
        CART, "(qd[by.start] * 2.0)", "(qd[by.start] * 1.0)",
        ["kinematics v_conv", "acceleration bias", "acceleration dE/dt"]),
    "springs from half their rest": (
        CART, "tree.coordinates.difference(q, tree.rest) if tree",
        "tree.coordinates.difference(q, [x * 0.5 for x in tree.rest]) if tree",
        ["gravity holding torque, springs", "gravity TMT: torque", "acceleration qdd"]),
    "half the energy of springs": (
        CART, "0.5 * k * (x * x)", "0.25 * k * (x * x)",
        ["gravity TMT: torque", "acceleration potential", "acceleration dE/dt"]),
    "a ball's axes that stay": (
        CART, "axes = [turn @ axis for axis in own]", "axes = [p.turn @ axis for axis in own]",
        ["kinematics T_b", "acceleration bias"]),
    "a ball that turns backward": (
        CART, "product(conjugate(q0[at]), q1[at])", "product(conjugate(q1[at]), q0[at])",
        ["gravity holding torque, springs", "acceleration qdd"]),
}  # fmt: skip


def assert_named(setup, expected):
    """Each of these checks fails, as 'experiment quantity', some by the beginning of their names."""
    failing = [
        f"{name} {check.scene.strip('(') if name == 'published' else check.quantity}"
        for name in dict.fromkeys(each.split()[0] for each in expected)
        for check in module(name).rows(setup).checks
        if not check.passed
    ]
    for named in expected:
        assert any(name.startswith(named) for name in failing), f"{named!r} did not fail; these did: {failing}"


@pytest.mark.parametrize("text, old, new, expected", IN_THE_MJCF.values(), ids=IN_THE_MJCF)
def test_error_in_the_mjcf(text, old, new, expected):
    assert text.count(old) == 1
    assert_named(setup_between(text, text.replace(old, new), states=10), expected)


@pytest.mark.parametrize("text, old, new, expected", IN_THE_METHOD.values(), ids=IN_THE_METHOD)
def test_error_in_the_method(text, old, new, expected):
    where = coordinates if "product" in old else method
    source = inspect.getsource(where)
    setup = setup_of(make=Setup, states=10, exact_states=1) if text == XML else setup_between(text, states=10)
    assert source.count(old) == 1
    try:
        exec(compile(source.replace(old, new), where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
        assert_named(setup, expected)
    finally:
        exec(compile(source, where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
