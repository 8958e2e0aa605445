"""A robot's file with the joints that are compared, and why an engine may say nothing of it."""

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ...robots.coordinates import Coordinates


class File(NamedTuple):
    """A robot's file, and the joints of the Tree that is compared."""

    path: Path  # MJCF or URDF
    # of the joints; a free joint b is `b x`, `b y`, `b z` (slides) and `b turn` (a ball)
    names: tuple[str, ...]
    kinds: tuple[str, ...]  # hinge, slide or ball
    is_urdf: bool = False  # by its root element, whatever its name

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.names, self.kinds)

    @property
    def free(self) -> tuple[str, ...]:
        """The names of the free joints, as the file has them."""
        balls = [name for name, kind in zip(self.names, self.kinds) if kind == "ball"]
        names = [name.removesuffix(" turn") for name in balls]
        return tuple(name for name in names if f"{name} x" in self.names)

    @property
    def floating(self) -> bool:
        """Whether the base of a URDF is free, by its own joint or by --floating."""
        return self.is_urdf and bool(self.free)

    @property
    def is_freed(self) -> bool:
        """Whether the base of a URDF is free by --floating alone."""
        joints = ElementTree.parse(self.path).iter("joint") if self.floating else ()
        return self.floating and "floating" not in {joint.get("type") for joint in joints}

    def is_free(self, joint: int) -> bool:
        """Whether a joint of the Tree is the ball of a free joint."""
        return self.names[joint].removesuffix(" turn") in self.free


class EngineError(ValueError):
    """An engine fails; the message says why, in one line."""


class Unread(EngineError):
    """An engine cannot read a file; the message is the engine's."""


class OtherJoints(EngineError):
    """An engine has read other joints than the file has; its arguments: their number of speeds, and that of the file."""

    @property
    def speeds(self) -> int:
        return int(self.args[0])

    def __str__(self) -> str:
        return "{} of {} speeds".format(*self.args)


class OtherNames(EngineError):
    """An engine gives a joint another name, by which this program does not find it."""


class TooLong(EngineError):
    """An engine does not answer within the time limit."""
