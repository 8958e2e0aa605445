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
ARM = """<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody><body pos="0 0 1">
<joint name="hip" axis="0 1 0" damping="0.3" armature="0.02"/>{rod}<body name="fore" pos="0 0 0.5">
<joint name="knee" axis="0 1 0.2" damping="0.2" stiffness="1.5"/>{rod}{load}</body></body></worldbody>
<actuator><motor joint="hip"/><motor joint="knee"/></actuator></mujoco>"""
LOAD = '<body pos="0 0.02 0.4"><inertial pos="0 0 0" mass="2" diaginertia="0.01 0.02 0.03"/></body>'
PAYLOAD = [[2.0], [0.0, 0.02, 0.4], [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]]
UPRIGHT, DT = np.array([0.1, -0.2]), 0.005


@pytest.mark.skipif(not shutil.which("gcc"), reason="no C compiler")
def test_a_controller_from_exported_c_holds_an_arm_with_a_payload_upright(tmp_path):
    with pytest.warns(UserWarning, match=r"does not have its actuator \(2\)"):
        tree = compare.tree(ARM.format(rod=ROD, load=""))
    quantities = ["inverse_dynamics", "step_derivatives:implicitfast"]
    text = tmt.equations(tree, "c", quantities, name="arm", parameters=["payload", "fore"])
    (tmp_path / "arm.c").write_text(text, encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC"]
    subprocess.run(["gcc", *flags, tmp_path / "arm.c", "-o", tmp_path / "arm.so", "-lm"], check=True)
    library, rest = ctypes.CDLL(str(tmp_path / "arm.so")), np.zeros(2)

    def called(name, shape, *arguments):
        arrays = [*(np.array(values, float) for values in arguments), np.empty(shape)]
        library[f"arm_{name}"](*(ctypes.c_void_p(array.ctypes.data) for array in arrays))
        return arrays[-1]

    tau = called("inverse_dynamics", 2, UPRIGHT, rest, rest, *PAYLOAD)
    both = called("step_derivatives_implicitfast", (4, 6), UPRIGHT, rest, tau, [DT], *PAYLOAD)
    A, B = both[:, :4], both[:, 4:]
    cost, of_torque = np.diag([100.0, 100.0, 1.0, 1.0]), 0.1 * np.eye(2)
    S = solve_discrete_are(A, B, cost, of_torque)
    K = np.linalg.solve(of_torque + B.T @ S @ B, B.T @ S @ A)

    model = mujoco.MjModel.from_xml_string(ARM.format(rod=ROD, load=LOAD))

    def deviations(gain, start, steps):
        data, states = mujoco.MjData(model), []
        data.qpos, data.qvel = UPRIGHT + start[:2], start[2:]
        for _ in range(steps):
            states.append(np.concatenate([data.qpos - UPRIGHT, data.qvel]))
            data.ctrl = tau - gain @ states[-1]
            mujoco.mj_step(model, data)
        return np.array(states)

    push = np.array([0.1, -0.1, 0.5, 0.5])
    assert np.abs(deviations(0 * K, 1e-3 * push, 400)).max() > 1.0  # it falls
    assert np.abs(deviations(K, push, 1000)[-1]).max() < 1e-3
    tiny, loop = 1e-6 * push, A - B @ K
    predicted = [np.linalg.matrix_power(loop, k) @ tiny for k in range(100)]
    assert np.abs(deviations(K, tiny, 100) - predicted).max() < 1e-5 * np.abs(tiny).max()
