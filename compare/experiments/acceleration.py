"""Bias in motion, forward and inverse dynamics, energy and power."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import tmt
from tmt import method
from tmt.dual import seeded

from ..engines import LABELS
from ..judge.check import Result
from ..judge.scale import acceleration_scale, bias_scale, condition, gravity_scale, mass_scale
from ..robots import Robot
from ..setup import Setup

TITLE = "Accelerations: the same equations in motion?"


def claim(robot: Robot) -> str:
    """What is claimed of any robot; one with damping loses energy and momentum by it."""
    of, constant = (
        ("torque", "is constant") if not any(robot.tree.damping) else ("torque and damping", "changes by damping alone")
    )
    return (
        "Bias and accelerations agree at random states under random torque; the acceleration of one engine put into the "
        f"inverse dynamics of the other gives the torque back; energy agrees with MuJoCo's; the power of the {of} is the "
        f"rate of the energy; and without gravity and torque the angular momentum about the first hinge {constant}."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    damping, drag = (", |D rates|", " plus |D rates|") if any(robot.tree.damping) else ("", "")
    return (
        f"With S the sum of the absolute convective, Euler and gravity terms{damping} and |tau|: bias 64 eps x S; accelerations "
        "64 eps x (cond(Mbar) + 1) x |Mbar^-1| S; inverse dynamics 64 eps x cond(Mbar) x S; power the same times the sum of "
        "|rates|; momentum 64 eps x cond(Mbar) x the largest entry of Mbar x the square of the sum of |rates|"
        f"{drag}; energy 64 eps x ({gravity_scale(robot.tree):.2f} J + |qd|' |Mbar| |qd| / 2)."
    )


def rows(setup: Setup) -> Result:
    """Each quantity at the named postures and at random states."""
    result, tree = Result("acceleration"), setup.robot.tree
    dynamics = ours, theirs = tuple(setup.compared().values())
    weightless = setup.compared(setup.robot.case("no gravity", gravity=False))
    damping = np.array(tree.damping)
    work, lost = ("tau.qd", "") if not damping.any() else ("(tau - D qd).qd", " + D qd")
    for sample in (setup.named, setup.random):
        q, qd, tau = sample.q, sample.qd, sample.tau
        cond = condition(tree, q)
        drag = damping * qd
        bias = bias_scale(tree, q, qd)
        force = bias + np.abs(tau).max(axis=1) + np.abs(drag).max(axis=1)
        speed = np.abs(qd).sum(axis=1)
        qdd, engine_qdd = (d.acceleration(q, qd, tau) for d in dynamics)
        M = ours.mass_matrix(q)

        result.agree(sample, "bias", "N m", ours.bias(q, qd), theirs.bias(q, qd), bias, truth="bias")
        result.agree(sample, "qdd", "rad/s2", qdd, engine_qdd, acceleration_scale(tree, q, force), truth="acceleration")
        back = np.einsum("sij,sj->si", M, engine_qdd) + ours.bias(q, qd) + drag
        result.agree(sample, "tau from MuJoCo's qdd by TMT", "N m", back, tau, cond * force)
        result.agree(sample, "tau from TMT's qdd by mj_inverse", "N m", tau, theirs.inverse(q, qd, qdd), cond * force)

        kinetic = np.einsum("si,sij,sj->s", np.abs(qd), np.abs(M), np.abs(qd)) / 2
        size = gravity_scale(tree) + kinetic
        result.agree(sample, "energy", "J", ours.energy(q, qd), theirs.energy(q, qd), size, truth="energy")
        potential = ours.potential_energy(q), theirs.potential_energy(q)
        result.agree(sample, "potential energy", "J", *potential, gravity_scale(tree), truth="potential_energy")

        power = np.einsum("si,si->s", tau - drag, qd)
        for label, accelerations in (("TMT", qdd), ("MuJoCo", engine_qdd)):
            gained = rate(partial(total_energy, tree), q, qd, accelerations)
            result.agree(sample, f"dE/dt - {work} at {label}'s qdd", "W", gained, power, cond * force * speed)

        # p is Mbar times the rates, its rate of change quadratic in them
        force = mass_scale(tree, q) * speed**2 + np.abs(drag).max(axis=1)
        for name, engine in weightless.items():
            change = rate(partial(first_momentum, tree), q, qd, engine.acceleration(q, qd, np.zeros_like(q)))
            quantity = f"dp_{setup.robot.joints[0]}/dt{lost} at {LABELS[name]}'s qdd, no gravity"
            result.agree(sample, quantity, "N m", change, -drag[:, 0], cond * force)
    return result


def rate(quantity: Callable, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Time derivative of quantity(q, qd) along the motion, exact by dual numbers, (states,)."""
    state = seeded([*q.T, *qd.T], [*qd.T, *qdd.T])
    return quantity(state[: q.shape[1]], state[q.shape[1] :]).slope


def total_energy(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
    """Potential and kinetic energy over any scalars, J."""
    parts = method.bodies(tree, q, qd)
    return method.potential(parts, tree.gravity) + method.kinetic(parts, qd)


def first_momentum(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
    """The first row of Mbar qd over any scalars: angular momentum about the first hinge, whose axis is fixed, N m s."""
    first_row = method.mass_matrix(method.bodies(tree, q, qd))[0]
    return sum(m * v for m, v in zip(first_row, qd))


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    yield partial(draw_distances, result, "random states", ["bias", "qdd", "energy", "potential energy"])
