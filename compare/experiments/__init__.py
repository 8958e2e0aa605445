"""The experiments, one file or folder for each word of the command line; this module finds them by looking into its folder.

An experiment is a module with a record, `EXPERIMENT = Experiment(order=..., ...)`, whose fields are literals, and a text,
NAME.md.jinja: a macro for its help, title, claim, tolerance, and for each kind of finding and caption. The module has

    rows(setup) -> Result                    numbers: tables, checks, findings
    figures(result, robot)                   yields calls that draw: (file name, figure, caption) (optional)
    headline(result) -> Finding | None       its one number on the first screen
    overview(results, robot)                 draws its picture of the first screen (of a record with `overview`)
    claim_values(robot) -> dict              what the macros claim and tolerance take in addition to the robot (optional)
    skipped(robot) -> Finding | None         why it does not apply to a robot (optional)
    begin(setup) -> Work                     starts long work (optional), which rows(setup, work) takes up
"""

import importlib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ..core.finding import Finding
from ..core.records import records_in

if TYPE_CHECKING:  # for --help, the names are enough
    from ..robots import Robot


@dataclass(frozen=True)
class Experiment:
    """What the program has to know of an experiment before it imports it."""

    order: int  # of `all` and of the report
    serves_own: bool = (
        True  # whether it applies to a user's own equations; if not, the macro not_of_own says why
    )
    asks_of_own: tuple[str, ...] | None = None  # which of a user's own functions it calls; None: all
    needs_file: bool = False  # or equations of a user's own: there is nothing to say of the arm's
    options: tuple[str, ...] = ()  # of the command line, in addition to those of every experiment
    in_quick: bool = True  # whether a quick run of several experiments has it
    timed: bool = False  # it measures times: it runs last, while nothing else does
    diagnosed: bool = False  # where it fails, `diagnosis` looks for the cause
    overview: str = ""  # the picture of the first screen that its result is part of


EXPERIMENTS = records_in(Path(__file__).parent, "EXPERIMENT", Experiment)
TIMED = tuple(name for name, record in EXPERIMENTS.items() if record.timed)


def module(name: str) -> ModuleType:
    return importlib.import_module(f".{name}", __package__)


def skipped(name: str, robot: "Robot") -> Finding | None:
    """Why an experiment does not apply to a robot, or None."""
    if robot.own and not EXPERIMENTS[name].serves_own:
        return Finding(name, "not_of_own")
    return getattr(module(name), "skipped", lambda robot: None)(robot)
