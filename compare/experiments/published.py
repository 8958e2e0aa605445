"""Every number that the assignment prints, from TMT, from MuJoCo and exactly."""

from dataclasses import dataclass

import numpy as np

import tmt
from tmt.reference import distance, exact

from .agreement import EPS, FACTOR, Result, acceleration_scale, gravity_scale, mass_scale
from .scenes import posture

TITLE = "Published numbers: does either engine contradict the assignment?"
CLAIM = (
    "Every number that the assignment prints, f2 and f3 apart, is met by TMT, by MuJoCo and by exact arithmetic. f2 and f3 "
    "are zero but for rounding, and both engines are within rounding of what is exact at the doubles nearest to pi and pi/2. "
    "That is f3 to every printed digit, for TMT too; of f2 it shares the size of the first entry."
)
BAR = (
    f"Half a unit of the last printed digit plus 64 eps x scale ({gravity_scale():.2f} N m; the largest entry of Mbar; for "
    f"accelerations (cond(Mbar) + 1) x |Mbar^-1| x {gravity_scale():.2f} N m). f2, f3, f4: the rounding alone, from the exact "
    "value; f3 and the first entry of f2, for exact arithmetic (f3 for TMT too), half a unit of the last printed digit."
)
LAST_DIGIT = 0.5e-18  # rad/s2, half a unit of the last digit that f2 and f3 are printed with
AXES = ("alpha", "beta", "gamma")


@dataclass(frozen=True)
class Item:
    """One printed answer."""

    item: str
    quantity: str
    posture: str
    values: tuple
    unit: str
    half_digit: float  # half a unit of the last printed digit; 0: zero but for rounding
    torque: str = "none"


ITEMS = (
    Item("c", "holding torque", "zero", (-2.2072, 0.0, -2.2072), "N m", 0.5e-4),
    Item("f1", "qdd", "zero", (0.0, 0.0, 41.8436), "rad/s2", 0.5e-4),
    Item("f2", "qdd", "hanging", (0.1641e-14, 0.0, 0.3021e-14), "rad/s2", 0.0),
    Item("f3", "qdd", "upright", (-0.3456e-14, 0.0, 0.0192e-14), "rad/s2", 0.0),
    Item("f4", "qdd", "zero", (0.0, 0.0, 0.0), "rad/s2", 0.0, torque="c"),
    Item("g", "Mbar", "zero", ((0.2445, 0.0, 0.0527), (0.0, 0.1938, 0.0), (0.0527, 0.0, 0.0527)), "kg m2", 0.5e-4),
    Item("h", "holding torque", "ball catch", (-2.6164, 1.9627, 0.8135), "N m", 0.5e-4),
)


def answers(item, engine) -> tuple:
    """(exact, TMT, MuJoCo, scale) for one item; exact as mpmath numbers."""
    q = posture(item.posture)
    rest = np.zeros_like(q)
    tau = tmt.gravity_balance(q) if item.torque == "c" else rest
    truth = exact(tmt.ARM, q, rest, tau)
    if item.quantity == "Mbar":
        return truth.mass_matrix, tmt.mass_matrix(q), engine.mass_matrix(q), mass_scale(q[None])[0]
    if item.quantity == "qdd":
        scale = acceleration_scale(q[None], gravity_scale())[0]
        return truth.acceleration, tmt.acceleration(q, rest, tau), engine.acceleration(q, rest, tau), scale
    return truth.gravity_balance, tmt.gravity_balance(q), engine.gravity_balance(q), gravity_scale()


def rows(setup) -> Result:
    """One row for each printed component, one check for each item and engine."""
    result = Result("published", shown=["item", "quantity", "component", "published", "exact", "tmt", "mujoco", "unit"])
    found = {}
    for item in ITEMS:
        found[item.item] = truth, ours, theirs, scale = answers(item, setup.engine)
        judge(result, item, *found[item.item])
        exactly, printed = truth.astype(float), np.array(item.values)
        for index in np.ndindex(printed.shape):
            result.rows.append(
                {
                    "item": item.item,
                    "posture": item.posture,
                    "quantity": item.quantity,
                    "component": " ".join(AXES[i] for i in index),
                    "unit": item.unit,
                    "published": printed[index],
                    "exact": exactly[index],
                    "tmt": ours[index],
                    "mujoco": theirs[index],
                    "tolerance": item.half_digit + FACTOR * EPS * scale,
                }
            )
    result.notes = [shared(item, *found[item.item]) for item in ITEMS if item.item in ("f2", "f3")]
    result.notes += slips(found["c"], setup.engine)
    return result


