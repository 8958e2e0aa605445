"""A controller at its own rate: a program reads lengths and speeds every n-th step and holds the force until it reads again.

At rest x' = A x + B u in a step of the model with motors, and u = C x is what the program computes. With a delay of d steps the
program's numbers reach the motors d steps after they were read. The state of a period is x with the numbers that are still
on the way, and its growth is the spectral radius of the product of the steps (a lifted map; Astrom and Wittenmark, Computer-
Controlled Systems, chapter 3).
"""

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np

from ..engines.mujoco.step import NUDGE, Step
from ..engines.mujoco.variants import Servo, held_servos, with_servos
from .growth import LASTS, MOST_STEPS, push_of
from .rest import Rest, rest_near

MOST_PERIOD = 0.5  # s
MOST_DELAYED = 5  # periods: the longest delay that is tried
SMALL_PUSH = 1e-7  # rad/s or m/s: deviations whose growth is judged
GROWN, GROWING = 1e3, 3.0  # fold: of the speed at the start; from the second to the last quarter
CREPT = 30.0  # fold, of the push at the start
AT_ONE = 2e-4  # the distance from 1 of a factor that counts as 1: of what nothing holds
LEAST_PERIODS = 40  # of a run
LONGER = 1.5  # fold, from one tried number of steps to the next


class Controlled(NamedTuple):
    """A model at rest whose servos are in a program. B: the step by their numbers, (n, k); C: these by the deviation, (k, n)."""

    rest: Rest
    servos: list[Servo]
    B: np.ndarray
    C: np.ndarray

    @property
    def dt(self) -> float:
        return self.rest.step.dt

    def period(self, steps: int, delay: int) -> np.ndarray:
        """The map of a period of a number of steps; delay: steps from reading to the force."""
        size, count = self.B.shape
        waiting = -(-delay // steps)  # earlier numbers that are still on the way
        state = np.eye(size, size + waiting * count)
        numbers = [self.C @ state]
        places = range(size, size + waiting * count, count)
        numbers += [np.eye(count, state.shape[1], place) for place in places]
        moved = state
        for step in range(steps):
            age = max(0, -(-(delay - step) // steps))
            moved = self.rest.A @ moved + self.B @ numbers[age]
        return np.vstack([moved, *numbers[:waiting]])

    def factor(self, steps: int, delay: int) -> float:
        """By how much the fastest growing deviation is multiplied in a period; 1.0: none grows."""
        size = float(np.abs(np.linalg.eigvals(self.period(steps, delay))).max())
        return size if size > 1.0 + AT_ONE else 1.0

    def longest_period(self, delay: int, beyond: int = 0) -> int | None:
        """The largest number of steps of a stable period, upwards from `beyond`, stable or 0; None: all that are tried."""
        most = max(round(MOST_PERIOD / self.dt), beyond + 1)
        return longest(lambda steps: self.factor(steps, delay) == 1.0, beyond + 1, most)

    def longest_delay(self, steps: int, beyond: int) -> int | None:
        """The longest stable delay in steps, upwards from `beyond`, which is stable; None: all that are tried.

        A shorter one need not be stable: what acts late may act at a better time.
        """
        most = beyond + MOST_DELAYED * steps
        return longest(lambda delay: self.factor(steps, delay) == 1.0, beyond + 1, most)

    def grows_in_run(self, steps: int, delay: int) -> bool:
        """Whether a small push grows in a run of the program, which lasts until a growth that is expected would show."""
        step, factor = self.rest.step, self.factor(steps, delay)
        periods = max(LEAST_PERIODS, np.log(GROWN) / np.log(factor) if factor > 1.0 else 0.0)
        count = int(min(max(LASTS / self.dt, periods * steps), MOST_STEPS))
        starts = (self.rest.state, step.moved(self.rest.state, push_of(step, self.rest.state, SMALL_PUSH)))
        runs = (step.run_program(start, self.servos, count, steps, delay) for start in starts)
        plain, moved = ([data.qvel.copy() for data in run] for run in runs)
        if min(len(plain), len(moved)) < count:
            return True
        sizes = np.abs(np.subtract(plain, moved)).max(axis=1) / SMALL_PUSH
        if not sizes.max() <= GROWN:
            return True
        early, late = sizes[count // 4 : count // 2].max(), sizes[3 * count // 4 :].max()
        least = 0.0 if factor > 1.0 else CREPT  # less may be what friction lets creep
        return bool(late > GROWING * max(early, 1.0) and sizes[-1] > least)


def longest(holds: Callable[[int], bool], first: int, most: int) -> int | None:
    """The largest number that holds before one that does not, upwards and then by bisection; first - 1: not even the first."""
    low, high = first - 1, first
    while holds(high):
        if high >= most:
            return None
        low, high = high, min(max(high + 1, round(high * LONGER)), most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def controlled(
    model: mujoco.MjModel, state: np.ndarray, dt: float, integrator: str, kp: float | None, kv: float | None
) -> Controlled | None:
    """The servos of a model in a program, at the rest near a state; None: it has none that reads a state.

    kp, kv: gains of actuators that are no servos, in their control over rad or m; their targets are the state.
    """
    step = Step(model, dt, integrator)
    step.put(state)
    targets, controls = step.lengths(), step.data.ctrl.copy()
    motors, servos = held_servos(model, controls, kp, kv, targets)
    if not servos:
        return None
    settled = rest_near(
        Step(model if kp is None else with_servos(model, kp, kv or 0.0, targets), dt, integrator), state
    )
    held = Step(motors, dt, integrator)
    places = [servo.control for servo in servos]
    held.put(settled.state)
    held.data.ctrl[places] = held.commands(servos)
    start = held.state()
    rest = Rest.at(held, start)
    columns = []
    for by in NUDGE * np.eye(held.size):
        held.put(start, by)
        ahead = held.commands(servos)
        held.put(start, -by)
        columns.append(ahead - held.commands(servos))
    if not np.abs(columns).max() > 0.0:  # what they read does not depend on the state
        return None
    return Controlled(
        rest, servos, held.by_control(start, np.array(places)), np.array(columns).T / (2.0 * NUDGE)
    )
