"""How long a held arm stays: departure from ball catch, a saddle, and from zero, a marginal posture."""

from itertools import product

import numpy as np
from scipy.integrate import quad

import tmt
from tmt import method
from tmt.dual import seeded

from .linear import held
from .motion import LEFT, departure
from .parties import Party
from .scenes import posture

LONGEST = 12.0  # s
SHORT = 1e-6  # s
PERTURBATIONS = tuple(10.0**-k for k in (2, 4, 6, 8, 10, 12))  # rad, of the angles at the start
TORQUES = (1e-13, 1e-14, 3e-15)  # rad, as the error of torque that moves the equilibrium as far; less is a few ulps
NEAR = 0.03  # s, or one step: how near the prediction an observed departure is to be
SCHEMES = (
    Party("TMT", "rk4"), Party("TMT", "semi_implicit_euler"), Party("TMT", "implicit"), Party("TMT", "implicit_midpoint"),
    Party("TMT", "gauss_legendre_4"), Party("TMT", "explicit_euler"),
    Party("MuJoCo", "Euler"), Party("MuJoCo", "implicit"), Party("MuJoCo", "RK4"),
)  # fmt: skip
EXPONENT = 0.02  # how near -1/2 the exponent of the time to leave zero is to be
ZERO_SIZES = tuple(10.0**-k for k in (2, 2.5, 3, 3.5, 4, 4.5, 5))  # rad


def own_torque(party, mujoco, at) -> np.ndarray:
    """The torque under which the compiled arithmetic of a party gives no acceleration at all at the posture, N m.

    MuJoCo's is its own bias. TMT's is sought among the torques within two ulps of its reference torque: the one whose
    residual is least; compiled code regroups the sums, and there may be no double that it takes for its bias.
    """
    if party.engine == "MuJoCo":
        return mujoco.gravity_balance(at.q)
    tau = variants(at.tau, 2)
    return tau[np.argmin(np.abs(residual(party, mujoco, at, tau)).max(axis=1))]


def residual(party, mujoco, at, tau) -> np.ndarray:
    """The torque by which tau, (..., n) N m, fails to hold the posture in the arithmetic of a party, to less than an ulp.

    Read from the first of its steps, which is so short that the arm does not move: Mbar qd / dt.
    """
    _, qd = party.run(mujoco, at.model, at.q + np.zeros_like(tau), np.zeros_like(tau), tau, SHORT, 1)
    return qd[..., 1, :] @ tmt.mass_matrix(at.q) / SHORT


def variants(tau, reach=1) -> np.ndarray:
    """The torques within so many ulps of each component, 27 for one ulp, (27, 3) N m; the middle one is tau itself."""
    away = range(-reach, reach + 1)
    return np.array(list(product(*([t + k * np.spacing(abs(t)) for k in away] for t in tau))))


def offset(at, off) -> np.ndarray:
    """How far the posture is from the equilibrium of the held torque plus a small torque, rad and N m (k, n)."""
    stiffness = at.matrix[3:, :3]
    return np.linalg.solve(stiffness, np.linalg.solve(tmt.mass_matrix(at.q), np.transpose(off))).T


def predicted(at, scheme, dt, moved, off, longest=LONGEST, rounded=True) -> list:
    """When the method's own linear map has the arm 0.1 rad away, s, for each of many starts; None: not within `longest`.

    moved: angles at the start from the posture, (k, n) rad; off: torques beyond the one that holds, (k, n) N m. The map
    carries all modes of the state about the equilibrium that this torque moves. rounded: each new angle is rounded to a
    double, as in a run, so that what a step adds may be lost; the rates are too small for that to matter.
    """
    change = (at.step(scheme, dt) - np.eye(2 * len(at.q))).T
    base = at.q if rounded else np.zeros_like(at.q)
    start, aside = base + np.asarray(moved), offset(at, off)
    q, qd = start.copy(), np.zeros_like(start)
    times = [None] * len(start)
    for k in range(1, round(longest / dt) + 1):
        added = np.concatenate([q - base + aside, qd], axis=1) @ change
        q, qd = q + added[:, : len(at.q)], qd + added[:, len(at.q) :]
        gone = ~(np.abs(q - start).max(axis=1) <= LEFT)
        if gone.any():
            times = [k * dt if time is None and out else time for time, out in zip(times, gone)]
            if None not in times:
                break
    return times