def judge(result, item, truth, ours, theirs, scale) -> None:
    """The checks of one item: against the printed digits, or, where those are rounding, against the exact value."""
    printed, bar, where = np.array(item.values), FACTOR * EPS * scale, f"({item.item}) {item.posture}"
    exactly = truth.astype(float)
    for engine, values in (("TMT", ours), ("MuJoCo", theirs), ("exact", exactly)):
        if item.half_digit:
            off, tolerance = np.abs(values - printed).max(), item.half_digit + bar
            result.check(where, f"{engine}: {item.quantity} - printed", off, tolerance, item.unit)
        elif engine != "exact":
            off = distance(values, truth).max()
            result.check(where, f"{engine}: {item.quantity} - exact", off, bar, item.unit, rounding=True)
    if item.item == "f3":
        for engine, values in (("exact", exactly), ("TMT", ours)):
            result.check(where, f"{engine}: qdd - printed", np.abs(values - printed).max(), LAST_DIGIT, item.unit)
    if item.item == "f2":
        off = abs(abs(exactly[0]) - abs(printed[0]))
        result.check(where, "exact: |qdd_alpha| - |printed|", off, LAST_DIGIT, item.unit)


def shared(item, truth, ours, theirs, scale) -> str:
    """Which printed components of an item that is zero but for rounding are met to every digit, and by whom."""
    told = []
    for engine, values in (("exact arithmetic", truth.astype(float)), ("TMT", ours), ("MuJoCo", theirs)):
        met = [name for name, v, p in zip(AXES, values, item.values) if p and abs(v - p) <= LAST_DIGIT]
        turned = [name for name, v, p in zip(AXES, values, item.values) if p and abs(v + p) <= LAST_DIGIT]
        told.append(
            f"{engine} {' and '.join(met) if len(met) < np.count_nonzero(item.values) else 'all'}"
            if met
            else f"{engine} none"
        )
        if turned:
            told[-1] += f", and {' and '.join(turned)} with the other sign"
    printed, exactly = (", ".join(f"{float(v):.4g}" for v in values) for values in (item.values, truth))
    return (
        f"{item.item}, printed ({printed}) {item.unit}, is met to every digit by: {'; '.join(told)}. Rounding of the torque "
        f"allows {FACTOR * EPS * scale:.1e} {item.unit}; pi and pi/2 are no doubles, and at the doubles nearest to them exact "
        f"arithmetic gives ({exactly}) {item.unit}."
    )


def slips(holding, engine) -> list[str]:
    """The slips of the original, with what is right; `holding`: what `answers` gives for (c)."""
    q, qd = posture("ball catch"), np.ones(3)
    c, s = np.cos(q[1]), np.sin(q[1])
    texts = {
        "text": np.array([qd[1], c * qd[0], s * qd[0]]),  # (bd, 0, 0) + Rb (0, ad, 0)
        "matrix": np.array([[0.0, 1.0, 0.0], [c, 0.0, 0.0], [-s, 0.0, 0.0]]) @ qd,  # B_1 as it is stated
    }
    right = {"TMT": tmt.angular_velocities(q, qd)[0], "MuJoCo": engine.angular_velocities(q, qd)[0]}
    off = {
        name: ", ".join(f"{np.abs(values - omega).max():.1e} rad/s from {of}'s" for of, omega in right.items())
        for name, values in texts.items()
    }
    _, ours, theirs, _ = holding
    printed = ITEMS[0].values[0]
    signs = ["the sign" if printed * value > 0.0 else "not the sign" for value in (ours[0], theirs[0])]
    return [
        "The text writes omega_1 = (bd, 0, 0) + Rb (0, ad, 0), and the same for omega_2; body components need the "
        f"transposes Rb' and Rg'. At ball catch with unit rates the text's omega_1 is {off['text']}; that of the stated "
        f"B_1 is {off['matrix']}.",
        "The stacked T carries alpha, beta, gamma as three more rows with zero mass: no effect, not needed.",
        "The equation for Qbar omits the transpose of T_b; the one for Mbar carries a stray qdd; the first line of "
        "virtual power has the gyroscopic term with the wrong sign; the second derivative of x is bracketed wrongly; "
        "two parts are called g.",
        "The program leaves an unused inertia matrix with mixed axes; states are listed with five entries where six are "
        "meant; the caption of Figure 3 repeats 'ball catch' and the number 2.",
        f"The sign of (c): the printed {printed} has {signs[0]} of the torque that holds TMT's arm ({ours[0]:+.5f} N m) and "
        f"{signs[1]} of MuJoCo's qfrc_bias at rest ({theirs[0]:+.5f} N m); the original's formula gives the opposite of what it "
        "prints. Its program flips gravity in the torque function and adds the result, and that function is right only at "
        "rest: the convective sign is wrong and the Euler part is missing.",
    ]


def figures(result):
    yield from ()
