# Numbers of a report, repeated with MuJoCo and NumPy alone: python reproduce.py [FILE]; status 1: one is not the same.
# The report is by: python -m compare all --out reports/example (MuJoCo 4.0.0)
import json
import sys
from pathlib import Path

import mujoco
import numpy as np

SAID = json.loads(r"""{
 "file": "mjcf/arm.xml",
 "states": [
  {"quantity": "Mbar", "entry": [2, 2], "other": 0.05274999999999998, "mujoco": 0.052750000000000116, "difference": 1.3877787807814457e-16, "tolerance": 3.341006793735965e-15, "qpos": [-2.778252176600897, 2.9451947279594073, 2.1921846860992504], "qvel": [0.0, 0.0, 0.0], "tau": [0.0, 0.0, 0.0]},
  {"quantity": "holding torque", "entry": [2], "other": 2.089485054579883, "mujoco": 2.0894850545798858, "difference": 2.6645352591003757e-15, "tolerance": 1.2480454849231367e-13, "qpos": [0.900561152233613, 2.862683210006166, 1.2005779135361099], "qvel": [0.0, 0.0, 0.0], "tau": [0.0, 0.0, 0.0]},
  {"quantity": "bias", "entry": [2], "other": 2.158020909248636, "mujoco": 2.158020909248634, "difference": 1.7763568394002505e-15, "tolerance": 1.5066362513910085e-13, "qpos": [-3.081626911516783, 2.966927409981312, -2.837312760811202], "qvel": [-0.7555184691736212, 0.541414068974678, 0.1215977443056957], "tau": [0.0, 0.0, 0.0]},
  {"quantity": "qdd", "entry": [2], "other": -204.27024998922167, "mujoco": -204.2702499892214, "difference": 2.5579538487363607e-13, "tolerance": 3.7603502682325775e-11, "qpos": [-2.6797913967665616, -3.022350375477668, -2.095941364558133], "qvel": [0.40461173746512635, -0.40761630263582305, 6.375175224986364], "tau": [-2.3705595397880197, 2.2949497597120487, -9.099245159057514]}],
 "runs": [],
 "smaller": null,
 "checks": [
  {"experiment": "mass", "scene": "random states", "quantity": "Mbar", "value": 1.3877787807814457e-16, "tolerance": 3.341006793735965e-15},
  {"experiment": "gravity", "scene": "random states", "quantity": "holding torque", "value": 2.6645352591003757e-15, "tolerance": 1.2480454849231367e-13},
  {"experiment": "gravity", "scene": "random states", "quantity": "holding torque, compiled", "value": 2.6645352591003757e-15, "tolerance": 1.2480454849231367e-13},
  {"experiment": "acceleration", "scene": "random states", "quantity": "bias", "value": 1.7763568394002505e-15, "tolerance": 1.5066362513910085e-13},
  {"experiment": "acceleration", "scene": "random states", "quantity": "qdd", "value": 2.5579538487363607e-13, "tolerance": 3.7603502682325775e-11}]
}""")
file, different = sys.argv[1] if len(sys.argv) > 1 else SAID["file"], 0
if not Path(file).is_file():
    raise SystemExit(f"{file} is not here: python reproduce.py FILE")


def beside(what, here, said, within=0.0):
    global different
    is_same = here == said or abs(here - said) <= within or not (np.isfinite(said) or abs(here) < 1e10)
    different += not is_same
    print(f"{what}: {here:.15g}; the report: {said:.15g}; {'the same' if is_same else 'NOT THE SAME'}")


def model(file, dt=None, integrator="RK4", off=("AUTORESET",)):
    m = mujoco.MjModel.from_xml_path(file)
    m.opt.timestep, m.opt.integrator = dt or m.opt.timestep, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    m.opt.disableflags |= sum(int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}", 0)) for flag in off)
    m.opt.enableflags &= ~int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))
    return m


m = model(file)
d, M = mujoco.MjData(m), np.zeros((m.nv, m.nv))
for row in SAID["states"]:  # the worst state of each quantity
    d.qpos[:], d.qvel[:], d.qfrc_applied[:] = row["qpos"], row["qvel"], row["tau"]
    mujoco.mj_forward(m, d)
    mujoco.mj_fullM(m, d, M)
    values = {"Mbar": M, "bias": d.qfrc_bias, "holding torque": d.qfrc_bias, "qdd": d.qacc}[row["quantity"]]
    here, what = float(values[tuple(row["entry"])]), f"{row['quantity']} {row['entry']}"
    beside(f"{what}, MuJoCo", here, row["mujoco"], row["tolerance"])
    beside(f"{what}, difference", abs(here - row["other"]), row["difference"], row["tolerance"])
report = Path(__file__).with_name("results.json")  # if the script stands beside it: whether it has these numbers
for said in SAID["checks"] if report.exists() else []:
    if not any(said.items() <= check.items() for check in json.loads(report.read_text("utf-8"))["checks"]):
        beside(f"not in results.json: {said}", said["value"], float("nan"), -1)
sys.exit(different > 0)

