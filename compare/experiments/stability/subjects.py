"""Which postures and motions of a robot are looked at, and what is left out because it has none."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ...judge.words import posture_begins
from ...robots import Robot
from ...robots.case import Case
from ...truth.conserved import floats
from ...truth.linear import Held, held
from ...truth.postures import all_of_kind, all_that_stay, of_kind, posture_names
from ...truth.rest import at_rest
from .choice import DAMPINGS, free_motion
from .falling import without_law
from .growth import stiffest

MOST_POSTURES = 6  # named postures that are looked at, the first
MANY = 7  # speeds, beyond which the runs of a file's robot are at one such posture
REST = "at rest"  # the name of the posture at which a robot that is read from a file rests without torque


class Subjects(NamedTuple):
    """What is looked at of a robot; None where it has none."""

    robot: Robot  # with the postures that are looked at, and no others
    centres: tuple[str, ...]  # the one that stands for its kind first
    saddles: tuple[str, ...]
    centre: Held | None
    saddle: Held | None
    swinging: Held | None  # the centre, if a mode swings there
    marginal: Held | None  # one whose potential is cubic along its mode without stiffness
    free: Case | None  # a free motion from the centre
    left_out: tuple[str, ...]  # what is left out, and why, in sentences

    @property
    def names(self) -> dict:
        """The names of the postures, for who draws."""
        one = {kind: at and at.name for kind, at in (("saddle", self.saddle), ("marginal", self.marginal))}
        return one | {"centres": self.centres, "centre": self.centre and self.centre.name}


@lru_cache(maxsize=64)
def subjects_of(robot: Robot) -> Subjects:
    """What is looked at of a robot."""
    robot, left_out = looked_at(robot)
    centres, saddles = (tuple(names) for names in (all_that_stay(robot), all_of_kind(robot, "saddle")))
    still = [name for name in centres if held(robot, name).without_stiffness.all()]
    centres = tuple(name for name in centres if name not in still)
    if robot.is_read and robot.coordinates.nv > MANY and len(centres) > 1:
        left_out.append(
            f"A robot of more than {MANY} speeds is run at the first of the postures at which a small deviation stays small: "
            f"{centres[0]}, not {', '.join(centres[1:])}."
        )
        centres = centres[:1]
    centre, saddle = (held(robot, names[0]) if names else None for names in (centres, saddles))
    swinging = centre if centre and stiffest(centre)[0] > 0.0 else None
    name = of_kind(robot, "marginal")
    marginal = held(robot, name) if name and not (robot.is_read and held(robot, name).stays) else None
    lawless = without_law(marginal) if marginal else None
    none = f"None of the {robot.noun}'s named postures is"
    if still:
        left_out.append(
            f"At {still[0]} every rate is zero: no step is too large there, and there is no limit to look for."
        )
    if robot.is_read:
        left_out += left_out_of_a_file(robot, centre or still)
    elif not centre:
        left_out.append(
            f"{none} a centre: limits of steps at one, the map of growth, silent failures and long runs are left out."
        )
    elif not swinging:
        left_out.append(f"No mode swings at {centre.name}: the nonlinear edge is left out.")
    if not saddle:
        left_out.append(f"{none} a saddle: departures from one are left out.")
    if not name:
        left_out.append(f"{none} marginal: the law of leaving one is left out.")
    elif not marginal:
        left_out.append(
            f"{posture_begins(name, robot)}, held, is marginal, but nothing pushes along its movements without stiffness: the "
            "law of leaving it is left out."
        )
    elif lawless:
        left_out.append(
            f"{posture_begins(name, robot)}, held, is marginal, but {lawless}: the law of leaving it is left out."
        )
    if not robot.claims and not robot.is_read:
        left_out.append(f"Nothing is claimed of the {robot.noun}: there are no claims to repeat.")
    marginal, free = None if lawless else marginal, free_motion(robot)
    if robot.is_read and (set(robot.tree.kind) != {"hinge"} or robot.tree.has_springs):
        free = None
        left_out.append(
            "Silent failures are left out: they are seen by the range of the potential, which is known of hinges without "
            "springs only."
        )
    return Subjects(robot, centres, saddles, centre, saddle, swinging, marginal, free, tuple(left_out))


def left_out_of_a_file(robot: Robot, stays: object) -> list[str]:
    """What is left out of every robot that is read from a file."""
    words = [
        f"The {robot.noun} is read from a file, of which a report looks at modes, limits of steps, departures and silent "
        "failures alone, with its own damping. Left out are methods that solve an equation in each step, the map of growth, the "
        "nonlinear edge and long runs: they would take most of the time of a report."
    ]
    if not stays:
        words.append(f"No posture of the {robot.noun} keeps a small deviation small: limits of steps are left out.")
    return words


def looked_at(robot: Robot) -> tuple[Robot, list[str]]:
    """The robot with the postures that are looked at, and what is to be said of that.

    Of a file's robot, whose postures are seldom at rest without torque, also the one to which it sinks from the first of them.
    """
    names, notes = posture_names(robot), []
    if len(names) > MOST_POSTURES:
        names = names[:MOST_POSTURES]
        notes.append(
            f"Of {len(posture_names(robot))} named postures the first {len(names)} are looked at: {', '.join(names)}."
        )
        postures, positions = ({n: of[n] for n in names if n in of} for of in (robot.postures, robot.positions))
        robot = replace(robot, postures=postures, positions=positions)
    if not robot.is_read:
        return robot, notes
    if floats(robot.tree):
        if np.any(robot.tree.gravity):
            notes.append(
                f"The {robot.noun} has a free body, which has no rest under gravity: all that is held here is held without "
                "gravity."
            )
        return robot, notes
    found = at_rest(robot.tree, robot.posture(names[0]))
    if found is None:
        notes.append(f"No posture was found at which the {robot.noun} rests without torque: it sinks for ever.")
        return robot, notes
    known = [name for name in names if np.abs(robot.coordinates.difference(found, robot.posture(name))).max() < 1e-6]
    if not known:
        rest = REST if REST not in names else f"{REST} without torque"
        robot = replace(robot, positions={**robot.positions, rest: tuple(map(float, found))})
        notes.append(
            f"Under no torque the {robot.noun} rests at a posture that was found downhill from {names[0]}; it is called "
            f"{rest}."
        )
    return robot, notes


def places(
    centres: Sequence[str], saddles: Sequence[str], dampings: Sequence[float] = DAMPINGS
) -> list[tuple[str, float]]:
    """Postures with the damping that is added, N m s/rad: centres with each, saddles with none."""
    return [*product(centres, dampings), *((name, 0.0) for name in saddles)]
