"""The cheapest setting of MuJoCo, of tmt and of all engines for each error, and what the gain consists of."""

from collections.abc import Sequence

TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad, worst error of a run


def advice(rows: list[dict], scenes: Sequence[str]) -> list[dict]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all.

    ratio: MuJoCo's time over tmt's. It is the product of integrator_part, MuJoCo's cheapest over its RK4; kernel_part,
    MuJoCo's RK4 over tmt's with the same step; and method_part, that over tmt's cheapest.
    """
    table = []
    for scene in scenes:
        of_scene = [row for row in rows if row["scene"] == scene and not row["diverged"]]
        for target in TARGETS:
            reach = [row for row in of_scene if row["worst_error_rad"] <= target]
            theirs, ours, best = (
                cheapest(reach, engine="mujoco"),
                cheapest(reach, engine="tmt"),
                cheapest(reach),
            )
            rk4 = cheapest(reach, engine="mujoco", method="RK4")
            same_step = cheapest(of_scene, engine="tmt", method="rk4", dt_s=rk4["dt_s"]) if rk4 else None
            line = {
                "scene": scene,
                "target_rad": target,
                "ratio": ratio(theirs, ours),
                "integrator_part": ratio(theirs, rk4),
                "kernel_part": ratio(rk4, same_step),
                "method_part": ratio(same_step, ours),
            }
            for name, row in (("mujoco", theirs), ("tmt", ours), ("of_all", best)):
                line |= {
                    name: setting(row) if row else "none",
                    f"{name}_dt_s": row and row["dt_s"],
                    f"{name}_ms": row and 1e3 * row["seconds"],
                    f"{name}_evaluations": row and row["evaluations"],
                }
            table.append(line)
    return table


def cheapest(rows: Sequence[dict], **wanted) -> dict | None:
    fit = [row for row in rows if all(row[key] == value for key, value in wanted.items())]
    return min(fit, key=lambda row: row["seconds"], default=None)


def ratio(slow: dict | None, fast: dict | None) -> float | None:
    return slow["seconds"] / fast["seconds"] if slow and fast else None


def setting(row: dict) -> str:
    steps = f"{row['steps']} steps" if row["dt_s"] else f"tolerance {row['tolerance']:.0e}"
    return f"{row['engine']} {row['method']}, {steps}"
