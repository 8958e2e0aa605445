"""Durations in words."""


def in_words(seconds: float) -> str:
    """A duration as rough as an estimate is."""
    if seconds < 10.0:
        return f"{max(round(seconds), 1)} s"
    return f"{5 * round(seconds / 5)} s" if seconds < 117.5 else f"{round(seconds / 60)} min"
