"""Compare all robots of a folder with a solution, as for a class: which files differ, and in which number.
Writes two submissions and the folder `class` with a table and a report for each of them."""

import csv
import subprocess
import sys
from pathlib import Path

PENDULUM = """<mujoco><worldbody><body name="rod">
  <joint name="hip" axis="0 1 0"/>
  <inertial pos="0 0 {com}" mass="1" diaginertia="0.1 0.1 0.01"/>
</body></worldbody></mujoco>"""

Path("submissions").mkdir()
for name, com in {"anna": -0.5, "ben": -0.55}.items():
    Path(f"submissions/{name}.xml").write_text(PENDULUM.format(com=com), encoding="utf-8")
Path("solution.xml").write_text(PENDULUM.format(com=-0.5), encoding="utf-8")

words = ["fleet", "submissions", "--reference", "solution.xml", "--only", "mass,parameters", "--out", "class"]
status = subprocess.run([sys.executable, "-m", "compare", *words], stdout=subprocess.DEVNULL).returncode
print(f"status {status}: {['no file differs', 'a file differs or broke off', 'it could not run'][status]}")
with open("class/fleet.csv", encoding="utf-8", newline="") as file:
    for row in csv.DictReader(file):  # the worst first
        print(f"{row['file']}: {row['verdict']} {row['reason']}".strip())
