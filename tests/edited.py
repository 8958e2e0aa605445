"""The arm with an edited file: what experiments are given to see whether they notice."""

from compare.engines.mujoco import Mujoco, parse
from compare.experiment import Setup, engines
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")
MOON = XML.replace("0 0 -9.81", "0 0 -1.62")


def setup_of(model: str | Mujoco = XML, make=Setup.small, **fields) -> Setup:
    """What an experiment needs of the arm, MuJoCo with this MJCF text or engine."""
    return make(ARM, engines(parse(model, ARM.tree) if isinstance(model, str) else model), **fields)
