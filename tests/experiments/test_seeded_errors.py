"""A check that never failed on a seeded error is not a check: each edit must make a named one fail."""

import inspect

import pytest
from edited import XML, setup_of

from compare.experiment import Setup
from compare.experiments import module
from tmt.equations import method

ALPHA = '<joint name="alpha" type="hinge" axis="0 1 0"/>'
BETA = '<joint name="beta" type="hinge" axis="1 0 0"/>'
GAMMA = '<joint name="gamma" type="hinge" axis="0 1 0"/>'

IN_THE_MJCF = {
    "inertia axes swapped": ("0.015 0.014 0.002", "0.014 0.015 0.002", ["parameters inertia", "mass Mbar"]),
    "CoM moved 1 mm": ('pos="0.15 0 0"', 'pos="0.151 0 0"', ["parameters com", "kinematics x_b", "mass Mbar"]),
    "mass 1 % off": ('mass="1.5"', 'mass="1.515"', ["parameters mass", "mass Mbar", "gravity holding torque"]),
    "gravity upward": ("0 0 -9.81", "0 0 9.81", ["parameters gravity", "gravity holding torque", "published c"]),
    "standard gravity": ("0 0 -9.81", "0 0 -9.80665", ["parameters gravity", "gravity holding torque"]),
    "hinge order": (f"{ALPHA}\n      {BETA}", f"{BETA}\n      {ALPHA}", ["parameters order", "kinematics x_b"]),
    "armature left in": (GAMMA, GAMMA.replace("/>", ' armature="0.01"/>'), ["parameters armature", "mass Mbar"]),
    "damping left in": (
        BETA, BETA.replace("/>", ' damping="0.1"/>'), ["parameters damping", "acceleration qdd", "trajectory dh/dqd"],
    ),
    "spring left in": (BETA, BETA.replace("/>", ' stiffness="1"/>'), ["parameters stiffness", "trajectory open loop"]),
    "beta axis flipped": (BETA, BETA.replace('"1 0 0"', '"-1 0 0"'), ["parameters axis", "kinematics x_b", "kinematics B_b"]),
    "gamma axis tilted": (GAMMA, GAMMA.replace('"0 1 0"', '"0 1 0.001"'), ["parameters axis", "kinematics T_b"]),
    "elbow 1 mm lower": ('pos="0 0 -0.3"', 'pos="0 0 -0.301"', ["parameters anchor", "kinematics v_conv"]),
    "a position servo": (
        "</mujoco>",
        '<actuator><position joint="beta" kp="3"/></actuator></mujoco>',
        ["parameters no forces of actuators", "acceleration qdd"],
    ),
    "air": ('<option gravity', '<option density="50" viscosity="1" gravity', ["parameters no forces of springs, fluid"]),
    "tendon armature": (
        "</mujoco>",
        '<tendon><fixed armature="0.1"><joint joint="alpha" coef="1"/></fixed></tendon></mujoco>',
        ["parameters tendon armature", "mass Mbar"],
    ),
    "an equality constraint": (
        'constraint="disable" autoreset="disable"/>\n  </option>',
        'autoreset="disable"/></option><equality><joint joint1="alpha" joint2="gamma"/></equality>',
        ["parameters no forces of constraints", "acceleration qdd"],
    ),
    "a hidden mass": (
        '<body name="forearm"',
        '<body pos="0 0 -0.1"><inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/></body><body name="forearm"',
        ["parameters other mass", "gravity holding torque"],
    ),
}  # fmt: skip

