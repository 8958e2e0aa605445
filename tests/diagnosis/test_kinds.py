"""Each kind of cause is named: conventions, numbers that change together, slips of the recursion, in all or in a part of h."""

from dataclasses import replace

import numpy as np
import pytest
from models import PATHS
from scipy.spatial.transform import Rotation

import tmt
from compare.diagnosis import Stated, Values, diagnose
from compare.diagnosis.hypothesis import NATURAL, cost, is_round
from compare.diagnosis.kinds.conventions import conventions
from compare.diagnosis.kinds.recursion import SLIPS, evaluated, slips_of_recursion
from compare.diagnosis.kinds.slips import slips_of_kinematics
from compare.diagnosis.layout import Layout
from compare.diagnosis.model import Equations
from compare.engines.mujoco import reading, tree_with_sites
from compare.robots.coordinates import Coordinates
from compare.robots.joint_map import joint_map

READ = {name: reading.read(PATHS[name]).tree for name in ("free_body", "mixed", "quadruped")}
ARM, STONE, LEGS = tmt.ARM, READ["free_body"], READ["quadruped"]
ROW = replace(  # three parallel hinges and slides between, two bodies alike
    ARM, kind=("hinge", "slide", "hinge"), axis=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    body_names=("first", "second"), body_joint=(0, 2), offset=((0.0, 0.0, 0.0), (0.2, 0.0, -0.1), (0.0, 0.0, -0.3)),
)  # fmt: skip


def point_inertia(r, mass):
    return mass * (r @ r * np.eye(3) - np.outer(r, r))


def states(tree, count=12):
    rng, coordinates = np.random.default_rng(1), Coordinates(tree.joint_names, tree.kind)
    q = coordinates.move(np.tile(tree.zero, (count, 1)), rng.uniform(-2.0, 2.0, (count, coordinates.nv)))
    return q, rng.uniform(-2.0, 2.0, (count, coordinates.nv))


def of_parts(tree, M, velocity_terms, rest, **more):
    """The diagnosis of Mbar and h, whose parts are known as those of a function are."""
    q, qd = states(tree)

    def bias(speeds):
        return velocity_terms * (1.0 if speeds.any() else 0.0) + rest

    return diagnose(tree, Values.of(tree, q, qd, M, velocity_terms + rest), bias=bias, **more)


def parts(tree):
    return Equations(tree, *states(tree)).parts


def convention_of(tree, place):
    """The first of a place or with this explanation."""
    every = conventions(Equations(tree, *states(tree)))
    return next(one.convention for one in every if place in (one.cause.place, one.cause.explains))


def places(diagnosis):
    return [cause.place for cause in diagnosis.causes]


def first(diagnosis):
    cause = diagnosis.causes[0]
    return cause.place, cause.explains


CONVENTIONS = [  # a model, and the cause of the convention
    (ARM, "sense of beta and gamma"), (ARM, "unit of beta"), (ROW, "angle of gamma"), (STONE, "angular velocity of stone turn"),
    (STONE, "linear velocity of stone x, stone y, stone z"), (STONE, "quaternion of stone turn"),
]  # fmt: skip


@pytest.mark.parametrize("tree, place", CONVENTIONS)
def test_a_convention_is_named(tree, place):
    convention = convention_of(tree, place)
    inner = Equations(tree, convention.q, convention.qd)
    assert place in places(of_parts(tree, *convention.applied(*inner.parts)))
    M, h, rest = convention.removed(*(inner.parts[0],) * 2, inner.h, inner.parts[2])
    there = convention.applied(M, h - rest, rest)  # there and back
    drift = np.einsum("sij,sj->si", M - inner.parts[0], convention.drift)
    assert np.allclose(there[0], inner.parts[0])
    assert np.allclose(there[1] + there[2], inner.h + drift[:, :0].sum())


def test_a_body_with_its_linear_velocity_in_its_own_axes_has_omega_x_v():
    """m (vdot + omega x v) of a point at the CoM: the drift of the convention."""
    point = replace(STONE, com=((0.0, 0.0, 0.0),), gravity=(0.0, 0.0, 0.0))
    (_, qd), convention = states(point), convention_of(point, "in body axes")
    _, velocity_terms, _ = convention.applied(*Equations(point, convention.q, convention.qd).parts)
    omega_x_v = np.cross(qd[:, 3:], qd[:, :3])
    assert np.allclose(velocity_terms[:, :3], point.mass[0] * omega_x_v)


