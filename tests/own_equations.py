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


def nan_bias(q, qd):
    return bias(q, qd) * (np.nan if abs(q[0]) > 2.0 else 1.0)


def late_bias(q, qd):
    if abs(q[0]) > 2.0:
        raise ArithmeticError("too far")
    return bias(q, qd)


def slow(q):
    time.sleep(0.05)
    return mass_matrix(q)


sign = changed(bias=lambda q, qd: 2.0 * bias(q, 0.0 * qd) - bias(q, qd))
slow_sign = changed(mass_matrix=slow, bias=sign.bias)
nan = changed(bias=nan_bias)
late = changed(bias=late_bias)
infinite = changed(bias=lambda q, qd: bias(q, qd) + np.inf)
doubled = changed(gravity=lambda q: 2.0 * bias(q, 0.0 * q))
swapped = changed(mass_matrix=lambda q: mass_matrix(q[::-1])[::-1, ::-1], bias=lambda q, qd: bias(q[::-1], qd[::-1])[::-1])
named = changed(mass_matrix=swapped.mass_matrix, bias=swapped.bias, joint_names=["knee", "hip"])


class Needing:
    def __init__(self, mass):
        pass


print("a user's file may print")
'''
BESIDE = "g, m, length, half, inertia = 9.81, 1.0, 1.0, 0.5, 0.1\n"


def write(folder):
    """The files of a user's folder."""
    for name, text in (("double.xml", XML), ("mine.py", MINE), ("numbers_beside.py", BESIDE)):
        (folder / name).write_text(text, encoding="utf-8")
