"""MuJoCo: the only folder that imports it."""

from .. import EngineRecord
from .engine import Mujoco
from .reading import Reading, engine, has_hinges, parse, read, tree_with_sites
from .source import ModelError, Source

ENGINE = EngineRecord(
    order=10, label="MuJoCo", colour="#E69F00", marker="s", in_quick_runs=True, from_file=True
)
__all__ = (
    "ModelError", "Mujoco", "Reading", "Source", "engine", "has_hinges", "parse", "read", "tree_with_sites",
)  # fmt: skip
