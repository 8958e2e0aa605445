"""Engines that read the robot's file themselves, each in a process of its own.

Their modules have, beside the record with `reads_file`, two names; they import their package in functions
only:

    METHODS = {name: (order, scheme), ...}      of integration; scheme: that of tmt, or a name of its own;
    order None: it takes a
                                                tolerance and chooses its own steps
    class Model(model.ReadModel)                what the engine has made of a file

and, where they differ with the Tree, methods_for(tree), of the same form as METHODS; where the engine steps
MuJoCo's own model, class Stepper(as_it_runs.Stepper), which runs the file as it is.

A process of its own keeps an engine's threads, its precision and a crash away from the program and from other
engines.
"""

from collections.abc import Callable, Mapping
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ...core.words import listed
from ...process.workers import WorkerEnded, Workers
from ...robots.case import Case
from .. import RECORDS, Array, Course, Engine, Method, Motion, OneByOne, Prepared, Setting
from ..mujoco.source import is_urdf
from ..own.equations import passive
from . import answers
from .file import EngineError, File, TooLong
from .model import Reading

T = TypeVar("T")


class Outside(Engine):
    """An engine in a process of its own. Nothing of its package is imported here."""

    def __init__(self, name: str):
        self.name, self.record = name, RECORDS[name]

    @cached_property
    def methods(self) -> Mapping[str, Method]:
        return self.named(answers.module_of(self.name).METHODS)

    def named(self, methods: Mapping[str, tuple[int | None, str]]) -> dict[str, Method]:
        kinds = methods.items()
        return {name: Method(self.name, name, *kind, adaptive=kind[0] is None) for name, kind in kinds}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None where joints are locked or the robot's own actuators act."""
        if case.scene.locked or case.controller:
            return {}
        methods_for = getattr(answers.module_of(self.name), "methods_for", None)
        return self.named(methods_for(case.tree)) if methods_for else self.methods

    def of(self, case: Case) -> "OutsideDynamics":
        return OutsideDynamics(self.name, case)


class OutsideDynamics(OneByOne):
    """A case in an outside engine: a robot without locked joints and without servos."""

    seconds_prepared: float | None = None  # of compilation, where it compiles

    def __init__(self, name: str, case: Case):
        self.name, self.case, self.tree, self.coordinates = name, case, case.tree, case.coordinates
        path = Path(case.robot.mjcf).resolve()
        text = path.read_text(encoding="utf-8", errors="replace")
        self.file = File(path, case.joints, case.coordinates.all_kinds, is_urdf(text))

    @cached_property
    def reading(self) -> Reading:
        return self.ask(answers.reading)

    def ask(self, act: Callable[..., T], *arguments: Any) -> T:
        """What a function of answers.py returns in the engine's process; EngineError if it fails or the process ends.

        A process reads the file once, and again if it is a new one.
        """
        asked = act, self.name, self.file, self.tree, *arguments
        try:
            return process(self.name).submit(answers.answer, *asked).result()
        except TimeoutError:
            raise TooLong(f"no answer within {answers.LIMIT:g} s") from None
        except WorkerEnded:
            raise EngineError("its process was killed") from None

    def at(self, q: Array, v: Array, tau: Array) -> tuple[Array, ...]:
        """M, h and accelerations at states, one or (states, n)."""
        return self.ask(answers.each, *np.atleast_2d(q, v, tau - passive(self.tree, q, v)))

    def mass_matrix(self, q: Array) -> Array:
        rest = np.zeros((len(np.atleast_2d(q)), self.coordinates.nv))
        return self.at(q, rest, rest)[0]

    def bias(self, q: Array, v: Array) -> Array:
        return self.at(q, v, np.zeros_like(v))[1]

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        return self.at(q, v, tau)[2]

    def prepare(self, q: Array, v: Array, tau: Array, setting: Setting, method: str) -> Prepared:
        if self.reading.not_set:
            raise EngineError(f"it has read another {listed(self.reading.not_set)}, which cannot be set")
        return super().prepare(q, v, tau, setting, method)

    def prepared(self, course: Course) -> Prepared:
        self.seconds_prepared, step_alone = self.ask(answers.prepared, course)

        def read(motion: Motion) -> Motion:
            seconds = motion.seconds if step_alone is None else step_alone * course.steps
            return motion._replace(steps=course.steps or None, seconds=seconds)

        return partial(self.ask, answers.ran, course), read


@cache
def process(name: str) -> Workers:
    """The process of an engine."""
    return Workers(1, answers.LIMIT, environment=RECORDS[name].environment, is_silent=True)
