"""MuJoCo: the only folder that imports it."""

from .engine import Mujoco
from .file import load, parse
from .lock import ModelError

__all__ = ["ModelError", "Mujoco", "load", "parse"]
