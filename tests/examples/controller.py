"""Hold the arm at a posture with gravity compensation and a PD controller, 1,000 times a second; needs tmt alone.
`tmt.prepare` compiles before the loop, so that no period waits for a compiler."""

from time import perf_counter

import numpy as np

import tmt

PERIOD = 1e-3  # s; the torque is constant in between
TARGET = np.radians([30.0, 10.0, 80.0])  # alpha, beta, gamma
STIFFNESS = np.array([60.0, 60.0, 30.0])  # N m/rad
DAMPING = np.array([8.0, 8.0, 3.0])  # N m s/rad

tmt.prepare(tmt.ARM, "gravity_balance")
q, qd = np.zeros(3), np.zeros(3)
longest = 0.0
for _ in range(2000):
    began = perf_counter()
    tau = tmt.gravity_balance(tmt.ARM, q) - STIFFNESS * (q - TARGET) - DAMPING * qd
    longest = max(longest, perf_counter() - began)
    motion = tmt.simulate(tmt.ARM, q, qd, tau, dt=PERIOD, steps=1)  # in the place of the robot
    q, qd = motion.q[-1], motion.qd[-1]

error = np.degrees(np.abs(q - TARGET).max())
print(f"after 2 s: {error:.4f} deg from the target, speed {np.abs(qd).max():.2g} rad/s")
print(f"longest computation of the torque: {1e6 * longest:.0f} us")
