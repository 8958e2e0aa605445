# Numbers of a report, repeated with MuJoCo and NumPy alone: python reproduce.py [FILE]; status 1: one is not the same.
# The report is by: python -m compare all --mjcf tests/models/quadruped.xml --write reports/quadruped_reduced.xml --out reports/quadruped (MuJoCo 4.0.0)
import json
import sys
from pathlib import Path

import mujoco
import numpy as np

SAID = json.loads(r"""{
 "file": "tests/models/quadruped.xml",
 "states": [
  {"quantity": "Mbar", "entry": [5, 15], "other": -0.03342581172657085, "mujoco": -0.033425811726570914, "difference": 6.245004513516506e-17, "tolerance": 1.937270928509779e-15, "qpos": [-0.47852915021247633, 0.18405283850369747, -0.3895333588085056, 0.11944144803834575, -0.6814951399102828, 0.009948447106801681, -0.7219412324901041, 0.6931247619138023, -0.26227446454004877, -2.213774569577505, -0.2614357740120641, -0.6508948864582882, -0.9188278836683834, -0.29167608108124343, 1.9611004914823122, -1.5290854716331588, 0.3767178948020755, 0.23706246800705522, -2.562798273528786], "qvel": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "tau": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]},
  {"quantity": "holding torque", "entry": [10], "other": -0.9284529196424562, "mujoco": -0.9284529196424529, "difference": 3.3306690738754696e-15, "tolerance": 1.8439115683007873e-13, "qpos": [-0.3179725012466972, -0.4122192976662369, 0.4211293905773743, -0.1888107986437808, 0.33308989384423576, -0.1156694677106108, 0.9165272386426261, -0.1572928531086163, 1.1033041569798763, -1.8156498887026398, 0.57654391613568, -0.025585715386330143, -1.9137659805986635, -0.2761104101476278, 2.2750061385356046, -1.5502209996217786, 0.319877316073093, 2.1942972785502177, -2.253407696694387], "qvel": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "tau": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]},
  {"quantity": "bias", "entry": [2], "other": 188.98137921204972, "mujoco": 188.98137921204977, "difference": 5.684341886080802e-14, "tolerance": 1.3859179375318374e-11, "qpos": [-0.42303886418523984, -0.01674525869847454, 0.3904183344020543, 0.13120116504477713, -0.986271578635533, 0.05972424361928872, -0.08054590114196263, 0.571603273849244, 1.3920495554271515, -0.5393319366769567, 0.6553638037466991, 0.4762499719205753, -0.7642002393579559, 0.1580131860680678, -1.1225170544925729, -1.5660041730400758, -0.003635102189584183, 2.1400985404197783, -2.4749172369384818], "qvel": [0.1301193830307159, 0.9817397130139573, 0.01928012717935723, -0.5358829715487312, -0.5141363485407116, 0.14002845389340202, -0.06173911112253316, 1.3714265752550414, 0.320658898669302, -0.744433295518795, 3.3796133472375605, -0.9180674258063852, 0.9150420131763841, -2.8653688045936647, -0.11206283911189852, 1.431508335900943, -1.918805648732162, -0.286789293076269], "tau": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]},
  {"quantity": "qdd", "entry": [2], "other": -20.39706002742536, "mujoco": -20.39706002742535, "difference": 1.0658141036401503e-14, "tolerance": 7.380673056367023e-12, "qpos": [0.2116315330637255, 0.08890215873714968, -0.28461930156136606, -0.9184182969680372, -0.07793669119887824, 0.3849502247276406, 0.04740283157618401, -0.43625180422002663, -0.8292722676580806, -0.5039588174472578, -0.25156852522165785, 0.7565907739020288, -2.0471593860906, -0.21118009473986665, -0.18983182353645534, -0.4853107022156866, 0.2129570870406705, -0.268817917281142, -1.0761274893320938], "qvel": [0.2363921031504448, -0.5195588221956147, 0.2351111540604509, -0.5485491176946242, -1.4062836427622027, -0.6670127351709629, -0.06861257037959101, 1.0469189366343956, -1.3138096011427054, -0.7174625177050935, 2.58628689565335, -0.8422339403461374, -0.21712458547569824, 2.4448866737514807, -1.25693705712639, -0.42280496423915404, -3.9046979336050445, 2.057548261338895], "tau": [146.13659906496292, -56.861110645628116, -186.40369969162197, -2.744567103648132, 0.4673696704065886, -2.7537316824251654, 0.03450788448388342, 0.27771375497907647, -0.12746866069267818, -0.3594716361796001, -0.37127981623505085, -0.1631553977355028, 0.22932389285753463, 0.0073254967745993715, -0.08610666695341387, -0.6458709859133321, -0.1495878678009851, -0.1154156487893499]}],
 "runs": [
  {"integrator": "implicitfast", "dt": 0.012400541822839842, "steps": 160, "over": 56, "speed": 0.006124738914243429, "start": {"qpos": [0.0, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4], "qvel": [-0.1, -0.1, 0.1, 0.1, -0.1, 0.1, 0.1, 0.1, 0.1, -0.1, 0.1, 0.1, 0.1, 0.1, 0.1, -0.1, -0.1, 0.1], "ctrl": [0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4]}},
  {"integrator": "implicitfast", "dt": 0.013045239860248546, "steps": 230, "over": 57, "speed": 0.8982896594993084, "start": {"qpos": [0.0, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4], "qvel": [0.1, -0.1, 0.1, 0.1, -0.1, 0.1, 0.1, 0.1, -0.1, -0.1, -0.1, 0.1, -0.1, -0.1, -0.1, -0.1, -0.1, -0.1], "ctrl": [0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4]}}],
 "smaller": {"file": "reports/quadruped_reduced.xml", "dt": 0.002, "integrator": "implicitfast", "places": [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18], "error": 0.0, "motions": [{"key": "stand", "steps": 500, "start": {"qpos": [0.0, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4], "ctrl": [0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4, 0.0, 0.7, -1.4]}}]},
 "checks": [
  {"experiment": "mass", "scene": "random states", "quantity": "Mbar", "value": 6.245004513516506e-17, "tolerance": 1.937270928509779e-15},
  {"experiment": "gravity", "scene": "random states", "quantity": "holding torque", "value": 3.3306690738754696e-15, "tolerance": 1.8439115683007873e-13},
  {"experiment": "gravity", "scene": "random states", "quantity": "holding torque, compiled", "value": 3.3306690738754696e-15, "tolerance": 1.884425690758052e-13},
  {"experiment": "acceleration", "scene": "random states", "quantity": "bias", "value": 5.684341886080802e-14, "tolerance": 1.3859179375318374e-11},
  {"experiment": "acceleration", "scene": "random states", "quantity": "bias, compiled", "value": 5.684341886080802e-14, "tolerance": 2.3210701336672478e-11},
  {"experiment": "acceleration", "scene": "random states", "quantity": "qdd", "value": 1.0658141036401503e-14, "tolerance": 7.380673056367023e-12},
  {"experiment": "acceleration", "scene": "named postures", "quantity": "bias from C qd", "value": 5.684341886080802e-14, "tolerance": 2.532899264410665e-10},
  {"experiment": "acceleration", "scene": "named postures", "quantity": "tau from Y theta", "value": 5.684341886080802e-14, "tolerance": 3.6479183332137405e-10},
  {"experiment": "acceleration", "scene": "named postures", "quantity": "dE/dt - (tau - D qd).qd at MuJoCo's qdd", "value": 5.684341886080802e-14, "tolerance": 2.7170482596974214e-09},
  {"experiment": "stability", "scene": "stand", "quantity": "stable at its own step", "value": 0.002, "tolerance": 0.012400541822839842}]
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


def started(m, start):
    d = mujoco.MjData(m)
    for name, values in start.items():
        getattr(d, name)[:] = np.reshape(values, getattr(d, name).shape)
    return d


mujoco.set_mju_user_warning(lambda text: None)  # that a run diverges


OFF = "CONSTRAINT", "CONTACT", "EQUALITY", "LIMIT", "FRICTIONLOSS", "ACTUATION"  # and what else the equations do not have
m = model(file, off=OFF)
m.opt.density = m.opt.viscosity = m.opt.enableflags = 0
m.dof_frictionloss[:] = 0
d, M = mujoco.MjData(m), np.zeros((m.nv, m.nv))
for row in SAID["states"]:  # the worst state of each quantity
    d.qpos[:], d.qvel[:], d.qfrc_applied[:] = row["qpos"], row["qvel"], row["tau"]
    mujoco.mj_forward(m, d)
    mujoco.mj_fullM(m, d, M)
    values = {"Mbar": M, "bias": d.qfrc_bias, "holding torque": d.qfrc_bias, "qdd": d.qacc}[row["quantity"]]
    here, what = float(values[tuple(row["entry"])]), f"{row['quantity']} {row['entry']}"
    beside(f"{what}, MuJoCo", here, row["mujoco"], row["tolerance"])
    beside(f"{what}, difference", abs(here - row["other"]), row["difference"], row["tolerance"])
for run in SAID["runs"]:  # at the longest stable step and at the first that fails
    m = model(file, run["dt"], run["integrator"])
    d, speeds = started(m, run["start"]), []
    for _ in range(run["steps"]):
        mujoco.mj_step(m, d)
        speeds.append(np.abs(d.qvel).max())
    here, said = max(speeds[-run["over"] :]), float("nan") if run["speed"] is None else run["speed"]
    what = f"{run['integrator']}, {1e3 * run['dt']:.4g} ms, largest speed of the last {run['over']} of {run['steps']} steps"
    beside(what, here, said, 1e-6 * abs(said))
smaller, error = SAID["smaller"], 0.0  # the file that was written, beside the whole one
one, other = (model(name, smaller["dt"], smaller["integrator"]) for name in (file, smaller["file"]))
for motion in smaller["motions"]:
    d, e, apart = started(one, motion["start"]), mujoco.MjData(other), np.zeros(other.nv)
    mujoco.mj_resetDataKeyframe(other, e, other.key(motion["key"]).id)
    for _ in range(motion["steps"] + 1):
        mujoco.mj_differentiatePos(other, apart, 1.0, d.qpos[smaller["places"]], e.qpos)
        error = max(error, np.abs(apart).max())
        mujoco.mj_step(one, d)
        mujoco.mj_step(other, e)
beside(f"error of {smaller['file']}", error, smaller["error"], 1e-6 * error)
report = Path(__file__).with_name("results.json")  # if the script stands beside it: whether it has these numbers
for said in SAID["checks"] if report.exists() else []:
    if not any(said.items() <= check.items() for check in json.loads(report.read_text("utf-8"))["checks"]):
        beside(f"not in results.json: {said}", said["value"], float("nan"), -1)
sys.exit(different > 0)

