"""The record of an experiment."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Experiment:
    """What the program has to know of an experiment before it imports it."""

    module: str = ""  # which has its functions, if it is not the one of its name
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
