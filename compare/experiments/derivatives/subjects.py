"""The states at which derivatives are taken: along the scenes of a robot, and where differences are hard."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import tmt

from ...engines.mujoco import Mujoco
from ...engines.mujoco.dynamics import MujocoDynamics
from ...robots import Robot
from ...robots.case import Case
from ...robots.coordinates import free_joints
from ...robots.states import Sample

STIFF_RATE = 2.0  # of a stiff spring and its damper, in units of 1 / step
AWAY = 1e-3  # rad or m from where such a spring is at rest
STIFF, SINGULAR = "stiff servos", "near a singular posture"


class Subject(NamedTuple):
    """States of one case: q (states, nq), qd, tau (states, nv)."""

    name: str
    kind: str  # "scene", "stiff" or "singular"
    case: Case
    tree: tmt.Tree
    q: np.ndarray
    qd: np.ndarray
    tau: np.ndarray

    @property
    def states(self) -> int:
        return len(self.q)


def cases_of(robot: Robot) -> list[Case]:
    """A damped case, one of its servos and a free one, as far as there are such; regular ones first."""
    chosen: dict[str, Case] = {}
    for case in sorted(robot.cases, key=lambda case: "regular" not in case.scene.tags):
        if case.scene.locked:
            continue
        kind = "servos" if case.controller else "free"
        chosen.setdefault("damped" if np.any(case.scene.damping) else kind, case)
    return [chosen[kind] for kind in ("damped", "servos", "free") if kind in chosen]


def along(case: Case, states: int) -> Subject:
    """States at equal times of the motion of a case, its start not among them; fewer where it ends early."""
    scene = case.scene
    method = "dopri8_adaptive"
    _, q, qd = tmt.simulate(*case.start, case.tau, scene.dt, scene.steps, method, case.tree, tolerance=1e-9)
    reached = np.flatnonzero(np.isfinite(qd).all(axis=1))
    at = reached[np.linspace(0, len(reached) - 1, states + 1).astype(int)[1:]]
    return Subject(case.name, "scene", case, case.tree, q[at], qd[at], np.tile(case.tau, (len(at), 1)))


def stiff(subject: Subject, dt: float) -> Subject:
    """A state near the rest of critically damped springs, fast as a few steps; free joints have none."""
    tree, q, qd = subject.tree, subject.q[:1], subject.qd[:1]
    inertia = 1.0 / np.einsum("ii->i", tmt.inverse_mass_matrix(q[0], tree))
    rate, first = STIFF_RATE / dt, [joint.qd.start for joint in tree.coordinates.joints]
    rest = np.array(tree.coordinates.move(q[0].tolist(), [-AWAY] * len(inertia)))
    stiffness, damping = inertia[first] * rate**2, 2.0 * inertia * rate
    for i in free_joints(tree):
        stiffness[i : i + 4], damping[first[i] : first[i] + 6] = 0.0, 0.0
    numbers = {"stiffness": stiffness, "damping": damping, "rest": rest}
    harder = replace(tree, **{name: tuple(values.tolist()) for name, values in numbers.items()})
    return subject._replace(name=STIFF, kind="stiff", tree=harder, q=q, qd=qd, tau=subject.tau[:1])


def near_singular(subject: Subject, sample: Sample) -> Subject:
    """The state of a sample whose Mbar, with unit diagonal, has the largest condition number."""
    M = tmt.mass_matrix(sample.q, subject.tree)
    root = np.sqrt(np.einsum("sii->si", M))
    at = int(np.argmax(np.linalg.cond(M / (root[:, :, None] * root[:, None, :]))))
    states = (values[at : at + 1] for values in (sample.q, sample.qd, sample.tau))
    return Subject(SINGULAR, "singular", subject.case, subject.tree, *states)


def all_subjects(robot: Robot, sample: Sample, dt: float, states: int) -> Sequence[Subject]:
    """All subjects, the main one first."""
    scenes = [along(case, states) for case in cases_of(robot)]
    free = next((subject for subject in scenes if not subject.case.controller), scenes[0])
    return [*scenes, stiff(free, dt), near_singular(free, sample)]


def dynamics_of(mujoco: Mujoco, subject: Subject) -> MujocoDynamics:
    """MuJoCo with the case, and the springs and dampers of a stiff subject."""
    if subject.kind != "stiff":
        return mujoco.of(subject.case)
    dynamics = mujoco.dynamics(subject.case)  # not the one that is kept
    dynamics.model.jnt_stiffness[dynamics.joints] = subject.tree.stiffness
    dynamics.model.dof_damping[dynamics.dofs] = subject.tree.damping
    dynamics.model.qpos_spring[dynamics.qpos] = subject.tree.rest
    return dynamics
