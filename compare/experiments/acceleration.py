"""Bias in motion, forward and inverse dynamics, energy and power."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

import tmt
from tmt import literal
from tmt.equations import method
from tmt.equations.dual import seeded

from ..engines import LABELS, WHOSE
from ..engines.tmt import Compiled
from ..judge.check import Result, agreement_headline
from ..judge.entries import has_own_scales, scales, unit
from ..judge.scale import gravity_scale
from ..judge.words import ROWS_COMPILED, listed
from ..robots import Robot
from ..truth.conserved import conserved
from . import Experiment
from .setup import Setup

EXPERIMENT = Experiment(order=60, options=("--joints",), diagnosed=True, overview="agreement")
headline = agreement_headline


def claim(robot: Robot) -> str:
    """What is claimed of any robot; one with damping loses energy and momentum by it."""
    of, constant = (
        ("torque", "is constant") if not any(robot.tree.damping) else ("torque and damping", "changes by damping alone")
    )
    if has_own_scales(robot.tree, robot.is_read):
        words = {"row": f"the momentum along the first joint ({robot.joints[0]})", "linear": "the linear momentum",
                 "angular": "the angular momentum"}  # fmt: skip
        kept = listed([words[momentum.kind] for momentum in conserved(robot.tree)])
    else:
        kept = "the angular momentum about the first hinge"
    kept = f"; and without gravity and torque {kept} {constant}" if kept and not robot.own else ""
    energy = " energy agrees with MuJoCo's;" if not robot.own or "energy" in robot.own else ""
    return (
        "Bias and accelerations agree at random states under random torque; the acceleration of one engine put into the "
        f"inverse dynamics of the other gives the torque back;{energy} the power of the {of} is the rate of the energy{kept}."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged, with the robot's own scale."""
    damping, drag = (", |D rates|", " plus |D rates|") if any(robot.tree.damping) else ("", "")
    if has_own_scales(robot.tree, robot.is_read):
        springs = ", k (|q| + |rest|)" if robot.tree.has_springs else ""
        return (
            "64 eps x scale, each entry its own. With F_i the sum of the absolute convective, Euler and gravity terms of a "
            f"joint{damping}{springs} and |tau|, where each is largest, and R = |terms of Mbar| |qdd| + F: bias its own terms; "
            "accelerations |Mbar^-1| R, entry by entry; inverse dynamics 2 R, whatever the condition of Mbar; power the same "
            "times |rates|; momenta the same without gravity and torque; energy the sum of m g L, of k (|q| + |rest|)^2 / 2, "
            "and of half the terms of Mbar times |rates| twice."
        )
    return (
        f"With S the sum of the absolute convective, Euler and gravity terms{damping} and |tau|: bias 64 eps x S; accelerations "
        "64 eps x (cond(Mbar) + 1) x |Mbar^-1| S; inverse dynamics 64 eps x cond(Mbar) x S; power the same times the sum of "
        "|rates|; momentum 64 eps x cond(Mbar) x the largest entry of Mbar x the square of the sum of |rates|"
        f"{drag}; energy 64 eps x ({gravity_scale(robot.tree):.2f} J + |qd|' |Mbar| |qd| / 2)."
    )


