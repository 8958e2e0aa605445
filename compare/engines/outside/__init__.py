"""Engines that read the robot's file themselves, each in a process of its own.

Their modules have, beside the record with `reads_file`, two names; they import their package in functions only:

    METHODS = {name: (order, scheme), ...}      of integration; scheme: that of tmt, or a name of its own; order None: it takes a
                                                tolerance and chooses its own steps
    class Model(model.ReadModel)                what the engine has made of a file

and, where they differ with the Tree, methods_for(tree), of the same form as METHODS.

A process of its own keeps an engine's threads, its precision and a crash away from the program and from other engines.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, cached_property
from operator import attrgetter
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

import tmt

from ...core.words import listed
from ...process.workers import Beginning, WorkerEnded, Workers
from ...robots.case import Case
from .. import RECORDS, Array, Course, Engine, Method, Motion, OneByOne, Prepared, Servos, Setting
from . import answers
from .bodies import passive
from .file import EngineError, File, TooLong
from .model import Reading

T = TypeVar("T")


class Outside(Engine):
    """An engine in a process of its own. Nothing of its package is imported here."""

    def __init__(self, name: str):
        self.name, self.record = name, RECORDS[name]

    @property
    def module(self) -> ModuleType:
        return importlib.import_module(f"..{self.record.module or self.name}", __package__)

    @cached_property
    def methods(self) -> Mapping[str, Method]:
        return self.named(self.module.METHODS)

    def named(self, methods: Mapping[str, tuple[int | None, str]]) -> dict[str, Method]:
        kinds = methods.items()
        return {name: Method(self.name, name, *kind, adaptive=kind[0] is None) for name, kind in kinds}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None where joints are locked or the robot's own actuators act."""
        if case.scene.locked or case.controller:
            return {}
        methods_for = getattr(self.module, "methods_for", None)
        return self.named(methods_for(case.tree)) if methods_for else self.methods

    def of(self, case: Case) -> "OutsideDynamics":
        return OutsideDynamics(self.name, case)

    def as_read(self, case: Case) -> "OutsideDynamics":
        """The dynamics of what the engine has read, nothing of which is set."""
        return OutsideDynamics(self.name, case, is_set=False)


class OutsideDynamics(OneByOne):
    """A case in an outside engine: a robot without locked joints and without servos."""

    seconds_prepared: float | None = None  # of compilation, where it compiles

    def __init__(self, name: str, case: Case, is_set: bool = True):
        self.name, self.case, self.tree, self.coordinates = name, case, case.tree, case.coordinates
        self.is_set = is_set
        self.file = File(Path(case.robot.mjcf).resolve(), case.joints, case.coordinates.all_kinds)

    @cached_property
    def reading(self) -> Reading:
        return self.ask(attrgetter("reading"))

    def ask(self, act: Callable[..., T], *arguments: Any) -> T:
        """What a function of answers.py returns in the engine's process; EngineError if it fails or the process ends.

        A process reads the file once, and again if it is a new one.
        """
        call = process(self.name).submit(
            answers.answer, act, self.name, self.file, self.tree, self.is_set, *arguments
        )
        try:
            return call.result()
        except TimeoutError:
            raise TooLong(f"no answer within {answers.LIMIT:g} s") from None
        except WorkerEnded:
            raise EngineError("its process was killed") from None

    def rows(self, quantity: str, *values: Array) -> Array:
        """A quantity at many states, (states, ...)."""
        states = [np.atleast_2d(np.asarray(value, float)) for value in values]
        return self.ask(answers.each, quantity, *states)

    def mass_matrix(self, q: Array) -> Array:
        return self.rows("mass_matrix", q)

    def bias(self, q: Array, v: Array) -> Array:
        return self.rows("bias", q, v)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        return self.rows("acceleration", q, v, tau - passive(self.acting, q, v))

    @property
    def acting(self) -> tmt.Tree:
        """The Tree with the damping and springs of the joints that act: where nothing is set, those that the engine has read."""
        if self.is_set:
            return self.tree
        none = np.zeros(self.coordinates.nv)
        acting = {"damping": none, "stiffness": none} | self.reading["read"]
        acting |= dict.fromkeys(self.reading["lacking"], none)
        joints = self.tree.coordinates.joints
        stiffness = tuple(float(acting["stiffness"][joint.qd.start]) for joint in joints)
        return replace(self.tree, damping=tuple(acting["damping"].tolist()), stiffness=stiffness)

    def derivatives(self, q: Array, v: Array, tau: Array) -> Array:
        """Of the accelerations by movements of q, by v and by tau, (states, 3, nv, nv), with damping and springs."""
        by = self.rows("derivatives", q, v, tau - passive(self.tree, q, v))
        bare, rest = replace(self.tree, damping=(0.0,) * len(self.tree.axis), stiffness=()), np.zeros_like(v)
        rates = (tmt.inverse_dynamics_derivatives(q, v, rest, tree) for tree in (self.tree, bare))
        for k, (whole, part) in enumerate(zip(*rates)):
            by[:, k] -= by[:, 2] @ (whole - part)
        return by

    def seconds_of_derivatives(self, *state: Array) -> float:
        """Of one evaluation at a state, in the engine's process."""
        return self.ask(answers.seconds_of_derivatives, *state)

    def has(self, quantity: str) -> bool:
        return quantity in self.reading["has"]

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        different = [number for number, is_set in self.reading["mended"].items() if not is_set]
        if self.is_set and different:
            raise EngineError(f"it has read another {listed(different)}, which cannot be set")
        return super().prepare(q, v, tau, setting, method)

    def batch(
        self, start: tuple[Array, Array, Array], dt: float, steps: int, method: str
    ) -> tuple[float, float, str, Array]:
        """Seconds of preparation and of steps of many worlds, from q, v and under tau, (worlds, n); the device; q of one."""
        times = np.array([0.0, dt * steps])
        return self.ask(answers.batched, Course(*start, times, steps, method))

    def prepared(self, course: Course) -> Prepared:
        course = course._replace(servos=servos_of(self.case))
        self.seconds_prepared, step_alone = self.ask(answers.prepared, course)
        alone = None if step_alone is None else step_alone * course.steps

        def run() -> Motion:
            return self.ask(answers.ran, course)

        def read(motion: Motion) -> Motion:
            return motion._replace(steps=course.steps or None, seconds_alone=alone)

        return run, read


def servos_of(case: Case) -> Servos | None:
    """The servos that act in a case, None if none does."""
    if case.controller is None:
        return None
    coordinates, (*_, positions, speeds) = case.coordinates, case.controller
    gains = np.zeros((coordinates.nv, coordinates.nq))
    gains[:, coordinates.places.first_positions] = positions
    return Servos(case.controller, gains, speeds)


@cache
def process(name: str) -> Workers:
    """The process of an engine."""
    return Workers(1, Beginning(RECORDS[name].environment, is_silent=True), answers.LIMIT)
