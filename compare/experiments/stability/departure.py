"""How long a held posture is kept: departure from a saddle after a small push or a small torque, in runs and predicted."""

from collections.abc import Iterable, Mapping
from itertools import product

import numpy as np

from tmt import literal

from ...engines import Engine, Method
from ...judge.check import About, Result
from ...judge.run import LEFT, departure
from ...judge.scale import EPS, gravity_scale
from ...truth.linear import NEGLIGIBLE, Held
from .subjects import unit_of_movements, who

LONGEST_DEPARTURE = 12.0  # s
PERTURBATIONS = tuple(10.0**-k for k in (2, 4, 6, 8, 10, 12))  # rad, of the angles at the start
# rad, as the error of torque that moves the equilibrium as far; less is a few ulps
TORQUE_ERRORS = (1e-13, 1e-14, 3e-15)
DEPARTURE_TOLERANCE = 0.03  # s, or one step: how near the prediction an observed departure is to be
DEPARTURE_SCHEMES = [
    "rk4",
    "semi_implicit_euler",
    "implicit",
    "implicit_midpoint",
    "gauss_legendre_4",
    "explicit_euler",
]
INSTANT = 1e-6  # s
MOST_VARIED = 5  # joints, whose torques are varied in all combinations


def predicted(
    at: Held,
    scheme: str,
    dt: float,
    moved: np.ndarray,
    off: np.ndarray,
    longest: float = LONGEST_DEPARTURE,
    rounded: bool = True,
) -> list[float | None]:
    """When the method's own linear map has a joint 0.1 rad or m away, s, for each of many starts; None: not within `longest`.

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


def not_lost(at: Held, size: float) -> bool:
    """Whether a perturbation, rad, is so large that rounding of the torque on the way cannot move a departure by 0.03 s.

    That is eps x sum of m g reach at each joint: it moves the mode along which the saddle is left as a perturbation would that is
    so large over its rate, and a perturbation that is larger by the part p moves the time by p over the rate.
    """
    n, rate = at.nv, at.modes[0][0]
    measure = np.abs(at.measures[0][n:]) @ np.abs(np.linalg.inv(at.mass_matrix)).sum(axis=1)
    return size * DEPARTURE_TOLERANCE * rate.real >= measure * EPS * gravity_scale(at.tree, at.q) / abs(rate)


def curved_by(at: Held) -> float:
    """How far a departure may be from that of the linear map because forces are not linear over 0.1 rad, s.

    By the second derivative of the force along the mode, relative to the linear force 0.1 rad away, over the rate.
    """
    n, rate = at.nv, at.modes[0][0]
    shape = at.shapes[:n, 0].real
    curved = np.linalg.solve(at.mass_matrix, at.curvature(shape)) * LEFT**2 / 2
    return float(np.abs(curved).max() / (abs(rate) ** 2 * LEFT) / rate.real)


def departures(dt: float, at: Held, engines: Mapping[str, Engine], methods: tuple[Method, ...]) -> list[dict]:
    """Rows for tables/departure.csv: every method that is led and every perturbation at one dt, from one saddle."""
    values, vectors = at.modes
    n = at.nv
    shape = vectors[:n, 0].real / np.abs(vectors[:n, 0]).max()
    column = "perturbation_" + unit_of_movements(at.case.robot).replace(" ", "_")
    rows, allowed = [], {"allowed_s": near(dt) + curved_by(at)} if at.case.robot.is_read else {}
    for method in (method for method in methods if is_led(at, method.scheme, dt)):
        own = own_torque(method, engines, at)
        steps = round(LONGEST_DEPARTURE / dt)
        sizes = [(size, size * shape, own) for size in PERTURBATIONS]
        # an error of torque that moves the equilibrium by size x shape, as far as doubles can say it
        push = at.mass_matrix @ shape * values[0].real ** 2
        if any(at.tree.damping) or values[0].imag:
            push = at.mass_matrix @ at.matrix[n:, :n] @ shape
        sizes += [(size, np.zeros(n), own + size * push) for size in TORQUE_ERRORS]
        if at.case.robot.is_read:
            sizes = [(size, *more) for size, *more in sizes if not_lost(at, size)]
        starts, torques = (np.array(values) for values in list(zip(*sizes))[1:])
        off = residual(method, engines, at, torques)
        expected = predicted(at, method.scheme, dt, [moved for _, moved, _ in sizes], off)
        if allowed and None not in expected:
            steps = min(steps, round((max(expected) + 2.0 * allowed["allowed_s"]) / dt))
        with np.errstate(over="ignore", invalid="ignore"):
            dynamics = engines[method.engine].of(at.case)
            motion = dynamics.run(at.moved(starts), np.zeros_like(starts), torques, dt, steps, method.name)
        for (size, moved, _), time, path in zip(sizes, expected, motion.q):
            rows.append({
                "scene": at.name + ("" if moved.any() else ", torque off"), "engine": method.engine,
                "method": method.name, "dt_s": dt, column: size, "predicted_s": time,
                "observed_s": departure(motion.t, at.away(path)), **allowed,
            })  # fmt: skip
    return rows


def check_departures(result: Result, rows: list[dict]) -> None:
    """The table of departures and a check for each."""
    if not rows:
        return
    result.tables.setdefault("departure", []).extend(rows)
    for row in rows:
        size = f"{size_of(row):.0e} {unit_in(row)}"
        check_row(result, f"{row['scene']}, {who(row)}, dt = {row['dt_s']:.4g} s, {size}", row)
    result.find("departures", **departure_values(rows))


def not_led(at: Held, methods: tuple[Method, ...], dts: Iterable[float]) -> list[tuple[str, float]]:
    """The methods and steps with which another mode grows faster than that of the saddle: they are left out."""
    return [(method.label, dt) for method in methods for dt in dts if not is_led(at, method.scheme, dt)]


def column_of(row: dict) -> str:
    """The column of a row's perturbation."""
    return next(name for name in row if name.startswith("perturbation_"))


