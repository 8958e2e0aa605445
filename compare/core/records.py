"""Records of the modules of a folder, which are read without importing the modules; that of an experiment."""

import ast
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import TypeVar

Record = TypeVar("Record")
order_of = attrgetter("order")


@dataclass(frozen=True)
class Experiment:
    """What the program has to know of an experiment before it imports it."""

    order: int = 0  # of `all` and of the report
    serves_own: bool = True  # a user's own equations; if not, the macro not_of_own says why
    asks_of_own: tuple[str, ...] | None = None  # which of a user's own functions it calls; None: all
    asks_others: bool = False  # engines beside mujoco and tmt, of which --engines has to name one
    needs_file: bool = False  # or equations of a user's own: there is nothing to say of the arm's
    # the most speeds of a robot for which a quick run of several experiments has it; None: any
    quick_speeds: int | None = None
    timed: bool = False  # it measures times: it runs last, while nothing else does
    states_causes: bool = False  # its failing checks are the causes of the others
    compares: bool = True  # if not, it only says why others fail
    overview: str = ""  # the picture of the first screen that its result is part of
    # the kinds of its `top` that are on the first screen of a run of several; the others stand in its section
    first_screen: tuple[str, ...] = ()
    runs_file: bool = False  # it asks about the file as it is, with contacts, actuators and constraints


def records_in(folder: Path, name: str, kind: type[Record]) -> dict[str, Record]:
    """The records `name = kind(field=literal, ...)` by the names of their modules, in their order."""
    records = {}
    for file in (*folder.glob("*.py"), *folder.glob("*/__init__.py")):
        _, begins, rest = file.read_text(encoding="utf-8").partition(f"\n{name} = {kind.__name__}(")
        if begins:
            call = ast.parse(f"kind({rest}").body[0]
            assert isinstance(call, ast.Expr) and isinstance(call.value, ast.Call)
            fields = {str(field.arg): ast.literal_eval(field.value) for field in call.value.keywords}
            records[file.parent.name if file.stem == "__init__" else file.stem] = kind(**fields)
    return dict(sorted(records.items(), key=lambda item: order_of(item[1])))
