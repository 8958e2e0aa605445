"""The pictures of a motion: what is drawn at which time, in the page and in the GIF."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .finding import Finding

FEW_STICKS = 6  # up to which they are drawn wide


class Pictures(NamedTuple):
    """The stick figures of both engines in one scene, at equal times."""

    scene: str
    run: str  # method and step
    t: np.ndarray  # (pictures,) s
    points: dict[str, np.ndarray]  # by engine (pictures, points, 2): right, up, m; NaN once it diverged
    links: list[tuple[int, int]]  # pairs of points that a stick joins
    apart: np.ndarray  # (pictures,): the largest difference of a joint; NaN if an engine has diverged
    unit: str  # of that
    left: dict[str, float | None]  # by engine: when a held robot left its posture, s
    seen: Finding  # departures, the largest difference, divergence
    fixed: bool  # whether the first point does not move, as the first joint only turns

    @property
    def few_sticks(self) -> bool:
        return len(self.links) <= FEW_STICKS

    def slower(self, seconds: float) -> float:
        """The factor by which the motion is slower, if each picture is shown for this time; 1 if hardly."""
        factor = seconds / float(self.t[1] - self.t[0])
        return 1.0 if 0.9 < factor < 1.1 else factor

    def placed(self, room: Sequence[float], middle: Sequence[float]) -> list[np.ndarray]:
        """The points of each engine in a drawing whose y goes down: in a room (2,), about a middle (2,)."""
        points = np.concatenate([path.reshape(-1, 2) for path in self.points.values()])
        points = points[np.isfinite(points).all(axis=1)]
        low, high = points.min(axis=0), points.max(axis=0)
        scale = (np.array(room) / np.maximum(high - low, 1e-3)).min()
        return [middle + scale * (path - (low + high) / 2) * [1.0, -1.0] for path in self.points.values()]
