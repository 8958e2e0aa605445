"""The kinds of a robot's named postures when they are held: centre, saddle, marginal."""

from .linear import held


def posture_names(robot) -> tuple[str, ...]:
    return (*robot.postures, *robot.positions)


def all_that_stay(robot) -> tuple[str, ...]:
    """The postures at which a small deviation stays small, the robot's example of a centre first."""
    stay = [name for name in posture_names(robot) if held(robot, name).stays]
    return tuple(sorted(stay, key=lambda name: name != robot.kinds.get("centre", stay[0])))


def kinds(robot) -> dict[str, str]:
    """The kind of each named posture, see `Held.kind`."""
    return {name: held(robot, name).kind for name in posture_names(robot)}


def of_kind(robot, kind: str) -> str | None:
    """The example of a kind: the robot's choice, else the first posture of that kind; None: there is none."""
    return robot.kinds.get(kind) or next((name for name, other in kinds(robot).items() if other == kind), None)


def all_of_kind(robot, kind: str) -> tuple[str, ...]:
    """The postures of a kind, its example first."""
    first = of_kind(robot, kind)
    others = (name for name, other in kinds(robot).items() if other == kind and name != first)
    return () if first is None else (first, *others)
