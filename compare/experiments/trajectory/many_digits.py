"""Runs of the same scheme with 50 digits: the rounding error of each engine by itself."""

from collections.abc import Iterable, Sequence

import mpmath
import numpy as np

from tmt.exact.values import DIGITS, distance
from tmt.methods import METHODS, one_step

from ...judge.check import Result, closest
from ...judge.run import step_in_words
from ...robots.case import Case

MOST_EXACT_STEPS = 64  # of a run with many digits
TOO_FAST = 1e4  # rad/s: a run with many digits that is faster has diverged


def many_digits(result: Result, cases: Sequence[Case], runs: Iterable[dict]) -> None:
    """Both runs compared with one of the same scheme with many digits. runs: of each case such positions by the scheme."""
    distances = []
    for case, paths in zip(cases, runs):
        for scheme, exact in paths.items():
            curve, dt = result.curves["runs"][(case.name, scheme, case.steps)], case.duration / case.steps
            every = curve["every"]  # steps between two states of the band
            last = min(round(curve["judged_until_s"] / dt), len(exact) - 1) // every
            states = slice(0, last * every + 1, every)
            off = {
                name: distance_of(case, curve[name][0][states], exact[states]).max(axis=1) for name in ("tmt", "mujoco")
            }
            where = f"{case.name}, {curve['integrator']}, {step_in_words(case, case.steps)}"
            check_digits(result, where, off, curve["band"][: last + 1], every * dt)
            largest = {name: float(values.max()) for name, values in off.items()}
            distances.append({"run": where, "until": last * every * dt, **largest})
    if distances:
        result.find("many_digits", digits=DIGITS, runs=distances)


def distance_of(case: Case, q: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """The distance of positions from exact ones, as movements without signs, (states, nv)."""
    if not case.coordinates.has_balls:
        return distance(q, exact)
    pairs = zip(q, exact)
    with mpmath.workdps(DIGITS):
        off = [case.tree.coordinates.difference([mpmath.mpf(float(x)) for x in a], list(b)) for a, b in pairs]
        return np.abs(np.array(off, dtype=float))


def check_digits(result: Result, where: str, off: dict, band: np.ndarray, dt: float) -> None:
    """The state of each engine's run closest to the band of rounding. off: {engine: distances, rad, (states,)}."""
    for label, apart in (("TMT", off["tmt"]), ("MuJoCo", off["mujoco"])):
        (k,) = closest(apart, band)
        at = f"t = {k * dt:.3f} s"
        result.check(where, f"{label} to many digits of its own scheme", apart[k], band[k], "rad", at, True)


def exact_runs(case: Case, schemes: Sequence[str], most: int = MOST_EXACT_STEPS) -> dict[str, np.ndarray]:
    """Positions of each scheme on mpmath numbers over the scene's own steps, the first `most` of them."""
    dt, steps = case.duration / case.steps, min(most, case.steps)
    return {scheme: exact_run(case, scheme, steps, dt) for scheme in schemes}


def exact_run(case: Case, scheme: str, steps: int, dt: float) -> np.ndarray:
    """Positions of the same scheme on mpmath numbers, from the same doubles: (steps + 1, nq), fewer if it diverges."""
    with mpmath.workdps(DIGITS):
        q, v, tau = ([mpmath.mpf(float(a)) for a in values] for values in (*case.start, case.tau))
        dt, path = mpmath.mpf(dt), [q]
        for _ in range(steps):
            q, v = one_step(METHODS[scheme], case.tree, q, v, tau, dt)
            path.append(q)
            if max(map(abs, v)) > TOO_FAST:  # diverged: its sines would need millions of digits of pi
                break
    return np.array(path, dtype=object)
