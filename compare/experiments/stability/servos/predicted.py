"""Step limits under a robot's own servos at its postures, predicted."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting, limits_in_force
from ....engines.mujoco.names import INTEGRATORS
from ....robots import Robot
from ....truth.driven import Posture
from ....truth.step_limits import LIMIT_UP_TO, Limit, Small

FAR_FROM_POSTURE = 0.1  # rad or m, of a rest from the posture
MOST_RESTS, SAME_REST = 4, 1e-3  # of limits, each at the rest with the one before; steps that are one, relative
STILL_THERE = 1e-6  # rad or m
GIVEN_WAY = 0.01  # rad or m
ASIDE_OF_LIMIT = 1e-2  # of a limit: where a step of MuJoCo is compared
FULL_MODEL = ("full_model_rms_speed", "full_model_warnings", "full_model_resets", "full_model_calm")  # columns


class Prediction(NamedTuple):
    """What is predicted at one posture."""

    at: Posture
    there: dict[tuple[str, str], Posture]  # at rest with the step that is the limit; none where it does not rest
    limits: dict[tuple[str, str], Limit]  # by the base and the integrator

    @property
    def name(self) -> str:
        return self.at.name

    @property
    def base(self) -> str:
        """The base that counts."""
        return self.at.bases[0]

    @property
    def rests(self) -> bool:
        return bool(self.limits)

    @property
    def is_known(self) -> bool:
        """Whether every integrator has a limit, or is known to have none, with the base that counts."""
        kinds = {limit.limit for (base, _), limit in self.limits.items() if base == self.base}
        return bool(kinds) and kinds <= {"finite", "none"}

    @property
    def is_finite(self) -> bool:
        """Whether it has a limit that counts."""
        return any(limit.limit == "finite" for (base, _), limit in self.limits.items() if base == self.base)

    def gives_way(self, base: str, integrator: str) -> bool:
        """Whether soft constraints give way at a limit to another posture: that limit is not observed."""
        apart = self.at.robot.coordinates.difference(self.there[base, integrator].q, self.at.q)
        return bool(np.abs(apart).max() > GIVEN_WAY)

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
    locked = (*(at.base if base == "locked" else ()), *at.aside)
    return Acting(reading.model, at.robot.drive, at.cut, locked, weightless=bool(at.base), limits=at.limits)


def predicted_at(robot: Robot, name: str, reading: Reading) -> Prediction:
    """The limits of every integrator at a posture, with each base; none where it does not rest.

    If they are not known, those without the joints that nothing holds.
    """
    prediction = near_by(robot, name, reading)
    unheld = () if prediction.is_known or not robot.drive.servos else prediction.at.unheld
    without = near_by(robot, name, reading, unheld) if unheld else prediction
    return without if without.is_known else prediction


def near_by(robot: Robot, name: str, reading: Reading, aside: tuple[int, ...] = ()) -> Prediction:
    """The limits with some speeds locked; joint limits are on where without them it rests far beyond them, or not at all."""

    def within(limits: tuple[int, ...]) -> Prediction:
        acting = Acting(reading.model, robot.drive, limits=limits)
        rows = acting.rows if acting.is_coupled else None
        return predicted_of(Posture(robot, name, acting.along, rows, reading.dt, aside))

    free, limits = within(()), limits_in_force(reading.model)
    if not limits or (free.is_known and (free.at.moved < FAR_FROM_POSTURE or not free.at.beyond())):
        return free
    limited = within(limits)
    return limited if limited.is_known else free


def predicted_of(at: Posture) -> Prediction:
    """The limits of all joints that are not aside."""
    if at.rest[1]:
        return Prediction(at, {}, {})
    nothing = Limit("drifts", None, "", None, "")  # free bodies that stand alone, and nothing else
    pairs = {
        (base, name): limit_at(at, base, name) if at.small(base).names else (at, nothing)
        for base in at.bases
        for name in INTEGRATORS
    }
    there, limits = ({pair: value[k] for pair, value in pairs.items()} for k in (0, 1))
    return Prediction(at, there, limits)


def limit_at(at: Posture, base: str, integrator: str) -> tuple[Posture, Limit]:
    """The limit, and the posture at rest with a step so long: where soft constraints are loaded, a longer step softens them."""
    limit = at.small(base).limit(integrator)
    for _ in range(MOST_RESTS):
        if limit.dt is None or not at.small(base).is_coupled or abs(limit.dt / at.dt - 1.0) < SAME_REST:
            break
        there = replace(
            at, dt=limit.dt, integrator="discrete" if integrator == "discrete" else "Euler", begin=tuple(at.q)
        )
        if there.rest[1] or np.abs(at.robot.coordinates.difference(there.q, at.q)).max() < STILL_THERE:
            break
        at, limit = there, there.small(base).limit(integrator)
    return at, limit


def limit_rows(predictions: Sequence[Prediction], dt: float, integrator: str) -> list[dict]:
    """The rows of step_limits.csv before anything is run: one per posture, base and integrator; dt, integrator: the file's."""
    rows = []
    for prediction in predictions:
        for base in prediction.at.bases:
            for name in INTEGRATORS:
                limit = prediction.limits.get((base, name), Limit("not_at_rest", None, "", None, ""))
                stable = prediction.is_stable(base, name, dt) if prediction.rests else None
                rows.append({
                    "posture": prediction.name, "base": base, "integrator": name, "limit": limit.limit,
                    "predicted_dt_s": limit.dt and float(limit.dt), "observed_dt_s": None, "file_dt_s": dt,
                    "file_integrator": integrator, "stable_at_file_dt": stable,
                    "limiting_joint": limit.joint if limit.limit == "finite" else None, "mode_per_s": limit.rate,
                    "mode_kind": limit.kind or None, "step_response_error": None, **dict.fromkeys(FULL_MODEL),
                })  # fmt: skip
    return rows


