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
TORQUES = tuple(10.0**-k for k in (13, 14, 15))  # rad, as the error of torque that moves the equilibrium as far
NEAR = 0.03  # s, or one step: how near the prediction an observed departure is to be
SCHEMES = (
    Party("TMT", "rk4"), Party("TMT", "semi_implicit_euler"), Party("TMT", "implicit"), Party("TMT", "implicit_midpoint"),
    Party("TMT", "gauss_legendre_4"), Party("TMT", "explicit_euler"),
    Party("MuJoCo", "Euler"), Party("MuJoCo", "implicit"), Party("MuJoCo", "RK4"),
)  # fmt: skip
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
    """How far the posture is from the equilibrium of the held torque plus a small torque, rad (n,), N m (n,)."""
    stiffness = at.matrix[3:, :3]
    return np.linalg.solve(stiffness, np.linalg.solve(tmt.mass_matrix(at.q), off))


def predicted(at, scheme, dt, moved, off, longest=LONGEST) -> float | None:
    """When the method's own linear map has the arm 0.1 rad away, s; None: not within `longest`.

    moved: angles at the start from the posture, rad; off: torque beyond the one that holds, N m. The map carries all six
    modes of the state about the equilibrium that this torque moves.
    """
    J = at.step(scheme, dt)
    equilibrium = -offset(at, off)
    state = np.concatenate([moved - equilibrium, np.zeros(3)])
    for k in range(1, round(longest / dt) + 1):
        state = J @ state
        if np.abs(state[:3] + equilibrium - moved).max() > LEFT:
            return k * dt
    return None


def stuck(at, dt, moved, off) -> float:
    """For how long at most rounding keeps the arm in place, s: while dt qd is below half an ulp of every angle."""
    push = at.matrix[3:, :3] @ (moved + offset(at, off))
    with np.errstate(divide="ignore"):
        return float(np.min(0.5 * np.spacing(np.abs(at.q)) / np.abs(dt * push)))


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
        for (size, moved, _), off, path in zip(sizes, left, paths):
            rows.append({
                "scene": at.name + (", torque off" if size in TORQUES else ""), "engine": party.engine, "method": party.method,
                "dt_s": dt, "perturbation_rad": size, "predicted_s": predicted(at, party.scheme, dt, moved, off),
                "observed_s": departure(t, path), "stuck_s": stuck(at, dt, moved, off),
            })  # fmt: skip
    return rows


def zero_law(party, mujoco) -> list:
    """Rows of the same table at zero, a marginal posture: predicted from its cubic potential, not from a limit.

    Along the mode without stiffness m q'' = c q^2 with c = -V'''/2, so t = sqrt(3 m/(2 c)) times the integral of
    1/sqrt(q^3 - p^3) from p to 0.1 rad beyond: about 2.43 sqrt(3 m/(2 c p)) for small p.
    """
    at = held("zero", posture("zero"))
    shape, slope = cubic(at)
    dt, rows = 0.01, []
    for sign, size in product((1.0, -1.0), ZERO_SIZES):
        start = sign * size
        expected = fall_time(slope, start)
        steps = round(1.5 * expected / dt)
        q, _ = party.run(mujoco, at.model, at.q + start * shape, np.zeros(3), own_torque(party, mujoco, at), dt, steps)
        rows.append({
            "scene": "zero", "engine": party.engine, "method": party.method, "dt_s": dt, "perturbation_rad": start,
            "predicted_s": expected, "observed_s": departure(dt * np.arange(steps + 1), q), "stuck_s": 0.0,
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
    """The table of departures, a check for each, and what rounding adds where steps are too small to move an angle."""
    late = []
    for row in rows:
        waiting = row.pop("stuck_s", 0.0)
        result.tables.setdefault("departure", []).append(row)
        where = f"{row['scene']}, {row['engine']} {row['method']}, dt = {row['dt_s']:.4g} s, {row['perturbation_rad']:.0e} rad"
        if row["predicted_s"] is None and row["observed_s"] is None:
            continue
        if row["predicted_s"] is None or row["observed_s"] is None:
            result.check(where, "departure, observed - predicted", np.nan, 0.0, "s")
            continue
        late_by, aim = row["observed_s"] - row["predicted_s"], near(row["dt_s"])
        off = abs(late_by)
        result.check(where, "departure, observed - predicted", off, aim + (waiting if late_by > 0.0 else 0.0), "s")
        late += [(off, waiting, where)] if off > aim else []
    if late:
        off, waiting, where = max(late)
        result.notes.append(
            f"{len(rows) - len(late)} of {len(rows)} departures are within one step or {NEAR:g} s of the prediction. "
            f"The other {len(late)} leave later, by at most {off:.2f} s ({where}): there dt qd stays below half a unit "
            f"in the last place of every angle, which keeps the arm in place for up to {waiting:.2f} s, and no linear "
            "map knows of that."
        )
    else:
        result.notes.append(f"All {len(rows)} departures are within one step or {NEAR:g} s of the prediction.")
    if falls and all(row["observed_s"] is not None for row in falls):
        slopes = []
        for engine in dict.fromkeys(row["engine"] for row in falls):
            for sign in (1.0, -1.0):
                one = [row for row in falls if row["engine"] == engine and row["perturbation_rad"] * sign > 0.0]
                small = [row for row in one if abs(row["perturbation_rad"]) <= 1e-4 * (1 + 1e-9)]
                sizes, times = ([abs(row[key]) for row in small] for key in ("perturbation_rad", "observed_s"))
                slopes.append(float(np.polyfit(np.log(sizes), np.log(times), 1)[0]))
                result.check(
                    f"zero, {engine}", "exponent of the time to leave, from -1/2", abs(slopes[-1] + 0.5), 0.02, ""
                )
        result.notes.append(
            "Zero is marginal: two eigenvalues are zero, the potential along that mode is cubic, and the arm leaves "
            f"algebraically: the time to leave goes with the perturbation to the power {min(slopes):.3f} to "
            f"{max(slopes):.3f} (law: -1/2) below 1e-4 rad, {falls[0]['observed_s']:.2f} s from "
            f"{falls[0]['perturbation_rad']:g} rad. There is no limit to show."
        )


def span(times) -> str:
    """The first and the last of some times in words; None among them stands for never."""
    times = [time for time in times if time is not None]
    return f"{min(times):.2f} to {max(times):.2f} s" if times else "no time within reach"


def near(dt) -> float:
    """How near a prediction an observed departure is to be, s: one step or 0.03 s."""
    return max(NEAR, dt * (1.0 + 1e-9))
