"""How far digits reach: the growth of a small difference, and runs of the same scheme with many digits."""

import mpmath
import numpy as np

import tmt
from tmt.methods import METHODS, one_step
from tmt.reference import DIGITS, distance

from .band import growth
from .motion import SCHEMES, TWINS, step

EVERY = 16  # steps between two recorded values of a growth
LONG = (60.0, 6144)  # s and steps of RK4, for the growth of errors
SHORT = (10.0, 512)
FEW = 5.0  # s: the other time at which a growth is told
CARRIED = {16: "doubles (16 digits)", 30: "30 digits"}
EXACT_STEPS = 64  # of the runs with many digits
FAST = 1e4  # rad/s: a run with many digits that is faster has diverged


def grown(scene, duration, steps) -> np.ndarray:
    """log10 of the growth of a small difference over so many steps of RK4, every 16 steps."""
    dt = duration / steps
    _, *path = tmt.simulate(*scene.start, scene.tau, dt, steps, "rk4", scene.model)
    return growth(METHODS["rk4"], scene.model, *path, scene.tau, dt, EVERY)


def growth_of_errors(result, scenes, curves, duration, steps) -> None:
    """log10 of the growth of a small difference over 5 s and the whole time, scene by scene, told in words."""
    t = np.linspace(0.0, duration, steps // EVERY + 1)
    curves = {scene.name: curve for scene, curve in zip(scenes, curves)}
    result.curves["growth"] = {"t": t, "curves": curves}
    result.notes += growth_told(t, curves)


def growth_told(t, curves) -> list[str]:
    """How much small differences have grown after 5 s and at the end, and which scenes have a horizon."""
    few = int(np.searchsorted(t, FEW))
    told = "; ".join(f"{name}: 10^{g[few]:.1f} and 10^{g[-1]:.1f}" for name, g in curves.items())
    horizons = {name: {digits: reach(t, g, digits) for digits in CARRIED} for name, g in curves.items()}
    found = [
        f"{name}: {' and '.join(at_of(t, at[digits]) + ' for ' + text for digits, text in CARRIED.items())}"
        for name, at in horizons.items()
        if any(time is not None for time in at.values())
    ]
    return [
        f"Growth of a small difference of the state over {t[few]:g} s and {t[-1]:g} s (RK4, exact Jacobians): {told}.",
        f"These have a horizon, beyond which a run depends on its last digits and on the step: {'; '.join(found)}."
        if found
        else f"No scene has a horizon within {t[-1]:g} s: nowhere does a difference of the last digit grow to 1 rad.",
    ]


def reach(t, grown, digits) -> float | None:
    """When a difference of 10^-digits has grown to 1 rad, s; None: not in this time."""
    beyond = grown > digits
    return float(t[beyond][0]) if beyond.any() else None


def at_of(t, time) -> str:
    """A horizon in words."""
    return f"more than {t[-1]:.0f} s" if time is None else f"about {time:.0f} s"


def many_digits(result, engine, scenes, runs) -> None:
    """Both runs against a run of the same scheme with many digits: which engine carries the rounding."""
    for scene, of_scene in zip(scenes, runs):
        variant = scene.engine(engine)
        for integrator, exact in of_scene.items():
            curve = result.curves["runs"][(scene.name, TWINS[integrator], EXACT_STEPS)]
            dt = scene.duration / EXACT_STEPS
            _, theirs, _ = variant.trajectory(*scene.start, scene.tau, dt, EXACT_STEPS, integrator)
            last = min(round(curve["judged_until_s"] / dt), len(exact) - 1)
            off = {name: distance(path[: last + 1], exact[: last + 1]).max(axis=1)
                   for name, path in (("TMT", curve["tmt"][0]), ("MuJoCo", theirs))}  # fmt: skip
            where = f"{scene.name}, {integrator}, {step(scene, EXACT_STEPS)}"
            judge_digits(result, where, off, curve["band"][: last + 1], dt)


def judge_digits(result, where, off, band, dt) -> None:
    """The state of each engine's run that comes closest to the band of rounding, {engine: distances in rad, (states,)}."""
    for name, apart in off.items():
        ratio = np.divide(apart, band, out=np.zeros_like(apart), where=band > 0)
        k = int(np.argmax(ratio))  # NaN counts as the largest
        at = f"t = {k * dt:.3f} s"
        result.check(where, f"{name} to many digits of its own scheme", apart[k], band[k], "rad", at, True)
    result.notes.append(
        f"Against {DIGITS} digits of the same scheme ({where}, to {dt * (len(band) - 1):.2f} s): TMT is at most "
        f"{off['TMT'].max():.1e} rad off, MuJoCo {off['MuJoCo'].max():.1e} rad."
    )


def exact_runs(scene, steps=EXACT_STEPS) -> dict:
    """Hinge angles of each scheme on mpmath numbers, by its integrator, over so many of the 64 steps."""
    return {name: exact_run(scene, TWINS[name], steps, scene.duration / EXACT_STEPS) for name in SCHEMES}


def exact_run(scene, twin, steps, dt) -> np.ndarray:
    """Hinge angles of the same scheme on mpmath numbers, from the same doubles: (steps + 1, 3), fewer if it diverges."""
    with mpmath.workdps(DIGITS):
        q, qd = ([mpmath.mpf(float(v)) for v in values] for values in scene.start)
        tau, dt = [mpmath.mpf(float(v)) for v in scene.tau], mpmath.mpf(dt)
        path = [q]
        for _ in range(steps):
            q, qd = one_step(METHODS[twin], scene.model, q, qd, tau, dt)
            path.append(q)
            if max(map(abs, qd)) > FAST:  # diverged: its sines would ask for millions of digits of pi
                break
    return np.array(path, dtype=object)
