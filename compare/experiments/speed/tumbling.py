"""The order of every method on a free asymmetric body, against Jacobi's elliptic functions: for robots with balls."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import tmt

from ...engines import LABELS, Engine, Method
from ...engines.mujoco import engine, read
from ...judge.check import About, Result
from ...robots import Robot
from ...robots.case import Case
from ...truth.free_body import free_turning
from .advice import CLEAR, REGULAR, check_order

BODY = "free asymmetric body"
MASS, MOMENTS = 1.0, (0.03, 0.05, 0.06)  # kg, kg m2 about the principal axes
QUATERNION, SPEEDS = (
    (0.5, 0.5, -0.5, 0.5),
    (480.0, 120.0, 360.0),
)  # deg/s about its own axes: it tumbles, far from a steady turn
TUMBLED, READ = 2.0, 8  # s; equal times at which it is read
FIRST_COUNT, LAST_COUNT = 16, 8192  # steps, doubled again and again
HINGE_ORDER = {"RK4": 4}  # of MuJoCo's integrators, where all joints are hinges; of the others 1
TEXT = """<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="stone">
      <joint name="turn" type="ball"/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{moments}"/>
    </body>
  </worldbody>
</mujoco>"""


def stone() -> Robot:
    """The body: one ball, its centre of mass in it, no gravity."""
    tree = tmt.Tree(
        hinge_names=["turn"], parent=[-1], offset=[(0.0, 0.0, 0.0)], axis=np.eye(3), damping=[0.0] * 3,
        body_names=["stone"], body_hinge=[0], mass=[MASS], com=[(0.0, 0.0, 0.0)], inertia=[np.diag(MOMENTS)],
        gravity=(0.0, 0.0, 0.0), kind=["ball"],
    )  # fmt: skip
    return Robot(BODY, Path("stone.xml"), tree, {}, ())


def mjcf() -> str:
    """The same body as MJCF."""
    return TEXT.format(mass=repr(MASS), moments=" ".join(map(repr, MOMENTS)))


def orders_on_a_body(result: Result, engines: Mapping[str, Engine]) -> list[dict]:
    """Rows and checks: each method of fixed step of both engines, its order and the one measured; and a sentence in `result`."""
    case = stone().case("tumbling", posture=QUATERNION, speed=SPEEDS)
    times = np.linspace(0.0, TUMBLED, READ + 1)
    _, exact = free_turning(times, MOMENTS, case.v, case.q)
    exact, table = exact.astype(float), []
    for of_body in (engines["tmt"], engine(read(mjcf()))):
        for method in of_body.methods.values():
            found = None if method.adaptive else order_of(case, of_body, method, exact)
            if found:
                order, coarse, fine = found
                table.append(
                    {"scene": BODY, "engine": method.engine, "method": method.name, "order": method.order,
                     "measured_order": order, "from_dt_s": coarse, "to_dt_s": fine}
                )  # fmt: skip
                check_order(result, f"{BODY}, {method.engine} {method.name}", method.order, order)
            elif not method.adaptive:
                where = f"{BODY}, {method.engine} {method.name}"
                result.check(where, "runs that show its order", 0, 1, "runs", rule="at least", about=About.PREDICTION)
    result.notes.append(orders_in_words(table))
    return table


def order_of(case: Case, engine: Engine, method: Method, exact: np.ndarray) -> tuple[float, float, float] | None:
    """The order between the two finest steps whose errors fall regularly, and these steps, s; None: there are no two.

    exact: quaternions at the times that are read.
    """
    dynamics, regular, count = engine.of(case), [], FIRST_COUNT
    while count <= LAST_COUNT:
        q = dynamics.run(*case.start, case.tau, TUMBLED / count, count, method.name).q[:: count // READ]
        error = np.abs(case.coordinates.difference(q, exact)).max()
        if CLEAR < error < REGULAR:
            regular.append((TUMBLED / count, error))
        elif regular:
            break
        count *= 2
    if len(regular) < 2:
        return None
    (coarse, large), (fine, small) = regular[-2:]
    return float(np.log2(large / small)), coarse, fine


def orders_in_words(table: list[dict]) -> str:
    """The orders in a sentence."""
    parts = []
    for name in dict.fromkeys(row["engine"] for row in table):
        own = [f"{row['method']} {row['measured_order']:.2f}" for row in table if row["engine"] == name]
        parts.append(f"{LABELS[name]}: {', '.join(own)}")
    words = (
        f"The robot has joints about which a body turns freely. The orders of the methods on a {BODY}, measured against Jacobi's "
        f"elliptic functions, are for {'; for '.join(parts)}."
    )
    lower = [
        row
        for row in table
        if row["engine"] == "mujoco" and row["measured_order"] < HINGE_ORDER.get(row["method"], 1) - 0.5
    ]
    for row in lower:
        words += (
            f" {LABELS['mujoco']}'s {row['method']} has order {row['measured_order']:.2f} there, where it has "
            f"{HINGE_ORDER.get(row['method'], 1)} with hinges: it turns a body by the mean of its speeds."
        )
    return words
