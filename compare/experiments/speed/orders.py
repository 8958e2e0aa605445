"""The order of each method of fixed step: measured where errors fall regularly, and on a free asymmetric body."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

import tmt

from ...engines import Engine, Method
from ...engines.mujoco import engine, read
from ...judge.check import About, Result
from ...judge.run import ORDER_MARGIN
from ...robots import Robot
from ...robots.case import Case
from ...truth.free_body import free_turning
from .accuracy import NEAR_ROUNDING

EARLY = 1.0  # s: until then chaos has not grown, and errors fall regularly
REGULAR, CLEAR = 3e-2, 2e-12  # rad: an error up to EARLY between these falls with its order, far above rounding
LEAST_ORDER = {8: 7.0}  # a bound only: with order 8 rounding comes before the measured order settles

# the free body
BODY = "free asymmetric body"
MASS, MOMENTS = 1.0, (0.03, 0.05, 0.06)  # kg, kg m2 about the principal axes
QUATERNION, SPEEDS = (0.5, 0.5, -0.5, 0.5), (480.0, 120.0, 360.0)  # deg/s in body axes: it tumbles
TUMBLING_TIME, TIMES_READ = 2.0, 8  # s; equal times at which it is read
FIRST_COUNT, LAST_COUNT = 16, 8192  # steps, doubled repeatedly
ORDER_WITH_HINGES = {"RK4": 4}  # of MuJoCo's integrators; of the others 1
TEXT = """<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="stone">
      <joint name="turn" type="ball"/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{moments}"/>
    </body>
  </worldbody>
</mujoco>"""


def orders(result: Result, scenes: Sequence[str], methods: Sequence[Method], complete: bool = True) -> list[dict]:
    """Rows and checks: the stated and the measured order of each method of fixed step.

    complete: every method must show its order in at least one scene (coarse steps of a quick run do not allow that), unless
    its coarsest steps are already near rounding. For a robot from a file only an order that has settled is checked.
    """
    table, unsettled, of_file = [], [], result.curves.get("of_file")
    for scene in scenes:
        # the error of rounding, or of a reference in doubles, differs from robot to robot
        clear = max(CLEAR, NEAR_ROUNDING * result.curves["floors"][scene]) if of_file else CLEAR
        for method in methods:
            regular = [row for row in early_runs(result, scene, method) if clear < row["early"] < REGULAR]
            if len(regular) < 2:
                continue
            if of_file and method.order not in LEAST_ORDER and not has_settled(regular):
                unsettled.append(f"{scene}, {method.engine} {method.name}")
                continue
            coarse, fine = regular[-2:]  # theory applies best to the finest
            order = order_between(coarse, fine)
            table.append(record(result, scene, method, order, coarse["dt_s"], fine["dt_s"]))
    if unsettled:
        result.find("orders_not_settled", runs=unsettled, margin=ORDER_MARGIN)
    for method in methods if complete else ():
        shown = sum((row["engine"], row["method"]) == (method.engine, method.name) for row in table)
        if shown or not near_rounding(result, scenes, method):
            check_is_shown(result, f"{method.engine} {method.name}", "scenes", shown)
    return table


def record(result: Result, scene: str, method: Method, measured: float, coarse: float, fine: float) -> dict:
    """A row, and the check of its order; coarse, fine: the steps, s."""
    check_order(result, f"{scene}, {method.engine} {method.name}", method.order, measured)
    return {
        "scene": scene, "engine": method.engine, "method": method.name, "order": method.order,
        "measured_order": measured, "from_dt_s": coarse, "to_dt_s": fine,
    }  # fmt: skip


def order_between(coarse: dict, fine: dict) -> float:
    """The order by which the error falls from one row to a finer one."""
    return float(np.log(coarse["early"] / fine["early"]) / np.log(coarse["dt_s"] / fine["dt_s"]))


def has_settled(rows: Sequence[dict]) -> bool:
    """Whether the last two measured orders of these rows, from coarse to fine, differ by at most ORDER_MARGIN.

    An error C dt^p (1 + c dt) gives a measured order that differs from p by c dt / ln 4, half as much with half the step: the
    last change of the order is its distance from p.
    """
    return len(rows) > 2 and abs(order_between(*rows[-3:-1]) - order_between(*rows[-2:])) <= ORDER_MARGIN


def near_rounding(result: Result, scenes: Sequence[str], method: Method) -> bool:
    """Whether half the coarsest steps of a method would already show rounding."""
    firsts = [runs[0]["early"] for scene in scenes if (runs := early_runs(result, scene, method))]
    return bool(firsts) and all(first < CLEAR * 2.0**method.order for first in firsts)


def early_runs(result: Result, scene: str, method: Method) -> list[dict]:
    """The rows of a method in a scene, from coarse to fine."""
    place = (scene, method.engine, method.name)
    return [row for row in result.rows if (row["scene"], row["engine"], row["method"]) == place]


def check_order(result: Result, where: str, order: int, measured: float) -> None:
    """The measured order is the method's; of order 8 it is at least 7."""
    least = LEAST_ORDER.get(order)
    if least is None:
        name, note = f"distance of the measured order from {order}", f"{measured:.2f}"
        result.check(where, name, abs(measured - order), ORDER_MARGIN, "", note, about=About.PREDICTION)
    else:
        result.check(where, f"measured order, of {order}", measured, least, "", rule="at least", about=About.PREDICTION)


def check_is_shown(result: Result, where: str, unit: str, count: int) -> None:
    result.check(where, f"{unit} that show its order", count, 1, unit, rule="at least", about=About.PREDICTION)


def stone() -> Robot:
    """The free body: one ball joint in its centre of mass, no gravity."""
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
    """Rows and checks: the order of each method of fixed step of both engines against Jacobi's elliptic functions."""
    case = stone().case("tumbling", posture=QUATERNION, speed=SPEEDS)
    times = np.linspace(0.0, TUMBLING_TIME, TIMES_READ + 1)
    exact, table = free_turning(times, MOMENTS, case.v, case.q)[1].astype(float), []
    for of_body in (engines["tmt"], engine(read(mjcf()))):
        for method in of_body.methods.values():
            if method.adaptive:
                continue
            if measured := order_of(case, of_body, method, exact):
                table.append(record(result, BODY, method, *measured))
            else:
                check_is_shown(result, f"{BODY}, {method.engine} {method.name}", "runs", 0)
    lower = [
        row | {"with_hinges": ORDER_WITH_HINGES.get(row["method"], 1)}
        for row in table
        if row["engine"] == "mujoco" and row["measured_order"] < ORDER_WITH_HINGES.get(row["method"], 1) - 0.5
    ]
    if lower:
        result.find("lower_orders", body=BODY, rows=lower)
    return table


def order_of(case: Case, engine: Engine, method: Method, exact: np.ndarray) -> tuple[float, float, float] | None:
    """The order between the two finest steps whose errors fall regularly, and these steps, s; None: fewer than two do.

    exact: quaternions at the times that are read.
    """
    dynamics, regular, count = engine.of(case), [], FIRST_COUNT
    while count <= LAST_COUNT:
        q = dynamics.run(*case.start, case.tau, TUMBLING_TIME / count, count, method.name).q[:: count // TIMES_READ]
        error = np.abs(case.coordinates.difference(q, exact)).max()
        if CLEAR < error < REGULAR:
            regular.append((TUMBLING_TIME / count, error))
        elif regular:
            break
        count *= 2
    if len(regular) < 2:
        return None
    (coarse, large), (fine, small) = regular[-2:]
    return float(np.log2(large / small)), coarse, fine
