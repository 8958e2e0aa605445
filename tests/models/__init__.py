"""Robots in MJCF: files written for this project, files that gymnasium ships, and texts made from a seed."""

from importlib.util import find_spec
from pathlib import Path

from .made import KINDS, chain, random_tree, with_features

__all__ = ["KINDS", "PATHS", "chain", "gymnasium_files", "random_tree", "with_features"]

# the files of this folder by name; `parts` holds what some of them include
PATHS = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.xml"))}


def gymnasium_files() -> list[Path]:
    """The MJCF files in the installed gymnasium, by name; none if it is not installed. Nothing of it is imported."""
    found = find_spec("gymnasium")
    folder = Path(found.origin).parent if found and found.origin else Path("nowhere")
    return sorted(folder.glob("envs/mujoco/assets/*.xml"))
