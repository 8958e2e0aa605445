"""Moved to linear."""

from .linear import whole_run

__all__ = ["whole_run"]
