"""Step limits under a robot's own servos at its postures, predicted."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....engines.mujoco import Reading
from ....engines.mujoco.acting import Acting
from ....engines.mujoco.flags import INTEGRATORS
from ....engines.mujoco.holding import limits_in_force
from ....robots import Robot
from ....truth.driven import Posture
from ....truth.step_limits import LIMIT_UP_TO, Limit, Small

FAR_FROM_POSTURE = 0.1  # rad or m, of a rest from the posture
MOST_RESTS, SAME_REST = 4, 1e-3  # of limits, each at the rest with the one before; steps that are one, relative
STILL_THERE = 1e-6  # rad or m
GIVEN_WAY = 0.01  # rad or m
ASIDE_OF_LIMIT = 1e-2  # of a limit: where a step of MuJoCo is compared
FULL_MODEL = ("full_model_rms_speed", "full_model_warnings", "full_model_resets", "full_model_calm")  # columns


class Predicted(NamedTuple):
    """What is predicted at one posture."""

    at: Posture
    there: dict[tuple[str, str], Posture]  # at rest with the step that is the limit; none where it does not rest
    limits: dict[tuple[str, str], Limit]  # by the base and the integrator

    @property
    def name(self) -> str:
        return self.at.name

    @property
    def rests(self) -> bool:
        return bool(self.limits)

    @property
    def is_known(self) -> bool:
        """Whether every integrator has a limit, or is known to have none, with the base that counts."""
        kinds = {limit.limit for (base, _), limit in self.limits.items() if base == self.at.bases[0]}
        return bool(kinds) and kinds <= {"finite", "none"}

    @property
    def is_finite(self) -> bool:
        """Whether it has a limit that counts."""
        return any(limit.limit == "finite" for (base, _), limit in self.limits.items() if base == self.at.bases[0])

    def gives_way(self, base: str, integrator: str) -> bool:
        """Whether soft constraints give way so far at a limit that the posture is another one: runs are not asked for it."""
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


def predicted_at(robot: Robot, name: str, reading: Reading) -> Predicted:
    """The limits of every integrator at a posture, with each base; none where it does not rest.

    Where that tells nothing, without the joints that nothing holds.
    """
    found = near_by(robot, name, reading)
    unheld = () if found.is_known or not robot.drive.servos else found.at.unheld
    without = near_by(robot, name, reading, unheld) if unheld else found
    return without if without.is_known else found


def near_by(robot: Robot, name: str, reading: Reading, aside: tuple[int, ...] = ()) -> Predicted:
    """The same with some speeds locked; with the limits of joints where it rests far away beyond them, or not at all, without."""

    def within(limits: tuple[int, ...]) -> Predicted:
        acting = Acting(reading.model, robot.drive, limits=limits)
        rows = acting.rows if acting.is_coupled else None
        return predicted_of(Posture(robot, name, acting.along, rows, reading.dt, aside))

    found, limits = within(()), limits_in_force(reading.model)
    if not limits or (found.is_known and (found.at.moved < FAR_FROM_POSTURE or not found.at.beyond())):
        return found
    limited = within(limits)
    return limited if limited.is_known else found


def predicted_of(at: Posture) -> Predicted:
    """The same of all joints that are not aside."""
    if at.rest[1]:
        return Predicted(at, {}, {})
    nothing = Limit("drifts", None, "", None, "")  # free bodies that stand alone, and nothing else
    found = {
        (base, name): limit_at(at, base, name) if at.small(base).names else (at, nothing)
        for base in at.bases
        for name in INTEGRATORS
    }
    limits = {pair: limit for pair, (_, limit) in found.items()}
    return Predicted(at, {pair: there for pair, (there, _) in found.items()}, limits)


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


def limit_rows(found: Sequence[Predicted], dt: float, integrator: str) -> list[dict]:
    """The rows of step_limits.csv before anything is run: one per posture, base and integrator; dt, integrator: the file's."""
    rows = []
    for one in found:
        for base in one.at.bases:
            for name in INTEGRATORS:
                limit = one.limits.get((base, name), Limit("not_at_rest", None, "", None, ""))
                rows.append({
                    "posture": one.name, "base": base, "integrator": name, "limit": limit.limit,
                    "predicted_dt_s": limit.dt and float(limit.dt), "observed_dt_s": None, "file_dt_s": dt,
                    "file_integrator": integrator, "stable_at_file_dt": one.is_stable(base, name, dt) if one.rests else None,
                    "limiting_joint": limit.joint if limit.limit == "finite" else None, "mode_per_s": limit.rate,
                    "mode_kind": limit.kind or None, "step_response_error": None, **dict.fromkeys(FULL_MODEL),
                })  # fmt: skip
    return rows


def radii_apart(one: Predicted, reading: Reading) -> dict[tuple[str, str], float]:
    """The difference of the spectral radius of a step near each finite limit, TMT to MuJoCo, by base and integrator.

    RK4 has no derivative in MuJoCo; soft constraints rest elsewhere with each step: these are compared by runs alone.
    """
    radii = {}
    for (base, integrator), limit in one.limits.items():
        if limit.limit == "finite" and integrator != "RK4" and not one.gives_way(base, integrator):
            at = one.there[base, integrator]
            small = at.small(base)
            if not small.is_coupled:
                acting = acting_at(reading, at, base)
                radii[base, integrator] = radius_apart(acting, at, small, integrator, limit.dt)
    return radii


def radius_apart(acting: Acting, at: Posture, small: Small, integrator: str, dt: float) -> float:
    """The spectral radius of a step beside that of MuJoCo's own derivative, just below and above a limit: the larger difference.

    What is free to move, or held by a rotor, stays as it is: that has the radius 1. Of activations only filters can grow.
    """
    nv = acting.model.nv
    kept = [k for k in range(2 * nv) if k % nv not in (*at.lone, *at.aside)] + [2 * nv + k for k in acting.filters]
    least = 1.0 if at.base else 0.0
    found = []
    for step in (dt * (1.0 - ASIDE_OF_LIMIT), dt * (1.0 + ASIDE_OF_LIMIT)):
        A = acting.transition(at.q, at.u, step, integrator)[np.ix_(kept, kept)]
        theirs = float(np.abs(np.linalg.eigvals(A)).max())
        decays = [np.exp(-step / tau) if is_exact else abs(1.0 - step / tau) for _, tau, is_exact in small.poles]
        own = max(small.growth(integrator, step) if small.names else 0.0, *decays, 0.0)
        found.append(abs(max(theirs, least) - max(own, least)))
    return max(found)
