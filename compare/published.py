"""Every number that the assignment prints, from TMT, from MuJoCo and exactly."""

from dataclasses import dataclass

import numpy as np

import tmt
from tmt.reference import distance, exact

from .agreement import EPS, FACTOR, Result, acceleration_scale, gravity_scale, mass_scale
from .scenes import posture

TITLE = "Published numbers: does either party contradict the assignment?"
CLAIM = (
    "Every number that the assignment prints, but f2 and f3, is met by TMT, by MuJoCo and by exact arithmetic. f2 and f3 "
    "are zero but for rounding, and both parties are within the bar of rounding there. Their printed digits are not "
    "noise: pi and pi/2 are not doubles, and exact arithmetic at the doubles nearest to them gives f3 to every printed "
    "digit, as TMT does; of f2 the printed value shares only the size of its first entry, and not the sign."
)
BAR = (
    "Half a unit of the last printed digit plus 64 eps x scale (9.42 N m; the largest entry of Mbar; for accelerations "
    "(cond(Mbar) + 1) x |Mbar^-1| x 9.42 N m). f2, f3, f4: the rounding bar alone, from the exact value; f3 and the "
    "first entry of f2, for exact arithmetic (f3 for TMT too), half a unit of the last printed digit."
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
    """One row for each printed component, one check for each item and party."""
    result = Result("published", shown=["item", "quantity", "component", "published", "exact", "tmt", "mujoco", "unit"])
    for item in ITEMS:
        truth, ours, theirs, scale = answers(item, setup.engine)
        printed = np.array(item.values)
        bar = FACTOR * EPS * scale
        parties = {"TMT": ours, "MuJoCo": theirs, "exact": truth.astype(float)}
        where = f"({item.item}) {item.posture}"
        for party, values in parties.items():
            if item.half_digit:
                off, tolerance = np.abs(values - printed).max(), item.half_digit + bar
                result.check(where, f"{party}: {item.quantity} - printed", off, tolerance, item.unit)
            elif party != "exact":
                off = distance(values, truth).max()
                result.check(where, f"{party}: {item.quantity} - exact", off, bar, item.unit, rounding=True)
        for index in np.ndindex(printed.shape):
            result.rows.append(
                {
                    "item": item.item,
                    "posture": item.posture,
                    "quantity": item.quantity,
                    "component": " ".join(AXES[i] for i in index),
                    "unit": item.unit,
                    "published": printed[index],
                    "exact": parties["exact"][index],
                    "tmt": ours[index],
                    "mujoco": theirs[index],
                    "tolerance": item.half_digit + bar,
                }
            )
        if item.item == "f3":
            for party in ("exact", "TMT"):
                off = np.abs(parties[party] - printed).max()
                result.check(where, f"{party}: qdd - printed", off, LAST_DIGIT, item.unit)
        if item.item == "f2":
            off = abs(abs(parties["exact"][0]) - abs(printed[0]))
            note = "the only entry of f2 that the printed value shares, but for its sign"
            result.check(where, "exact: |qdd_alpha| - |printed|", off, LAST_DIGIT, item.unit, note)
    result.notes = slips()
    return result


def slips() -> list[str]:
    """The slips of the original, with what is right."""
    q, qd = posture("ball catch"), np.ones(3)
    right = tmt.angular_velocities(q, qd)[0]
    c, s = np.cos(q[1]), np.sin(q[1])
    text = np.array([qd[1], c * qd[0], s * qd[0]])  # (bd, 0, 0) + Rb (0, ad, 0)
    apart = np.abs(text - right).max()
    return [
        "The text writes omega_1 = (bd, 0, 0) + Rb (0, ad, 0), and the same for omega_2; body components need the "
        f"transposes Rb' and Rg'. At ball catch with unit rates the text's omega_1 is off by {apart:.4f} rad/s. The "
        "B matrices and the original program are right.",
        "The stacked T carries alpha, beta, gamma as three more rows with zero mass: no effect, not needed.",
        "The equation for Qbar omits the transpose of T_b; the one for Mbar carries a stray qdd; the first line of "
        "virtual power has the gyroscopic term with the wrong sign; the second derivative of x is bracketed wrongly; "
        "two parts are called g.",
        "The program leaves an unused inertia matrix with mixed axes; states are listed with five entries where six are "
        "meant; the caption of Figure 3 repeats 'ball catch' and the number 2.",
        f"The sign of (c): the printed {ITEMS[0].values[0]} is the torque that holds the arm (here "
        f"{tmt.gravity_balance(np.zeros(3))[0]:+.5f} N m, MuJoCo's qfrc_bias at rest); the original's formula gives the "
        "opposite sign. Its program flips gravity in the torque function and adds the result, and that function is right "
        "only at rest: the convective sign is wrong and the Euler part is missing.",
    ]


def figures(result):
    yield from ()
