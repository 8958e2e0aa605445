"""Moved to names."""

from .names import INTEGRATORS, integrator_by_name

__all__ = ["INTEGRATORS", "integrator_by_name"]
