"""Moved to acting."""

from .acting import limits_in_force

__all__ = ["limits_in_force"]
