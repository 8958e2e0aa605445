"""Check your own equations of motion with MuJoCo: a cart with a pole, M(q) q'' + h(q, q') = tau.
Put the function that begins with test_ into your tests; run as a script, this prints what a wrong sign does."""

import numpy as np

import compare

CART_POLE = """<mujoco><worldbody><body>
  <joint name="cart" type="slide" axis="1 0 0"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
  <body>
    <joint name="pole" axis="0 1 0"/>
    <inertial pos="0 0 0.5" mass="0.2" diaginertia="0.01 0.01 0.001"/>
  </body>
</body></worldbody></mujoco>"""
CART, POLE, LENGTH, INERTIA, G = 1.0, 0.2, 0.5, 0.01, 9.81  # kg, kg, m, kg m2, m/s2


def mass_matrix(q):
    coupling = POLE * LENGTH * np.cos(q[1])
    return [[CART + POLE, coupling], [coupling, INERTIA + POLE * LENGTH**2]]


def bias(q, qd):
    return [-POLE * LENGTH * np.sin(q[1]) * qd[1] ** 2, -POLE * LENGTH * G * np.sin(q[1])]


def test_my_equations():
    compare.assert_agrees(CART_POLE, mass_matrix=mass_matrix, bias=bias)


if __name__ == "__main__":
    test_my_equations()
    worst = compare.differences(CART_POLE, bias=lambda q, qd: [bias(q, qd)[0], -bias(q, qd)[1]])[0]
    wrong = f"{worst.entry} is {worst.yours:.3g}, not {worst.mujoco:.3g}"
    print(f"the equations agree; with a wrong sign {wrong}")
    print(f"probable cause: {worst.cause}")
