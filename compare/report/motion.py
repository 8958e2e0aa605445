"""The motion itself, in the page."""

from collections.abc import Sequence

from .verdict import Section


def motion_in_html(sections: Sequence[Section], robot: object) -> str:
    """Nothing to show yet."""
    return ""
