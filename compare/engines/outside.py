"""Engines that read the robot's file themselves, each in a process of its own.

Their modules have, beside the record with `reads_file`, two names; they import their package in functions only:

    METHODS = {name: (order, scheme), ...}      of integration; scheme: that of tmt, or a name of its own; order None: it takes a
                                                tolerance and chooses its own steps
    class Model(ReadModel)                      what the engine has made of a file

and, where they differ with the Tree, methods_for(tree), of the same form as METHODS.

A process of its own keeps an engine's threads, its precision and a crash away from the program and from other engines.
"""

import importlib
import os
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import cache, cached_property
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

import tmt

from ..judge import timing
from ..judge.scale import FACTOR
from ..process.crash import described
from ..process.streams import in_one_line
from ..process.workers import begin
from ..robots.case import Case, Coordinates
from . import GRID, RECORDS, Engine, Method, Motion, Prepared, Setting, as_far_as_it_goes

EPS_OF = {name: float(np.finfo(name).eps) for name in ("float32", "float64")}
ONE = 20  # calls of one state that are timed together


class File(NamedTuple):
    """A robot's file, and the joints of the Tree that is compared."""

    path: Path  # MJCF or URDF
    names: tuple[
        str, ...
    ]  # of the joints; a free joint `base` is `base x`, `base y`, `base z` (slides), `base turn` (a ball)
    kinds: tuple[str, ...]  # hinge, slide or ball

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.names, self.kinds)

    @property
    def free(self) -> tuple[str, ...]:
        """The names of the free joints, as the file has them."""
        return tuple(name.removesuffix(" turn") for name, kind in zip(self.names, self.kinds)
                     if kind == "ball" and f"{name.removesuffix(' turn')} x" in self.names)  # fmt: skip


class Unread(ValueError):
    """An engine cannot read a file; the message says why, in one line."""


class ReadModel:
    """What an engine has made of a file; a base class.

    All methods take and return numbers in the Tree's order of joints and in MuJoCo's conventions: q with quaternions w x y z; of
    a free joint the position and velocity of the body's origin in the world, and the angular velocity in body axes. Units: rad,
    m, N m, N. No contacts, limits, actuators or friction losses act. The quantities of one state; q (nq,), v, tau (nv,).
    """

    is_compiled = False  # whether the first call compiles, which may take long
    drops = ()  # numbers of the Tree that its equations do not have at all: they act as part of the torque

    def __init__(self, file: File, precision: str):
        """Read the file; Unread if that is not possible."""
        raise NotImplementedError

    def numbers(self) -> Mapping[str, np.ndarray]:
        """What it has read, by name; a name that is missing: it does not tell.

        gravity (3,) m/s2; mass (joints,) kg and moments (joints, 3) kg m2, ascending: of all bodies together that move with a
        joint and not with the next one, 0 if there is none, about their common centre of mass; armature, damping, stiffness
        (nv,).
        """
        raise NotImplementedError

    def mend(self, name: str, values: np.ndarray) -> bool:
        """Set numbers that it has read differently, of the same shape as in `numbers`; False: that is not possible."""
        return False

    def mass_matrix(self, q):
        """M (nv, nv), with the armature."""
        raise NotImplementedError

    def bias(self, q, v):
        """h (nv,): Coriolis, centrifugal and gravity terms, with the sign of MuJoCo's qfrc_bias; no springs, no damping."""
        raise NotImplementedError

    def acceleration(self, q, v, force):
        """(nv,), from M a = force - h by the engine's own forward dynamics; damping and springs are part of the force."""
        raise NotImplementedError

    def many(self, q, v, force):
        """The accelerations of many states at once, (states, nv), for timing; only engines that can."""
        raise NotImplementedError

    def prepare(self, method: str, tau, dt: float | None, tolerance: float | None) -> None:
        """What a run needs that does not depend on its length: objects, compiled code."""

    def run(self, q, v, tau, times, steps: int | None, method: str, tolerance: float | None):
        """States (nq + nv,) at equal times, s, the first at 0, as (times, nq + nv), fewer if it breaks off; and its evaluations.

        steps: of equal length, a multiple of len(times) - 1; None: within a tolerance. tau constant; the damping and the
        springs of the file act.
        """
        raise NotImplementedError


