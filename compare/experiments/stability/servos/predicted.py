"""Step limits under a robot's own servos at its postures, predicted, and the same by the eigenvalues of a step."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting
from ....engines.mujoco.flags import INTEGRATORS
from ....robots import Robot
from ....truth.driven import Posture
from ....truth.linear import NEUTRAL
from ....truth.step_limits import LIMIT_UP_TO, Limit, Small

NEAR_LIMIT = 1e-3  # of a limit: where the eigenvalues of a step are asked whether it is one
ASIDE_OF_LIMIT = 1e-2  # of a limit: where a step of MuJoCo is asked


class Predicted(NamedTuple):
    """What is predicted at one posture."""

    at: Posture
    small: dict[str, Small]  # by the base; none where it does not rest
    limits: dict[tuple[str, str], Limit]  # by the base and the integrator

    @property
    def name(self) -> str:
        return self.at.name

    @property
    def rests(self) -> bool:
        return bool(self.small)

    @property
    def is_finite(self) -> bool:
        """Whether it has a limit that counts."""
        return any(limit.limit == "finite" for (base, _), limit in self.limits.items() if base == self.at.bases[0])

    def is_stable(self, base: str, integrator: str, dt: float) -> bool | None:
        """Whether a step is within the limit; None: there is none, or no servo whose step it is."""
        limit = self.limits[base, integrator]
        if limit.limit not in ("finite", "none") or not self.at.robot.drive.feeds_back:
            return None
        return bool(dt <= (limit.dt or LIMIT_UP_TO))

    @property
    def pairs(self) -> Iterator[tuple[str, str]]:
        """Each base and integrator whose step has a limit, or is known to have none."""
        return (pair for pair, limit in self.limits.items() if limit.limit in ("finite", "none"))


def acting_at(reading: Reading, at: Posture, base: str) -> Acting:
    """MuJoCo with the robot's drive and all else off, at a posture, with a base of BASES."""
    locked = at.base if base == "locked" else ()
    return Acting(reading.model, at.robot.drive, at.cut, locked=locked, weightless=bool(at.base))


def predicted_at(robot: Robot, name: str, reading: Reading) -> Predicted:
    """The limits of every integrator at a posture, with each base; none where it does not rest."""
    at = Posture(robot, name, Acting(reading.model, robot.drive).along)
    if at.rest[1]:
        return Predicted(at, {}, {})
    small = {base: at.small(base) for base in at.bases}
    nothing = Limit("drifts", None, "", None, "")  # free bodies that stand alone, and nothing else
    return Predicted(
        at,
        small,
        {
            (base, name): small[base].limit(name) if small[base].names else nothing
            for base in small
            for name in INTEGRATORS
        },
    )


def limit_rows(found: Sequence[Predicted], dt: float, integrator: str) -> list[dict]:
    """The rows of step_limits.csv before anything is run: one per posture, base and integrator; dt, integrator: the file's."""
    rows = []
    for one in found:
        for base in one.at.bases:
            for name in INTEGRATORS:
                limit = one.limits.get((base, name), Limit("not_at_rest", None, "", None, ""))
                rows.append(
                    {
                        "posture": one.name,
                        "base": base,
                        "integrator": name,
                        "limit": limit.limit,
                        "predicted_dt_s": limit.dt and float(limit.dt),
                        "observed_dt_s": None,
                        "file_dt_s": dt,
                        "file_integrator": integrator,
                        "stable_at_file_dt": one.is_stable(base, name, dt) if one.rests else None,
                        "limiting_joint": limit.joint if limit.limit == "finite" else None,
                        "mode_per_s": limit.rate,
                        "mode_kind": limit.kind or None,
                        "step_response_error": None,
                    }
                )
    return rows


class Steps(NamedTuple):
    """What the eigenvalues of a step say of one limit."""

    base: str
    integrator: str
    apart: (
        float | None
    )  # of the limit: how far the one by the closed form is from that by eigenvalues; None: no closed form
    beside: (
        float | None
    )  # the largest difference of the spectral radius from that of MuJoCo's own derivative; None: RK4


def steps_at(one: Predicted, reading: Reading) -> list[Steps]:
    """Each finite limit of a posture beside the eigenvalues of steps, our own and MuJoCo's."""
    rows = []
    for (base, integrator), limit in one.limits.items():
        if limit.limit == "finite":
            small, acting = one.small[base], acting_at(reading, one.at, base)
            beside = None if integrator == "RK4" else radius_apart(acting, one.at, small, integrator, limit.dt)
            rows.append(Steps(base, integrator, forms_apart(small, integrator, limit), beside))
    return rows


def forms_apart(small: Small, integrator: str, limit: Limit) -> float | None:
    """How far a limit by the closed form is from the step at which the spectral radius passes 1, of itself."""
    if not small.has_closed_form(integrator) or limit.shape is None:
        return None

    def excess(dt):
        return small.growth(integrator, dt) - 1.0 - max(NEUTRAL, 2.0 * dt * small.neutral)

    low, high = limit.dt * (1.0 - NEAR_LIMIT), limit.dt * (1.0 + NEAR_LIMIT)
    if excess(low) <= 0.0 < excess(high):
        by_radius = brentq(excess, low, high, xtol=1e-9 * limit.dt)
    else:
        by_radius = small.scanned(integrator) or np.inf
    return float(abs(limit.dt / by_radius - 1.0))


def radius_apart(acting: Acting, at: Posture, small: Small, integrator: str, dt: float) -> float:
    """The spectral radius of a step beside that of MuJoCo's own derivative, just below and above a limit: the larger difference.

    What is free to move, or held by a rotor, stays as it is: that has the radius 1. Of activations only filters can grow.
    """
    nv = acting.model.nv
    kept = [k for k in range(2 * nv) if k % nv not in at.lone] + [2 * nv + k for k in acting.filters]
    least = 1.0 if at.base else 0.0
    found = []
    for step in (dt * (1.0 - ASIDE_OF_LIMIT), dt * (1.0 + ASIDE_OF_LIMIT)):
        A = acting.transition(at.q, at.u, step, integrator)[np.ix_(kept, kept)]
        theirs = float(np.abs(np.linalg.eigvals(A)).max())
        decays = [np.exp(-step / tau) if is_exact else abs(1.0 - step / tau) for _, tau, is_exact in small.poles]
        own = max(small.growth(integrator, step) if small.names else 0.0, *decays, 0.0)
        found.append(abs(max(theirs, least) - max(own, least)))
    return max(found)
