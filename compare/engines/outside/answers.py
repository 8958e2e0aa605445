"""What an engine's own process does: read a file, give quantities at states, run."""

import importlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, TypeVar

import numpy as np

import tmt

from ...core import timing
from ...core.errors import described
from ...core.words import in_one_line
from .. import RECORDS, Array, Course, Motion
from .file import EngineError, File, Unread
from .model import Reading, ReadModel

if TYPE_CHECKING:
    from .as_it_runs import Run

ROUNDS = 5  # of timing a short run
LIMIT = 120.0  # s, of an answer: compiling a large model may take hours
T = TypeVar("T")


def answer(act: Callable[..., T], *arguments: object) -> T:
    """act(*arguments); EngineError with the reason, in one line, where it raises."""
    with raising(EngineError, with_place=True):
        return act(*arguments)


@contextmanager
def raising(kind: type[EngineError], with_place: bool) -> Iterator[None]:
    """What is raised in this block as an error of a kind, in one line."""
    try:
        yield
    except EngineError:
        raise
    except (Exception, SystemExit) as error:  # the latter by assertions of Drake
        raise kind(in_one_line(" ".join(described(error, with_place).split()))) from None


def module_of(name: str) -> ModuleType:
    """The module of an engine, by the name of its record."""
    return importlib.import_module(f"..{RECORDS[name].module or name}", __package__)


@cache
def read(name: str, file: File, tree: tmt.Tree) -> tuple[ReadModel, Reading]:
    """The model of an engine, with the Tree's numbers as far as they can be set. Once in a process."""
    begin, record = time.perf_counter(), RECORDS[name]
    kind: type[ReadModel] = module_of(name).Model
    with raising(Unread, with_place=False):
        model = kind(file, record.precision)
    found = model.compare(tree, record.eps)
    return model, found._replace(seconds=time.perf_counter() - begin)


def reading(name: str, file: File, tree: tmt.Tree) -> Reading:
    return read(name, file, tree)[1]


def each(name: str, file: File, tree: tmt.Tree, q: Array, v: Array, force: Array) -> tuple[Array, ...]:
    """M, h and a at many states of the Tree, (states, ...); force: without that of damping and springs."""
    model, found = read(name, file, tree)[0], []
    for positions, speeds, forces in zip(q, v, force):
        at = model.order.state(positions, speeds)
        M, h, a = model.dynamics(at, at.force(forces))
        found.append((at.S.T @ M @ at.S, at.S.T @ h, np.linalg.solve(at.S, a - at.c)))
    return tuple(np.array(values, float) for values in zip(*found))


def prepared(name: str, file: File, tree: tmt.Tree, course: Course) -> tuple[float, float | None]:
    """Seconds until a run could begin; and of a step without what Python does around it, None where that is nothing."""
    begin, (model, _) = time.perf_counter(), read(name, file, tree)
    model.prepare(course)
    step = model.step_alone(course) if course.steps else None
    if step:
        step()  # its code is compiled, or loaded
    seconds = time.perf_counter() - begin
    if step is None:
        return seconds, None
    count = 1 + int(timing.WARM / timing.fastest({"": step}, 3)[""])

    def steps() -> None:
        for _ in range(count):
            step()

    return seconds, timing.fastest({"": steps}, ROUNDS)[""] / count


def ran(name: str, file: File, tree: tmt.Tree, course: Course) -> Motion:
    """A run, timed in this process: the fastest of some, or the only one where it takes long enough."""
    model, _ = read(name, file, tree)
    order, _ = module_of(name).METHODS[course.method]

    def run() -> tuple[Motion, float]:
        states, evaluations, why = course.start[None], None, "a number is not finite"
        begin = time.perf_counter()
        try:
            states, evaluations = model.run(course)
        except ArithmeticError as error:  # it cannot go on
            why = str(error)
        seconds = time.perf_counter() - begin
        evaluations = order and order * course.steps if evaluations is None else evaluations
        return course.motion(np.asarray(states, float), why)._replace(evaluations=evaluations), seconds

    motion, seconds = run()
    if seconds < timing.TIMED_ENOUGH:
        seconds = timing.fastest({"": run}, ROUNDS)[""]
    return motion._replace(seconds=seconds)


def run_as_it_is(name: str, file: File, tree: tmt.Tree, iterations: int | None) -> "Run | None":
    """The file's run in an engine that steps MuJoCo's model, with its own iterations or others; None in another engine."""
    from .as_it_runs import run

    kind = getattr(module_of(name), "Stepper", None)
    return kind and run(kind, RECORDS[name].precision, file, iterations)