def test_the_order_of_many_joints_is_named_as_it_is_stated():
    names = list(LEGS.joint_names)
    depth = [len(LEGS.path(i)) for i in range(len(names))]
    breadth = [names[i] for i in np.argsort(depth, kind="stable")]
    assert len(names) > 6 and breadth != names
    q, qd = states(LEGS)
    other = joint_map(Equations(LEGS, q, qd).coordinates, breadth)
    inner = Equations(LEGS, other.positions(q), other.speeds(qd))
    given = Values.of(LEGS, q, qd, other.own_mass_matrix(inner.parts[0]), other.own_forces(inner.h))
    found = diagnose(LEGS, given, stated=Stated(joint_map(inner.coordinates, None)))
    assert any(cause.joints == f"joints={breadth}" for cause in found.causes)


def test_a_convention_and_a_number_are_named_together():
    heavy, convention = replace(ROW, mass=(1.9, 1.52)), convention_of(ROW, "angle of gamma")
    found = of_parts(ROW, *convention.applied(*Equations(heavy, convention.q, convention.qd).parts))
    assert found.causes[0].place == "angle of gamma and mass of second"


BENT_ARM = replace(  # no axis, CoM or tensor of it is along an axis of another
    ARM, axis=((0.0, 0.0, 1.0), (0.6, 0.8, 0.0), (0.0, 0.6, 0.8)), offset=((0.0, 0.0, 0.1), (0.1, 0.02, 0.3), (0.2, -0.05, -0.3)),
    body_names=("upper arm", "forearm"), body_joint=(1, 2), com=((0.02, 0.03, -0.1), (0.1, 0.05, -0.15)),
    inertia=(ARM.inertia[0], ((0.03, 0.002, -0.001), (0.002, 0.025, 0.003), (-0.001, 0.003, 0.015))),
)  # fmt: skip
BENT = """<mujoco><worldbody>
  <body name="arm" euler="-90 0 30"><joint name="lift" axis="0 0 1"/>
    <inertial pos=".1 .02 .01" mass="2" fullinertia=".006 .021 .022 .001 .0007 .0004"/>
    <body name="hand" pos=".3 .02 .01" euler="20 0 45"><joint name="elbow" axis="0 0 1"/>
      <inertial pos=".09 .01 .03" mass=".8" fullinertia=".0009 .0031 .0033 .0001 .00005 .00002"/></body></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("text, other, place, explains", [
    ("pos=\".09 .01 .03\"", "pos=\".09 .01 .3\"", "CoM z of hand", 0.3),
    ("pos=\".3 .02 .01\"", "pos=\".3 .2 .01\"", "offset y of elbow", 0.2),
    (".0009 .0031 .0033", ".0033 .0031 .0009", "moments of inertia of hand, axes x and z exchanged", ""),
    ("elbow\" axis=\"0 0 1\"", "elbow\" axis=\"0 1 0\"", "axis of elbow", "y"),
    ("euler=\"20 0 45\"", "", "fixed turn at elbow (euler, quat or rpy)", "left out"),
    ("<worldbody>", "<compiler eulerseq=\"XYZ\"/><worldbody>", "fixed turn at every joint (euler, quat or rpy)",
     "angles in the other order, z, y, x"),
])  # fmt: skip
def test_numbers_are_said_in_the_frames_of_the_file(text, other, place, explains):
    right, wrong = tree_with_sites(reading.read(BENT)), reading.read(BENT.replace(text, other)).tree
    found = first(of_parts(right, *parts(wrong)))
    assert found == (place, pytest.approx(explains) if isinstance(explains, float) else explains)


def test_a_turned_tensor_is_named_where_no_motion_shows_the_mass_of_its_body():
    """On a gimbal the mass, which is on no lever, has the same effect as a part of the tensor."""
    body = '<body name="{}" pos="0 {} 0.2"><inertial pos="0 {} 0.03" mass="2" fullinertia="{}"/><joint name="{}" axis="{}"/>'
    ring = body.format("ring", 0.1, 0.0, ".02 .03 .01 0 0 0", "pan", "0 0 1")
    cup = body.format("cup", 0.3, 0.1, ".012 .009 .005 .001 -.0004 .0007", "tilt", "1 0 0")
    text = f"<mujoco><worldbody>{ring}{cup}</body></body></worldbody></mujoco>"
    right = tree_with_sites(reading.read(text))
    turn = Rotation.from_euler("xyz", (20.0, 0.0, -50.0), degrees=True).as_matrix()
    tensors = [right.inertia[0], (turn @ np.array(right.inertia[1]) @ turn.T).tolist()]
    found = of_parts(right, *parts(replace(right, inertia=tensors)))
    assert first(found) == ("inertia of cup", "turned by rpy = (20, 0, -50) deg")


TENSOR = np.array(ARM.inertia[1])
EDITS = {  # numbers of the arm: the cause
    "axes exchanged": ({"inertia": (ARM.inertia[0], TENSOR[::-1, ::-1])}, "inertia of forearm, axes x and z exchanged"),
    "a body left out": ({"mass": (1.9, 0.0), "inertia": (ARM.inertia[0], 0.0 * TENSOR)}, "forearm"),
    "of rods": ({"inertia": np.array(ARM.inertia) * [[1], [1], [0]]}, "inertia zz of every body"),
    "in mm": ({"com": 1e3 * np.array(ARM.com), "offset": 1e3 * np.array(ARM.offset)}, "all lengths"),
    "along x": ({"gravity": (-9.81, 0.0, 0.0)}, "gravity"),
    "a length and a CoM": (
        {"com": ((0.0, 0.0, -0.3), ARM.com[1]), "offset": (*ARM.offset[:2], (0.0, 0.0, -0.15))},
        "CoM of upper arm and offset of gamma"),
    "another axis": ({"axis": (*ARM.axis[:2], (0.0, 0.0, 1.0))}, "axis of gamma"),
}  # fmt: skip


@pytest.mark.parametrize("fields, place", EDITS.values(), ids=EDITS)
def test_numbers_that_change_together_are_one_cause(fields, place):
    tree = ARM
    for name, value in fields.items():
        object.__setattr__(tree := replace(tree), name, np.array(value, float).tolist())
    assert place in places(of_parts(ARM, *parts(tree)))


def test_a_load_is_named_with_its_mass_and_place():
    arm, point = replace(ARM, mass=(1.9, 1.5)), np.array([0.3, 0.02, 0.01])
    m, c, I = arm.mass[1], np.array(arm.com[1]), np.array(arm.inertia[1])
    com, load = (m * c + 0.4 * point) / (m + 0.4), np.diag([1e-3, 2e-3, 3e-3])
    tensor = I + load + point_inertia(c - com, m) + point_inertia(point - com, 0.4)
    fields = {"com": (arm.com[0], com.tolist()), "inertia": (arm.inertia[0], tensor.tolist())}
    place, explains = first(of_parts(arm, *parts(replace(arm, mass=(1.9, m + 0.4), **fields))))
    assert place == "a load on forearm"
    assert explains.startswith("0.4 kg, CoM (0.3, 0.02, 0.01) m, xx 0.001, yy 0.002, zz 0.003")


def test_several_moments_of_inertia_below_zero_are_no_cause():
    for size, is_cause in ((0.5, True), (-3.0, False)):
        tree = replace(ARM)
        object.__setattr__(tree, "inertia", [ARM.inertia[0], (TENSOR * [[1.0], [size], [size]]).tolist()])
        assert any(cause.kind == "several" for cause in of_parts(ARM, *parts(tree)).causes) is is_cause


@pytest.mark.parametrize("tree", READ.values(), ids=READ)
def test_the_recursion_without_a_slip_is_the_method(tree):
    equations = Equations(tree, *states(tree), Layout(len(tree.axis), True, False))
    (values,) = evaluated(equations, "", np.zeros((len(tree.parent), 1), bool))
    assert np.allclose(values, equations.right, rtol=0.0, atol=1e-13 * np.abs(equations.right).max())


def test_every_slip_of_the_recursion_changes_something_in_some_model():
    changed = set()
    for tree in (ARM, ROW, READ["mixed"]):
        equations = Equations(tree, *states(tree, 3), Layout(len(tree.axis), True, False))
        for cause, column, *_ in slips_of_recursion(equations):
            if (np.abs(column) > 1e-9).any():
                changed.add((cause.form, cause.explains))
    assert changed >= {(slip.place, slip.wrong) for slip in SLIPS}


@pytest.mark.parametrize("kind, place, explains", [
    (slips_of_recursion, "moment c x F of the force at the CoM of forearm", "left out"),
    (slips_of_kinematics, "velocity of the CoM of forearm", "speed of beta left out"),
    (slips_of_kinematics, "axis of beta", "that of gamma"),
])  # fmt: skip
def test_a_slip_of_the_derivation_is_named(kind, place, explains):
    equations = Equations(BENT_ARM, *states(BENT_ARM), Layout(3, True, False))
    added = next(one.column for one in kind(equations) if one.key == (place, explains))
    M, velocity_terms, rest = np.split(equations.right + added, [9, 12], axis=1)
    found = of_parts(BENT_ARM, M.reshape(-1, 3, 3), velocity_terms, rest)
    assert (place, explains) in {(cause.place, cause.explains) for cause in found.causes}


def test_a_slip_and_a_number_are_named_together():
    tensor = (TENSOR + point_inertia(np.array(ARM.com[1]), ARM.mass[1])).tolist()
    found = of_parts(ARM, *parts(replace(ARM, inertia=(ARM.inertia[0], tensor), mass=(1.7, 1.5))))
    pairs = [{part.place for part in cause.parts} for cause in found.causes]
    assert {"mass of upper arm", "inertia of forearm"} in pairs


def test_a_velocity_with_the_part_of_another_body():
    (q, qd), (M, velocity_terms, rest) = states(BENT_ARM), parts(BENT_ARM)
    T, (a, _), m = tmt.jacobians(BENT_ARM, q)[0], tmt.convective_terms(BENT_ARM, q, qd), BENT_ARM.mass[1]
    right, wrong = T[:, 1], T[:, 1].copy()
    wrong[:, :, 1] = T[:, 0, :, 1]
    M = M + m * (np.swapaxes(wrong, 1, 2) @ wrong - np.swapaxes(right, 1, 2) @ right)
    velocity_terms = velocity_terms + m * np.einsum("sci,sc->si", wrong - right, a[:, 1])
    rest = rest - m * np.einsum("sci,c->si", wrong - right, np.array(BENT_ARM.gravity))
    place, explains = first(of_parts(BENT_ARM, M, velocity_terms, rest))
    assert place == "velocity of the CoM of forearm" and "beta" in explains and "upper arm" in explains


def test_one_of_both_blocks_of_M_transposed_or_of_the_other_sign():
    M, velocity_terms, rest = parts(STONE)
    M = M.copy()
    M[:, :3, 3:] = np.swapaxes(M[:, :3, 3:], 1, 2)
    found = first(of_parts(STONE, M, velocity_terms, rest))
    assert found == ("M[stone x, stone y, stone z][stone turn]", "transposed")
    M[:, :3, 3:] = -np.swapaxes(M[:, :3, 3:], 1, 2)
    found = of_parts(STONE, M, velocity_terms, rest).causes[0]
    assert (found.place, found.explains) == ("M[stone x, stone y, stone z][stone turn]", pytest.approx(-1.0))


def test_a_cause_in_parts_of_the_equations_alone():
    (M, velocity_terms, rest), other = parts(ARM), parts(replace(ARM, com=(ARM.com[0], (0.0, 0.0, 0.0))))
    assert first(of_parts(ARM, M, velocity_terms, other[2])) == ("CoM x of forearm in gravity alone", 0.0)
    place = "CoM x of forearm in the velocity terms of h alone"
    assert first(of_parts(ARM, M, other[1], rest)) == (place, 0.0)
    assert first(of_parts(ARM, other[0], other[1], rest)) == ("CoM x of forearm, but not in gravity", 0.0)


def test_the_likelier_of_two_causes_comes_first():
    equations = Equations(ARM, *states(ARM))
    found = of_parts(ARM, *parts(replace(ARM, gravity=(0.0, 0.0, 9.81))))
    costs = [cost(cause, equations) for cause in found.causes]
    assert costs == sorted(costs) and costs[0] < NATURAL and found.causes[0].kind == "option"
    assert is_round(0.73) and is_round(0.1234) and not is_round(0.12345678)
    assert is_round(0.730001) and not is_round(0.12345 + 1e-7)


def test_forces_of_accelerations_alone():
    """Mbar qdd + h of a heavier arm."""
    (q, qd), heavy = states(ARM), replace(ARM, mass=(1.9, 1.52))
    qdd, tau = tmt.acceleration(heavy, q, qd, 0.3 * qd), 0.3 * qd
    force = tau - np.array(ARM.damping) * qd
    found = diagnose(ARM, Values.of(ARM, q, qd, None, force, 1e-12), qdd=qdd)
    assert first(found) == ("mass of forearm", pytest.approx(1.52))
