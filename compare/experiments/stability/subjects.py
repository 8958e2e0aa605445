"""Which postures and motions of a robot are looked at, and what is left out because it has none."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

from ...case import Case
from ...judge.words import capital
from ...robots import Robot
from ...truth.linear import Held, all_of_kind, held, of_kind
from .choice import free_motion
from .falling import without_law
from .limits import stiffest

DAMPINGS = (0.0, 0.5, 50.0)  # N m s/rad, added


class Subjects(NamedTuple):
    """What is looked at of a robot; None where it has none."""

    centres: tuple[str, ...]  # the one that stands for its kind first
    saddles: tuple[str, ...]
    centre: Held | None
    saddle: Held | None
    swinging: Held | None  # the centre, if a mode swings there
    marginal: Held | None  # one whose potential is cubic along its mode without stiffness
    free: Case | None  # a free motion from the centre
    left_out: tuple[str, ...]  # what is left out, and why, in sentences


def subjects_of(robot: Robot) -> Subjects:
    """What is looked at of a robot."""
    centres, saddles = all_of_kind(robot, "centre"), all_of_kind(robot, "saddle")
    centre, saddle = (held(robot, names[0]) if names else None for names in (centres, saddles))
    swinging = centre if centre and stiffest(centre)[0] > 0.0 else None
    name = of_kind(robot, "marginal")
    marginal = name and held(robot, name)
    lawless = without_law(marginal) if marginal else None
    none, left_out = f"None of the {robot.name}'s named postures is", []
    if not centre:
        left_out.append(
            f"{none} a centre: limits of steps at one, the map of growth, silent failures and long runs are left out."
        )
    elif not swinging:
        left_out.append(f"No mode swings at {centre.name}: the nonlinear edge is left out.")
    if not saddle:
        left_out.append(f"{none} a saddle: departures from one are left out.")
    if not marginal:
        left_out.append(f"{none} marginal: the law of leaving one is left out.")
    elif lawless:
        left_out.append(f"{capital(name)}, held, is marginal, but {lawless}: the law of leaving it is left out.")
    if not robot.claims:
        left_out.append(f"Nothing is claimed of the {robot.name}: there are no claims to repeat.")
    marginal = None if lawless else marginal
    return Subjects(centres, saddles, centre, saddle, swinging, marginal, free_motion(robot), tuple(left_out))


def places(
    centres: Sequence[str], saddles: Sequence[str], dampings: Sequence[float] = DAMPINGS
) -> list[tuple[str, float]]:
    """Postures with the damping that is added, N m s/rad: centres with each, saddles with none."""
    return [*product(centres, dampings), *((name, 0.0) for name in saddles)]