def radii_apart(prediction: Prediction, reading: Reading) -> dict[tuple[str, str], float]:
    """The difference of the spectral radius of a step near each finite limit, TMT to MuJoCo, by base and integrator.

    RK4 has no derivative in MuJoCo; soft constraints rest elsewhere with each step: these are compared by runs alone.
    """
    radii = {}
    for (base, integrator), limit in prediction.limits.items():
        if limit.limit == "finite" and integrator != "RK4" and not prediction.gives_way(base, integrator):
            at = prediction.there[base, integrator]
            small = at.small(base)
            if not small.is_coupled:
                acting = acting_at(reading, at, base)
                radii[base, integrator] = radius_apart(acting, at, small, integrator, limit.dt)
    return radii


def radius_apart(acting: Acting, at: Posture, small: Small, integrator: str, dt: float) -> float:
    """The difference of the spectral radius of a step from MuJoCo's, just below and above a limit: the larger one.

    What is free to move, or held by a rotor, stays as it is: that has the radius 1. Of activations only filters can grow.
    """
    nv = acting.model.nv
    kept = [k for k in range(2 * nv) if k % nv not in (*at.lone, *at.aside)] + [2 * nv + k for k in acting.filters]
    least = 1.0 if at.base else 0.0
    apart = []
    for step in (dt * (1.0 - ASIDE_OF_LIMIT), dt * (1.0 + ASIDE_OF_LIMIT)):
        A = acting.transition(at.q, at.u, step, integrator)[np.ix_(kept, kept)]
        theirs = float(np.abs(np.linalg.eigvals(A)).max())
        decays = [np.exp(-step / tau) if is_exact else abs(1.0 - step / tau) for _, tau, is_exact in small.poles]
        own = max(small.growth(integrator, step) if small.names else 0.0, *decays, 0.0)
        apart.append(abs(max(theirs, least) - max(own, least)))
    return max(apart)
