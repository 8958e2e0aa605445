"""The torque that holds a robot against gravity."""

import numpy as np

from tmt import literal

from ..core.check import Result
from ..judge.agree import agree
from ..judge.entries import unit
from . import Experiment
from .quantities import compared, figures, headline
from .setup import Setup

__all__ = ["EXPERIMENT", "figures", "headline", "rows"]
EXPERIMENT = Experiment(order=50, asks_of_own=("gravity", "bias"), options=("--joints",), diagnosed=True)


def rows(setup: Setup) -> Result:
    """Torques at named postures and random states; those of gravity and springs together; a user's own gravity and bias."""
    tree, (ours, theirs) = setup.robot.tree, setup.compared().values()
    result, comparisons = compared(setup, "gravity", "holding torque")
    units = unit(tree, "N m", "N")
    for comparison in comparisons:
        sample, scale, (held, *_) = comparison.sample, comparison.scale, comparison.values("holding torque")
        if "gravity" in setup.robot.own:
            still = ours.bias(sample.q, np.zeros(tree.coordinates.nv))
            agree(result, sample, "yours: gravity - bias at rest", units, held, still, scale.weight)
        if tree.has_springs:
            held, size = held + literal.spring_torque(sample.q, tree), scale.weight + scale.springs
            engine_held = theirs.inverse(sample.q, 0.0, 0.0)
            agree(result, sample, "holding torque, springs too", units, held, engine_held, size)
    return result