IN_THE_METHOD = {
    "Rb for Rb'": ("to_body = frame.turn.transposed", "to_body = frame.turn", ["kinematics omega_b", "kinematics B_b"]),
    "rotations in the wrong order": (
        "p.turn @ rotation(tree.axis[by.start], q[at.start] - tree.reference[i])",
        "rotation(tree.axis[by.start], q[at.start] - tree.reference[i]) @ p.turn",
        ["kinematics x_b"],
    ),
    "centripetal term missing": (
        "frame.omega_conv.cross(r) + frame.omega.cross(frame.omega.cross(r))",
        "frame.omega_conv.cross(r)",
        ["kinematics v_conv", "acceleration bias"],
    ),
    "convective rotation missing": (
        "p.omega_conv + p.omega.cross(spin)",
        "p.omega_conv",
        ["kinematics w_conv", "acceleration bias"],
    ),
    "Newton's convective term missing": ("b.v_conv - g)", "ZERO - g)", ["acceleration bias", "acceleration dE/dt"]),
    "Euler's convective term missing": (
        "b.inertia @ b.w_conv + b.omega",
        "b.omega",
        ["acceleration bias", "acceleration dE/dt"],
    ),
    "gyroscopic term missing": (
        " + b.omega.cross(b.inertia @ b.omega) for b in parts]",
        " for b in parts]",
        ["acceleration bias", "acceleration dp_alpha/dt"],
    ),
    "gyroscopic sign, as in the original": (
        "b.inertia @ b.w_conv + b.omega.cross",
        "b.inertia @ b.w_conv - b.omega.cross",
        ["acceleration bias"],
    ),
    "gravity sign": ("b.v_conv - g)", "b.v_conv + g)", ["gravity holding torque", "published c"]),
    "rotational inertia missing": (" + b.B[i].dot(moment)", "", ["mass Mbar", "published g"]),
    "potential sign": (
        "* -1.0).dot(b.x)",
        "* 1.0).dot(b.x)",
        ["gravity TMT: torque - dV/dq", "acceleration potential"],
    ),
    "half a kinetic energy": ("result + 0.5 *", "result + 0.25 *", ["acceleration energy"]),
    "joint torque dropped": ("[t - d * v - hi for", "[-d * v - hi for", ["acceleration qdd"]),
}


def failing(setup, experiment) -> list[str]:
    """The checks of an experiment that fail, as 'experiment quantity'."""
    checks = module(experiment).rows(setup).checks
    return [
        f"{experiment} {c.scene.strip('(') if experiment == 'published' else c.quantity}"
        for c in checks
        if not c.passed
    ]


def failing_of(setup, expected) -> list[str]:
    """Those of the experiments that are named, each run once."""
    return [
        name
        for experiment in dict.fromkeys(named.split()[0] for named in expected)
        for name in failing(setup, experiment)
    ]


def failing_in(name) -> list[str]:
    """Those of the file with an error."""
    old, new, expected = IN_THE_MJCF[name]
    assert XML.count(old) == 1
    return failing_of(few(XML.replace(old, new)), expected)


def assert_named(found, expected):
    for named in expected:
        assert any(name.startswith(named) for name in found), f"{named!r} did not fail; these did: {found}"


def few(model=XML):
    return setup_of(model, make=Setup, states=50, exact_states=2, finer=(1,), size="quick")


@pytest.mark.parametrize("name", IN_THE_MJCF)
def test_error_in_the_mjcf(name, beside):
    assert_named(beside.result(failing_in, name), IN_THE_MJCF[name][-1])


@pytest.mark.parametrize("old, new, expected", IN_THE_METHOD.values(), ids=IN_THE_METHOD)
def test_error_in_the_method(old, new, expected):
    text = inspect.getsource(method)
    assert text.count(old) == 1
    try:
        exec(compile(text.replace(old, new), method.__file__, "exec"), method.__dict__)
        assert_named(failing_of(few(), expected), expected)
    finally:
        exec(compile(text, method.__file__, "exec"), method.__dict__)


def test_mirror_symmetry_needs_the_kinematics():
    """A flipped beta axis passes mass and acceleration: what hides it is said in design, and shown here."""
    flipped = few(XML.replace(BETA, BETA.replace('"1 0 0"', '"-1 0 0"')))
    assert failing(flipped, "mass") == []
    assert failing(flipped, "kinematics") != []