def examine(dt, mujoco, parties) -> list:
    """Rows for tables/departure.csv: every party and perturbation at one dt, in one scene."""
    at = held("ball catch", posture("ball catch"))
    values, vectors = at.modes
    shape = vectors[:3, 0].real / np.abs(vectors[:3, 0]).max()
    steps = round(LONGEST / dt)
    t = dt * np.arange(steps + 1)
    rows = []
    for party in parties:
        own = own_torque(party, mujoco, at)
        sizes = [(size, size * shape, own) for size in PERTURBATIONS]
        # an error of torque that moves the equilibrium by size x shape, as far as doubles can say it
        push = tmt.mass_matrix(at.q) @ shape * values[0].real ** 2
        sizes += [(size, np.zeros(3), own + size * push) for size in TORQUES]
        starts, torques = (np.array([of[k] for of in sizes]) for k in (1, 2))
        with np.errstate(over="ignore", invalid="ignore"):
            paths, _ = party.run(mujoco, at.model, at.q + starts, np.zeros_like(starts), torques, dt, steps)
        left = residual(party, mujoco, at, torques)
        expected = predicted(at, party.scheme, dt, [moved for _, moved, _ in sizes], left)
        for k, ((size, _, _), time, path) in enumerate(zip(sizes, expected, paths)):
            rows.append({
                "scene": at.name + (", torque off" if k >= len(PERTURBATIONS) else ""), "engine": party.engine,
                "method": party.method, "dt_s": dt, "perturbation_rad": size, "predicted_s": time,
                "observed_s": departure(t, path),
            })  # fmt: skip
    return rows


def zero_law(party, mujoco, sizes=ZERO_SIZES) -> list:
    """Rows of the same table at zero, a marginal posture: predicted from its cubic potential, not from a limit.

    Along the mode without stiffness m q'' = c q^2 with c = -V'''/2, so t = sqrt(3 m/(2 c)) times the integral of
    1/sqrt(q^3 - p^3) from p to 0.1 rad beyond: about 2.43 sqrt(3 m/(2 c p)) for small p.
    """
    at = held("zero", posture("zero"))
    shape, slope = cubic(at)
    dt, rows = 0.01, []
    for sign, size in product((1.0, -1.0), sizes):
        start = sign * size
        expected = fall_time(slope, start)
        steps = round(1.5 * expected / dt)
        q, _ = party.run(mujoco, at.model, at.q + start * shape, np.zeros(3), own_torque(party, mujoco, at), dt, steps)
        rows.append({
            "scene": "zero", "engine": party.engine, "method": party.method, "dt_s": dt, "perturbation_rad": start,
            "predicted_s": expected, "observed_s": departure(dt * np.arange(steps + 1), q),
        })  # fmt: skip
    return rows


def cubic(at) -> tuple[np.ndarray, float]:
    """The mode without stiffness, scaled to 1 rad and turned so that the arm falls along it, and c/m in q'' = c/m q^2.

    c by nested dual numbers: the second derivative of the torque dV/dq along the mode.
    """
    values, vectors = np.linalg.eigh(-tmt.mass_matrix(at.q) @ at.matrix[3:, :3])
    shape = vectors[:, np.argmin(np.abs(values))]
    shape = shape / np.abs(shape).max()

    def second(direction):
        inner = seeded([float(a) for a in at.q], list(direction))
        outer = seeded(inner, list(direction))
        torque = method.bias(method.bodies(at.model, outer), at.model.gravity)
        along = sum((component * float(d) for component, d in zip(torque, direction)), 0.0)
        return float(inner[0].parts(outer[0].parts(along)[1])[1])

    ratio = -0.5 * second(shape) / (shape @ tmt.mass_matrix(at.q) @ shape)
    return (shape, ratio) if ratio > 0.0 else (-shape, -ratio)


def fall_time(slope, start) -> float:
    """Time from rest at `start` to 0.1 rad beyond it in q'' = slope q^2, s."""
    end = start + LEFT
    # q = start + u^2 takes the root out of the integrand at the start
    value, _ = quad(
        lambda u: 2.0 / np.sqrt(u**4 + 3.0 * start * u**2 + 3.0 * start**2), 0.0, np.sqrt(end - start), limit=500
    )
    return float(np.sqrt(1.5 / slope) * value)


