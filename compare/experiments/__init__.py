"""The experiments: one file or folder for each word of the command line, found by looking into this folder.

An experiment is a module with a record, `EXPERIMENT = Experiment(order=..., ...)`, whose fields are literals,
and functions: see Functions. Its text is NAME.md.jinja: a macro for its help, title, claim and tolerance, and
for each kind of finding and caption.
"""

import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..core.finding import Finding
from ..core.records import Experiment as Experiment
from ..core.records import records_in

if TYPE_CHECKING:  # for --help, the names are enough
    from ..core.check import Result
    from ..robots import Robot
    from .setup import Setup

Drawing = Callable[[], tuple[str, Any, Finding | str]]  # draws: the name of the file, the figure, the caption


@dataclass(frozen=True)
class Functions:
    """The functions of an experiment's module; those that have a default here may be missing there."""

    rows: Callable[..., "Result"]  # of a Setup, and of the work that begin has started: what was computed
    begin: Callable[["Setup"], Any] | None = None  # starts long work
    figures: Callable[["Result", "Robot"], Iterable[Drawing]] = lambda result, robot: ()
    headline: Callable[["Result"], Finding | None] = lambda result: None  # its one number on the first screen
    overview: Callable[[Mapping[str, "Result"], "Robot"], Iterable[Drawing]] = lambda results, robot: ()
    claim_values: Callable[["Robot"], dict[str, Any]] = lambda robot: {}  # for the macros claim and tolerance
    skipped: Callable[["Robot"], Finding | None] = lambda robot: None  # why it does not apply to a robot


EXPERIMENTS = records_in(Path(__file__).parent, "EXPERIMENT", Experiment)
ALWAYS = "mujoco", "tmt"  # the engines that take part in each run
TIMED = tuple(name for name, record in EXPERIMENTS.items() if record.timed)


def module(name: str) -> ModuleType:
    return importlib.import_module(f".{name}", __package__)


def functions(name: str) -> Functions:
    names = [field.name for field in fields(Functions) if hasattr(module(name), field.name)]
    return Functions(**{function: getattr(module(name), function) for function in names})


def skipped(name: str, robot: "Robot", engines: str | None = None) -> Finding | None:
    """Why an experiment does not apply to a robot, or None; engines: of --engines, ALWAYS need no extra."""
    if robot.own and not EXPERIMENTS[name].serves_own:
        return Finding(name, "not_of_own")
    asked = EXPERIMENTS[name].asks_of_own if robot.own else None
    if asked and not {*asked} & {*robot.own}:
        return Finding("shared", "nothing_given", {"asked": asked})
    is_without = engines and EXPERIMENTS[name].asks_others and {*engines.split(",")} <= {*ALWAYS}
    return (
        Finding(name, "none_chosen", {"engines": engines}) if is_without else functions(name).skipped(robot)
    )