def rows(setup: Setup) -> Result:
    """Each quantity at the named postures and at random states."""
    robot, tree, is_read = setup.robot, setup.robot.tree, setup.robot.is_read
    (name, _), dynamics = robot.compared, tuple(setup.compared().values())
    result, whose, (ours, theirs) = Result("acceleration", label=LABELS[name]), WHOSE[name], dynamics
    still = robot.case("no gravity", gravity=False)
    weightless, momenta = ({}, ()) if robot.own else (setup.compared(still), conserved(tree))
    damping = np.array(tree.damping)
    work, lost = ("tau.qd", "") if not damping.any() else ("(tau - D qd).qd", " + D qd")
    torques, rates = unit(tree, "N m", "N"), unit(tree, "rad/s2", "m/s2")
    for sample in (setup.named, setup.random):
        q, qd, tau = sample.q, sample.qd, sample.tau
        drag = damping * qd
        scale = scales(tree, is_read, q, qd)
        force = scale.force(tau)
        qdd, engine_qdd = (d.acceleration(q, qd, tau) for d in dynamics)
        of_scale = engine_qdd if robot.own else qdd  # of one's own nothing need be a number
        M, springs = ours.mass_matrix(q), literal.spring_torque(q, tree) if tree.has_springs else 0.0

        result.agree(sample, "bias", torques, ours.bias(q, qd), theirs.bias(q, qd), scale.bias, truth="bias")
        result.agree(sample, "qdd", rates, qdd, engine_qdd, scale.acceleration(force, of_scale), truth="acceleration")
        back, closing = (
            np.einsum("sij,sj->si", M, engine_qdd) + ours.bias(q, qd) + drag + springs,
            scale.closing(force, of_scale),
        )
        result.agree(sample, f"tau from MuJoCo's qdd by {result.label}", torques, back, tau, closing)
        result.agree(sample, f"tau from {whose} qdd by mj_inverse", torques, tau, theirs.inverse(q, qd, qdd), closing)

        if not robot.own:
            result.agree(sample, "energy", "J", ours.energy(q, qd), theirs.energy(q, qd), scale.energy, truth="energy")
            potential = ours.potential_energy(q), theirs.potential_energy(q)
            result.agree(sample, "potential energy", "J", *potential, scale.potential_energy, truth="potential_energy")
            if sample is setup.random:
                compiled = Compiled(tree)
                fast = compiled.acceleration(q, qd, tau)
                result.agree(sample, "bias, compiled", torques, compiled.bias(q, qd), theirs.bias(q, qd), scale.bias)
                result.agree(sample, "qdd, compiled", rates, fast, engine_qdd, scale.acceleration(force, qdd))
                energies = (compiled.energy(q, qd), theirs.energy(q, qd)), (compiled.potential_energy(q), potential[1])
                result.agree(sample, "energy, compiled", "J", *energies[0], scale.energy)
                result.agree(sample, "potential energy, compiled", "J", *energies[1], scale.potential_energy)
        elif "energy" in robot.own:  # which may be zero where one likes
            zero, rest = np.array(tree.zero)[None], np.zeros((1, tree.coordinates.nv))
            above = (engine.energy(q, qd) - engine.energy(zero, rest) for engine in dynamics)
            result.agree(sample, "energy above the zero position's", "J", *above, scale.energy)

        power = np.einsum("si,si->s", tau - drag, qd)
        for engine, accelerations in ((whose, qdd), (WHOSE["mujoco"], engine_qdd)):
            gained = rate(partial(total_energy, tree), tree, q, qd, accelerations)
            result.agree(sample, f"dE/dt - {work} at {engine} qdd", "W", gained, power, scale.power(force, of_scale))

        scale = scales(still.tree, is_read, q, qd)
        for name, engine in weightless.items():
            accelerations = engine.acceleration(q, qd, np.zeros_like(qd))
            size = scale.change(accelerations)
            for momentum in momenta:
                change = np.stack(rate(momentum.momentum, tree, q, qd, accelerations), axis=-1)
                quantity = f"d{momentum.name}/dt{lost} at {LABELS[name]}'s qdd, no gravity"
                loss = momentum.effect(q, -drag - springs)
                result.agree(sample, quantity, momentum.unit, change, loss, momentum.size(q, size))
        result.notes += sample.notes
    if robot.own:
        energy = "" if "energy" in robot.own else "they have no energy, and "
        result.notes.append(
            f"Of your equations bias, accelerations and torques are compared; {energy}what stays constant without gravity is "
            "left out, for gravity is in them."
        )
    elif len(momenta) == 0 or momenta[-1].kind == "linear":
        result.notes.append(
            f"The rotors of {setup.robot.joints[0]} differ between its axes: the angular momentum is left out."
        )
    result.notes += [ROWS_COMPILED] * (not setup.robot.own)
    return result


def rate(quantity: Callable, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray | list:
    """Time derivative of quantity(q, qd) along the motion, exact by dual numbers, (states,); of several a list."""
    rates = tree.coordinates.component_rates(q.T, qd.T)
    state = seeded([*q.T, *qd.T], [*rates, *qdd.T])
    found = quantity(state[: q.shape[1]], state[q.shape[1] :])
    return [part.slope for part in found] if isinstance(found, list) else found.slope


def total_energy(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
    """Potential and kinetic energy over any scalars, J."""
    parts = method.bodies(tree, q, qd)
    own = method.potential(parts, tree.gravity) + method.spring_energy(tree, q)
    return own + method.kinetic(parts, qd, tree.armature)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from .figures import draw_distances  # matplotlib is for the process that draws

    quantities = ["bias", "qdd", "energy", "potential energy"]
    known = [quantity for quantity in quantities if quantity in result.curves["random states"]]
    yield partial(draw_distances, result, "random states", known)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import pictures_of_agreement  # matplotlib is for the process that draws

    yield from pictures_of_agreement(results)
