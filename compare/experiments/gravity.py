"""The torque that holds a robot against gravity."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ..judge.check import Result
from ..judge.scale import acceleration_scale, gravity_scale
from ..robots import Robot
from ..setup import Setup

TITLE = "Gravity balance: do both hold the model with the same torque?"


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    return (
        "TMT's holding torque is MuJoCo's qfrc_bias at rest; in both it is the gradient of the engine's own potential "
        f"energy; and TMT's torque, given to MuJoCo, leaves the {robot.name} at rest."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    scale = gravity_scale(robot.tree)
    return (
        f"Torques: 64 eps x {scale:.2f} N m, the sum of m g reach. Accelerations left: 64 eps x (cond(Mbar) + 1) x "
        f"|Mbar^-1| x {scale:.2f} N m. "
        "The gradient is exact, not a small difference: V is a + b cos q_i + c sin q_i in each hinge angle, so that "
        "dV/dq_i = (V(q_i + 90 deg) - V(q_i - 90 deg)) / 2. (Rounding the sum q_i + 90 deg costs about 2 eps of the scale.)"
    )


def gradient(potential_energy: Callable, q: np.ndarray) -> np.ndarray:
    """dV/dq of hinges by the rule above, N m, (states, n), from V of angles q, (..., n) rad."""
    quarter = np.pi / 2 * np.eye(q.shape[1])
    return (potential_energy(q[:, None] + quarter) - potential_energy(q[:, None] - quarter)) / 2


def rows(setup: Setup) -> Result:
    """Torques at each named posture and at random ones, their gradients, and TMT's torque given to MuJoCo."""
    result, tree = Result("gravity"), setup.robot.tree
    tmt, mujoco = setup.compared().values()
    scale = gravity_scale(tree)
    for sample in (*setup.named.each(), setup.random):
        q = sample.q
        ours, theirs = tmt.gravity_balance(q), mujoco.gravity_balance(q)
        result.agree(sample, "holding torque", "N m", ours, theirs, scale, truth="gravity_balance")
        if sample is not setup.random:
            result.curves.setdefault("postures", {})[sample.name] = {"tmt": ours[0], "mujoco": theirs[0]}
        result.agree(sample, "TMT: torque - dV/dq", "N m", ours, gradient(tmt.potential_energy, q), scale)
        result.agree(sample, "MuJoCo: torque - dV/dq", "N m", gradient(mujoco.potential_energy, q), theirs, scale)

    for sample in (setup.named, setup.random):
        q = sample.q
        at_rest = np.zeros_like(q)  # given to TMT, MuJoCo's torque would leave the same number with the other sign
        left = mujoco.acceleration(q, at_rest, tmt.gravity_balance(q))
        allowed = acceleration_scale(tree, q, scale)
        result.agree(sample, "qdd of MuJoCo under TMT's torque", "rad/s2", at_rest, left, allowed)
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances, draw_holding_torques  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states", ["holding torque"])
    yield partial(draw_holding_torques, result, robot)
