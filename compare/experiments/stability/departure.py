"""How long a held posture is kept: departure from a saddle after a small push or a small torque, in runs and predicted."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from ...core.check import About, Result
from ...engines import Engine, Method
from ...judge.run import LEFT, departure, number_or_none
from ...stability.equilibrium import NEGLIGIBLE, Equilibrium
from .tables import DepartureRow

LONGEST_DEPARTURE = 12.0  # s
AWAITED = 1.5  # times the latest departure that is predicted: so long is a run
PERTURBATIONS = tuple(10.0**-k for k in (2, 4, 6, 8, 10, 12))  # rad, of the angles at the start
# rad, as the error of torque that moves the equilibrium as far; less is a few ulps
TORQUE_ERRORS = (1e-13, 1e-14, 3e-15)
DEPARTURE_TOLERANCE = 0.03  # s, or one step: how near the prediction an observed departure is to be
INSTANT = 1e-6  # s


def predicted(
    at: Equilibrium, schemes: Sequence[str], dt: float, moved: np.ndarray, off: np.ndarray
) -> np.ndarray:
    """When each method's own linear map has a joint 0.1 rad away, (methods, k) s; NaN: not within 12 s.

    moved: angles at the start from the posture, (k, n) rad; off: torques beyond the one that holds, (methods,
    k, n) N m. The map carries all modes of the state about the equilibrium that this torque moves. Each new
    angle is rounded to a double, as in a run, so that what a step adds may be lost; the rates are too small
    for that to matter.
    """
    n = at.nv
    changes = np.array([(at.step(scheme, dt) - np.eye(2 * n)).T for scheme in schemes])
    forces = np.linalg.solve(at.mass_matrix, off[..., None])[..., 0]
    aside = forces @ np.linalg.inv(at.matrix[n:, :n]).T
    start = np.broadcast_to(at.q + moved, off.shape)
    q, qd, times = start, np.zeros_like(start), np.full(off.shape[:-1], np.nan)
    for k in range(1, round(LONGEST_DEPARTURE / dt) + 1):
        added = np.concatenate([q - at.q + aside, qd], axis=-1) @ changes
        q, qd = q + added[..., :n], qd + added[..., n:]
        gone = ~(np.abs(q - start).max(axis=-1) <= LEFT)
        times[gone & np.isnan(times)] = k * dt
        if gone.all():
            break
    return times


def is_led(at: Equilibrium, scheme: str, dt: float) -> bool:
    """Whether a method's step lets no mode grow faster than the one along which a saddle is left.

    If it does, that mode outgrows the other from what rounding and squares of the deviation put into it, and
    the linear map cannot say when the posture is left.
    """
    return bool(np.isclose(at.growing_rate(scheme, dt), np.abs(at.rates[0]), rtol=NEGLIGIBLE))


def departures(
    dt: float, at: Equilibrium, engines: Mapping[str, Engine], methods: tuple[Method, ...]
) -> list[DepartureRow]:
    """Rows for tables/departure.csv: every method that is led and every perturbation at one dt, from one saddle."""
    rate, shape, rows = at.rates[0].real, at.vectors[: at.nv, 0].real, list[DepartureRow]()
    shape = shape / np.abs(shape).max()
    sizes = [(size, True) for size in PERTURBATIONS] + [(size, False) for size in TORQUE_ERRORS]
    moved = np.array([size * shape * is_push for size, is_push in sizes])
    # an error of torque that moves the equilibrium by size x shape, as far as doubles can say it
    force = at.mass_matrix @ shape * rate**2
    errors = np.array([size * force * (not is_push) for size, is_push in sizes])
    led = [method for method in methods if is_led(at, method.scheme, dt)]
    torques = [own_torque(method, engines, at) + errors for method in led]
    off = np.array([residual(method, engines, at, tau) for method, tau in zip(led, torques)])
    expected = predicted(at, [method.scheme for method in led], dt, moved, off.reshape(-1, *moved.shape))
    for method, tau, times in zip(led, torques, expected):
        latest = np.inf if np.isnan(times).any() else AWAITED * times.max()
        motion = at.run(method, engines, tau, dt, math.ceil(min(LONGEST_DEPARTURE, latest) / dt), moved)
        for (size, is_push), time, path in zip(sizes, times, motion.q):
            rows.append(DepartureRow(
                scene=at.name + ("" if is_push else ", torque off"), engine=method.engine, method=method.name,
                dt=dt, perturbation=size, predicted=number_or_none(time), observed=departure(motion.t, path),
            ))  # fmt: skip
    return rows


def check_departures(result: Result, rows: list[DepartureRow]) -> None:
    """The table of departures and a check of each: to one step or 0.03 s; where the prediction stays, the run stays."""
    result.tables.setdefault("departure", []).extend(rows)
    for row in rows:
        off, missing = late(row), {"the run stays": row.observed, "the prediction stays": row.predicted}
        note = " and ".join(text for text, time in missing.items() if time is None)
        where = f"{row.scene}, {row.who}, dt = {row.dt:.4g} s, {row.perturbation:.0e} rad"
        value, quantity = None if off is None else abs(off), "departure, observed - predicted"
        result.check(where, quantity, value, near(row), "s", note, about=About.PREDICTION)


def late(row: DepartureRow) -> float | None:
    """By how much a run leaves later than predicted, s: 0 where neither leaves, None where only one of them does."""
    if row.observed is None or row.predicted is None:
        return 0.0 if row.observed is row.predicted else None
    return row.observed - row.predicted


def near(row: DepartureRow) -> float:
    """How near its prediction a departure is to be: one step or 0.03 s."""
    return max(DEPARTURE_TOLERANCE, row.dt) * (1.0 + 1e-9)


def departure_values(rows: list[DepartureRow]) -> dict[str, Any]:
    """How many departures are as predicted, and the largest difference, s."""
    off = [(late(row), row) for row in rows]
    close = sum(by is not None and abs(by) <= near(row) for by, row in off)
    known = [abs(by) for by, row in off if by is not None and row.observed is not None]
    return {"count": len(rows), "close": close, "worst": max(known, default=None)}


# torques that hold


def own_torque(method: Method, engines: Mapping[str, Engine], at: Equilibrium) -> np.ndarray:
    """The torque under which the compiled arithmetic of an engine gives no acceleration at all at the posture, (n,) N m.

    MuJoCo's is its own bias. TMT's is sought among the torques within two ulps of its reference torque: the
    one whose residual is least; compiled code regroups the sums, and there may be no double that it takes for
    its bias.
    """
    if method.engine == "mujoco":
        return engines["mujoco"].of(at.case).bias(at.q, np.zeros(at.nv))
    tau = variants(at.tau, 2)
    return tau[np.argmin(np.abs(residual(method, engines, at, tau)).max(axis=1))]


def residual(method: Method, engines: Mapping[str, Engine], at: Equilibrium, tau: np.ndarray) -> np.ndarray:
    """The torque by which tau, (..., n) N m, fails to hold the posture in the arithmetic of an engine, to less than an ulp.

    Read from the first step of a method, which is so short that nothing moves: Mbar qd / dt.
    """
    motion = at.run(method, engines, tau, INSTANT, 1)
    return motion.v[..., 1, :] @ at.mass_matrix / INSTANT


def variants(tau: np.ndarray, reach: int = 1) -> np.ndarray:
    """The (2 reach + 1)^n torques within `reach` ulps of each component, (k, n) N m; the one in the middle is tau itself."""
    away = np.array(list(product(range(-reach, reach + 1), repeat=len(tau))))
    return tau + away * np.spacing(np.abs(tau))
