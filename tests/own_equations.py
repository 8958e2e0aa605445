"""A double pendulum as MJCF and its equations as a user writes them, right and wrong, for test_own_reference and test_help."""

XML = """<mujoco model="double"><worldbody>
  <body name="upper"><joint name="hip" axis="0 -1 0"/><inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.1"/>
    <body name="lower" pos="0 0 -1"><joint name="knee" axis="0 -1 0"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.1"/></body></body>
</worldbody></mujoco>"""

MINE = '''
import time
from types import SimpleNamespace

import numpy as np
import sympy

from numbers_beside import g, half, inertia, length, m


def mass_matrix(q):
    c = np.cos(q[1])
    second = inertia + m * half**2
    first = 2 * inertia + m * (2 * half**2 + length**2 + 2 * length * half * c)
    between = second + m * length * half * c
    return np.array([[first, between], [between, second]])


def bias(q, qd):
    turning = m * length * half * np.sin(q[1])
    weight = m * g * half * np.sin(q[0] + q[1])
    return np.array([
        -turning * (2 * qd[0] + qd[1]) * qd[1] + m * g * (half + length) * np.sin(q[0]) + weight,
        turning * qd[0] ** 2 + weight,
    ])


def energy(q, qd):
    height = -(half + length) * np.cos(q[0]) - half * np.cos(q[0] + q[1])
    return m * g * height + qd @ mass_matrix(q) @ qd / 2


class Object:
    """An object, with an energy."""

    joint_names = ["hip", "knee"]
    mass_matrix, bias, energy = map(staticmethod, (mass_matrix, bias, energy))


class inside:
    also = Object


def changed(**more):
    return SimpleNamespace(**({"mass_matrix": mass_matrix, "bias": bias} | more))


def far(q):
    return abs(q[0]) > 2.0


def nan_bias(q, qd):
    return bias(q, qd) * (np.nan if far(q) else 1.0)


def late_bias(q, qd):
    if far(q):
        raise ArithmeticError("too far")
    return bias(q, qd)


def greedy(q):
    q *= 2.0
    return mass_matrix(q / 2.0)


def slow(q):
    time.sleep(0.05)
    return mass_matrix(q)


sign = changed(bias=lambda q, qd: 2.0 * bias(q, 0.0 * qd) - bias(q, qd))
nan = changed(bias=nan_bias)
late = changed(bias=late_bias)
skew = changed(mass_matrix=lambda q: mass_matrix(q) + [[0.0, 0.01], [0.0, 0.0]])
changes = changed(mass_matrix=greedy)
singular = changed(mass_matrix=lambda q: 0.0 * mass_matrix(q))
infinite = changed(bias=lambda q, qd: bias(q, qd) + np.inf)
doubled = changed(gravity=lambda q: 2.0 * bias(q, 0.0 * q))
slowly = changed(mass_matrix=slow)
slow_sign = changed(mass_matrix=slow, bias=sign.bias)
mirrored = changed(bias=lambda q, qd: -bias(-q, -qd), joint_names=["-hip", "-knee"])
swapped = changed(mass_matrix=lambda q: mass_matrix(q[::-1])[::-1, ::-1], bias=lambda q, qd: bias(q[::-1], qd[::-1])[::-1])

complex_bias = changed(bias=lambda q, qd: bias(q, qd) * 1j)
short = changed(bias=lambda q, qd: bias(q, qd)[:1])
first = changed(bias=lambda q, qd: q[5])
no_bias = SimpleNamespace(mass_matrix=mass_matrix)
named = changed(joint_names=["hip", "ankle"])


class Needing:
    def __init__(self, mass):
        pass


class Raising:
    def __init__(self):
        raise KeyError("mass")


symbols = sympy.symbols("q1 q2 w1 w2")
q1, q2, w1, w2 = symbols
q, w = sympy.Matrix([q1, q2]), sympy.Matrix([w1, w2])
ends = [sympy.Matrix([sympy.sin(a), -sympy.cos(a)]) for a in (q1, q1 + q2)]
centres = [ends[0] * half, ends[0] * length + ends[1] * half]
M = inertia * sympy.Matrix([[2, 1], [1, 1]])
for x in centres:
    M += m * x.jacobian(q).T * x.jacobian(q)
T, V = (w.T * M * w)[0] / 2, m * g * sum(x[1] for x in centres)
h = sympy.Matrix([T.diff(v) for v in w]).jacobian(q) * w - sympy.Matrix([(T - V).diff(a) for a in q])
of_symbols = SimpleNamespace(mass_matrix=M, bias=h, energy=T + V, symbols=symbols)
print("a user's file may print")
'''
BESIDE = "g, m, length, half, inertia = 9.81, 1.0, 1.0, 0.5, 0.1\n"


def write(folder):
    """The files of a user's folder."""
    for name, text in (("double.xml", XML), ("mine.py", MINE), ("numbers_beside.py", BESIDE)):
        (folder / name).write_text(text, encoding="utf-8")
