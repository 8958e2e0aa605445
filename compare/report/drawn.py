"""A motion as it is drawn: stick figures of both engines."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.finding import Finding


class Drawn(NamedTuple):
    scene: str
    run: str  # method and step
    t: np.ndarray  # (frames,) s
    # of each engine (frames, points, 2): to the right and up, m; NaN from where it has diverged on
    points: dict[str, np.ndarray]
    links: list[tuple[int, int]]  # pairs of points that a stick joins
    # (frames,): the largest difference of the engines in any joint; NaN if one has diverged
    apart: np.ndarray
    unit: str  # of that
    ended: dict[str, float | None]  # of each engine: time of divergence, s
    left: dict[str, float | None]  # of each engine: time when a held robot left its posture, s
    seen: Finding  # departures, the largest difference, divergence
    fixed: bool  # whether the first point does not move, as the first joint only turns

    def placed(self, room: Sequence[float], middle: Sequence[float]) -> list[np.ndarray]:
        """The points of each engine in a drawing, whose y goes down: in a room about a middle, (2,) each."""
        points = np.concatenate([path.reshape(-1, 2) for path in self.points.values()])
        points = points[np.isfinite(points).all(axis=1)]
        low, high = points.min(axis=0), points.max(axis=0)
        scale = (np.array(room) / np.maximum(high - low, 1e-3)).min()
        return [middle + scale * (path - (low + high) / 2) * [1.0, -1.0] for path in self.points.values()]
