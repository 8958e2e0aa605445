"""Where a model rests at a step and an integrator, with everything on that its file has on.

A rest is a state that a step leaves as it is apart from a creep: v+ = v with the least v, act+ = act. Dry friction and sticking
contacts creep in MuJoCo: their force is proportional to the speed. The rest depends on the step, as MuJoCo softens contacts
whose time constant is below two steps (refsafe), and on the integrator.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import mujoco
import numpy as np

from ..engines.mujoco.step import RELAXING, Step

AT_REST = 1e-5  # rad/s2 or m/s2: the acceleration that is sought
SETTLED, NEAR_REST = 1e-3, 0.02  # rad/s2 or m/s2: the one with which the search ends, and that counts as rest
TRIES = 15  # of Newton's method
SHARES = 1.0, 0.5, 0.25, 0.1, 0.03  # of its step: the parts that are tried
REACH = 0.05  # rad or m: its longest step
UNHELD = 1e-6  # of the largest slope of a force: none
# of the largest singular value: softer directions move only if the stiffer do not help
DEPENDENT = 1e-4, 1e-6, 1e-9
RELAXED_STEPS = 1e-3, 5e-4  # s, the longest step of a relaxed run, and of a file with a shorter one
RELAXED = (4.0, 10.0), (3.0, 1.0), (2.0, 0.0)  # s, 1/s: how long its parts last, how fast its speeds decay
RELAXED_STILL = 1e-6  # rad/s or m/s
WILD = 100.0  # rad/s or m/s: a run that is faster has diverged
LEFT_ALONE, MOST_ALONE = 1.0, 4000  # s, and steps at most, of a run that is left alone
HALVED_STEPS = 500  # of a run whose speeds are halved after each step


@dataclass(frozen=True)
class Rest:
    """A state near rest. left: the largest acceleration there, rad/s2 or m/s2; A: the derivative of the step, (n, n)."""

    step: Step
    state: np.ndarray
    left: float
    A: np.ndarray

    @classmethod
    def at(cls, step: Step, state: np.ndarray) -> "Rest":
        """A state as it is."""
        return cls(step, state, left_at(step, state), step.derivative(state))

    @property
    def is_found(self) -> bool:
        return self.left <= NEAR_REST

    @property
    def speeds(self) -> np.ndarray:
        """Of the creep, (nv,)."""
        self.step.put(self.state)
        return self.step.data.qvel.copy()

    @property
    def is_held(self) -> np.ndarray:
        """At which positions the forces depend on the movement, (nv,): not a wheel, or what slides along a floor."""
        nv = self.step.model.nv
        slope = np.abs(self.A - np.eye(self.step.size))[nv : 2 * nv, :nv].max(axis=0, initial=0.0)
        return slope > UNHELD * slope.max(initial=0.0)

    @property
    def accelerations(self) -> np.ndarray:
        """What is left of the accelerations, (nv,)."""
        nv = self.step.model.nv
        return self.step.after(self.state)[nv : 2 * nv] / self.step.dt


def relaxed(model: mujoco.MjModel, state: np.ndarray) -> np.ndarray:
    """Where a model sinks to from a state if its motion is damped much, and then less: the last part has the true creep.

    Of a file with a short step by longer ones, if they bear it.
    """
    longest, shortest = RELAXED_STEPS
    own = min(longest, model.opt.timestep)
    for integrator, dt in product(RELAXING, dict.fromkeys((max(own, shortest), own))):
        step, end = Step(model, dt, integrator), state
        for seconds, rate in RELAXED:
            end = step.relaxed(end, seconds, rate, RELAXED_STILL)
            if fastest(step, end) < RELAXED_STILL:
                return end
        if fastest(step, end) < WILD:
            return end
    return state


def fastest(step: Step, state: np.ndarray) -> float:
    """The largest speed of a state, rad/s or m/s."""
    step.put(state)
    return float(np.abs(step.data.qvel).max(initial=0.0))


def rest_near(step: Step, state: np.ndarray) -> Rest:
    """The rest near a state by Newton's method; where that fails, from where runs lead.

    The first run is left alone: it finds a creep if the step is stable. The speeds of the other are halved after each step.
    """
    best = newton(step, state)
    alone = min(round(LEFT_ALONE / step.dt), MOST_ALONE)
    for steps, share in ((alone, 1.0), (HALVED_STEPS, 0.5)):
        if best.left <= SETTLED:
            break
        for data in step.run(best.state, steps):
            data.qvel *= share
            if not np.abs(data.qvel).max() < WILD:
                break
        end = step.state()
        if np.isfinite(end).all() and fastest(step, end) < WILD:
            again = newton(step, end)
            best = min(best, again, key=lambda rest: rest.left)
    return best


def newton(step: Step, state: np.ndarray) -> Rest:
    rest = Rest.at(step, state)
    for _ in range(TRIES):
        if rest.left <= AT_REST or not np.isfinite(rest.A).all():
            break
        better = next((move for move in moves_of(rest) if move.left < rest.left), None)
        if better is None:
            break
        rest = Rest.at(step, better.state)
    return rest


def moves_of(rest: Rest) -> Iterator[Rest]:
    """States that Newton's method tries: whole steps and parts of them, at first along the stiffer directions alone."""
    for dependent in DEPENDENT:
        by = towards_rest(rest, dependent)
        for share in SHARES:
            state = rest.step.moved(rest.state, share * by)
            yield replace(rest, state=state, left=left_at(rest.step, state))


def left_at(step: Step, state: np.ndarray) -> float:
    """The largest acceleration of a step, rad/s2 or m/s2; inf where it is no number."""
    nv = step.model.nv
    left = float(np.abs(step.after(state)[nv : 2 * nv]).max(initial=0.0)) / step.dt
    return left if np.isfinite(left) else np.inf


def towards_rest(rest: Rest, dependent: float) -> np.ndarray:
    """A step of Newton's method: positions and activations take what they can, the creep what is left."""
    step, nv = rest.step, rest.step.model.nv
    change = (rest.A - np.eye(step.size))[nv:]
    speed = slice(nv, 2 * nv)
    placed = np.r_[0:nv, 2 * nv : step.size]
    wanted = step.after(rest.state)[nv:] - change[:, speed] @ rest.speeds
    weights = np.r_[np.full(nv, 1.0 / step.dt), np.ones(step.size - 2 * nv)]
    by = np.zeros(step.size)
    by[placed] = np.linalg.lstsq(weights[:, None] * change[:, placed], -weights * wanted, rcond=dependent)[0]
    left = (wanted + change[:, placed] @ by[placed])[:nv]
    creep = np.linalg.lstsq(change[:nv, speed], -left, rcond=dependent)[0]
    share = min(1.0, REACH / max(np.abs(by).max(initial=0.0), REACH))
    by *= share
    by[speed] = share * (creep - rest.speeds)
    return by
