"""Which failing checks are gone without the causes; a second error is not hidden behind the first."""

import dataclasses
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..core.check import Check, Result
from ..engines.mujoco import engine, read
from ..engines.own import OwnDynamics
from ..experiments import module
from ..experiments.setup import Setup, engines
from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from ..report.verdict import Section, failures

AT_STATES = ("kinematics", "mass", "gravity", "acceleration")  # what compares models with little work
NODES = 24  # of the integral of a force at rest, which is smooth


def explained(setup: Setup, section: Section) -> list[Check]:
    """The failing comparisons and predictions of a section that are gone when the causes are mended.

    A user's own M and h are explained where the diagnosis reproduces them; what else is the user's must
    follow from M and h. A file is compared once more with tmt's equations for its own numbers.
    Nothing explains a part that broke off, an unstable step, or a value of a user's own that is no number.
    """
    failed = failures([section])
    checks = failed.differing + failed.unconfirmed
    if section.record.states_causes or not checks:
        return []
    if setup.robot.own:
        follows = what_follows(setup)
        return [check for check in checks if check.value is not None and follows[kind_of(check)]]
    mended = of_own_numbers(setup)
    if mended is None:
        return []
    if section.name in (*AT_STATES, "trajectory"):
        again = compared_again(mended, section.name).checks
        still = {(check.scene, check.quantity) for check in again if check.failed}
        return [check for check in checks if (check.scene, check.quantity) not in still]
    if any(check.failed for name in AT_STATES for check in compared_again(mended, name).checks):
        return []
    # the printed numbers are those of the stated robot, which tmt has
    return [check for check in checks if not check.quantity.startswith(("TMT", "exact"))]


@lru_cache(maxsize=2)
def of_own_numbers(setup: Setup) -> Setup | None:
    """The same with the file's own numbers in tmt's equations, without other forces; None: not possible."""
    reading = setup.reading or read(Path(setup.robot.mjcf))
    stated, tree = setup.robot.tree, reading.tree
    if (tree.joint_names, tree.kind, tree.parent) != (stated.joint_names, stated.kind, stated.parent):
        return None
    robot = dataclasses.replace(setup.robot, tree=tree)
    return dataclasses.replace(setup, robot=robot, engines=engines(engine(reading)), reading=reading)


@lru_cache
def compared_again(mended: Setup, name: str) -> Result:
    return module(name).rows(mended)


def kind_of(check: Check) -> str:
    """What a check of a user's own equations depends on: geometry, M and h, or what follows from these."""
    if check.experiment == "kinematics":
        return "geometry"
    if check.quantity.startswith(("energy", "potential energy")):
        return "energy"
    if check.experiment in ("mass", "gravity") or check.quantity.startswith("bias"):
        return check.experiment if check.experiment == "gravity" else "equations"
    return "motion"


@lru_cache(maxsize=2)
def what_follows(setup: Setup) -> dict[str, bool]:
    """What of a user's own equations is explained by the causes of M and h, by the kinds of `kind_of`.

    Accelerations follow where no other force is in them at any random state, or the diagnosis explains it;
    own gravity and energy where they are those of the own M and h, at some of these states.
    """
    assert setup.own is not None
    diagnosis, given = module("diagnosis"), setup.own.of(setup.robot.case())
    found = diagnosis.diagnosed(setup)
    equations = found.ratio <= 1.0 or bool(found.diagnosis.causes)
    motion = equations
    if motion and not found.of_forces and given.has("acceleration") and given.has("bias"):
        motion = diagnosis.is_solved(given, setup.robot.tree, setup.random)  # it has asked at a few states
    follows = dict.fromkeys(("equations", "gravity", "energy"), equations)
    follows |= {"geometry": False, "motion": motion}
    sample = setup.random.first(found.states)
    scale = Entries(setup.robot.tree, sample.q, sample.qd)
    at_rest = np.zeros_like(sample.qd)
    if equations and given.has("gravity"):
        off = np.abs(given.gravity_balance(sample.q) - given.bias(sample.q, at_rest))
        follows["gravity"] = bool((off <= FACTOR * EPS * scale.weight).all())
    if equations and given.has("energy"):
        kinetic = given.energy(sample.q, sample.qd) - given.energy(sample.q, at_rest)
        kinetic = kinetic - np.einsum("si,sij,sj->s", sample.qd, given.mass_matrix(sample.q), sample.qd) / 2.0
        off = np.maximum(np.abs(kinetic), np.abs(lifted_less_work(given, sample.q)))
        follows["energy"] = bool((off <= 2.0 * FACTOR * EPS * scale.energy).all())
    return follows


def lifted_less_work(given: OwnDynamics, q: np.ndarray) -> np.ndarray:
    """Energy at rest above that at q = 0, less the work of the bias at rest on a line, J; NaN for balls."""
    if given.coordinates.has_balls:
        return np.full(len(q), np.nan)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    rest, work = np.zeros_like(q), 0.0
    for node, weight in zip((1.0 + nodes) / 2.0, weights / 2.0):
        work = work + weight * np.einsum("si,si->s", given.bias(node * q, rest), q)
    return given.energy(q, rest) - given.energy(0.0 * q, rest) - work
