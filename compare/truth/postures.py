"""What each named posture of a robot is when it is held."""

from .linear import held


def posture_names(robot) -> tuple[str, ...]:
    """The names of its postures."""
    return (*robot.postures, *robot.positions)


def all_that_stay(robot) -> tuple[str, ...]:
    """The postures at which a small deviation stays small, the one that stands for a centre first."""
    stay = [name for name in posture_names(robot) if held(robot, name).stays]
    return tuple(sorted(stay, key=lambda name: name != robot.kinds.get("centre", stay[0])))


def kinds(robot) -> dict[str, str]:
    """What each named posture is when it is held, see `Held.kind`."""
    return {name: held(robot, name).kind for name in posture_names(robot)}


def of_kind(robot, kind: str) -> str | None:
    """The posture that stands for a kind: the robot's choice, else the first of that kind; None: there is none."""
    return robot.kinds.get(kind) or next((name for name, found in kinds(robot).items() if found == kind), None)


def all_of_kind(robot, kind: str) -> tuple[str, ...]:
    """The postures of a kind, the one that stands for it first."""
    first = of_kind(robot, kind)
    others = (name for name, found in kinds(robot).items() if found == kind and name != first)
    return () if first is None else (first, *others)
