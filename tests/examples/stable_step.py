"""Find the time steps that are stable for a robot with its own servos, with each integrator of MuJoCo.
Writes robot.xml and a report to the current folder; use your own file in the place of robot.xml."""

import csv
import json
import subprocess
import sys
from pathlib import Path

ROBOT = """<mujoco>
  <option timestep="0.01" integrator="Euler"/>
  <worldbody><body name="upper arm">
    <joint name="shoulder" axis="0 1 0" damping="0.5"/>
    <inertial pos="0 0 -0.2" mass="2" diaginertia="0.02 0.02 0.004"/>
    <body name="forearm" pos="0 0 -0.4">
      <joint name="elbow" axis="0 1 0" damping="0.2"/>
      <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.002"/>
    </body>
  </body></worldbody>
  <actuator><position joint="shoulder" kp="400" kv="20"/><position joint="elbow" kp="300" kv="8"/></actuator>
</mujoco>"""

Path("robot.xml").write_text(ROBOT, encoding="utf-8")
words = ["stability", "--quick", "--mjcf", "robot.xml", "--out", "report"]
status = subprocess.run([sys.executable, "-m", "compare", *words], stdout=subprocess.DEVNULL).returncode
results = json.loads(Path("report/results.json").read_text(encoding="utf-8"))
for check in results["checks"]:
    if check["quantity"] == "stable at its own step":
        answer = "stable" if check["passed"] else "not stable"
        print(f"step of the file, {check['value']} s: {answer} (status {status})")
with open("report/tables/step_limits.csv", encoding="utf-8", newline="") as file:
    for row in csv.DictReader(file):
        dt = row["predicted_dt_s"]
        limit = f"{float(dt):.4f} s, {row['limiting_joint']}" if dt else "none"
        print(f"limit with {row['integrator']}: {limit}")
