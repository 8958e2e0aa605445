"""The cheapest setting of MuJoCo, of tmt and of all engines for each error, and what the gain consists of."""

from collections.abc import Sequence

from .accuracy import NEAR_ROUNDING, Floors

TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad, worst error of a run


def advice(rows: list[dict], scenes: Sequence[str], floors: Floors) -> list[dict]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all.

    ratio: MuJoCo's time over tmt's. It is the product of integrator_part, MuJoCo's cheapest over its RK4; kernel_part,
    MuJoCo's RK4 over tmt's with the same step; and method_part, that over tmt's cheapest.
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
            same_step = cheapest(reach=of_scene, engine="tmt", method="rk4", dt_s=rk4["dt_s"]) if rk4 else None

            def part(slow, fast):
                return slow["seconds"] / fast["seconds"] if slow and fast else None

            line = {
                "scene": scene,
                "target_rad": target,
                "ratio": part(theirs, ours),
                "integrator_part": part(theirs, rk4),
                "kernel_part": part(rk4, same_step),
                "method_part": part(same_step, ours),
            }
            for name, row in (("mujoco", theirs), ("tmt", ours), ("of_all", best)):
                line |= {
                    name: row and setting(row),
                    f"{name}_dt_s": row and row["dt_s"],
                    f"{name}_ms": row and 1e3 * row["seconds"],
                    f"{name}_evaluations": row and row["evaluations"],
                }
            reasons = (
                unreached(of_scene, engine, floors[scene])
                for engine, row in (("mujoco", theirs), ("tmt", ours))
                if not row
            )
            line["why_not"] = "; ".join(reasons) or None
            table.append(line)
    return table


def setting(row: dict) -> str:
    steps = f"{row['steps']} steps" if row["dt_s"] else f"tolerance {row['tolerance']:.0e}"
    return f"{row['engine']} {row['method']}, {steps}"


def unreached(rows: list[dict], engine: str, floor: float) -> str:
    """Why no setting of an engine reaches an error. rows: of one scene, those that did not diverge."""
    runs, name = [run for run in rows if run["engine"] == engine], {"mujoco": "MuJoCo"}.get(engine, engine)
    if not runs:
        return f"all runs of {name} diverged"
    best = min(runs, key=lambda run: run["worst_error_rad"])
    if best is [run for run in runs if run["method"] == best["method"]][-1]:
        cause = "at its finest step"
    elif best["worst_error_rad"] < NEAR_ROUNDING * floor:
        cause = f"limited by rounding, {floor:.0e} rad"
    else:
        cause = f"finer steps gain nothing, rounding is {floor:.0e} rad"
    return f"{name}'s smallest error: {best['worst_error_rad']:.1e} rad, {cause}"


def headline_values(table: list[dict], scene: str, target: float) -> dict | None:
    """The cheapest setting of all and that of MuJoCo (of tmt, if MuJoCo is the cheapest) for an error; None: not reached."""
    line = next((line for line in table if line["scene"] == scene and line["target_rad"] == target), None)
    if not (line and line["of_all"]):
        return None
    other = "tmt" if line["of_all"] == line["mujoco"] else "mujoco"
    chosen = [(line[name], line[f"{name}_dt_s"], line[f"{name}_ms"]) for name in ("of_all", other) if line[name]]
    return {"scene": scene, "target": target, "settings": list(dict.fromkeys(chosen))}
