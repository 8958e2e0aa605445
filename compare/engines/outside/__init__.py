"""Engines that read the robot's file themselves, each in a process of its own.

Their modules have, beside the record with `reads_file`, two names; they import their package in functions only:

    METHODS = {name: (order, scheme), ...}      of integration; scheme: that of tmt, or a name of its own; order None: it takes a
                                                tolerance and chooses its own steps
    class Model(model.ReadModel)                what the engine has made of a file

and, where they differ with the Tree, methods_for(tree), of the same form as METHODS.

A process of its own keeps an engine's threads, its precision and a crash away from the program and from other engines.
"""

import importlib
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType

import numpy as np

from ...core.words import listed
from ...robots.case import Case
from .. import GRID, RECORDS, Engine, Method, Motion, Prepared, Setting, as_far_as_it_goes, rows_of_states
from .answers import LIMIT, answer, started
from .model import EngineError, File, TooLong, passive


class Outside(Engine):
    """An engine in a process of its own. Nothing of its package is imported here."""

    def __init__(self, name: str):
        self.name, self.record = name, RECORDS[name]
        self.methods = self.named(self.module.METHODS)

    @property
    def module(self) -> ModuleType:
        return importlib.import_module(f"..{self.record.module or self.name}", __package__)

    def named(self, methods: Mapping) -> dict[str, Method]:
        return {name: Method(self.name, name, *of, adaptive=of[0] is None) for name, of in methods.items()}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None where joints are locked or the robot's own actuators act."""
        if case.scene.locked or case.controller:
            return {}
        methods_for = getattr(self.module, "methods_for", None)
        return self.named(methods_for(case.tree)) if methods_for else self.methods

    def of(self, case: Case) -> "OutsideDynamics":
        return OutsideDynamics(self.name, case)


class OutsideDynamics:
    """A case in an outside engine: a robot without locked joints and without servos."""

    def __init__(self, name: str, case: Case):
        self.name, self.case, self.tree, self.coordinates = name, case, case.tree, case.coordinates
        self.file = File(Path(case.robot.mjcf).resolve(), case.joints, case.coordinates.all_kinds)
        self.key = hash((self.file, self.tree))
        self.readings: dict[ProcessPoolExecutor, Mapping] = {}  # by the process; a new one has read nothing

    @property
    def reading(self) -> Mapping:
        """Of the child: its numbers as read, which of them were mended, and seconds until the model was there."""
        own = process(self.name)
        if own not in self.readings:
            self.readings[own] = self.ask("read", self.name, self.file, self.tree)
        return self.readings[own]

    def ask(self, act: str, *arguments):
        """The value of a function of answers.py in the engine's process; EngineError if it fails or the process ends."""
        if act != "read":
            self.reading  # noqa: B018 - mends what it has read differently
        begin = time.monotonic()
        try:
            return process(self.name).submit(answer, self.key, act, arguments).result()
        except BrokenProcessPool:
            processes.pop(self.name, None)  # those of other engines go on
            if time.monotonic() - begin > LIMIT:
                raise TooLong(f"no answer within {LIMIT:g} s") from None
            raise EngineError("its process was killed") from None

    def rows(self, quantity: str, *values) -> np.ndarray:
        """A quantity at many states, (states, ...)."""
        return self.ask("each", quantity, *(np.atleast_2d(np.asarray(value, float)) for value in values))

    def mass_matrix(self, q):
        return self.rows("mass_matrix", q)

    def bias(self, q, v):
        return self.rows("bias", q, v)

    def acceleration(self, q, v, tau):
        return self.rows("acceleration", q, v, tau - passive(self.tree, q, v))

    def has(self, quantity: str) -> bool:
        return quantity in self.reading["has"]

    def run(self, q, v, tau, dt, steps, method, tolerance=None) -> Motion:
        """Motions recorded at every multiple of dt."""
        t, (batch, states), ended = np.linspace(0.0, dt * steps, steps + 1), rows_of_states(q, v, tau), []
        paths = []
        for state in zip(*states):
            of, _, _, why = self.ask("ran", *state, t, None if tolerance else steps, method, tolerance)
            path, end = as_far_as_it_goes(t, of, np.concatenate(state[:2]), why)
            paths.append(path)
            ended.append(end)
        q, v = np.split(np.reshape(paths, (*batch, steps + 1, -1)), [self.coordinates.nq], axis=-1)
        return Motion(t, q, v, None, np.reshape(np.array(ended, dtype=object), batch)[()], steps)

    def prepare(self, q, v, tau, setting: Setting, method) -> Prepared:
        if different := [number for number, is_set in self.reading["mended"].items() if not is_set]:
            raise EngineError(f"it has read another {listed(different)}, which cannot be set")
        t = np.linspace(0.0, setting.duration, GRID + 1)
        arguments = q, v, tau, t, setting.steps, method, setting.tolerance
        self.seconds_prepared = self.ask("prepared", *arguments)  # of compilation, where it compiles

        def run():
            return self.ask("ran", *arguments)

        def read(outcome):
            states, evaluations, seconds, why = outcome
            path, ended = as_far_as_it_goes(t, states, np.concatenate([q, v]), why)
            return Motion(
                t, *np.split(path, [self.coordinates.nq], axis=1), evaluations, ended, setting.steps, seconds
            )

        return run, read


processes: dict[str, ProcessPoolExecutor] = {}  # by the engine


def process(name: str) -> ProcessPoolExecutor:
    """The process of an engine, begun where there is none."""
    if name not in processes:
        begin = (RECORDS[name].environment,)
        processes[name] = ProcessPoolExecutor(1, get_context("spawn"), initializer=started, initargs=begin)
    return processes[name]
