"""The record of an experiment: what the program has to know of it before it imports it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Experiment:
    order: int = 0  # of `all` and of the report
    serves_own: bool = True  # a user's own equations; if not, the macro not_of_own says why
    asks_of_own: tuple[str, ...] | None = None  # which of a user's own functions it calls; None: all
    needs_file: bool = False  # or equations of a user's own: there is nothing to say of the arm's
    options: tuple[str, ...] = ()  # of the command line, in addition to those of every experiment
    in_quick: bool = True  # whether a quick run of several experiments has it
    timed: bool = False  # it measures times: it runs last, while nothing else does
    diagnosed: bool = False  # where it fails, `diagnosis` looks for the cause
    states_causes: bool = False  # its failing checks are the causes of the others
    compares: bool = True  # if not, it only says why others fail
    overview: str = ""  # the picture of the first screen that its result is part of
