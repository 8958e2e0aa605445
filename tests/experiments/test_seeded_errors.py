"""A check that never failed on a seeded error is not a check: each error must make named ones fail."""

import inspect

import pytest
from edited import XML, setup_of
from jointed import CART, STONE, setup_between

from compare.experiment import Setup
from compare.experiments import module
from tmt.equations import method
from tmt.model import coordinates
from tmt.model.tree import coordinates_of  # the one that trees ask, with what it has kept

# the text, what is replaced in it, the checks that must fail; model_edits.py has more errors of the arm
IN_THE_MJCF = {
    "tendon armature": (
        XML, "</mujoco>", '<tendon><fixed armature="0.1"><joint joint="alpha" coef="1"/></fixed></tendon></mujoco>',
        ["parameters tendon armature", "mass Mbar"]),
    "an equality constraint": (
        XML, 'constraint="disable" autoreset="disable"/>\n  </option>',
        'autoreset="disable"/></option><equality><joint joint1="alpha" joint2="gamma"/></equality>',
        ["parameters no forces of constraints", "acceleration qdd"]),
    "a hidden mass": (
        XML, '<body name="forearm"',
        '<body pos="0 0 -0.1"><inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/></body><body name="forearm"',
        ["parameters other mass", "gravity holding torque"]),
    "a slide's axis 1e-6 off": (
        CART, 'axis="1 0.2 0"', 'axis="1 0.200001 0"', ["kinematics T_b", "mass Mbar", "gravity holding torque"]),
    "the armature of a ball": (CART, 'armature="0.01"', 'armature="0.01000001"', ["mass Mbar", "acceleration qdd"]),
    "the spring of a slide": (
        CART, 'stiffness="20"', 'stiffness="20.0001"',
        ["gravity holding torque, springs", "gravity qdd", "acceleration qdd", "acceleration potential"]),
    "where a slide's spring rests": (
        CART, 'springref="0.1"', 'springref="0.100001"', ["gravity holding torque, springs", "acceleration potential"]),
    "a ball's centre": (CART, 'pos="0 0.01 0"', 'pos="0 0.010001 0"', ["kinematics T_b", "acceleration bias"]),
    "a free body's mass": (STONE, 'mass="2"', 'mass="2.000001"', ["mass Mbar", "acceleration dlinear momentum"]),
    "a free body's centre of mass": (
        STONE, "0.02 0.01 0.03", "0.020001 0.01 0.03", ["kinematics x_b", "acceleration dangular momentum"]),
}  # fmt: skip

IN_THE_METHOD = {  # of the arm's equations
    "Rb for Rb'": ("to_body = frame.turn.transposed", "to_body = frame.turn", ["kinematics omega_b", "kinematics B_b"]),
    "rotations in the wrong order": (
        "p.turn @ rotation(tree.axis[by.start], q[at.start] - tree.reference[i])",
        "rotation(tree.axis[by.start], q[at.start] - tree.reference[i]) @ p.turn", ["kinematics x_b"]),
    "centripetal term missing": (
        "frame.omega_conv.cross(r) + frame.omega.cross(frame.omega.cross(r))", "frame.omega_conv.cross(r)",
        ["kinematics v_conv", "acceleration bias"]),
    "convective rotation missing": (
        "p.omega_conv + p.omega.cross(spin)", "p.omega_conv", ["kinematics w_conv", "acceleration bias"]),
    "Newton's convective term missing": ("b.v_conv - g)", "ZERO - g)", ["acceleration bias", "acceleration dE/dt"]),
    "Euler's convective term missing": (
        "b.inertia @ b.w_conv + b.omega", "b.omega", ["acceleration bias", "acceleration dE/dt"]),
    "gyroscopic term missing": (
        " + b.omega.cross(b.inertia @ b.omega) for b in parts]", " for b in parts]",
        ["acceleration bias", "acceleration dp_alpha/dt"]),
    "gyroscopic sign, as in the original": (
        "b.inertia @ b.w_conv + b.omega.cross", "b.inertia @ b.w_conv - b.omega.cross", ["acceleration bias"]),
    "gravity sign": ("b.v_conv - g)", "b.v_conv + g)", ["gravity holding torque", "published c"]),
    "rotational inertia missing": (" + b.B[i].dot(moment)", "", ["mass Mbar", "published g"]),
    "potential sign": ("* -1.0).dot(b.x)", "* 1.0).dot(b.x)", ["gravity TMT: torque - dV/dq", "acceleration potential"]),
    "half a kinetic energy": ("result + 0.5 *", "result + 0.25 *", ["acceleration energy"]),
    "joint torque dropped": ("[t - d * v - hi for", "[-d * v - hi for", ["acceleration qdd"]),
}  # fmt: skip

