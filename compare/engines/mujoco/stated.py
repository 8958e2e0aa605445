"""Moved to parameters."""

from .parameters import Stated, stated_numbers

__all__ = ["Stated", "stated_numbers"]
