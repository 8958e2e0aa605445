"""The experiments, one file or folder for each word of the command line; this module finds them by looking into its folder.

An experiment is a module with a record, `EXPERIMENT = Experiment(order=..., ...)`, whose fields are literals: they are read
without importing the module. Beside it is its text, NAME.md.jinja: a macro for its help, title, claim, tolerance, and for each
kind of finding and caption. The module has

    rows(setup) -> Result                    numbers: tables, checks, findings
    figures(result, robot)                   yields calls that draw, each returning (file name, figure, caption)
    headline(result) -> Finding | None       its one number on the first screen
    overview(results, robot)                 draws its picture of the first screen (of a record with `overview`)
    claim_values(robot) -> dict              what the macros claim and tolerance take in addition to the robot (optional)
    skipped(robot) -> Finding | None         why it does not apply to a robot (optional)
    begin(setup)                             starts long work (optional)
"""

import ast
import importlib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ..judge.finding import Finding

if TYPE_CHECKING:  # for --help, the names are enough
    from ..robots import Robot

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Experiment:
    """What the program has to know of an experiment before it imports it."""

    order: int  # of `all` and of the report
    serves_own: bool = True  # whether it applies to a user's own equations; if not, the macro not_of_own says why
    asks_of_own: tuple[str, ...] | None = None  # which of a user's own functions it calls; None: all
    options: tuple[str, ...] = ()  # of the command line, in addition to those of every experiment
    timed: bool = False  # it measures times: it runs last, while nothing else does
    diagnosed: bool = False  # where it fails, `diagnosis` looks for the cause
    overview: str = ""  # the picture of the first screen that its result is part of


def found_in(folder: Path) -> dict[str, Experiment]:
    """The experiments of a folder by their names, in their order."""
    found = {}
    for file in (*folder.glob("*.py"), *folder.glob("*/__init__.py")):
        text = file.read_text(encoding="utf-8")
        for node in ast.parse(text).body if "\nEXPERIMENT = Experiment(" in text else ():
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) == "EXPERIMENT":
                fields = {field.arg: ast.literal_eval(field.value) for field in node.value.keywords}
                found[file.parent.name if file.stem == "__init__" else file.stem] = Experiment(**fields)
    return dict(sorted(found.items(), key=lambda item: item[1].order))


EXPERIMENTS = found_in(FOLDER)
TIMED = tuple(name for name, record in EXPERIMENTS.items() if record.timed)


def module(name: str) -> ModuleType:
    """An experiment's module."""
    return importlib.import_module(f".{name}", __package__)


def skipped(name: str, robot: "Robot") -> Finding | None:
    """Why an experiment does not apply to a robot, or None."""
    if robot.own and not EXPERIMENTS[name].serves_own:
        return Finding(name, "not_of_own")
    return getattr(module(name), "skipped", lambda robot: None)(robot)
