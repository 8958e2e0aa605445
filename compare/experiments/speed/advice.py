"""What follows from times and errors: which setting to choose, how much of the gain is whose, the measured orders."""

from collections.abc import Sequence

import numpy as np

from ...engines import Method
from ...judge.check import About, Result
from ...judge.run import ORDER_MARGIN
from .accuracy import NEAR_ROUNDING, Floors

TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad, worst on the way
ASKED = 1e-3  # rad: the one of these for which a sentence says what to use
EARLY = 1.0  # s: up to here chaos has not yet grown, and errors fall regularly
REGULAR, CLEAR = 3e-2, 2e-12  # rad, in that time: an error in between falls with its order, and rounding is far below
LEAST_ORDER = {8: 7.0}  # of order 8 only the least, as rounding comes before it has settled


def advice(rows: list[dict], scenes: Sequence[str], floors: Floors) -> list[dict]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all, and whose the gain is.

    ratio: MuJoCo's time over tmt's. It is the product of three: integrator_part, MuJoCo's cheapest against its RK4;
    kernel_part, MuJoCo's RK4 against tmt's with the same step; method_part, that against tmt's cheapest.
    """
    table = []
    for scene in scenes:
        of_scene = [row for row in rows if row["scene"] == scene and not row["diverged"]]
        for target in TARGETS:
            reach = [row for row in of_scene if row["worst_error_rad"] <= target]

            def cheapest(reach=reach, **wanted):
                fit = [row for row in reach if all(row[key] == value for key, value in wanted.items())]
                return min(fit, key=lambda row: row["seconds"], default=None)

            theirs, ours, best = cheapest(engine="mujoco"), cheapest(engine="tmt"), cheapest()
            rk4 = cheapest(engine="mujoco", method="RK4")
            alike = cheapest(reach=of_scene, engine="tmt", method="rk4", dt_s=rk4["dt_s"]) if rk4 else None

            def part(slow, fast):
                return slow["seconds"] / fast["seconds"] if slow and fast else None

            line = {
                "scene": scene,
                "target_rad": target,
                "ratio": part(theirs, ours),
                "integrator_part": part(theirs, rk4),
                "kernel_part": part(rk4, alike),
                "method_part": part(alike, ours),
            }
            for who, row in (("mujoco", theirs), ("tmt", ours), ("of_all", best)):
                line |= {
                    who: setting_in_words(row) if row else None,
                    f"{who}_dt_s": row and row["dt_s"],
                    f"{who}_ms": row and 1e3 * row["seconds"],
                    f"{who}_evaluations": row and row["evaluations"],
                }
            line["why_not"] = why_not(of_scene, theirs, ours, floors[scene])
            table.append(line)
    return table


def step_response_in_words(table: Sequence[dict], driven: Sequence[str]) -> list[str]:
    """Which integrator and step come to 1e-3 rad where servos act, beside the other scenes; [] if they act in none.

    table: what `advice` gives; driven: the names of the scenes in which they act.
    """
    lines = [line for line in table if line["target_rad"] == ASKED]

    def answers(wanted):
        return "; ".join(cheapest_in_words(line) for line in lines if (line["scene"] in driven) == wanted)

    if not (answers(True) and answers(False)):
        return []
    return [
        f"Which integrator and step for {ASKED:g} rad? Where the robot's own servos act: {answers(True)}. Where they do not: "
        f"{answers(False)}."
    ]


def cheapest_in_words(line: dict) -> str:
    """The cheapest setting of MuJoCo and of tmt in one line of `advice`."""
    found = [
        f"{line[who]} (dt = {line[f'{who}_dt_s']:.3g} s), {line[f'{who}_ms']:.3g} ms"
        if line[f"{who}_dt_s"]
        else f"{line[who]}, {line[f'{who}_ms']:.3g} ms"
        for who in ("mujoco", "tmt")
        if line[who]
    ]
    return f"{line['scene']}: {' or '.join(found) if found else 'none comes so near'}"


def setting_in_words(row: dict) -> str:
    """A setting in words."""
    setting = f"{row['steps']} steps" if row["dt_s"] else f"tolerance {row['tolerance']:.0e}"
    return f"{row['engine']} {row['method']}, {setting}"


def why_not(rows: list[dict], theirs: dict | None, ours: dict | None, floor: float) -> str | None:
    """Why no setting of an engine reaches the error; None if both do. rows: of one scene, those that did not diverge."""
    reasons = []
    for name, engine, row in (("MuJoCo", "mujoco", theirs), ("tmt", "tmt", ours)):
        runs = [run for run in rows if run["engine"] == engine]
        if row is None and runs:
            best = min(runs, key=lambda run: run["worst_error_rad"])
            last = [run for run in runs if run["method"] == best["method"]][-1]
            if best is last:
                cause = "its steps end before"
            elif best["worst_error_rad"] < NEAR_ROUNDING * floor:
                cause = f"there rounding, of the size of {floor:.0e} rad, takes over"
            else:
                cause = f"finer steps come no nearer, though rounding is of the size of {floor:.0e} rad only"
            reasons.append(f"{name}'s least error is {best['worst_error_rad']:.1e} rad: {cause}")
        elif row is None:
            reasons.append(f"{name} has no run that did not diverge")
    return "; ".join(reasons) or None


def orders(result: Result, scenes: Sequence[str], methods: Sequence[Method], complete: bool = True) -> list[dict]:
    """Rows and checks: each method of fixed step, its order and the one measured where the error falls regularly.

    complete: every method must show its order in one scene at least, which the coarse steps of a quick run do not allow; but
    for one that is near rounding with its coarsest steps already, wherever it runs. Of the robot of a file, of whose motion
    nothing is known beforehand, only an order that has settled is measured; of what others a sentence says so.
    """
    table, open_ones, of_file = [], [], result.curves.get("of_file")
    for scene in scenes:
        # what rounding leaves, and what is known of a reference in doubles, differs from robot to robot
        clear = max(CLEAR, NEAR_ROUNDING * result.curves["floors"][scene]) if of_file else CLEAR
        for method in methods:
            regular = [row for row in early_runs(result, scene, method) if clear < row["early"] < REGULAR]
            if len(regular) < 2:
                continue
            if of_file and method.order not in LEAST_ORDER and not has_settled(regular):
                open_ones.append(f"{scene}, {method.engine} {method.name}")
                continue
            coarse, fine = regular[-2:]  # the finest are those to which the theory applies best
            measured = order_between(coarse, fine)
            table.append(
                {"scene": scene, "engine": method.engine, "method": method.name, "order": method.order,
                 "measured_order": measured, "from_dt_s": coarse["dt_s"], "to_dt_s": fine["dt_s"]}
            )  # fmt: skip
            check_order(result, f"{scene}, {method.engine} {method.name}", method.order, measured)
    if open_ones:
        result.notes.append(
            "No order is asked where that from one halving of the step to the next still changes by more than "
            f"{ORDER_MARGIN:g}, or was seen once: {'; '.join(open_ones)}."
        )
    for method in methods if complete else ():
        shown = sum((row["engine"], row["method"]) == (method.engine, method.name) for row in table)
        if shown or not near_rounding(result, scenes, method):
            where = f"{method.engine} {method.name}"
            result.check(
                where, "scenes that show its order", shown, 1, "scenes", rule="at least", about=About.PREDICTION
            )
    return table


def order_between(coarse: dict, fine: dict) -> float:
    """The order by which an error falls from one row to a finer one."""
    return float(np.log(coarse["early"] / fine["early"]) / np.log(coarse["dt_s"] / fine["dt_s"]))


def has_settled(rows: Sequence[dict]) -> bool:
    """Whether the order of the last two of these rows, from coarse to fine, is that of the two before except for ORDER_MARGIN.

    An error C dt^p (1 + c dt) seems to fall by an order that is off p by c dt / ln 4, half as much with half the step: what the
    order still changes is how far it is from p.
    """
    return len(rows) > 2 and abs(order_between(*rows[-3:-1]) - order_between(*rows[-2:])) <= ORDER_MARGIN


def near_rounding(result: Result, scenes: Sequence[str], method: Method) -> bool:
    """Whether errors of a method are so small with its coarsest steps that half of these would show rounding."""
    firsts = [runs[0]["early"] for scene in scenes if (runs := early_runs(result, scene, method))]
    return bool(firsts) and all(first < CLEAR * 2.0**method.order for first in firsts)


def early_runs(result: Result, scene: str, method: Method) -> list[dict]:
    """The rows of a method in a scene, from coarse to fine."""
    place = (scene, method.engine, method.name)
    return [row for row in result.rows if (row["scene"], row["engine"], row["method"]) == place]


def check_order(result: Result, where: str, order: int, measured: float) -> None:
    """A check: the measured order is the method's; of order 8 it is at least 7."""
    least = LEAST_ORDER.get(order)
    if least is None:
        what, note = f"distance of the measured order from {order}", f"{measured:.2f}"
        result.check(where, what, abs(measured - order), ORDER_MARGIN, "", note, about=About.PREDICTION)
    else:
        result.check(where, f"measured order, of {order}", measured, least, "", rule="at least", about=About.PREDICTION)
