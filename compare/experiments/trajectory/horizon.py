"""How far digits reach: the growth of a small difference, and runs of the same scheme with many digits."""

from collections.abc import Iterable, Mapping, Sequence

import mpmath
import numpy as np

from tmt.exact.values import DIGITS, distance
from tmt.methods import METHODS, one_step

from ...engines import Engine
from ...judge.check import Result, closest
from ...judge.rounding import growth
from ...judge.run import step_in_words
from ...judge.words import listed
from ...robots import Robot
from ...robots.case import Case
from .runs import steps_afforded

GROWTH_EVERY = 16  # steps between two recorded values of a growth
GROWTH_RUN = (60.0, 6144)  # s and steps of RK4, for the growth of errors
SHORT_GROWTH_RUN = (10.0, 512)  # of a small run
GROWTH_STEPS_OF_A_FILE = 2048  # of RK4, as long as the shortest step of its scenes; or as many as can be afforded
GROWN_EARLY = 5.0  # s: the other time at which a growth is reported
CARRIED = {16: "doubles (16 digits)", 30: "30 digits"}
MOST_EXACT_STEPS = 64  # of a run with many digits
TOO_FAST = 1e4  # rad/s: a run with many digits that is faster has diverged


def grown(case: Case, engines: Mapping[str, Engine], duration: float, steps: int) -> np.ndarray:
    """log10 of the growth of a small difference over so many steps of RK4, every 16 steps; NaN where the run diverges."""
    dt = duration / steps
    motion = engines["tmt"].of(case).run(*case.start, case.tau, dt, steps, "rk4")
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that is about to end
        return growth(METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, GROWTH_EVERY)


def growth_run(robot: Robot, cases: Sequence[Case], small: bool) -> tuple[float, int]:
    """Over what time the growth of errors is followed, s, and with how many steps."""
    if not (robot.is_read and cases):
        return SHORT_GROWTH_RUN if small else GROWTH_RUN
    most = 128 if small else min([GROWTH_STEPS_OF_A_FILE, *(steps_afforded(case) for case in cases)])
    steps = max(1, most // GROWTH_EVERY) * GROWTH_EVERY
    return steps * min(case.scene.dt for case in cases), steps


def early(t: np.ndarray) -> int:
    """Which of the times is the other one at which a growth is reported: 5 s, or half of a shorter time."""
    return int(np.searchsorted(t, min(GROWN_EARLY, t[-1] / 2)))


def growth_of_errors(result: Result, cases: Sequence[Case], curves: Iterable, duration: float, steps: int) -> None:
    """log10 of the growth of a small difference over 5 s and the whole time, scene by scene, and in words."""
    t = np.linspace(0.0, duration, steps // GROWTH_EVERY + 1)
    curves = {case.name: curve for case, curve in zip(cases, curves)}
    result.curves["growth"] = {"t": t, "curves": curves}
    result.notes += growth_in_words(t, curves)


def growth_in_words(t: np.ndarray, curves: Mapping[str, np.ndarray]) -> list[str]:
    """How much small differences have grown after 5 s and at the end, and which scenes have a horizon."""
    soon = early(t)
    each = "; ".join(f"{name}: {power(g[soon], 1)} and {power(g[-1], 1)}" for name, g in curves.items())
    horizons = {name: {digits: reach(t, g, digits) for digits in CARRIED} for name, g in curves.items()}
    found = [
        f"{name}: {' and '.join(time_in_words(t, curves[name], at[digits]) + ' for ' + text for digits, text in CARRIED.items())}"
        for name, at in horizons.items()
        if any(time is not None for time in at.values())
    ]
    known = {name: known_until(t, g) for name, g in curves.items()}
    at_once = [name for name, until in known.items() if not until]  # nothing is known of its growth
    least = min((until for until in known.values() if until), default=0.0)
    none = f"No scene has a horizon within {least:g} s: nowhere does a difference of the last digit grow to 1 rad"
    none += f"; but of {listed(at_once)} nothing is known, for the run diverges at once." if at_once else "."
    return [
        f"Growth of a small difference of the state over {t[soon]:g} s and {t[-1]:g} s (RK4, exact Jacobians): {each}.",
        f"These have a horizon, beyond which a run depends on its last digits and on the step: {'; '.join(found)}."
        if found
        else none,
    ]


def power(exponent: float, digits: int) -> str:
    """A growth in words."""
    return f"10^{exponent:.{digits}f}" if np.isfinite(exponent) else "no number (the run diverges)"


def known_until(t: np.ndarray, grown: np.ndarray) -> float:
    """Until when a growth is known, s."""
    return float(t[np.isfinite(grown)][-1])


def reach(t: np.ndarray, grown: np.ndarray, digits: int) -> float | None:
    """When a difference of 10^-digits has grown to 1 rad, s; None: not in this time."""
    beyond = grown > digits
    return float(t[beyond][0]) if beyond.any() else None


def time_in_words(t: np.ndarray, grown: np.ndarray, time: float | None) -> str:
    """A horizon in words."""
    return f"more than {known_until(t, grown):.0f} s" if time is None else f"about {time:.0f} s"


def many_digits(result: Result, cases: Sequence[Case], runs: Iterable[dict]) -> None:
    """Both runs beside a run of the same scheme with many digits: which engine carries the rounding.

    runs: of each case its paths with many digits, by the scheme.
    """
    for case, of_case in zip(cases, runs):
        for scheme, exact in of_case.items():
            curve, dt = result.curves["runs"][(case.name, scheme, case.steps)], case.duration / case.steps
            every = curve["every"]  # steps between two states of the band
            last = min(round(curve["judged_until_s"] / dt), len(exact) - 1) // every
            states = slice(0, last * every + 1, every)
            off = {
                name: distance_of(case, curve[name][0][states], exact[states]).max(axis=1) for name in ("tmt", "mujoco")
            }
            where = f"{case.name}, {curve['integrator']}, {step_in_words(case, case.steps)}"
            check_digits(result, where, off, curve["band"][: last + 1], every * dt)


def distance_of(case: Case, q: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """How far positions are from exact ones, as movements without signs, (states, nv)."""
    if not case.coordinates.has_balls:
        return distance(q, exact)
    pairs = zip(q, exact)
    with mpmath.workdps(DIGITS):
        off = [
            case.tree.coordinates.difference([mpmath.mpf(float(x)) for x in one], list(other)) for one, other in pairs
        ]
        return np.abs(np.array(off, dtype=float))


def check_digits(result: Result, where: str, off: dict, band: np.ndarray, dt: float) -> None:
    """The state of each engine's run that comes closest to the band of rounding, {engine: distances in rad, (states,)}."""
    for label, apart in (("TMT", off["tmt"]), ("MuJoCo", off["mujoco"])):
        (k,) = closest(apart, band)
        at = f"t = {k * dt:.3f} s"
        result.check(where, f"{label} to many digits of its own scheme", apart[k], band[k], "rad", at, True)
    result.notes.append(
        f"Against {DIGITS} digits of the same scheme ({where}, to {dt * (len(band) - 1):.2f} s): TMT is at most "
        f"{off['tmt'].max():.1e} rad off, MuJoCo {off['mujoco'].max():.1e} rad."
    )


def exact_runs(case: Case, schemes: Sequence[str], most: int = MOST_EXACT_STEPS) -> dict[str, np.ndarray]:
    """Positions of each scheme on mpmath numbers, over at most so many of the scene's own steps."""
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
            if max(map(abs, v)) > TOO_FAST:  # diverged: its sines would ask for millions of digits of pi
                break
    return np.array(path, dtype=object)