def judge(result, rows, falls) -> None:
    """The table of departures, a check for each, and the law of zero. falls: those of the rows that start at zero."""
    result.tables.setdefault("departure", []).extend(rows)
    for row in rows:
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s"
        check_row(result, f"{where}, {row['perturbation_rad']:.0e} rad", row)
    result.notes.append(tell_departures(rows))
    slopes = {}
    for engine in dict.fromkeys(row["engine"] for row in falls):
        for sign, side in ((1.0, "along the fall"), (-1.0, "against it")):
            mine = [row for row in falls if row["engine"] == engine and row["perturbation_rad"] * sign > 0.0]
            slopes[engine, side] = exponent(mine)
            off = None if slopes[engine, side] is None else abs(slopes[engine, side] + 0.5)
            result.check(f"zero, {engine}, {side}", "exponent of the time to leave, from -1/2", off, EXPONENT, "")
    if falls:
        result.notes.append(tell_falls(falls, list(slopes.values())))


def late(row) -> float | None:
    """By how much a run leaves later than predicted, s: 0 where neither leaves, None where only one of them does."""
    times = row["observed_s"], row["predicted_s"]
    if None in times:
        return 0.0 if times == (None, None) else None
    return times[0] - times[1]


def check_row(result, where, row) -> None:
    """The check of one departure: as predicted to one step or 0.03 s; where the prediction stays, the run stays too."""
    off = late(row)
    missing = {"observed_s": "the run stays", "predicted_s": "the prediction stays"}
    note = " and ".join(text for key, text in missing.items() if row[key] is None)
    quantity = "departure, observed - predicted"
    result.check(where, quantity, None if off is None else abs(off), near(row["dt_s"]), "s", note)


def tell_departures(rows) -> str:
    """How many departures are as predicted, and the farthest."""
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    neither = sum(row["observed_s"] is row["predicted_s"] is None for row in rows)
    close = sum(abs(late(row)) <= near(row["dt_s"]) for row in both)
    told = f"{len(rows)} starts at ball catch and zero: {len(both)} leave in the run and in the prediction"
    if both:
        worst = max(both, key=lambda row: abs(late(row)))
        coarsest = max((row["dt_s"] for row in both), default=0.0)
        told += (
            f", {close} of these within one step or {NEAR:g} s; the largest difference is {abs(late(worst)):.3f} s "
            f"({worst['scene']}, {worst['engine']} {worst['method']}, dt = {worst['dt_s']:.4g} s, "
            f"{worst['perturbation_rad']:g} rad)"
        )
        fine = [abs(late(row)) for row in both if row["dt_s"] < coarsest]
        told += f", and {max(fine):.3f} s at steps below {coarsest:.4g} s" if fine else ""
    told += f"; staying in both: {neither}" if neither else ""
    lost = len(rows) - len(both) - neither
    return told + (f"; staying in only one of the two: {lost}." if lost else ".")


def exponent(rows) -> float | None:
    """The power of the perturbation with which the time to leave goes, from the rows up to 1e-4 rad; None: not known."""
    small = [row for row in rows if abs(row["perturbation_rad"]) <= 1e-4 * (1 + 1e-9)]
    if len(small) < 2 or any(row["observed_s"] is None for row in small):
        return None
    sizes, times = ([abs(row[key]) for row in small] for key in ("perturbation_rad", "observed_s"))
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def tell_falls(falls, slopes) -> str:
    """The law of the time to leave zero, and what the runs make of it."""
    known = [slope for slope in slopes if slope is not None]
    law = "no series of runs leaves, so they give no power"
    if known:
        law = (
            f"{len(known)} of {len(slopes)} series, an engine and a side each, leave, up to 1e-4 rad with the power "
            f"{min(known):.3f} to {max(known):.3f}"
        )
    one = max(falls, key=lambda row: row["perturbation_rad"])
    return (
        f"Zero, held: the potential along the mode without stiffness is cubic, which predicts a time that goes with the "
        f"power -1/2. In the runs {law}. From {one['perturbation_rad']:g} rad along the fall the law gives "
        f"{one['predicted_s']:.2f} s and the run takes {span([one['observed_s']])}."
    )


def span(times) -> str:
    """The first and the last of some times in words; None among them stands for never."""
    times = [time for time in times if time is not None]
    if not times:
        return "no time within reach"
    low, high = (f"{time:.2f}" for time in (min(times), max(times)))
    return f"{low} s" if low == high else f"{low} to {high} s"


def near(dt) -> float:
    """How near a prediction an observed departure is to be, s: one step or 0.03 s."""
    return max(NEAR, dt) * (1.0 + 1e-9)
