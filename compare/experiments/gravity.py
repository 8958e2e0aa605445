"""The torque that holds a robot against gravity."""

import numpy as np

from tmt import literal

from ..core.check import Result
from ..judge.entries import unit
from . import Experiment
from .quantities import compared, headline
from .setup import Setup

__all__ = ["EXPERIMENT", "headline", "rows"]
EXPERIMENT = Experiment(order=50, asks_of_own=("gravity", "bias"))


def rows(setup: Setup) -> Result:
    """Holding torques, those of gravity and springs together, and a user's own gravity beside the bias."""
    tree, units = setup.robot.tree, unit(setup.robot.tree, "N m", "N")
    result, comparisons = compared(setup, "gravity", "holding torque")
    for comparison in comparisons:
        engine, mujoco, *_ = comparison.engines
        sample, scale, (held, *_) = comparison.sample, comparison.scale, comparison.values("holding torque")
        if {"gravity", "bias"} <= {*setup.robot.own}:
            still = engine.bias(sample.q, np.zeros(tree.coordinates.nv))
            comparison.agree("yours: gravity - bias at rest", units, held, still, scale.weight)
        if tree.has_springs:
            held, size = held + literal.spring_torque(tree, sample.q), scale.weight + scale.springs
            mujoco_held = mujoco.inverse(sample.q, 0.0, 0.0)
            comparison.agree("holding torque, springs too", units, held, mujoco_held, size)
    return result
