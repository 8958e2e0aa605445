"""The torque that holds the arm against gravity."""

from functools import partial

import numpy as np

import tmt

from .agreement import Result, acceleration_scale, gravity_scale

TITLE = "Gravity balance: do both hold the arm with the same torque?"
CLAIM = (
    "TMT's holding torque is MuJoCo's qfrc_bias at rest; in both it is the gradient of the engine's own potential "
    "energy; and TMT's torque, given to MuJoCo, leaves the arm at rest."
)
BAR = (
    f"Torques: 64 eps x {gravity_scale():.2f} N m, the sum of m g reach. Accelerations left: 64 eps x (cond(Mbar) + 1) x "
    f"|Mbar^-1| x {gravity_scale():.2f} N m. "
    "The gradient is exact, not a small difference: V is a + b cos q_i + c sin q_i in each hinge angle, so that "
    "dV/dq_i = (V(q_i + 90 deg) - V(q_i - 90 deg)) / 2. (Rounding the sum q_i + 90 deg costs about 2 eps of the scale.)"
)


def gradient(potential_energy, q) -> np.ndarray:
    """dV/dq by the shift rule above, N m, (states, n)."""
    quarter = np.pi / 2 * np.eye(q.shape[1])
    return (potential_energy(q[:, None] + quarter) - potential_energy(q[:, None] - quarter)) / 2


def rows(setup) -> Result:
    """Torques at each named posture and at random ones, their gradients, and TMT's torque given to MuJoCo."""
    result = Result("gravity")
    engine, scale = setup.engine, gravity_scale()
    for sample in (*setup.named.each(), setup.random):
        q = sample.q
        ours, theirs = tmt.gravity_balance(q), engine.gravity_balance(q)
        result.agree(sample, "holding torque", "N m", ours, theirs, scale, truth="gravity_balance")
        if sample is not setup.random:
            result.curves.setdefault("postures", {})[sample.name] = (ours[0], theirs[0])
        result.agree(sample, "TMT: torque - dV/dq", "N m", ours, gradient(tmt.potential_energy, q), scale)
        result.agree(sample, "MuJoCo: torque - dV/dq", "N m", gradient(engine.potential_energy, q), theirs, scale)

    for sample in (setup.named, setup.random):
        q = sample.q
        at_rest = np.zeros_like(q)  # given to TMT, MuJoCo's torque would leave the same number with the other sign
        left = engine.acceleration(q, at_rest, tmt.gravity_balance(q))
        result.agree(sample, "qdd of MuJoCo under TMT's torque", "rad/s2", at_rest, left, acceleration_scale(q, scale))
    return result


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield partial(draw.distances, result, "random states", ["holding torque"])
    yield partial(draw.holding_torques, result)
