"""The experiments: a row of EXPERIMENTS for each word of the command line.

An experiment is a row and a module, or a folder, of its name, which has functions: see Functions. The module
is imported only where the experiment runs. Its text is NAME.md.jinja: a macro for its help, title, claim and
tolerance, and for each kind of finding and caption.
"""

import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..core.finding import Finding
from ..core.records import Experiment as Experiment

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


EXPERIMENTS = {  # in the order of `all` and of the report
    "parameters": Experiment(serves_own=False, states_causes=True),
    "published": Experiment(serves_own=False),
    "kinematics": Experiment(module="states", asks_of_own=("com_positions", "jacobians")),
    "mass": Experiment(module="states", asks_of_own=("mass_matrix",), overview="agreement"),
    "gravity": Experiment(module="states", asks_of_own=("gravity", "bias")),
    "acceleration": Experiment(module="states", overview="agreement"),
    "engines": Experiment(serves_own=False, runs_file=True, asks_others=True, quick_speeds=0, first_screen=("answer",)),
    "trajectory": Experiment(overview="scenes"),
    "diagnosis": Experiment(needs_file=True, states_causes=True, compares=False),
    "speed": Experiment(serves_own=False, timed=True, overview="times"),
    "stability": Experiment(serves_own=False, runs_file=True, overview="limits",
                            first_screen=("answer", "by_itself", "smaller", "remedies", "within")),
    "derivatives": Experiment(serves_own=False, runs_file=True, timed=True, quick_speeds=8,
                              first_screen=("answer", "standing")),
    "reduction": Experiment(serves_own=False, runs_file=True, quick_speeds=8, first_screen=("answer", "needs")),
}  # fmt: skip
ALWAYS = "mujoco", "tmt"  # the engines that take part in each run
TIMED = tuple(name for name, record in EXPERIMENTS.items() if record.timed)


def module(name: str) -> ModuleType:
    return importlib.import_module(f".{EXPERIMENTS.get(name, Experiment()).module or name}", __package__)


def functions(name: str) -> Functions:
    """Those of an experiment's module, or those that it makes for one of several experiments."""
    if hasattr(module(name), "functions"):
        made: Functions = module(name).functions(name)
        return made
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
