"""Others beside tmt, each where it is installed: heyoka's compiled function, Pinocchio's aba, MuJoCo's batches."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from tmt import literal
from tmt.compiled import evaluator

from ...engines.heyoka import Heyoka, compiled_accelerations
from ...engines.pinocchio import PinocchioCalls
from ...judge.scale import EPS, FACTOR, acceleration_scale, bias_scale, spring_scale
from ..setup import Setup
from .ways import FORWARD, IN_LANES, RK4_STEP

COMPILED, COMPILED_FAST = "heyoka, compiled function", "heyoka, compiled function, fast math"
ABA, ABA_OF_NOTHING, ABA_OF_MANY = (
    "Pinocchio, aba called from Python",
    "Pinocchio, aba without joints called from Python",
    "Pinocchio, aba in one call",
)
BATCH = "MuJoCo, batch"
CALL = "call"  # what is timed in the place of an evaluation
FEWER, MORE = 1000, 10_000  # states in one call
COMPARED_AT = 20  # states at which accelerations are compared before they are timed


class Peers:
    """Those that take part for a setup's robot, and why others do not: absent, {(quantity, implementation): why}."""

    def __init__(self, setup: Setup, states: Sequence[np.ndarray]):
        from ...engines.mujoco.batch import BatchedCalls  # MuJoCo where it is needed

        self.setup, self.tree, self.batches, self.absent = setup, setup.robot.tree, BatchedCalls, {}
        heyoka = Heyoka()
        self.heyoka = self.unless(heyoka.unavailable() or heyoka.too_long(self.tree), (FORWARD, COMPILED))
        why = PinocchioCalls.unavailable() or PinocchioCalls.unfit(self.tree)
        self.pinocchio, self.of_tolerance = None, None
        if why is None:
            calls = PinocchioCalls(self.tree)
            self.of_tolerance = difference(calls, [part[:COMPARED_AT] for part in states])
            why = differs_in_words(self.of_tolerance)
            self.pinocchio = None if why else calls
        self.unless(why, (FORWARD, ABA))
        self.batch = self.unless(BatchedCalls.unavailable(), (FORWARD, BATCH))

    def unless(self, why: str | None, key: tuple[str, str]) -> bool:
        """Whether it takes part; else why it does not is kept."""
        if why:
            self.absent[key] = why
        return not why

    def of_one_state(self, state: Sequence[np.ndarray]) -> Iterator[tuple[str, str, Callable]]:
        """(quantity, implementation, loop(count)) at one state."""
        if self.pinocchio:
            yield FORWARD, ABA, self.pinocchio.aba_loop(*state)
            yield CALL, ABA_OF_NOTHING, self.pinocchio.call_loop()

    def of_many_states(self, states: Sequence[np.ndarray]) -> dict[tuple, Callable]:
        """{(quantity, implementation, states, threads): run} for the first of many states, (N, nq and nv), N > 1.

        heyoka's function, and the lanes beside it, take so many that the call from Python weighs little.
        """
        runs, some = {}, [np.ascontiguousarray(part[:FEWER]) for part in states]
        if self.heyoka:
            wide = [np.ascontiguousarray(part[:MORE].T) for part in states]
            given, out = np.concatenate(wide), np.empty(wide[1].shape)
            for name, fastest in ((COMPILED, False), (COMPILED_FAST, True)):
                function = compiled_accelerations(self.tree, fastest)
                runs[FORWARD, name, out.shape[1], 1] = lambda function=function: function(given, outputs=out)
            lanes, found = evaluator(self.tree, "acceleration").lanes, np.empty(out.shape)
            runs[FORWARD, IN_LANES, out.shape[1], 1] = lambda: lanes(*wide, found)
        if self.pinocchio and (run := self.pinocchio.aba_of_many(*some)):
            runs[FORWARD, ABA_OF_MANY, len(some[0]), 1] = run
        for threads in (1, 2) if self.batch else ():
            calls = self.batches(self.setup.engines["mujoco"].of(self.setup.robot.case()), *some, threads)
            runs[FORWARD, BATCH, len(some[0]), threads] = calls.forward
            runs[RK4_STEP, BATCH, len(some[0]), threads] = calls.step
        return runs


def difference(calls: PinocchioCalls, states: Sequence[np.ndarray]) -> float:
    """The largest difference of its accelerations from tmt's at some states, as a multiple of the tolerance of rounding."""
    (q, v, tau), tree = states, calls.tree
    acting = np.abs(tau) + np.abs(v) * np.array(tree.damping) + spring_scale(tree, q)
    force = bias_scale(tree, q, v) + acting.max(axis=1)
    off = np.abs(calls.acceleration(q, v, tau) - literal.acceleration(q, v, tau, tree)).max(axis=1)
    return float((off / (FACTOR * EPS * acceleration_scale(tree, q, force))).max())


def differs_in_words(of_tolerance: float) -> str | None:
    """Why Pinocchio's time does not count, or None."""
    if of_tolerance <= 1.0:
        return None
    return (
        f"Pinocchio's accelerations differ from tmt's by {of_tolerance:.2g} times the tolerance of rounding: not timed"
    )


def peers_in_words(ns: Mapping[tuple, float], lanes: Mapping[int, float], peers: Peers) -> list[str]:
    """Their times beside tmt's in words. lanes: nanoseconds of forward dynamics in lanes by the number of states."""
    found = []
    if (FORWARD, ABA, 1, 1) in ns:
        aba, call = ns[FORWARD, ABA, 1, 1], ns[CALL, ABA_OF_NOTHING, 1, 1]
        text = f"Pinocchio's aba, called from Python, takes {aba:.0f} ns, the call alone (aba without joints) {call:.0f} ns"
        many = {key[2]: value for key, value in ns.items() if key[1] == ABA_OF_MANY}
        text += "".join(f"; in one call for {count:,} states {value:.0f} ns each" for count, value in many.items())
        found.append(
            f"{text}. Its accelerations are tmt's within {100 * peers.of_tolerance:.2g} % of the tolerance of rounding."
        )
    for count in sorted({key[2] for key in ns if key[1] in (COMPILED, BATCH)} & lanes.keys()):
        parts = [
            f"{label} {value:.1f} ns ({as_often(value / lanes[count])} times)"
            for name, label, threads in (
                (COMPILED, "heyoka's compiled function", 1),
                (COMPILED_FAST, "with fast math", 1),
                (BATCH, "MuJoCo's batch", 1),
                (BATCH, "on two threads", 2),
            )
            if (value := ns.get((FORWARD, name, count, threads)))
        ]
        found.append(f"Of {count:,} states in one call each takes: tmt {lanes[count]:.1f} ns; {', '.join(parts)}.")
    return found + [f"{why}." for why in peers.absent.values()]


def as_often(ratio: float) -> str:
    """A ratio in two digits or so."""
    return f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.2g}"
