"""MuJoCo: the only folder that imports it."""

from .engine import Mujoco
from .file import has_hinges, load, parse
from .lock import ModelError
from .reading import Reading, engine, read

__all__ = ["ModelError", "Mujoco", "Reading", "engine", "has_hinges", "load", "parse", "read"]
