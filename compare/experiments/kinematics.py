"""Positions, angular velocities, Jacobians and convective terms."""

from functools import partial

import tmt

from .agreement import Result, reaches

TITLE = "Kinematics: do the bodies move alike?"
CLAIM = (
    "Every quantity between the hinge angles and the equations of motion has a counterpart in MuJoCo, so that a wrong "
    "one can be named: x_b and omega_b (xipos, cvel), T_b and B_b (mj_jacBodyCom, its rotation turned into body axes), "
    "and both convective terms (mj_jacDot times the rates)."
)
BAR = (
    f"64 eps x scale. Lengths and T_b: the largest distance from the shoulder, {reaches().max():.2f} m. B_b: 1. Angular "
    f"velocity: the sum S of |rates|. Convective terms: {reaches().max():.2f} m x S^2 and S^2."
)


def rows(setup) -> Result:
    """Six quantities at the named postures and at random states."""
    result = Result("kinematics")
    engine = setup.engine
    reach = reaches().max()
    for sample in (setup.named, setup.random):
        q, qd = sample.q, sample.qd
        speed = abs(qd).sum(axis=1)
        T, B = tmt.jacobians(q)
        engine_T, engine_B = engine.jacobians(q)
        v_conv, w_conv = tmt.convective_terms(q, qd)
        engine_v, engine_w = engine.convective_terms(q, qd)
        omega = tmt.angular_velocities(q, qd), engine.angular_velocities(q, qd)
        for quantity, unit, ours, theirs, scale, truth in (
            ("x_b", "m", tmt.com_positions(q), engine.com_positions(q), reach, "com_positions"),
            ("omega_b", "rad/s", *omega, speed, "angular_velocities"),
            ("T_b", "m/rad", T, engine_T, reach, "T"),
            ("B_b", "", B, engine_B, 1.0, "B"),
            ("v_conv", "m/s2", v_conv, engine_v, reach * speed**2, "v_conv"),
            ("w_conv", "rad/s2", w_conv, engine_w, speed**2, "w_conv"),
        ):
            result.agree(sample, quantity, unit, ours, theirs, scale, truth=truth)
    return result


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield partial(draw.distances, result, "random states")
