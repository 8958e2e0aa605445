# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # The first hour
# A double pendulum, whose equations of motion somebody has derived, and three questions: are they right, which step does
# MuJoCo need for it, and which method costs least for an error?

# %%
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import compare

ROD = '<inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.01"/>'
LOWER = f'<body pos="0 0 -1"><joint name="knee" axis="0 1 0" stiffness="40" damping="0.2"/>{ROD}</body>'
UPPER = f'<body><joint name="hip" axis="0 1 0" damping="0.2"/>{ROD}{LOWER}</body>'
Path("robot.xml").write_text(f"<mujoco><worldbody>{UPPER}</worldbody></mujoco>", encoding="utf-8")


# %% [markdown]
# ## A wrong sign
# M(q) q'' + h(q, q') = tau, where h has no springs and no damping. Of the centrifugal terms one has the wrong sign.


# %%
def mass_matrix(q):
    coupled = 0.35 + 0.5 * np.cos(q[1])
    return [[1.7 + np.cos(q[1]), coupled], [coupled, 0.35]]


def bias(q, qd, sign=1.0):
    s, g1, g2 = 0.5 * np.sin(q[1]), 14.715 * np.sin(q[0]), 4.905 * np.sin(q[0] + q[1])
    return [sign * s * qd[1] ** 2 - 2 * s * qd[0] * qd[1] + g1 + g2, s * qd[0] ** 2 + g2]


worst, *others = compare.differences("robot.xml", mass_matrix=mass_matrix, bias=bias)
print(f"{worst.entry}: yours {worst.yours:.4f}, MuJoCo {worst.mujoco:.4f}; {len(others)} more differences")
print(f"probable cause: {worst.cause}")

# %% [markdown]
# With the other sign they agree, to the rounding of each entry.

# %%
compare.assert_agrees("robot.xml", mass_matrix=mass_matrix, bias=lambda q, qd: bias(q, qd, sign=-1.0))
print("the equations agree")

# %% [markdown]
# ## Which step?
# A push of 0.1 rad/s is survived up to these steps; the robot hangs at rest.

# %%
limits = compare.step_limits("robot.xml")
print(limits)
limits.to_frame()[["stable_up_to_s", "fails_at_s"]]

# %% [markdown]
# ## Which method for which error?
# The table of `speed` has a row for each run. Of each engine only what nothing of it beats is drawn.

# %%
command = [sys.executable, "-m", "compare", "speed", "--quick", "--mjcf", "robot.xml", "--out", "report"]
subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
runs = pd.read_csv("report/tables/speed.csv").dropna(subset=["seconds", "worst_error_rad"])
runs = runs[runs.scene == runs.scene.iloc[0]].sort_values("seconds")
for engine, own in runs.groupby("engine"):
    best = own[own.worst_error_rad < own.worst_error_rad.cummin().shift(fill_value=np.inf)]
    plt.loglog(best.worst_error_rad, 1e3 * best.seconds, "o-", label=engine)
plt.gca().set(xlabel="largest error, rad", ylabel="time of a run, ms", title=runs.scene.iloc[0])
plt.legend()
plt.savefig("time_over_error.png", dpi=100)
print(f"time over error: {', '.join(sorted(set(runs.engine)))}")
