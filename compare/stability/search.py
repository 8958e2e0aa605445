"""The largest number that holds: a step, a period, the strength of a change."""

from collections.abc import Callable

RATIO = 1.5  # fold, from one tried number to the next


def largest(
    holds: Callable[[float], bool], first: float, least: float, most: float, within: float
) -> tuple[float | None, float | None]:
    """Return the largest number that holds and the smallest that fails, a factor of at most `within` apart.

    From `first` upwards by factors of RATIO to what fails, or downwards to what holds, then by bisection of
    the logarithm.

    Parameters
    ----------
    holds : callable
        Whether a number, above 0, holds.
    first, least, most : float
        Where the search begins, and the ends of what is tried; first <= most, and it may be below `least`.
    within : float
        A factor above 1.

    Returns
    -------
    (low, high)
        low is None where none holds down to `least`, high is None where `most` holds.
    """
    low, high = None, None
    number = first
    if holds(first):
        low = first
        while high is None and low < most:
            number = min(low * RATIO, most)
            low, high = (number, None) if holds(number) else (low, number)
    else:
        high = first
        while low is None and high > least:
            number = max(high / RATIO, least)
            low, high = (number, high) if holds(number) else (None, number)
    while low is not None and high is not None and high > low * within:
        number = (low * high) ** 0.5
        low, high = (number, high) if holds(number) else (low, number)
    return low, high
