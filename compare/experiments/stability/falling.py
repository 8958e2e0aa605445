"""How long a marginal posture is kept: along a mode without stiffness the potential is cubic, which gives a law."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.integrate import quad

from ...engines import LABELS, Engine, Method
from ...judge.check import About, Result
from ...judge.run import LEFT, departure
from ...truth.linear import Held
from .departure import span
from .torques import own_torque

EXPONENT_TOLERANCE = 0.02  # how near -1/2 the exponent of the time to leave is to be
FALL_SIZES = tuple(10.0**-k for k in (2, 2.5, 3, 3.5, 4, 4.5, 5))  # rad
FALL_STEP = 0.01  # s
LONGEST_FALL = 1000.0  # s: a cubic coefficient that lets the smallest start stay longer is taken for none


def without_law(at: Held) -> str | None:
    """Why a marginal posture is not left by the law of a cubic potential, or None."""
    soft = at.soft.shape[1]
    if soft != 1:
        return f"{soft} of its modes have no stiffness"
    if any(at.tree.damping):
        return "it is damped"
    slope = cubic(at)[1]
    longest = max((fall_time(slope, sign * min(FALL_SIZES)) for sign in (1.0, -1.0)) if slope else [np.inf])
    if longest > LONGEST_FALL:
        return "the potential along its mode without stiffness is not cubic"
    return None


def fall(method: Method, at: Held, engines: Mapping[str, Engine], sizes: Sequence[float] = FALL_SIZES) -> list[dict]:
    """Rows for tables/departure.csv at a marginal posture: predicted from its cubic potential, not from a limit.

    Along the mode without stiffness m q'' = c q^2 with c = -V'''/2, so t = sqrt(3 m/(2 c)) times the integral of
    1/sqrt(q^3 - p^3) from p to 0.1 rad beyond: about 2.43 sqrt(3 m/(2 c p)) for small p.
    """
    shape, slope = cubic(at)
    dynamics, tau = engines[method.engine].of(at.case), own_torque(method, engines, at)
    rows = []
    for start in (sign * size for sign in (1.0, -1.0) for size in sizes):
        expected = fall_time(slope, start)
        steps = round(1.5 * expected / FALL_STEP)
        motion = dynamics.run(at.moved(start * shape), np.zeros(at.nv), tau, FALL_STEP, steps, method.name)
        rows.append({
            "scene": at.name, "engine": method.engine, "method": method.name, "dt_s": FALL_STEP, "perturbation_rad": start,
            "predicted_s": expected, "observed_s": departure(motion.t, at.away(motion.q)),
        })  # fmt: skip
    return rows


def cubic(at: Held) -> tuple[np.ndarray, float]:
    """The mode without stiffness, scaled to 1 rad and turned so that the fall is along it, and c/m in q'' = c/m q^2.

    c by nested dual numbers: the second derivative of the torque dV/dq along the mode.
    """
    n, inertia = at.nv, at.mass_matrix
    values, vectors = np.linalg.eigh(-inertia @ at.matrix[n:, :n])
    shape = vectors[:, np.argmin(np.abs(values))]
    shape = shape / np.abs(shape).max()
    ratio = float(-0.5 * (shape @ at.curvature(shape)) / (shape @ inertia @ shape))
    return (shape, ratio) if ratio > 0.0 else (-shape, -ratio)


def fall_time(slope: float, start: float) -> float:
    """Time from rest at `start` to 0.1 rad beyond it in q'' = slope q^2, s."""
    end = start + LEFT
    # q = start + u^2 takes the root out of the integrand at the start
    value, _ = quad(
        lambda u: 2.0 / np.sqrt(u**4 + 3.0 * start * u**2 + 3.0 * start**2), 0.0, np.sqrt(end - start), limit=500
    )
    return float(np.sqrt(1.5 / slope) * value)


def check_falls(result: Result, falls: list[dict]) -> None:
    """The law of the time to leave: a check of its exponent for each engine and side."""
    exponents = {}
    for engine in dict.fromkeys(row["engine"] for row in falls):
        for sign, side in ((1.0, "along the fall"), (-1.0, "against it")):
            mine = [row for row in falls if row["engine"] == engine and row["perturbation_rad"] * sign > 0.0]
            found = exponents[engine, side] = exponent(mine)
            off = None if found is None else abs(found + 0.5)
            where = f"{falls[0]['scene']}, {LABELS[engine]}, {side}"
            result.check(
                where, "exponent of the time to leave, from -1/2", off, EXPONENT_TOLERANCE, "", about=About.PREDICTION
            )
    if falls:
        result.notes.append(falls_in_words(falls, list(exponents.values())))


def exponent(rows: list[dict]) -> float | None:
    """The power of the perturbation with which the time to leave goes, from the rows up to 1e-4 rad; None: not known."""
    small = [row for row in rows if abs(row["perturbation_rad"]) <= 1e-4 * (1 + 1e-9)]
    if len(small) < 2 or any(row["observed_s"] is None for row in small):
        return None
    sizes, times = ([abs(row[key]) for row in small] for key in ("perturbation_rad", "observed_s"))
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def falls_in_words(falls: list[dict], exponents: Sequence[float | None]) -> str:
    """The law of the time to leave a marginal posture, and what the runs make of it."""
    known = [found for found in exponents if found is not None]
    law = "no series of runs leaves, so they give no power"
    if known:
        law = (
            f"{len(known)} of {len(exponents)} series, an engine and a side each, leave, up to 1e-4 rad with the power "
            f"{min(known):.3f} to {max(known):.3f}"
        )
    one = max(falls, key=lambda row: row["perturbation_rad"])
    return (
        f"Held at {one['scene']}: the potential along the mode without stiffness is cubic, which predicts a time that "
        f"goes with the power -1/2. In the runs {law}. From {one['perturbation_rad']:g} rad along the fall the law gives "
        f"{one['predicted_s']:.2f} s and the run takes {span([one['observed_s']])}."
    )
