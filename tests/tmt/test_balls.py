"""Springs of balls at any turn, also none and exactly half of one, in every type of number: MuJoCo's, and a closed form."""

import ctypes
import shutil
import subprocess
from itertools import product as product_of

import mujoco
import numpy as np
import pytest
from helpers.many_digits import exact
from helpers.trees import one_body

import tmt
from tmt.compiled import Evaluator
from tmt.derivation.coordinates import product
from tmt.exact.many import exact_of_many
from tmt.exact.motion import trajectory

K, REST = 2.5, np.array([0.5, 0.5, -0.5, 0.5])
# of the second w is exactly zero after half a turn, of the first but for rounding
AXES = np.array([1.0, 2.0, -2.0]) / 3.0, np.array([0.0, -1.0, 0.0])
TREE = one_body(np.eye(3), ["ball"], stiffness=[K], rest=REST, gravity=(0.0, 0.0, 0.0))
FILE = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="ball" stiffness="{K}"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
TURNS = (0.0, 1e-300, 1e-9, 1.0, np.pi - 1e-9, np.pi, np.pi + 1e-9, 5.0, 2.0 * np.pi - 1e-9)
QUANTITIES = "spring_torque", "potential_energy", "inverse_dynamics_derivatives"
Z = np.zeros(3)


def turned(angle, axis=AXES[0]):
    """The position after a turn about an axis from rest."""
    sine, cosine = np.sin(angle / 2.0), np.cos(angle / 2.0)
    return np.array(product(REST.tolist(), [0.0 if angle == np.pi else cosine, *(sine * axis)]))


def expected(angle, axis):
    """Torque, energy and the derivative of the torque: k u, k u^2 / 2 and k dexp^-1(u), |u| at most pi."""
    angle = angle if angle <= np.pi else angle - 2.0 * np.pi
    u, half = angle * axis, angle / 2.0
    cross = np.array([np.cross(u, unit) for unit in np.eye(3)]).T
    share = (1.0 - half / np.tan(half)) / angle**2 if abs(angle) > 1e-4 else 1.0 / 12.0
    return K * u, K * angle**2 / 2.0, K * (np.eye(3) + cross / 2.0 + share * cross @ cross)


def compiled_c(folder):
    """The quantities by a compiler of C, as functions of a state."""
    (folder / "robot.c").write_text(tmt.equations(TREE, "c", QUANTITIES))
    subprocess.run(
        ["gcc", "-O1", "-shared", "-fPIC", "robot.c", "-o", "robot.so", "-lm"], cwd=folder, check=True
    )
    library, shapes = ctypes.CDLL(str(folder / "robot.so")), [(3,), (1,), (2, 3, 3)]

    def values(name, *state):
        out = np.empty(shapes[QUANTITIES.index(name)])
        parts = out if len(out) == 2 else [out]
        library[f"robot_{name}"](*(ctypes.c_void_p(x.ctypes.data) for x in (*state, *parts)))
        return out

    return values


def executed(language):
    found = {}
    exec(tmt.equations(TREE, language, QUANTITIES), found)
    return lambda name, *state: found[name](*state)


def with_50_digits(name, *state):
    values = exact(TREE, state[0], Z, Z, Z)
    return [values.dtau_dq, values.dtau_dqd] if name == QUANTITIES[2] else getattr(values, name)


TYPES = {
    "float": lambda _: lambda name, *state: getattr(tmt, name)(TREE, *state),
    "compiled": lambda _: lambda name, *state: Evaluator(TREE, name).of_one(*state),
    "pairs": lambda _: lambda name, q, *_: exact_of_many(TREE, name, q[None], *np.zeros((2, 1, 3))).high[0],
    "50 digits": lambda _: with_50_digits, "Python": lambda _: executed("python"), "C": compiled_c,
    "JAX": lambda _: executed("jax"),
}  # fmt: skip


@pytest.mark.parametrize("kind", TYPES)
def test_a_spring_at_any_turn_has_its_torque_energy_and_derivatives(kind, tmp_path):
    if kind == "C" and not shutil.which("gcc"):
        pytest.skip("no C compiler")
    if kind == "JAX":
        pytest.importorskip("jax").config.update("jax_enable_x64", True)
    values = TYPES[kind](tmp_path)
    for angle, axis in product_of(TURNS, AXES):
        torque, energy, by_tangent = expected(angle, axis)
        q = turned(angle, axis)
        states = [q], [q], [q, Z, Z]
        calls = zip(QUANTITIES, states)
        found = [np.array(values(name, *state), dtype=float) for name, state in calls]
        assert np.abs(found[0] - torque).max() <= 1e-14
        assert abs(found[1] - energy).max() <= 4e-14
        assert np.abs(found[2][0] - by_tangent).max() <= 1e-13 and not found[2][1].any()


@pytest.mark.parametrize("angle", TURNS)
def test_a_spring_at_any_turn_is_that_of_mujoco(angle):
    model = mujoco.MjModel.from_xml_string(FILE)
    model.qpos_spring[:], data = REST, mujoco.MjData(model)
    for axis in AXES:
        data.qpos = turned(angle, axis)
        mujoco.mj_forward(model, data)
        assert np.abs(tmt.spring_torque(TREE, data.qpos) + data.qfrc_spring).max() <= 1e-14


def test_a_quaternion_of_nearly_length_1_has_the_turn_of_one_of_length_1():
    q = turned(2.0)
    for size in (1.0 - 0.9e-6, 1.0 + 0.9e-6):
        assert np.abs(tmt.spring_torque(TREE, size * q) - tmt.spring_torque(TREE, q)).max() <= 1e-14


def test_a_motion_that_starts_at_half_a_turn_swings_back():
    """About its axis the body is a pendulum on a spring, of 1 kg m2: angle pi cos(sqrt(k) t)."""
    path = trajectory(TREE, turned(np.pi), Z, Z, 0.25, 2)
    for k, q in enumerate(path.high[:, :4]):
        angle = np.pi * np.cos(np.sqrt(K) * 0.25 * k)
        assert np.abs(q - turned(angle)).max() <= 4e-15
