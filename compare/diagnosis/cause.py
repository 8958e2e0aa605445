"""Causes: explanations of a difference, the results of all searches. Their text is in causes.md.jinja."""

from collections.abc import Sequence
from typing import NamedTuple

from ..core.finding import Finding
from ..core.text import say
from ..robots.joint_map import JointMap

TEMPLATE = "causes"
LEAST_STATES = 4  # different positions: with fewer, wrong numbers explain by luck


class Change(NamedTuple):
    """One change of the equations."""

    kind: str  # "number", "term", "coefficient", "option", "order", ...
    place: str
    stated: float | str
    explains: float | str  # the value that explains the difference
    unit: str = ""  # "times" of a factor


class Cause(NamedTuple):
    """One explanation of the whole difference: one change, or two of which each field has both."""

    rank: int
    kind: str
    place: str
    stated: float | str
    explains: float | str
    unit: str
    left_over: float  # of the difference, a share
    changes: tuple[Change, ...]
    joints: JointMap | None = None  # with which the equations would agree, for a convention of the joints
    tied: int = 0  # other explanations that explain as much

    def text(self, stated_by: str = "argument") -> str:
        """The cause in words. stated_by: how joints are stated, "argument" (joints=), "option" (--joints); "": they are not."""
        return say(Finding(TEMPLATE, "cause", {"cause": self, "stated_by": stated_by}))


class Diagnosis(NamedTuple):
    """What explains a difference."""

    differs: bool
    causes: tuple[Cause, ...] = ()  # of one rank, each explains everything; (): nothing does
    closest: Cause | None = (
        None  # where nothing explains everything: of single changes the one that leaves least
    )
    details: tuple[dict, ...] = ()  # coefficients that differ, with both numbers or in terms
    entries: tuple[str, ...] = ()  # of Mbar and h that differ, "M[hip][knee]"
    compared: int = 0  # entries in all
    # single changes that leave least: what they leave, a share, and whether it is within the tolerance
    nearest: tuple[tuple[str, float, bool], ...] = ()
    too_few: int = 0  # states, if they are too few for a search
    seconds: float | None = None  # of a search that was not finished

    def sentence(self, stated_by: str = "argument") -> str:
        """The result in words. stated_by: see `Cause.text`."""
        values = {"found": self, "least_states": LEAST_STATES, "stated_by": stated_by}
        return say(Finding(TEMPLATE, "diagnosis", values))


def cause_of(rank: int, changes: Sequence[Change], left: float, joints: JointMap | None = None) -> Cause:
    """The cause that one or several changes are."""
    fields = changes[0]
    if len(changes) > 1:
        texts = ([f"{x:.12g}" if isinstance(x, float) else x for x in column] for column in zip(*changes))
        fields = (" and ".join(filter(None, column)) for column in texts)
    return Cause(rank, *fields, left, tuple(changes), joints)


def tied(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """The causes of one rank, each with the number of the others."""
    return tuple(cause._replace(tied=len(causes) - 1) for cause in causes)
