"""The loops over any tree run on numbers of many digits, in a process in which nothing is compiled: the sums of method.py."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# the largest differences of Mbar, of h and of the equation of motion, in 50 digits, beside the largest numbers themselves
PROGRAM = """
import sys
from collections import namedtuple
import mpmath, numpy as np
from trees import random_state, tree_of_kinds
from tmt import loop_bodies, loop_trees, loops
from tmt.equations import method
from tmt.exact.tree import exact_tree

mpmath.mp.dps, seed = 50, int(sys.argv[1])
rng = np.random.default_rng(seed)
tree = tree_of_kinds(rng, bodies=5, along_axes=True)  # of length 1 in any number of digits
q, qd, tau = ([mpmath.mpf(x) for x in values.tolist()] for values in random_state(rng, tree))
exact, nv = exact_tree(tree, mpmath.mpf), len(tree.axis)
exact.rest, exact.coordinates = [mpmath.mpf(x) for x in tree.rest], tree.coordinates  # as their doubles are, in all digits
Joint = namedtuple("Joint", loop_trees.JOINT.names)
joints = [Joint(*row) for row in loop_trees.rows(tree, mpmath.mpf)]
numbers = loop_trees.arrays(tree)._replace(joints=joints, gravity=exact.gravity)
w, M, h, qdd = [None] * loops.workspace(numbers), [0] * (nv * nv), [None] * nv, [None] * nv
loops.mass_matrix_and_bias(numbers, q, qd, w, M, h)
Mbar, bias = method.mass_matrix_and_bias(exact, q, qd)
on_path = [(v, w) for v in range(nv) for w in range(v + 1) if M[v * nv + w] != 0]
print(len(on_path) >= nv, mpmath.nstr(max(abs(M[v * nv + w] - Mbar[v][w]) for v, w in on_path)))
print(max(map(abs, bias)) > 1, mpmath.nstr(max(abs(x - y) for x, y in zip(h, bias))))
loops.forward_dynamics(numbers, q, qd, tau, w, qdd)
force = method.reduced_force(exact, bias, q, qd, tau)
left = [sum(m * x for m, x in zip(row, qdd)) - f for row, f in zip(Mbar, force)]
print(max(map(abs, force)) > 1, mpmath.nstr(max(map(abs, left))))
Body = namedtuple("Body", loop_trees.BODY.names)
joints = [Joint(*row) for row in loop_trees.rows(tree, mpmath.mpf, about_world=True)]
own = zip(loop_trees.bodies(tree), exact.mass, exact.com, exact.inertia)
bodies = [Body(int(row["joint"]), m, com, [x for line in I for x in line]) for row, m, com, I in own]
outer, parts, m = numbers._replace(joints=joints), method.bodies(exact, q, qd), len(bodies)
w = [None] * loop_bodies.workspace(outer)
in_line = lambda vectors: [x for v in vectors for x in v]
columns = lambda of: [[*column][k] for b in parts for k in range(3) for column in getattr(b, of)]
energy = method.potential(parts, exact.gravity) + method.spring_energy(exact, q)
expected = {
    "POSITIONS": in_line(b.x for b in parts), "ANGULAR_VELOCITIES": in_line(b.omega for b in parts),
    "JACOBIANS": columns("T") + columns("B"),
    "CONVECTIVE_TERMS": in_line(b.v_conv for b in parts) + in_line(b.w_conv for b in parts),
    "POTENTIAL_ENERGY": [energy], "ENERGY": [energy + method.kinetic(parts, qd, exact.armature)],
    "SPRING_TORQUE": method.spring_torque(exact, q),
}
for name, values in expected.items():
    out = [None] * len(values)
    loop_bodies.of_bodies(outer, bodies, getattr(loop_bodies, name), q, qd, w, out)
    print(max(map(abs, values)) > 0.1, mpmath.nstr(max(abs(x - y) for x, y in zip(out, values))))
print(*tree.kind, any(tree.stiffness))
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_loops_are_the_method_in_50_digits(seed):
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(seed)], env=environment, cwd=ROOT, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    *found, kinds = (line.split() for line in run.stdout.splitlines())
    assert len(found) == 10 and all(some == "True" and float(off) < 1e-45 for some, off in found)
    assert {*kinds} == {"hinge", "slide", "ball", "True"}
