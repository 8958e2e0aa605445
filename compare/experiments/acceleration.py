"""Bias in motion, forward and inverse dynamics, energy and power."""

import dataclasses
from functools import partial

import numpy as np

import tmt
from tmt import method
from tmt.dual import seeded

from .agreement import Result, acceleration_scale, bias_scale, condition, gravity_scale, mass_scale

TITLE = "Accelerations: the same equations in motion?"
CLAIM = (
    "Bias and accelerations agree at random states under random torque; the acceleration of one engine put into the "
    "inverse dynamics of the other gives the torque back; energy agrees with MuJoCo's; the power of the torque is the "
    "rate of the energy; and without gravity and torque the angular momentum about the first hinge is constant."
)
BAR = (
    "With S the sum of the absolute convective, Euler and gravity terms and |tau|: bias 64 eps x S; accelerations "
    "64 eps x (cond(Mbar) + 1) x |Mbar^-1| S; inverse dynamics 64 eps x cond(Mbar) x S; power the same times the sum of "
    "|rates|; momentum 64 eps x cond(Mbar) x the largest entry of Mbar x the square of the sum of |rates|; "
    f"energy 64 eps x ({gravity_scale():.2f} J + |qd|' |Mbar| |qd| / 2)."
)


def rows(setup) -> Result:
    """Each quantity at the named postures and at random states."""
    result = Result("acceleration")
    engine, floating = setup.engine, setup.engine.variant(gravity=0.0)
    weightless = dataclasses.replace(tmt.ARM, gravity=(0.0, 0.0, 0.0))
    for sample in (setup.named, setup.random):
        q, qd, tau = sample.q, sample.qd, sample.tau
        cond = condition(q)
        bias = bias_scale(q, qd)
        force = bias + np.abs(tau).max(axis=1)
        speed = np.abs(qd).sum(axis=1)
        qdd, engine_qdd = tmt.acceleration(q, qd, tau), engine.acceleration(q, qd, tau)
        M = tmt.mass_matrix(q)

        result.agree(sample, "bias", "N m", tmt.bias(q, qd), engine.bias(q, qd), bias, truth="bias")
        result.agree(sample, "qdd", "rad/s2", qdd, engine_qdd, acceleration_scale(q, force), truth="acceleration")
        back = np.einsum("sij,sj->si", M, engine_qdd) + tmt.bias(q, qd)
        result.agree(sample, "tau from MuJoCo's qdd by TMT", "N m", back, tau, cond * force)
        result.agree(sample, "tau from TMT's qdd by mj_inverse", "N m", tau, engine.inverse(q, qd, qdd), cond * force)

        kinetic = np.einsum("si,sij,sj->s", np.abs(qd), np.abs(M), np.abs(qd)) / 2
        size = gravity_scale() + kinetic
        result.agree(sample, "energy", "J", tmt.energy(q, qd), engine.energy(q, qd), size, truth="energy")
        potential = tmt.potential_energy(q), engine.potential_energy(q)
        result.agree(sample, "potential energy", "J", *potential, gravity_scale(), truth="potential_energy")

        power = np.einsum("si,si->s", tau, qd)
        for party, accelerations in (("TMT", qdd), ("MuJoCo", engine_qdd)):
            gained = rate(lambda q, qd: total_energy(tmt.ARM, q, qd), q, qd, accelerations)
            result.agree(sample, f"dE/dt - tau.qd at {party}'s qdd", "W", gained, power, cond * force * speed)

        torque_free = np.zeros_like(q)
        force = mass_scale(q) * speed**2  # p is Mbar times the rates, its rate of change quadratic in them
        for party, accelerations in (
            ("TMT", tmt.acceleration(q, qd, torque_free, weightless)),
            ("MuJoCo", floating.acceleration(q, qd, torque_free)),
        ):
            change = rate(alpha_momentum, q, qd, accelerations)
            quantity = f"dp_alpha/dt at {party}'s qdd, no gravity"
            result.agree(sample, quantity, "N m", change, np.zeros(len(q)), cond * force)
    return result


def rate(quantity, q, qd, qdd) -> np.ndarray:
    """Time derivative of quantity(q, qd) along the motion, exact by dual numbers, (states,)."""
    state = seeded([*q.T, *qd.T], [*qd.T, *qdd.T])
    return quantity(state[: q.shape[1]], state[q.shape[1] :]).slope


def total_energy(model, q, qd):
    """Potential and kinetic energy over any scalars, J."""
    parts = method.bodies(model, q, qd)
    return method.potential(parts, model.gravity) + method.kinetic(parts, qd)


def alpha_momentum(q, qd):
    """The first row of Mbar qd over any scalars: angular momentum about the first hinge, N m s."""
    first_row = method.mass_matrix(method.bodies(tmt.ARM, q, qd))[0]
    return sum(m * v for m, v in zip(first_row, qd))


def figures(result):
    from . import draw  # matplotlib is for the process that draws

    yield partial(draw.distances, result, "random states", ["bias", "qdd", "energy", "potential energy"])
