"""A double pendulum as MJCF and its equations as a user writes them, right and wrong: what test_agreement_of_own imports, and a
user's file in test_own_reference and test_help."""

import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np

XML = """<mujoco model="double"><worldbody>
  <body><joint name="hip" axis="0 1 0" damping="0.3"/><inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.02"/>
    <body pos="0 0 -1"><joint name="knee" axis="0 1 0"/>
      <inertial pos="0 0 -0.5" mass="2" diaginertia="0.2 0.2 0.02"/></body></body></worldbody></mujoco>"""
G = 9.81
PRINTS = 'from numbers_beside import g\n\nprint("a user\'s file may print")\n'


def mass_matrix(q):
    c = np.cos(q[1])
    return np.array([[3.05 + 2 * c, 0.7 + c], [0.7 + c, 0.7]])


def bias(q, qd, of_square=1.0):
    s, lower = np.sin(q[1]), G * np.sin(q[0] + q[1])
    turning = s * np.array([-2 * qd[0] * qd[1] - of_square * qd[1] ** 2, qd[0] ** 2])
    return turning + [2.5 * G * np.sin(q[0]) + lower, lower]


def wrong_bias(q, qd):
    return bias(q, qd, of_square=-1.0)


def gravity(q):
    return bias(q, np.zeros(2))


def acceleration(q, qd, tau, bias=bias, damping=0.3):
    return np.linalg.solve(mass_matrix(q), tau - bias(q, qd) - np.array([damping, 0.0]) * qd)


def energy(q, qd):
    return qd @ mass_matrix(q) @ qd / 2 - G * (2.5 * np.cos(q[0]) + np.cos(q[0] + q[1]))


class Object:
    """An object, with an energy."""

    joint_names = ("hip", "knee")
    mass_matrix, bias, energy = map(staticmethod, (mass_matrix, bias, energy))


class inside:
    also = Object


class Needing:
    def __init__(self, mass):
        pass


def changed(**more):
    return SimpleNamespace(**({"mass_matrix": mass_matrix, "bias": bias} | more))


def late_bias(q, qd):
    if abs(q[0]) > 2.0:
        raise ArithmeticError("too far")
    return bias(q, qd)


def slow(q):
    time.sleep(0.05)
    return mass_matrix(q)


sign = changed(bias=wrong_bias)
slow_sign = changed(mass_matrix=slow, bias=wrong_bias)
nan = changed(bias=lambda q, qd: bias(q, qd) * (np.nan if abs(q[0]) > 2.0 else 1.0))
late = changed(bias=late_bias)
infinite = changed(bias=lambda q, qd: bias(q, qd) + np.inf)
doubled = changed(gravity=lambda q: 2.0 * gravity(q))
SWAPPED = {"mass_matrix": lambda q: mass_matrix(q[::-1])[::-1, ::-1]}
SWAPPED["bias"] = lambda q, v: bias(q[::-1], v[::-1])[::-1]
alone, alone_sign, alone_damped = (
    SimpleNamespace(acceleration=partial(acceleration, **more))
    for more in ({}, {"bias": wrong_bias}, {"damping": 0.5})
)
inverse = SimpleNamespace(inverse_dynamics=lambda q, qd, qdd: mass_matrix(q) @ qdd + bias(q, qd))
swapped, named = changed(**SWAPPED), changed(**SWAPPED, joint_names=["knee", "hip"])


def write(folder):
    mine = Path(__file__).read_text(encoding="utf-8") + PRINTS
    for name, text in (("double.xml", XML), ("mine.py", mine), ("numbers_beside.py", "g = 9.81\n")):
        (folder / name).write_text(text, encoding="utf-8")
