"""MuJoCo: the only folder that imports it."""

from .engine import Mujoco
from .reading import Reading, engine, has_hinges, parse, read, tree_with_sites
from .source import ModelError, Source

__all__ = (
    "ModelError", "Mujoco", "Reading", "Source", "engine", "has_hinges", "parse", "read", "tree_with_sites",
)  # fmt: skip
