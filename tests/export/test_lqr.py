"""A and B of exported C, with a payload as argument, in a linear-quadratic controller: it holds an arm upright in MuJoCo."""

import ctypes
import shutil
import subprocess

import mujoco
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import compare
import tmt

ROD = '<inertial pos="0 0.01 0.25" mass="1.2" diaginertia="0.03 0.03 0.002"/>'
LOAD = '<body pos="0 0.02 0.4"><inertial pos="0 0 0" mass="2" diaginertia="0.01 0.02 0.03"/></body>'
PAYLOAD = [[2.0], [0.0, 0.02, 0.4], [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]]
ARM = f"""<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody><body pos="0 0 1">
<joint name="hip" axis="0 1 0" damping="0.3" armature="0.02"/>{ROD}<body name="fore" pos="0 0 0.5">
<joint name="knee" axis="0 1 0.2" damping="0.2" stiffness="1.5"/>{ROD}{LOAD}</body></body></worldbody>
<actuator><motor joint="hip"/><motor joint="knee"/></actuator></mujoco>"""
UPRIGHT, PUSH = np.array([0.1, -0.2]), np.array([0.1, -0.1, 0.5, 0.5])


def deviations(tau, gain, start, steps):
    model = mujoco.MjModel.from_xml_string(ARM)
    data, states = mujoco.MjData(model), []
    data.qpos, data.qvel = UPRIGHT + start[:2], start[2:]
    for _ in range(steps):
        states.append(np.concatenate([data.qpos - UPRIGHT, data.qvel]))
        data.ctrl = tau - gain @ states[-1]
        mujoco.mj_step(model, data)
    return np.array(states)


@pytest.mark.skipif(not shutil.which("gcc"), reason="no C compiler")
@pytest.mark.filterwarnings("ignore:the Tree of .* does not have its actuator")
def test_a_controller_from_exported_c_holds_an_arm_with_a_payload_upright(tmp_path):
    names, parameters = ["inverse_dynamics", "step_derivatives:implicitfast"], ["payload", "fore"]
    text = tmt.equations(compare.tree(ARM.replace(LOAD, "")), "c", names, name="arm", parameters=parameters)
    (tmp_path / "arm.c").write_text(text, encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, tmp_path / "arm.c", "-o", tmp_path / "arm.so", "-lm"], check=True)
    library, rest = ctypes.CDLL(str(tmp_path / "arm.so")), np.zeros(2)

    def called(name, shape, *arguments):
        arrays = [*(np.array(values, float) for values in (*arguments, *PAYLOAD)), np.empty(shape)]
        library[f"arm_{name}"](*(ctypes.c_void_p(array.ctypes.data) for array in arrays))
        return arrays[-1]

    tau = called("inverse_dynamics", 2, UPRIGHT, rest, rest)
    A, B = np.split(called("step_derivatives_implicitfast", (4, 6), UPRIGHT, rest, tau, [0.005]), [4], axis=1)
    S = solve_discrete_are(A, B, np.diag([100.0, 100.0, 1.0, 1.0]), 0.1 * np.eye(2))
    K = np.linalg.solve(0.1 * np.eye(2) + B.T @ S @ B, B.T @ S @ A)
    assert np.abs(deviations(tau, 0.0 * K, 1e-3 * PUSH, 400)).max() > 1.0  # it falls
    assert np.abs(deviations(tau, K, PUSH, 1000)[-1]).max() < 1e-3
    predicted = [np.linalg.matrix_power(A - B @ K, k) @ PUSH for k in range(100)]
    assert np.abs(1e6 * deviations(tau, K, 1e-6 * PUSH, 100) - predicted).max() < 1e-5
