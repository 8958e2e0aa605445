"""What follows from times and errors: which setting to choose, how much of the gain is whose, the measured orders."""

import numpy as np

TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad, worst on the way
EARLY = 1.0  # s: up to here chaos has not yet grown, and errors fall regularly
REGULAR, CLEAR = 3e-2, 2e-12  # rad, in that time: an error in between falls with its order, and rounding is far below
MARGIN, LEAST = 0.15, {8: 7.0}  # of the measured order; for order 8 only the least, as rounding ends its range early


def advice(rows, scenes, floors) -> list[dict]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all, and whose the gain is.

    ratio: MuJoCo's time over tmt's. It is the product of the kernel's part, RK4 against RK4 at MuJoCo's step, of the
    method's, tmt's rk4 against tmt's best, and of the choice of the integrator where MuJoCo's cheapest is not RK4.
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
            rk4 = cheapest(engine="mujoco", method="RK4"), cheapest(engine="tmt", method="rk4")
            line = {
                "scene": scene,
                "worst_error_rad": target,
                "ratio": theirs["seconds"] / ours["seconds"] if theirs and ours else None,
                "kernel_part": rk4[0]["seconds"] / rk4[1]["seconds"] if all(rk4) else None,
                "method_part": rk4[1]["seconds"] / ours["seconds"] if rk4[1] and ours else None,
            }
            for party, row in (("mujoco", theirs), ("tmt", ours), ("of_all", best)):
                line |= {
                    party: named(row) if row else None,
                    f"{party}_dt_s": row and row["dt_s"],
                    f"{party}_ms": row and 1e3 * row["seconds"],
                    f"{party}_evaluations": row and row["evaluations"],
                }
            line["why_not"] = why_not(of_scene, target, theirs, ours, floors[scene])
            table.append(line)
    return table


def named(row) -> str:
    """A setting in words."""
    setting = f"{row['steps']} steps" if row["dt_s"] else f"tolerance {row['tolerance']:.0e}"
    return f"{row['engine']} {row['method']}, {setting}"


def why_not(rows, target, theirs, ours, floor) -> str | None:
    """Why no setting of a party reaches the error; None if both do."""
    reasons = []
    for party, engine, row in (("MuJoCo", "mujoco", theirs), ("tmt", "tmt", ours)):
        if row is None:
            errors = [row["worst_error_rad"] for row in rows if row["engine"] == engine]
            least = min(errors, default=np.inf)
            cause = (
                f"rounding, of the size of {floor:.0e} rad, has taken over"
                if target < 10 * floor
                else "its steps end before"
            )
            reasons.append(f"{party}'s least error is {least:.1e} rad: {cause}")
    return "; ".join(reasons) or None


def orders(result, scenes, known) -> list[dict]:
    """Rows and checks: each method of fixed step, its order and the one measured where the error falls regularly."""
    table = []
    for scene in scenes:
        for engine, method, order in known:
            runs = [
                row for row in result.rows
                if (row["scene"], row["engine"], row["method"]) == (scene, engine, method) and CLEAR < row["early"] < REGULAR
            ]  # fmt: skip
            if len(runs) < 2:
                continue
            coarse, fine = runs[-2:]  # the finest are those to which the theory applies best
            measured = float(np.log(coarse["early"] / fine["early"]) / np.log(coarse["dt_s"] / fine["dt_s"]))
            table.append(
                {"scene": scene, "engine": engine, "method": method, "order": order, "measured_order": measured,
                 "from_dt_s": coarse["dt_s"], "to_dt_s": fine["dt_s"]}
            )  # fmt: skip
            least = LEAST.get(order)
            off = abs(measured - order) if least is None else max(0.0, least - measured)
            text = (
                f"measured order {measured:.2f}, from {order}"
                if least is None
                else f"order {measured:.2f}, below {least:g}"
            )
            result.check(f"{scene}, {engine} {method}", text, off, MARGIN if least is None else 0.0, "")
    return table
