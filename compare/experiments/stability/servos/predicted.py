"""Step limits under a robot's own servos at its postures, predicted."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting
from ....engines.mujoco.names import INTEGRATORS
from ....robots import Robot
from ....truth.driven import Posture
from ....truth.step_limits import LIMIT_UP_TO, Limit
from ..tables import StepLimitRow

MOST_RESTS, SAME_REST = (
    4,
    1e-3,
)  # of limits, each at the rest with the one before; steps that are one, relative
STILL_THERE, GIVEN_WAY = (
    1e-6,
    0.01,
)  # rad or m: by less nothing moves; by more the limit is that of another posture
ASIDE_OF_LIMIT = 1e-2  # of a limit: where a step of MuJoCo is compared
KNOWN, COUPLED = (
    ("finite", "none"),
    "coupled",
)  # kinds of limits; of discrete with a free base and soft constraints
OUT_OF_RANGE = (
    1e-3  # rad or m: a rest farther beyond the range of a joint is one on its limit, which is off here
)
ADHESION = "a transmission of type body"  # it acts in contacts alone


class Prediction(NamedTuple):
    at: Posture
    why: str  # there are no limits, if there are none
    there: dict[
        str, Posture
    ]  # by integrator: at rest with the step that is the limit; none where it does not rest
    limits: dict[str, Limit]  # by integrator

    @property
    def known(self) -> list[str]:
        """The integrators that have a limit, or are known to have none."""
        return [name for name in INTEGRATORS if name in self.limits and self.limits[name].limit in KNOWN]

    def gives_way(self, integrator: str) -> bool:
        """Whether soft constraints give way at a limit to another posture: that limit is not observed."""
        return self.there[integrator].away(self.at.q) > GIVEN_WAY

    def longest(self, integrator: str) -> float:
        """The longest step that is stable or was tried, s."""
        return self.limits[integrator].dt or LIMIT_UP_TO

    def is_stable(self, integrator: str, dt: float) -> bool | None:
        """Whether a step is within the limit; None: there is none, or no servo whose step it is."""
        if integrator not in self.known or not self.at.robot.drive.feeds_back:
            return None
        return bool(dt <= self.longest(integrator))


def acting_at(reading: Reading, at: Posture) -> Acting:
    """MuJoCo with the robot's drive and all else off, at a posture."""
    return Acting(reading.model, at.robot.drive, at.cut, weightless=bool(at.base))


def predicted_at(robot: Robot, name: str, reading: Reading) -> Prediction:
    """The limits of every integrator at a posture; none where it does not rest."""
    acting = Acting(reading.model, robot.drive)
    at = Posture(robot, name, acting.along, acting.rows if acting.is_coupled else None, reading.dt)
    why = why_unknown(at)
    found = {} if why else {name: limit_at(at, name) for name in INTEGRATORS if name != "implicit"}
    if found:  # at rest the bias has no derivative by the speeds
        found["implicit"] = found["implicitfast"]
    return Prediction(at, why, *({name: pair[k] for name, pair in found.items()} for k in (0, 1)))


def unmodelled(robot: Robot) -> dict[str, str]:
    """What may brake, push or pull a robot in the air and has no law here, by name, and what it is."""
    fluid = {
        name: "fluid" for feature in robot.features if feature.feature == "fluid" for name in feature.names
    }
    return {name: reason for name, reason in robot.drive.refused.items() if reason != ADHESION} | fluid


def why_unknown(at: Posture) -> str:
    """Why a posture has no limits, or "": a kind of the column `limit`."""
    if unmodelled(at.robot):
        return "not_judged"
    if at.is_tied:
        return "tied"
    if at.rest[1]:
        return "not_at_rest"
    return "out_of_range" if at.beyond > OUT_OF_RANGE else ""


def limit_at(at: Posture, integrator: str) -> tuple[Posture, Limit]:
    """The limit, and the posture at rest with a step so long: where soft constraints are loaded, a longer step softens them."""
    if not at.small.names:
        return at, Limit("drifts")
    if (
        integrator == "discrete" and at.small.couple and at.base
    ):  # it lets a free base and soft constraints act at once
        return at, Limit(COUPLED)
    limit = at.small.limit(integrator)
    for _ in range(MOST_RESTS):
        if limit.dt is None or not at.small.couple or abs(limit.dt / at.dt - 1.0) < SAME_REST:
            break
        solved = "discrete" if integrator == "discrete" else "Euler"
        there = replace(at, dt=limit.dt, integrator=solved, begin=tuple(at.q))
        if there.rest[1] or there.away(at.q) < STILL_THERE:
            break
        at, limit = there, there.small.limit(integrator)
    return at, limit


def limit_rows(predictions: Sequence[Prediction], dt: float, integrator: str) -> list[StepLimitRow]:
    """The rows of step_limits.csv before anything is run: one per posture and integrator; dt, integrator: the file's."""
    rows = []
    for prediction in predictions:
        for name in INTEGRATORS:
            limit = prediction.limits.get(name, Limit(prediction.why))
            rows.append(StepLimitRow(
                posture=prediction.at.name, base=prediction.at.base_kind, integrator=name, limit=limit.limit,
                predicted_dt=limit.dt and float(limit.dt), file_dt=dt, file_integrator=integrator,
                stable_at_file_dt=prediction.is_stable(name, dt),
                limiting_joint=limit.joint if limit.limit == "finite" else None,
                mode=limit.rate, mode_kind=limit.kind or None,
            ))  # fmt: skip
    return rows


def radii_apart(prediction: Prediction, reading: Reading) -> dict[str, float]:
    """The difference of the spectral radius of a step near each finite limit, TMT to MuJoCo, by integrator.

    RK4 has no derivative in MuJoCo; soft constraints rest elsewhere with each step: these are compared by runs alone.
    """
    finite = [name for name, limit in prediction.limits.items() if limit.dt and name != "RK4"]
    if not finite or prediction.at.small.couple:
        return {}
    acting = acting_at(reading, prediction.at)
    return {name: radius_apart(acting, prediction.at, name, prediction.limits[name].dt) for name in finite}


def radius_apart(acting: Acting, at: Posture, integrator: str, dt: float) -> float:
    """The difference of the spectral radius of a step from MuJoCo's, just below and above a limit: the larger one.

    What is free to move stays as it is: that has the radius 1. Of activations only filters can grow.
    """
    nv, small = acting.model.nv, at.small
    kept = [k for k in range(2 * nv) if k % nv not in at.lone] + [2 * nv + k for k in acting.filters]
    least, apart = 1.0 if at.base else 0.0, []
    for step in (dt * (1.0 - ASIDE_OF_LIMIT), dt * (1.0 + ASIDE_OF_LIMIT)):
        A = acting.transition(at.q, at.u, step, integrator)[np.ix_(kept, kept)]
        theirs = float(np.abs(np.linalg.eigvals(A)).max())
        decays = [
            np.exp(-step / tau) if is_exact else abs(1.0 - step / tau) for _, tau, is_exact in small.poles
        ]
        own = max(small.growth(integrator, step) if small.names else 0.0, *decays, 0.0)
        apart.append(abs(max(theirs, least) - max(own, least)))
    return max(apart)