class Outside(Engine):
    """An engine in a process of its own. Nothing of its package is imported here."""

    def __init__(self, name: str):
        self.name, self.record = name, RECORDS[name]
        self.methods = self.named(self.module.METHODS)

    @property
    def module(self):
        return importlib.import_module(f".{self.record.module or self.name}", __package__)

    def named(self, methods: Mapping) -> dict[str, Method]:
        return {
            name: Method(self.name, name, order, scheme, order is None) for name, (order, scheme) in methods.items()
        }

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        module = self.module
        return self.named(module.methods_for(case.tree)) if hasattr(module, "methods_for") else self.methods

    def of(self, case: Case) -> "OutsideDynamics":
        return OutsideDynamics(self.name, case)


class OutsideDynamics:
    """A case in an outside engine: a robot without locked joints and without servos."""

    def __init__(self, name: str, case: Case):
        self.name, self.case, self.tree, self.coordinates = name, case, case.tree, case.coordinates
        self.file = File(Path(case.robot.mjcf).resolve(), case.joints, case.coordinates.all_kinds)

    @cached_property
    def reading(self) -> Mapping:
        """Of the child: its numbers as read, which of them were mended, and seconds until the model was there."""
        return self.ask("read", self.tree)

    def ask(self, act: str, *arguments):
        """The value of a function of this module in the engine's process; Unread if the process ends."""
        try:
            return process(self.name).submit(answer, self.name, self.file, act, arguments).result()
        except BrokenProcessPool:
            process.cache_clear()
            raise Unread(f"its process was killed while it did: {act}") from None

    def rows(self, quantity: str, *values) -> np.ndarray:
        """A quantity at many states, (states, ...)."""
        self.reading  # noqa: B018 - mends what it has read differently
        return self.ask("each", quantity, *(np.atleast_2d(np.asarray(value, float)) for value in values))

    def mass_matrix(self, q):
        return self.rows("mass_matrix", q)

    def bias(self, q, v):
        return self.rows("bias", q, v)

    def acceleration(self, q, v, tau):
        return self.rows("acceleration", q, v, tau - passive(self.tree, q, v))

    def prepare(self, q, v, tau, setting: Setting, method) -> Prepared:
        self.reading  # noqa: B018
        t = np.linspace(0.0, setting.duration, GRID + 1)
        arguments = q, v, tau, t, setting.steps, method, setting.tolerance
        self.ask("prepared", *arguments)

        def run():
            return self.ask("ran", *arguments)

        def read(outcome):
            states, evaluations, seconds, why = outcome
            path, ended = as_far_as_it_goes(t, states, np.concatenate([q, v]), why)
            return Motion(t, *np.split(path, [self.coordinates.nq], axis=1), evaluations, ended, setting.steps, seconds)

        return run, read


def passive(tree: tmt.Tree, q, v) -> np.ndarray:
    """The forces of damping and springs of the joints, N m, (..., nv): D v + k (q - rest)."""
    drag = np.array(tree.damping) * v
    return drag + tmt.literal.spring_torque(q, tree) if tree.has_springs else drag


# ---------------------------------------------------------------- in the engine's process


@cache
def process(name: str) -> ProcessPoolExecutor:
    """The process of an engine."""
    return ProcessPoolExecutor(1, get_context("spawn"), initializer=started, initargs=(RECORDS[name].environment,))


def started(environment: tuple[tuple[str, str], ...]) -> None:
    begin()
    os.environ.update(environment)


models = {}  # (file, tree): (model, reading), of this process


def answer(name: str, file: File, act: str, arguments: tuple) -> object:
    """What a function below returns for a model; Unread with the reason, in one line, where the engine raises."""
    try:
        return {"read": read, "each": each, "prepared": prepared, "ran": ran, "timed": timed}[act](
            name, file, *arguments
        )
    except Unread:
        raise
    except Exception as error:
        raise Unread(in_one_line(" ".join(described(error).split()))) from None


