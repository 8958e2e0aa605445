"""How long a held posture is kept: departure from a saddle, under a small push and a small torque, in runs and predicted."""

from collections.abc import Iterable, Mapping
from itertools import product

import numpy as np

import tmt

from ...engines import Engine, Method
from ...judge.check import Result
from ...judge.run import LEFT, departure
from ...truth.linear import NEGLIGIBLE, Held
from .choice import who

LONGEST_DEPARTURE = 12.0  # s
INSTANT = 1e-6  # s
PERTURBATIONS = tuple(10.0**-k for k in (2, 4, 6, 8, 10, 12))  # rad, of the angles at the start
# rad, as the error of torque that moves the equilibrium as far; less is a few ulps
TORQUE_ERRORS = (1e-13, 1e-14, 3e-15)
DEPARTURE_TOLERANCE = 0.03  # s, or one step: how near the prediction an observed departure is to be
DEPARTURE_SCHEMES = (
    "rk4",
    "semi_implicit_euler",
    "implicit",
    "implicit_midpoint",
    "gauss_legendre_4",
    "explicit_euler",
)
MOST_VARIED = 5  # joints, whose torques are varied in all combinations


def own_torque(method: Method, engines: Mapping[str, Engine], at: Held) -> np.ndarray:
    """The torque under which the compiled arithmetic of an engine gives no acceleration at all at the posture, (n,) N m.

    MuJoCo's is its own bias. TMT's is sought among the torques within two ulps of its reference torque: the one whose
    residual is least; compiled code regroups the sums, and there may be no double that it takes for its bias.
    """
    if method.engine == "mujoco":
        own = engines["mujoco"].of(at.case).gravity_balance(at.q)
        return own + tmt.spring_torque(at.q, at.tree) if at.tree.has_springs else own
    tau = variants(at.tau, 2)
    return tau[np.argmin(np.abs(residual(method, engines, at, tau)).max(axis=1))]


def residual(method: Method, engines: Mapping[str, Engine], at: Held, tau: np.ndarray) -> np.ndarray:
    """The torque by which tau, (..., n) N m, fails to hold the posture in the arithmetic of an engine, to less than an ulp.

    Read from the first step of a method, which is so short that nothing moves: Mbar qd / dt.
    """
    start = at.moved(np.zeros_like(tau))
    motion = engines[method.engine].of(at.case).run(start, np.zeros_like(tau), tau, INSTANT, 1, method.name)
    return motion.v[..., 1, :] @ at.mass_matrix / INSTANT


