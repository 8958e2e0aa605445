"""Moved to dynamics."""

from .dynamics import convective_accelerations

__all__ = ["convective_accelerations"]