def read(name: str, file: File, tree: tmt.Tree) -> dict:
    """The numbers that the engine has read, those of the Tree, which that differ were mended, and the seconds that it took."""
    begin = time.perf_counter()
    record = RECORDS[name]
    module = importlib.import_module(f".{record.module or name}", __package__)
    model, stated = module.Model(file, record.precision), numbers_of(tree)
    found = {number: np.asarray(values, float) for number, values in model.numbers().items()}
    eps = EPS_OF[record.precision]
    mended = {}
    for number, values in found.items():
        size = np.abs(stated[number]).max(initial=0.0)
        if np.shape(values) != np.shape(stated[number]):
            raise Unread(f"{number}: {len(values)} values, {len(stated[number])} in the compared model")
        if not np.abs(values - stated[number]).max(initial=0.0) <= FACTOR * eps * size:
            mended[number] = number in model.drops or model.mend(number, stated[number])
    models[file] = model, tree
    return {"read": found, "stated": stated, "mended": mended, "seconds": time.perf_counter() - begin,
            "is_compiled": model.is_compiled}  # fmt: skip


def numbers_of(tree: tmt.Tree) -> dict[str, np.ndarray]:
    """The Tree's numbers in the shapes of ReadModel.numbers."""
    joints, nv = len(tree.kind), tree.coordinates.nv
    mass, moments = np.zeros(joints), np.zeros((joints, 3))
    for joint in range(joints):
        own = [b for b, at in enumerate(tree.body_hinge) if at == joint]
        mass[joint], moments[joint] = together(
            [(tree.mass[b], np.array(tree.com[b]), np.array(tree.inertia[b])) for b in own]
        )
    stiffness = [
        k for k, place in zip(tree.stiffness, tree.coordinates.joints) for _ in range(place.qd.stop - place.qd.start)
    ]
    each = {"armature": tree.armature, "damping": tree.damping, "stiffness": stiffness}
    each = {
        name: np.broadcast_to(np.asarray(values, float) if len(values) else 0.0, nv) for name, values in each.items()
    }
    return {"gravity": np.array(tree.gravity, float), "mass": mass, "moments": moments} | each


def together(bodies: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray]:
    """The mass of bodies that move as one, and the moments of inertia about their centre of mass, ascending, (3,).

    bodies: mass, kg, centre of mass, m, and inertia about it, kg m2 (3, 3), in common axes.
    """
    mass = sum(body[0] for body in bodies)
    if not mass:
        return 0.0, np.zeros(3)
    centre, tensor = sum(m * c for m, c, _ in bodies) / mass, np.zeros((3, 3))
    for m, c, inertia in bodies:
        d = c - centre
        tensor += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, np.linalg.eigvalsh(tensor)


def each(name: str, file: File, quantity: str, *values: np.ndarray) -> np.ndarray:
    model, _ = models[file]
    return np.array([getattr(model, quantity)(*state) for state in zip(*values)], dtype=float)


def prepared(name: str, file: File, q, v, tau, t, steps, method, tolerance) -> float:
    """Seconds until a run could begin."""
    begin = time.perf_counter()
    models[file][0].prepare(method, tau, t[-1] / steps if steps else None, tolerance)
    return time.perf_counter() - begin


def ran(name: str, file: File, q, v, tau, t, steps, method, tolerance) -> tuple[np.ndarray, int | None, float, str]:
    """The states at the times t, evaluations, seconds of the run alone, and why it may have ended early."""
    model, _ = models[file]
    begin, why = time.perf_counter(), "a number is not finite"
    try:
        states, evaluations = model.run(q, v, tau, t, steps, method, tolerance)
    except ArithmeticError as error:  # it cannot go on
        states, evaluations, why = np.concatenate([q, v])[None], None, str(error)
    return np.asarray(states, float), evaluations, time.perf_counter() - begin, why


def timed(name: str, file: File, q, v, force) -> dict[str, float]:
    """Nanoseconds of an acceleration: of one state, of the first call, and, of each of many at once where it can."""
    model, found = models[file][0], {}
    begin = time.perf_counter()
    model.acceleration(q[0], v[0], force[0])
    found["first call"] = 1e9 * (time.perf_counter() - begin)
    calls = {"one state": lambda: [model.acceleration(q[0], v[0], force[0]) for _ in range(ONE)]}
    if type(model).many is not ReadModel.many:
        model.many(q, v, force)
        calls["many states"] = lambda: model.many(q, v, force)
    of = {"one state": ONE, "many states": len(q)}
    return found | {which: 1e9 * seconds / of[which] for which, seconds in timing.fastest(calls, 5).items()}
