"""MuJoCo: the only folder that imports it."""

from .engine import Mujoco
from .file import load, parse
from .lock import ModelError
from .reading import Reading, engine, read

__all__ = ["ModelError", "Mujoco", "Reading", "engine", "load", "parse", "read"]
