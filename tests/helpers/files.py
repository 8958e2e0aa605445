"""Small MJCF, a case of any tree, and comparisons with tmt and exact values: for the tests of this folder."""

import struct
from types import SimpleNamespace

import numpy as np
from helpers.trees import random_state

import tmt
from compare.engines import RECORDS
from compare.judge.entries import Entries
from compare.judge.scale import FACTOR
from compare.robots.coordinates import Coordinates
from compare.robots.states import Sample

EPS = np.finfo(float).eps

PLAIN = '<body name="b"><joint name="j"/><geom name="g" size="0.1" pos="0.2 0 0"/></body>'
SECOND = '<body name="c" pos="0.5 0 0"><joint name="k" axis="0 1 0"/><geom name="h" size="0.1"/></body>'
TWO = PLAIN.replace("</body>", f"{SECOND}</body>")

TENDON = '<tendon><fixed name="t" {}><joint joint="j" coef="1"/><joint joint="k" coef="2"/></fixed></tendon>'
URDF = """<robot name="r"><link name="base"/><link name="b"><inertial><origin xyz="0.1 0 0.2" rpy="0.4 -0.3 0.9"/>
<mass value="1"/><inertia ixx="0.04" ixy="0.003" ixz="0" iyy="0.025" iyz="-0.002" izz="0.02"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="b"/><axis xyz="0 1 0"/></joint></robot>"""


CORNERS = np.eye(4, 3, k=-1)  # of a tetrahedron
FACES = (0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3)
TETRAHEDRON = [struct.pack("<12fH", 0, 0, 0, *CORNERS[list(face)].ravel(), 0) for face in FACES]
STL = struct.pack("<80sI", b"", len(FACES)) + b"".join(TETRAHEDRON)


def mjcf(content: str = PLAIN, before: str = "", after: str = "") -> str:
    return f"<mujoco>{before}<worldbody>{content}</worldbody>{after}</mujoco>"


def case_of(tree: tmt.Tree, locked=None, damping=0.0, gravity=True):
    """A case of a Tree, as far as MuJoCo's engine asks it; tree is that without the locked joints."""
    return SimpleNamespace(
        tree=tree, locked=locked or {}, scene=SimpleNamespace(gravity=gravity, damping=damping),
        controller=None, added_damping=np.full(len(tree.axis), damping), joints=tree.joint_names,
        coordinates=Coordinates(tree.joint_names, tree.kind),
    )  # fmt: skip


def assert_the_same(dynamics, tree, rng, states=3):
    """Every quantity of MuJoCo and tmt within 64 eps of the scale of what is summed."""

    def same(found, expected, scale):
        assert np.abs(np.subtract(found, expected)).max() <= 64 * EPS * scale

    for _ in range(states):
        q, v, tau = random_state(rng, tree)
        M, h = tmt.mass_matrix(tree, q), tmt.bias(tree, q, v)
        largest, reach = np.abs(M).max(), 1.0 + np.abs(tmt.com_positions(tree, q)).max()
        force = largest * (v @ v) + sum(tree.mass) * np.linalg.norm(tree.gravity) * reach
        force += np.abs(tmt.spring_torque(tree, q)).max()
        same(dynamics.mass_matrix(q), M, largest)
        same(dynamics.bias(q, v), h, force)
        same(dynamics.gravity_balance(q), tmt.gravity_balance(tree, q), force)
        of_solution = (force + 1.0) / largest * np.linalg.cond(M) ** 2
        same(dynamics.acceleration(q, v, tau), tmt.acceleration(tree, q, v, tau), of_solution)
        same(dynamics.com_positions(q), tmt.com_positions(tree, q), reach)
        same(dynamics.angular_velocities(q, v), tmt.angular_velocities(tree, q, v), np.abs(v).sum())
        same(dynamics.jacobians(q), tmt.jacobians(tree, q), reach)
        convective = tmt.convective_terms(tree, q, v)
        same(dynamics.convective_terms(q, v), convective, reach * np.abs(v).sum() ** 2)
        energy = force * reach + largest * (v @ v)
        same(dynamics.potential_energy(q), tmt.potential_energy(tree, q), energy)
        same(dynamics.energy(q, v), tmt.energy(tree, q, v), energy)
        same([*dynamics.other_forces(q, v).values()], 0.0, force)


def assert_exact(engine, of, robot, count=5):
    """M, h and accelerations of an outside engine are the exact ones; float32 is asked at numbers that it has."""
    rng, precision, bound = np.random.default_rng(3), RECORDS[engine].precision, FACTOR * RECORDS[engine].eps
    q = robot.coordinates.random(rng, count, robot.ranges)
    v, tau = rng.uniform(-2.0, 2.0, (2, count, robot.coordinates.nv))
    q, v, tau = (values.astype(precision).astype(float) for values in (q, v, tau))
    sample, scales = Sample(robot.tree, "", q, v, tau, count), Entries(robot.tree, q, v)
    assert (sample.exact("mass_matrix").distance(of.mass_matrix(q)) <= bound * scales.mass_matrix).all()
    assert (sample.exact("bias").distance(of.bias(q, v)) <= bound * scales.bias).all()
    exact = sample.exact("acceleration")
    size = scales.acceleration(scales.force(tau), exact.high)
    assert (exact.distance(of.acceleration(q, v, tau)) <= bound * size).all()
