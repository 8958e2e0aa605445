"""The file as it runs, with contacts, friction, actuators and the solver's own settings, beside MuJoCo.

In the engine's own process. Free runs say how far apart the positions are after some of the file's own steps.
Steps from MuJoCo's own states, one at a time, say which field differs first: a free run would blame chaos on
one.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from ...judge.scale import EPS, FACTOR
from .. import Array
from ..mujoco.names import bit, element_name, joint_places
from ..mujoco.source import Source
from .file import File

STEPS, LISTED = 100, (1, 10, 100)  # of the file's own; those after which free runs are compared
# largest difference of a field over its largest entry that is that of the precision
BEYOND = {"float32": 1e-4, "float64": FACTOR * EPS}
LS_ITERATIONS = 50  # at least, of a run with more iterations than the file's own
# an acceleration solves M, and the solver stops at its own tolerance
SOLVED = "qacc_smooth", "efc_force", "qfrc_constraint", "qacc", "qvel after", "qpos after"
PASSING = 1e-2  # of the largest entry of a field over all steps: a difference is beside that at least
FIELDS = (
    "xpos", "M", "qfrc_bias", "qfrc_passive", "qfrc_actuator", "contacts", "dist", "efc_J", "efc_aref", "qacc_smooth",
    "efc_force", "qfrc_constraint", "qacc", "qvel after", "qpos after",
)  # fmt: skip


class Difference(NamedTuple):
    """A field of a step from MuJoCo's own state that an engine has otherwise."""

    step: int  # from 1
    field: str
    of: str  # a degree of freedom or a body; a pair of geoms
    share: float  # of the largest entry of the field


class Run(NamedTuple):
    """A file beside MuJoCo; iterations, ls_iterations: of the solver."""

    iterations: int
    ls_iterations: int
    apart: dict[int, float]  # rad or m, the largest of q, by the number of steps of free runs
    first: Difference | None
    largest: dict[str, float]  # share of each field over all steps
    over: float  # the largest share over what its field is allowed
    seconds: float  # of the processor, with compilation


class Stepper(ABC):
    """MuJoCo's model in an engine that steps it: its own if it reads the file itself."""

    model: mujoco.MjModel  # of the data that `get` returns

    @abstractmethod
    def __init__(self, file: File, model: mujoco.MjModel):
        """Put the model; NotImplementedError or ValueError where the engine has not all that it needs."""

    @abstractmethod
    def put(self, data: mujoco.MjData) -> Any:
        """The engine's data with the state, controls and warm start of MuJoCo's."""

    @abstractmethod
    def step(self, data: Any) -> Any:
        """The engine's data after a step."""

    @abstractmethod
    def get(self, data: Any) -> mujoco.MjData:
        """Data of the engine's in MuJoCo's."""


def require_same(model: mujoco.MjModel, other: mujoco.MjModel) -> None:
    """ValueError where a model that an engine has made of the file has other joints, or other numbers of something."""
    for name in ("nq", "nv", "nu", "na", "nbody", "ngeom"):
        counts = getattr(model, name), getattr(other, name)
        if counts[0] != counts[1]:
            raise ValueError(f"{name} is {counts[0]} in its model, {counts[1]} in MuJoCo's")
    for name in ("jnt_type", "qpos0"):
        if not np.allclose(getattr(model, name), getattr(other, name), atol=1e-6):
            raise ValueError(f"{name} is not that of MuJoCo's model")


def copied(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjData:
    """Data of such a model with the state, controls and warm start of MuJoCo's."""
    values = mujoco.MjData(model)
    for name in ("qpos", "qvel", "act", "ctrl"):
        getattr(values, name)[:] = getattr(data, name)
    mujoco.mj_forward(model, values)
    values.qacc_warmstart[:] = data.qacc_warmstart
    return values


Fields = dict[str, Array]  # of a step
Kind = Callable[[File, Any], Stepper]


def run(kind: Kind, precision: str, file: File, iterations: int | None = None) -> Run:
    """A run of the file by an engine, from the first keyframe with its controls, else from qpos0.

    iterations: of the solver, with LS_ITERATIONS at least; None: the file's own.
    """
    model = mujoco.MjModel.__copy__(Source(file.path, file.floating).model)
    model.opt.disableflags &= ~bit("AUTORESET")  # MuJoCo Warp refuses it
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    if iterations is not None:
        model.opt.iterations = iterations
        model.opt.ls_iterations = max(LS_ITERATIONS, model.opt.ls_iterations)
    begin, engine, data = time.process_time(), kind(file, model), mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)  # for the warm start
    free, apart = engine.put(data), dict[int, float]()
    made, moved = list[Sequence[Fields]](), mujoco.MjData(model)
    for step in range(1, STEPS + 1):
        other = engine.get(engine.step(engine.put(data)))
        free = engine.step(free)
        mujoco.mj_copyState(model, data, moved, mujoco.mjtState.mjSTATE_INTEGRATION)
        for values in (moved.qpos, moved.qvel):  # by the rounding of the precision, up and down in turns
            values *= 1.0 + np.finfo(precision).eps * (-1.0) ** np.arange(values.size)
        mujoco.mj_step(model, moved)
        mujoco.mj_step(model, data)
        if not np.isfinite(data.qacc).all():
            break
        made.append((fields(model, data), fields(model, moved), fields(engine.model, other)))
        if step in LISTED:
            apart[step] = float(np.abs(data.qpos - engine.get(free).qpos).max())
    of_fields, option = compared(model, made, BEYOND[precision]), model.opt
    return Run(option.iterations, option.ls_iterations, apart, *of_fields, time.process_time() - begin)


