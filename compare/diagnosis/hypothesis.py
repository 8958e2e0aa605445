"""One explanation of a difference: a cause, and Mbar and h as they would be with it."""

from functools import partial
from typing import Any, NamedTuple

from numpy import ndarray

from ..core.cause import Cause


class Hypothesis(NamedTuple):
    """A cause without a number to fit, and the values that it gives, (states, entries)."""

    cause: Cause
    values: ndarray

    @property
    def key(self) -> tuple[str, str]:
        """What tells it from the others of its kind."""
        return self.cause.place, str(self.cause.explains)


EVERY = 0.03  # what a slip in several bodies or joints costs more


def hypothesis(
    rank: int, kind: str, place: str, stated: str, explains: str, values: ndarray, owner: str = "",
    owners: int = 1,
) -> Hypothesis:  # fmt: skip
    """A hypothesis; place: with {} for the owner, a body or joint, or several."""
    name, form = (place.replace("{}", owner), place) if owner else (place, "")
    about: dict[str, Any] = {
        "rank": rank,
        "kind": kind,
        "place": name,
        "stated": stated,
        "explains": explains,
    }
    return Hypothesis(Cause(form=form, owners=owners, cost=EVERY * (owners > 1), **about), values)


option, slip = partial(hypothesis, 1, "option"), partial(hypothesis, 2, "slip")
