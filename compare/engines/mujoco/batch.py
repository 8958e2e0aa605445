"""Moved to calls."""

from .calls import BatchedCalls

__all__ = ["BatchedCalls"]
