"""Small deviations where equalities, or limits at which joints rest, hold joints together: MuJoCo's soft constraints."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..robots.actuators import Rows
from .deviations import Deviations
from .step_limits import LIMIT_UP_TO, Small, upwards

NEARLY = 0.3  # of the limit of rigid constraints: from there on the limit of soft ones is sought step by step
COARSELY = 1e-6  # of a limit
DEPENDENT = 1e-8  # of the largest singular value of the Jacobian of constraints: less is none


@dataclass(frozen=True)
class Rigid(Small):
    """Small deviations that meet constraints, in coordinates for these, as if the constraints were rigid."""

    soft: "Coupled | None" = None

    def braking(self, integrator):
        N = self.soft.meeting
        return N.T @ self.soft.braking(integrator) @ N


@dataclass(frozen=True)
class Coupled(Small):
    """Small deviations where constraints hold joints together; K has what these do by turning with the posture.

    What grows or drifts by itself and which modes there are is said of rigid constraints, in coordinates that meet them. A step
    is MuJoCo's: it finds the force of the soft constraints without what an integrator has implicit (discrete: with it), so that
    its limit is not that of rigid ones. couple: the Rows at a step size and an integrator, of all these speeds.
    """

    couple: Callable[[float, str], Rows] | None = None
    is_coupled = True
    refined = COARSELY

    @cached_property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m)."""
        jacobian = self.couple(1e-3, "Euler").jacobian
        _, sizes, directions = np.linalg.svd(jacobian)
        return directions[int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum()) :].T

    @cached_property
    def rigid(self) -> "Rigid":
        """The same in these coordinates: N' M N y'' + N' D N y' + N' K N y = 0."""
        N = self.meeting
        square = {name: N.T @ getattr(self, name) @ N for name in ("M", "K", "D", "springs")}
        names, base = tuple(map(str, range(N.shape[1]))), tuple(np.flatnonzero(N[list(self.base)].any(axis=0)).tolist())
        return Rigid(**of_small(self) | square | {"names": names, "base": base}, soft=self)

    def of_all(self, moves: np.ndarray) -> np.ndarray:
        """Movements of `rigid` in the units of its M as those of all speeds in the units of M."""
        return self.root.T @ self.meeting @ self.rigid.unrooted.T @ moves

    @cached_property
    def modes(self):
        values, moves = self.rigid.modes
        return values, self.of_all(moves)

    @cached_property
    def growing(self):
        found = self.rigid.growing if self.meeting.size else None
        return found and (found[0], self.of_all(found[1]))

    @cached_property
    def drifts(self):
        return bool(self.meeting.size) and self.rigid.drifts

    def steps_tried(self, integrator):
        """A few up to well below the limit of rigid constraints, then as of others: each takes a forward pass and eigenvalues."""
        near = NEARLY * (self.rigid.limit(integrator).dt or LIMIT_UP_TO)
        return np.concatenate([np.geomspace(near / 100.0, near, 5)[:-1], upwards(near)])

    def has_closed_form(self, integrator):
        return False

    def constrained(self, integrator, dt, stiff, damped, matrix):
        rows = self.couple(dt, integrator)
        J, metric = rows.jacobian @ self.unrooted.T, matrix if integrator == "discrete" else np.eye(len(self.M))
        eased = np.linalg.solve(metric, J.T).T
        pull = np.linalg.solve(eased @ J.T + np.diag(rows.softness), J).T
        stiff = stiff - pull @ (eased @ stiff - rows.stiffness[:, None] * J)
        damped = damped - pull @ (eased @ damped - rows.damping[:, None] * J)
        return stiff, damped, np.eye(len(self.M)) - pull @ eased


def of_small(small: Small) -> dict:
    """What small deviations are made of, by name."""
    return {one.name: getattr(small, one.name) for one in fields(Deviations)}