def unit_in(row: dict) -> str:
    """The unit of a row's perturbation."""
    return column_of(row).removeprefix("perturbation_").replace("_", " ")


def size_of(row: dict) -> float:
    """A row's perturbation, in that unit."""
    return row[column_of(row)]


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
    result.check(where, quantity, None if off is None else abs(off), near_row(row), "s", note, about=About.PREDICTION)


def departure_values(rows: list[dict]) -> dict:
    """How many departures are as predicted, and the worst."""
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    neither = sum(row["observed_s"] is row["predicted_s"] is None for row in rows)
    worst = max(both, key=lambda row: abs(late(row)), default=None)
    return {
        "postures": list(dict.fromkeys(row["scene"].removesuffix(", torque off") for row in rows)),
        "count": len(rows),
        "leave": len(both),
        "close": sum(abs(late(row)) <= near_row(row) for row in both),
        "worst": worst
        and {"off": abs(late(worst)), "method": who(worst), "dt": worst["dt_s"], "scene": worst["scene"]},
        "stay": neither,
        "differ": len(rows) - len(both) - neither,
    }


def span(times: Iterable[float | None]) -> tuple[float, float] | None:
    """The first and the last of some times; None: there is none. A time of None: never."""
    times = [time for time in times if time is not None]
    return (min(times), max(times)) if times else None


def near_row(row: dict) -> float:
    """How near its prediction a departure is to be, s."""
    return row.get("allowed_s", near(row["dt_s"]))


def near(dt: float) -> float:
    """How near a prediction an observed departure is to be, s: one step or 0.03 s."""
    return max(DEPARTURE_TOLERANCE, dt) * (1.0 + 1e-9)


# torques that hold


def own_torque(method: Method, engines: Mapping[str, Engine], at: Held) -> np.ndarray:
    """The torque under which the compiled arithmetic of an engine gives no acceleration at all at the posture, (n,) N m.

    MuJoCo's is its own bias. TMT's is sought among the torques within two ulps of its reference torque: the one whose
    residual is least; compiled code regroups the sums, and there may be no double that it takes for its bias.
    """
    if method.engine == "mujoco":
        own = engines["mujoco"].of(at.case).gravity_balance(at.q)
        return own + literal.spring_torque(at.q, at.tree) if at.tree.has_springs else own
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
    """The torques within `reach` ulps of each component, (k, n) N m; the one in the middle is tau itself.

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