IN_THE_METHOD_OF_KINDS = {
    "armature left out of Mbar": ("rotor if rotor else M[i][i]", "0.0 if rotor else M[i][i]", ["mass Mbar", "acceleration qdd"]),
    "armature left out of the energy": ("0.5 * rotor *", "0.0 * rotor *", ["acceleration energy", "acceleration dE/dt"]),
    "a slide's convective term once": (
        "(qd[by.start] * 2.0)", "(qd[by.start] * 1.0)", ["kinematics v_conv", "acceleration bias", "acceleration dE/dt"]),
    "a slide that turns its body": (
        "ZERO if not moved or f.slides else", "ZERO if not moved else", ["kinematics B_b", "mass Mbar"]),
    "springs from half their rest": (
        "tree.coordinates.difference(q, tree.rest) if tree",
        "tree.coordinates.difference(q, [x * 0.5 for x in tree.rest]) if tree",
        ["gravity holding torque, springs", "gravity TMT: torque", "acceleration qdd"]),
    "half the energy of springs": (
        "0.5 * k * (x * x)", "0.25 * k * (x * x)", ["gravity TMT: torque", "acceleration potential", "acceleration dE/dt"]),
    "a ball's axes that stay": (
        "axes = [turn @ axis for axis in own]", "axes = [p.turn @ axis for axis in own]",
        ["kinematics T_b", "acceleration bias"]),
    "a ball that turns backward": (
        "product(conjugate(q0[at]), q1[at])", "product(conjugate(q1[at]), q0[at])",
        ["gravity holding torque, springs", "acceleration qdd"]),
}  # fmt: skip


def setup_with(text, edited):
    """Of tmt's equations for a text beside MuJoCo's for an edited one."""
    if text == XML:
        return setup_of(edited, make=Setup, states=20, exact_states=1, finer=(1,), size="quick")
    return setup_between(text, edited, states=20)


def failing(setup, expected) -> list[str]:
    """The checks that fail of the experiments that are named, as 'experiment quantity'."""
    return [
        f"{name} {check.scene.strip('(') if name == 'published' else check.quantity}"
        for name in dict.fromkeys(each.split()[0] for each in expected)
        for check in module(name).rows(setup).checks
        if not check.passed
    ]


def failing_in(name) -> list[str]:
    """Those of a file with an error."""
    text, old, new, expected = IN_THE_MJCF[name]
    assert text.count(old) == 1
    return failing(setup_with(text, text.replace(old, new)), expected)


def assert_named(found, expected):
    for named in expected:
        assert any(name.startswith(named) for name in found), f"{named!r} did not fail; these did: {found}"


@pytest.mark.parametrize("text", [CART, STONE], ids=["cart", "stone"])
def test_without_an_error_all_checks_pass(text):
    assert failing(setup_with(text, text), ["kinematics", "mass", "gravity", "acceleration"]) == []


@pytest.mark.parametrize("name", IN_THE_MJCF)
def test_error_in_the_mjcf(name, shared):
    assert_named(shared(failing_in, name), IN_THE_MJCF[name][-1])


@pytest.mark.parametrize("name", [*IN_THE_METHOD, *IN_THE_METHOD_OF_KINDS])
def test_error_in_the_method(name):
    text = XML if name in IN_THE_METHOD else CART
    old, new, expected = (IN_THE_METHOD | IN_THE_METHOD_OF_KINDS)[name]
    where = coordinates if "product" in old else method
    source, setup = inspect.getsource(where), setup_with(text, text)
    assert source.count(old) == 1
    try:
        exec(compile(source.replace(old, new), where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
        assert_named(failing(setup, expected), expected)
    finally:
        exec(compile(source, where.__file__, "exec"), where.__dict__)
        coordinates_of.cache_clear()