def variants(tau: np.ndarray, reach: int = 1) -> np.ndarray:
    """The torques within so many ulps of each component, (k, n) N m; the one in the middle is tau itself.

    (2 reach + 1)^n of them, 27 for one ulp of three joints; of more than five joints one component differs at a time.
    """
    ulps = range(-reach, reach + 1)
    if len(tau) <= MOST_VARIED:
        away = np.array(list(product(ulps, repeat=len(tau))))
    else:
        single = [k * unit for k in ulps if k for unit in np.eye(len(tau))]
        away = np.array([*single[: len(single) // 2], np.zeros(len(tau)), *single[len(single) // 2 :]])
    return tau + away * np.spacing(np.abs(tau))


def offset(at: Held, off: np.ndarray) -> np.ndarray:
    """How far the posture is from the equilibrium of the held torque plus a small torque, rad and N m (k, n).

    A torque along a mode without stiffness has no equilibrium, and is too small to matter.
    """
    n = at.nv
    accelerations = np.linalg.solve(at.mass_matrix, np.transpose(off))
    return (np.linalg.pinv(at.matrix[n:, :n], rcond=NEGLIGIBLE**2) @ accelerations).T


def predicted(
    at: Held,
    scheme: str,
    dt: float,
    moved: np.ndarray,
    off: np.ndarray,
    longest: float = LONGEST_DEPARTURE,
    rounded: bool = True,
) -> list[float | None]:
    """When the method's own linear map has a joint 0.1 rad away, s, for each of many starts; None: not within `longest`.

    moved: angles at the start from the posture, (k, n) rad; off: torques beyond the one that holds, (k, n) N m. The map
    carries all modes of the state about the equilibrium that this torque moves. rounded: each new angle is rounded to a
    double, as in a run, so that what a step adds may be lost; the rates are too small for that to matter.
    """
    n = at.nv
    change = (at.step(scheme, dt) - np.eye(2 * n)).T
    base = at.sizes if rounded else np.zeros(n)
    start, aside = base + np.asarray(moved), offset(at, off)
    q, qd = start.copy(), np.zeros_like(start)
    times = [None] * len(start)
    for k in range(1, round(longest / dt) + 1):
        added = np.concatenate([q - base + aside, qd], axis=1) @ change
        q, qd = q + added[:, :n], qd + added[:, n:]
        gone = ~(np.abs(q - start).max(axis=1) <= LEFT)
        if gone.any():
            times = [k * dt if time is None and out else time for time, out in zip(times, gone)]
            if None not in times:
                break
    return times


def is_led(at: Held, scheme: str, dt: float) -> bool:
    """Whether a method's step lets no mode grow faster than the one along which a saddle is left.

    If it does, that mode outgrows the other from what rounding and squares of the deviation put into it, and the linear map
    cannot say when the posture is left.
    """
    shape = at.fastest_growing(scheme, dt)[1]
    return bool(np.isclose(at.rate(shape), np.abs(at.modes[0][0]), rtol=NEGLIGIBLE))


def departures(dt: float, at: Held, engines: Mapping[str, Engine], methods: tuple[Method, ...]) -> list[dict]:
    """Rows for tables/departure.csv: every method that is led and every perturbation at one dt, from one saddle."""
    values, vectors = at.modes
    n, steps = at.nv, round(LONGEST_DEPARTURE / dt)
    shape = vectors[:n, 0].real / np.abs(vectors[:n, 0]).max()
    rows = []
    for method in (method for method in methods if is_led(at, method.scheme, dt)):
        own = own_torque(method, engines, at)
        sizes = [(size, size * shape, own) for size in PERTURBATIONS]
        # an error of torque that moves the equilibrium by size x shape, as far as doubles can say it
        push = at.mass_matrix @ shape * values[0].real ** 2
        if any(at.tree.damping) or values[0].imag:
            push = at.mass_matrix @ at.matrix[n:, :n] @ shape
        sizes += [(size, np.zeros(n), own + size * push) for size in TORQUE_ERRORS]
        starts, torques = (np.array([of[k] for of in sizes]) for k in (1, 2))
        with np.errstate(over="ignore", invalid="ignore"):
            dynamics = engines[method.engine].of(at.case)
            motion = dynamics.run(at.moved(starts), np.zeros_like(starts), torques, dt, steps, method.name)
        off = residual(method, engines, at, torques)
        expected = predicted(at, method.scheme, dt, [moved for _, moved, _ in sizes], off)
        for k, ((size, _, _), time, path) in enumerate(zip(sizes, expected, motion.q)):
            rows.append({
                "scene": at.name + (", torque off" if k >= len(PERTURBATIONS) else ""), "engine": method.engine,
                "method": method.name, "dt_s": dt, "perturbation_rad": size, "predicted_s": time,
                "observed_s": departure(motion.t, at.away(path)),
            })  # fmt: skip
    return rows


def check_departures(result: Result, rows: list[dict]) -> None:
    """The table of departures and a check for each."""
    if not rows:
        return
    result.tables.setdefault("departure", []).extend(rows)
    for row in rows:
        check_row(
            result, f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s, {row['perturbation_rad']:.0e} rad", row
        )
    result.notes.append(departures_in_words(rows))


def not_led_in_words(at: Held, methods: tuple[Method, ...], dts: Iterable[float]) -> list[str]:
    """Which methods are left out with which steps, because another mode grows faster than that of the saddle."""
    found = [f"{method.label} at {dt:.4g} s" for method in methods for dt in dts if not is_led(at, method.scheme, dt)]
    if not found:
        return []
    return [
        f"Departures from {at.name} are not compared where a step lets another mode grow faster than that of the saddle, for "
        f"then rounding decides: {'; '.join(found)}."
    ]


def late(row: dict) -> float | None:
    """By how much a run leaves later than predicted, s: 0 where neither leaves, None where only one of them does."""
    times = row["observed_s"], row["predicted_s"]
    if None in times:
        return 0.0 if times == (None, None) else None
    return times[0] - times[1]


def check_row(result: Result, where: str, row: dict) -> None:
    """The check of one departure: as predicted to one step or 0.03 s; where the prediction stays, the run stays too."""
    off = late(row)
    missing = {"observed_s": "the run stays", "predicted_s": "the prediction stays"}
    note = " and ".join(text for key, text in missing.items() if row[key] is None)
    quantity = "departure, observed - predicted"
    result.check(where, quantity, None if off is None else abs(off), near(row["dt_s"]), "s", note)


def departures_in_words(rows: list[dict]) -> str:
    """How many departures are as predicted, and the farthest."""
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    neither = sum(row["observed_s"] is row["predicted_s"] is None for row in rows)
    close = sum(abs(late(row)) <= near(row["dt_s"]) for row in both)
    postures = " and ".join(dict.fromkeys(row["scene"].removesuffix(", torque off") for row in rows))
    text = f"{len(rows)} starts at {postures}: {len(both)} leave in the run and in the prediction"
    if both:
        worst = max(both, key=lambda row: abs(late(row)))
        coarsest = max((row["dt_s"] for row in both), default=0.0)
        text += (
            f", {close} of these within one step or {DEPARTURE_TOLERANCE:g} s; the largest difference is "
            f"{abs(late(worst)):.3f} s ({worst['scene']}, {who(worst)}, dt = {worst['dt_s']:.4g} s, "
            f"{worst['perturbation_rad']:g} rad)"
        )
        fine = [abs(late(row)) for row in both if row["dt_s"] < coarsest]
        text += f", and {max(fine):.3f} s at steps below {coarsest:.4g} s" if fine else ""
    text += f"; staying in both: {neither}" if neither else ""
    lost = len(rows) - len(both) - neither
    return text + (f"; staying in only one of the two: {lost}." if lost else ".")


def span(times: Iterable[float | None]) -> str:
    """The first and the last of some times in words; None among them stands for never."""
    times = [time for time in times if time is not None]
    if not times:
        return "no time within reach"
    low, high = (f"{time:.2f}" for time in (min(times), max(times)))
    return f"{low} s" if low == high else f"{low} to {high} s"


def near(dt: float) -> float:
    """How near a prediction an observed departure is to be, s: one step or 0.03 s."""
    return max(DEPARTURE_TOLERANCE, dt) * (1.0 + 1e-9)
