"""Plot the time of a run of five seconds against its error, one line for each method, from the table of a report.
Usage: python time_against_error.py reports/latest/tables/speed.csv; writes time_against_error.png to the current folder."""

import sys

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import pandas as pd

SCENE = "bent, free"
METHODS = {"mujoco": ["Euler", "implicitfast", "RK4"], "tmt": ["rk4", "dopri8", "dopri8_adaptive"]}
MARKERS = "osD^v*"
plt.style.use("tableau-colorblind10")

table = pd.read_csv(sys.argv[1])
table = table[table.scene == SCENE]
fig, ax = plt.subplots(figsize=(7, 4.5), layout="constrained")
lines = [(engine, method) for engine, methods in METHODS.items() for method in methods]
for (engine, method), marker in zip(lines, MARKERS):
    runs = table[(table.engine == engine) & (table.method == method)].sort_values("seconds")
    style = "-" if engine == "tmt" else "--"
    ax.loglog(1000 * runs.seconds, runs.worst_error_rad, style, marker=marker, label=f"{engine}, {method}")
ax.set(xlabel="time of the run, ms", ylabel="largest error of an angle, rad", title=SCENE)
ax.grid(alpha=0.3)
fig.legend(loc="outside right upper")
fig.savefig("time_against_error.png", dpi=150)
print(f"time_against_error.png: {len(lines)} methods in the scene {SCENE!r}")
