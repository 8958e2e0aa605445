"""Evaluations by other engines, where they are installed: heyoka's function, Pinocchio's aba, MuJoCo's batches."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tmt import literal
from tmt.compiled import evaluator

from ...engines.heyoka import Heyoka, compiled_accelerations
from ...engines.pinocchio import PinocchioCalls
from ...judge.scale import EPS, FACTOR, acceleration_scale, bias_scale, spring_scale
from ..setup import Setup
from .implementations import FORWARD, IN_LANES, RK4_STEP

COMPILED, COMPILED_FAST = "heyoka, compiled function", "heyoka, compiled function, fast math"
ABA, ABA_OF_MANY = "Pinocchio, aba called from Python", "Pinocchio, aba in one call"
CALL, ABA_OF_NOTHING = "call", "Pinocchio, aba without joints called from Python"
BATCH = "MuJoCo, batch"
BATCH_STATES, HEYOKA_STATES = 1000, 10_000  # in one call; of heyoka more, so that the call weighs little
COMPARED_STATES = 20  # at which accelerations are compared before they are timed


class Peers:
    """The engines that can evaluate a setup's robot; absent: {(quantity, implementation): why not}."""

    def __init__(self, setup: Setup, states: Sequence[np.ndarray]):
        from ...engines.mujoco.calls import BatchedCalls  # here, since importing MuJoCo takes long

        self.setup, self.tree, self.batches, self.pinocchio = setup, setup.robot.tree, BatchedCalls, None
        heyoka = Heyoka()
        reason = PinocchioCalls.unavailable() or PinocchioCalls.unfit(self.tree)
        if reason is None:
            self.pinocchio = PinocchioCalls(self.tree)
            reason = differs(difference(self.pinocchio, [part[:COMPARED_STATES] for part in states]))
        reasons = {
            COMPILED: heyoka.unavailable() or heyoka.too_long(self.tree),
            ABA: reason,
            BATCH: BatchedCalls.unavailable(),
        }
        self.absent = {(FORWARD, name): reason for name, reason in reasons.items() if reason}

    def has(self, name: str) -> bool:
        return (FORWARD, name) not in self.absent

    def of_one_state(self, state: Sequence[np.ndarray]) -> Iterator[tuple[str, str, Callable]]:
        """(quantity, implementation, loop(count)) at one state."""
        if self.has(ABA):
            yield FORWARD, ABA, self.pinocchio.aba_loop(*state)
            yield CALL, ABA_OF_NOTHING, self.pinocchio.call_loop()

    def of_many_states(self, states: Sequence[np.ndarray]) -> dict[tuple, Callable]:
        """{(quantity, implementation, states, threads): run} for the first of many states, (N, nq and nv), N > 1."""
        runs, some = {}, [np.ascontiguousarray(part[:BATCH_STATES]) for part in states]
        if self.has(COMPILED):
            wide = [np.ascontiguousarray(part[:HEYOKA_STATES].T) for part in states]
            inputs, out = np.concatenate(wide), np.empty(wide[1].shape)
            for name, fastest in ((COMPILED, False), (COMPILED_FAST, True)):
                function = compiled_accelerations(self.tree, fastest)
                runs[FORWARD, name, out.shape[1], 1] = lambda function=function: function(inputs, outputs=out)
            lanes, of_lanes = evaluator(self.tree, "acceleration").lanes, np.empty(out.shape)
            runs[FORWARD, IN_LANES, out.shape[1], 1] = lambda: lanes(*wide, of_lanes)
        if self.has(ABA) and (run := self.pinocchio.aba_of_many(*some)):
            runs[FORWARD, ABA_OF_MANY, len(some[0]), 1] = run
        for threads in (1, 2) if self.has(BATCH) else ():
            calls = self.batches(self.setup.engines["mujoco"].of(self.setup.robot.case()), *some, threads)
            runs[FORWARD, BATCH, len(some[0]), threads] = calls.forward
            runs[RK4_STEP, BATCH, len(some[0]), threads] = calls.step
        return runs


def difference(calls: PinocchioCalls, states: Sequence[np.ndarray]) -> float:
    """The largest difference of its accelerations from tmt's, over the tolerance of rounding."""
    (q, v, tau), tree = states, calls.tree
    acting = np.abs(tau) + np.abs(v) * np.array(tree.damping) + spring_scale(tree, q)
    force = bias_scale(tree, q, v) + acting.max(axis=1)
    off = np.abs(calls.acceleration(q, v, tau) - literal.acceleration(q, v, tau, tree)).max(axis=1)
    return float((off / (FACTOR * EPS * acceleration_scale(tree, q, force))).max())


def differs(of_tolerance: float) -> str | None:
    """Why Pinocchio is not timed, or None."""
    return None if of_tolerance <= 1.0 else f"its accelerations differ from tmt's by {of_tolerance:.2g} tolerances"