def distance(values: Array, others: Array) -> Array:
    """Of each entry of a field; infinite where another one has others, or is not a number."""
    if values.shape != others.shape:
        return np.array([np.inf])
    return np.nan_to_num(np.abs(values - others), nan=np.inf).ravel()


def compared(
    model: mujoco.MjModel, made: Sequence[Sequence[Fields]], beyond: float
) -> tuple[Difference | None, dict[str, float], float]:
    """first, largest and over of a Run. made: of steps the fields of MuJoCo, from a moved state, and of the engine.

    A field may differ by `beyond` of its largest entry, and by FACTOR times what the rounding of the state
    makes of it: the distance of a contact is a small difference of positions, and a force at rest follows
    from that.
    """
    names, over, first, largest = names_of(model), 0.0, None, dict[str, float]()
    # of Runge and Kutta's stages MuJoCo leaves the mean in qacc, others the last: "qvel after" says the same
    is_mean = model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    listed = [name for name in FIELDS if not (name == "qacc" and is_mean)]
    peaks = {name: max(size(mine[name]) for mine, *_ in made) for name in listed if made}
    for step, (mine, moved, others) in enumerate(made, 1):
        for name in listed:
            scale = max(size(mine[name]), PASSING * peaks[name]) or 1.0
            allowed = max(beyond, model.opt.tolerance) if name in SOLVED else beyond
            rounding = size(distance(mine[name], moved[name])) / scale
            if rounding == np.inf:  # a contact is there or not, by rounding
                continue
            distances = distance(mine[name], others[name])
            share, worst = size(distances) / scale, int(distances.argmax()) if distances.size else 0
            largest[name] = max(largest.get(name, 0.0), share)
            over = max(over, share / max(allowed, FACTOR * rounding))
            if first is None and share > max(allowed, FACTOR * rounding):
                owners = names.get(name, [""])
                first = Difference(step, name, owners[worst * len(owners) // max(distances.size, 1)], share)
    return first, largest, over


def size(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def fields(m: mujoco.MjModel, d: mujoco.MjData) -> Fields:
    """The fields of a step in the order of the pipeline, whatever the order of contacts and of the constraints' rows.

    J of the rows is joined to J'J, (nv, nv), aref to J'aref, force to |J|'|force|, (nv,).
    """
    M, rows = np.zeros((m.nv, m.nv)), d.efc_J.reshape(-1, m.nv)[: d.nefc]
    mujoco.mj_fullM(m, d, M)
    contacts, force = sorted(contacts_of(d)), np.abs(rows).T @ np.abs(d.efc_force[: d.nefc])
    pairs, distances = [pair for pair, _ in contacts], [distance for _, distance in contacts]
    constraints = rows.T @ rows, rows.T @ d.efc_aref[: d.nefc], d.qacc_smooth, force, d.qfrc_constraint
    smooth = d.xpos, M, d.qfrc_bias, d.qfrc_passive, d.qfrc_actuator, pairs, distances
    values = *smooth, *constraints, d.qacc, d.qvel, d.qpos
    return {name: np.array(value, float) for name, value in zip(FIELDS, values)}


def contacts_of(d: mujoco.MjData) -> Iterator[tuple[tuple[int, int], float]]:
    """The contacts that act: the sorted pair of geoms, and the distance, m."""
    for contact in d.contact:
        if contact.dist < contact.includemargin:
            first, second = sorted(map(int, contact.geom))
            yield (first, second), float(contact.dist)


def names_of(m: mujoco.MjModel) -> dict[str, list[str]]:
    """What the entries of a field belong to, by its name."""
    speeds = [""] * m.nv
    for name, place in joint_places(m).items():
        for dof in place.dofs:
            speeds[dof] = name
    of_speeds = "M", "qfrc_bias", "qfrc_passive", "qfrc_actuator", "efc_J", "efc_aref", *SOLVED[:-1]
    return dict.fromkeys(of_speeds, speeds) | {"xpos": [element_name(m, "body", b) for b in range(m.nbody)]}
