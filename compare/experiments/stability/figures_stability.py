"""Figures: step limits, departure, claims."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...judge.finding import Finding
from ...judge.run import LEFT, number_or_nan
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from ...robots import Robot
from .claims import VARIANT, ulps_of
from .departure import DEPARTURE_TOLERANCE, departure_values, size_of
from .limits import LINEAR_DEVIATION, apart
from .subjects import coarsest_case, damped, fraction, unit_of_movements

SCHEME_LOOKS = {  # colour, dash, name
    "rk4": (GREEN, "-", "RK4"),
    "explicit_euler": (GREY, (0, (1, 1)), "explicit Euler"),
    "semi_implicit_euler": (BLUE, "--", "semi-implicit Euler"),
    "implicit": (RED, "-.", "implicit"),
    "implicit_midpoint": (ORANGE, (0, (5, 1)), "implicit midpoint"),
    "gauss_legendre_4": (PINK, (0, (3, 1, 1, 1, 1, 1)), "Gauss-Legendre 4"),
    "dopri8": (SKY, (0, (4, 2)), "Dormand-Prince 8"),
}
MARKS, MUJOCO_MARKS = "ov^DsP", "x+1"
ENGINE_COLOURS = {"tmt": BLUE, "mujoco": ORANGE}


def look(name: str) -> tuple:
    """Colour, dash and printed name of a method."""
    return SCHEME_LOOKS.get(name, ("black", "-", name))


def draw_limits(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Predicted and observed limits as paired bars, scene by scene and damping by damping."""
    rows = [row for row in result.rows if row["scene"] in result.curves["looked at"]["centres"]]
    panels = list(dict.fromkeys((row["scene"], row["damping"]) for row in rows))
    schemes = list(dict.fromkeys(row["method"] for row in rows if row["engine"] == "tmt"))
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    fig = Figure(figsize=(WIDTH, 0.9 + 2.15 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharey=True, squeeze=False)
    for ax, (scene, damping) in zip(axes.flat, panels):
        here = [row for row in rows if (row["scene"], row["damping"]) == (scene, damping)]
        alike = [row for row in rows if row["damping"] == damping]
        finite = [v for r in alike for v in (r["predicted_dt_s"], r["observed_dt_s"]) if v] or [1.0]
        low, high = min(finite) / 3, max(finite) * 2
        for row in here:
            place = schemes.index(result.curves["schemes"][row["engine"], row["method"]])
            if row["engine"] == "mujoco":
                if row["limit"] == "finite" and row["observed_dt_s"] is not None:
                    mark = {"marker": "|", "markersize": 9, "markeredgewidth": 1.6, "linestyle": "none"}
                    ax.plot(row["observed_dt_s"], place + 0.2, color="black", **mark)
            elif row["limit"] != "finite":
                text = {"never_fails": "no limit", "always_fails": "fails at every step"}[row["limit"]]
                ax.text(low * 1.1, place, text, va="center", fontsize=8, color=GREY)
            else:
                for shift, key, colour in ((-0.2, "predicted_dt_s", ORANGE), (0.2, "observed_dt_s", BLUE)):
                    if row[key] is not None:
                        ax.barh(place + shift, row[key] - low, left=low, height=0.36, color=colour)
        ax.set(xscale="log", xlim=(low, high), ylim=(len(schemes) - 0.4, -0.6))
        ticks = [m * 10.0**k for k in range(-4, 3) for m in ((1, 2, 5) if high / low < 100 else (1,))]
        ticks = [tick for tick in ticks if low < tick < high]
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.minorticks_off()
        ax.set_yticks(range(len(schemes)), [look(name)[2] for name in schemes])
        ax.set_title(f"{scene}, {damped(robot, damping)}")
        ax.grid(axis="y", visible=False)
    for ax in axes.flat[len(panels) :]:
        ax.set_visible(False)
    fig.supxlabel("largest stable dt, s" + " (damping in N m s/rad)" * (not robot.is_read), fontsize=9)
    handles = [
        axes[0, 0].barh(-9, 1, color=ORANGE, label="predicted from one step"),
        axes[0, 0].barh(-9, 1, color=BLUE, label="observed, TMT"),
        *axes[0, 0].plot([], [], "|", color="black", markersize=9, markeredgewidth=1.6, label="observed, MuJoCo"),
    ]
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    finite = [row for row in rows if row["limit"] == "finite"]
    off = [apart(row) for row in finite if apart(row) is not None]
    first = [row for row in finite if (row["scene"], row["damping"], row["engine"]) == (*panels[0], "tmt")]
    caption = result.finding(
        "figure_limits",
        deviation=LINEAR_DEVIATION,
        unit=unit_of_movements(robot),
        has_actuators=bool(robot.drive.actuators),
        predicted=len(finite),
        observed=len(off),
        median=float(np.median(off)) if off else None,
        worst=max(off, default=None),
        posture=panels[0][0],
        products={look(row["method"])[2]: row["predicted_dt_s"] * row["mode_per_s"] for row in first},
    )
    return "stability_limits", fig, caption


def draw_departure(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Time to leave a saddle against the size of the perturbation, with the predicted slope."""
    unit, coarse, saddle = unit_of_movements(robot), coarsest_case(robot), result.curves["looked at"]["saddle"]
    rows = [row for row in result.tables["departure"] if row["scene"] in (saddle, f"{saddle}, torque off")]
    steps = sorted({row["dt_s"] for row in rows}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    axes = fig.subplots(1, len(steps), sharey=True, squeeze=False)[0]
    methods = list(dict.fromkeys((row["engine"], row["method"]) for row in rows))
    for ax, dt in zip(axes, steps):
        for k, (engine, method) in enumerate(methods):
            mine = [row for row in rows if (row["dt_s"], row["engine"], row["method"]) == (dt, engine, method)]
            mine.sort(key=size_of)
            sizes = [size_of(row) for row in mine]
            observed, predicted = ([number_or_nan(row[key]) for row in mine] for key in ("observed_s", "predicted_s"))
            label = f"{LABELS[engine]}: {look(method)[2] if engine == 'tmt' else method}"
            colour, dash, _ = look(method)
            if engine == "tmt":
                ax.plot(sizes, predicted, linestyle=dash, color=colour, linewidth=1)
                ax.plot(sizes, observed, MARKS[k % 6], color=colour, mfc="none", markersize=11 - k, label=label)
            else:
                ax.plot(sizes, observed, MUJOCO_MARKS[k % 3], color="black", markersize=5, label=label)
        ax.axvspan(1e-15, 3e-13, color=(GREY, 0.15), linewidth=0)
        step = fraction(coarse.duration, dt) if dt == coarse.scene.dt else f"{dt:g}"
        ax.set(xscale="log", xlim=(1e-15, 3e-2), ylim=(0, None), title=f"dt = {step} s")
        ax.set_xticks([1e-14, 1e-10, 1e-6, 1e-2])
        ax.minorticks_off()
    axes[0].set_ylabel(f"time until a movement of {LEFT:g} {unit}, s")
    axes[0].plot([], [], color="black", linewidth=1, label="predicted by the linear map")
    axes[0].fill_between([], [], color=(GREY, 0.15), linewidth=0, label="perturbation by an error of the torque")
    fig.supxlabel(f"perturbation, {unit}", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
    values = departure_values(rows) | {"posture": saddle, "noun": robot.noun, "unit": unit, "left": LEFT}
    values |= {"rate": result.curves["rate at saddle"], "tolerance": DEPARTURE_TOLERANCE}
    return "stability_departure", fig, result.finding("figure_departure", **values)


def draw_claims(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Claims 1 and 2: departure against the push of the residual, and against the number of steps."""
    claims, rows = robot.claims, result.tables["stability_claims"]
    finer = [row for row in rows if row["claim"] == 2]
    fig = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = fig.subplots(1, 1 + bool(finer), squeeze=False)[0]
    draw_torques(axes[0], [row for row in rows if row["claim"] == 1 and row["torque"].startswith(VARIANT)], robot)
    if finer:
        draw_finer_steps(axes[1], finer, robot)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
    values = {"dt": fraction(claims.duration, claims.dt), "joint": robot.joints[0], "posture": claims.left}
    return "stability_claims", fig, result.finding("figure_claims", **values, finer=bool(finer))


def draw_torques(ax: Axes, rows: list[dict], robot: Robot) -> None:
    """Claim 1: when and to which side the posture is left, over the push of the residual on the unstable mode."""
    symbol = robot.symbol(robot.joints[0])
    largest = max((abs(row["push_rad_per_s2"]) for row in rows if row["push_rad_per_s2"]), default=1.0)
    factor = 10.0 ** np.floor(np.log10(largest))
    for engine, fill in (("tmt", "full"), ("mujoco", "none")):
        for side, mark, word in ((1, "^", "larger"), (-1, "v", "smaller")):
            mine = [row for row in rows if (row["engine"], row["direction"]) == (engine, side)]
            pushes, times = ([row[key] for row in mine] for key in ("push_rad_per_s2", "observed_s"))
            label = f"{LABELS[engine]}, to {word} {symbol}"
            options = {"color": ENGINE_COLOURS[engine], "fillstyle": fill, "markersize": 5, "label": label}
            ax.plot(np.array(pushes) / factor, times, mark, **options)
    pairs = {(row["push_rad_per_s2"] / factor, row["predicted_s"]) for row in rows if row["predicted_s"] is not None}
    ax.plot(*np.array(sorted(pairs)).reshape(-1, 2).T, color="black", linewidth=0.8, label="predicted")
    ax.axvline(0.0, color="black", linewidth=0.5)
    ax.set(
        title=f"claim 1: {robot.claims.left}", xlabel=f"initial acceleration of the unstable mode, {factor:.0e} rad/s2"
    )
    ax.set_ylabel(f"time until a movement of {LEFT:g} rad, s")


def draw_finer_steps(ax: Axes, rows: list[dict], robot: Robot) -> None:
    """Claim 2: when and to which side the posture is left against the number of steps, the torque one ulp off."""
    column, duration = ulps_of(robot)[0], robot.claims.duration
    for engine, sign in dict.fromkeys((row["engine"], row[column]) for row in rows):
        mine = [row for row in rows if (row["engine"], row[column]) == (engine, sign)]
        counts, times = [duration / row["dt_s"] for row in mine], [number_or_nan(row["observed_s"]) for row in mine]
        options = {"color": ENGINE_COLOURS[engine], "fillstyle": "full" if engine == "tmt" else "none"}
        ax.plot(counts, times, "-" if sign > 0 else "--", color=ENGINE_COLOURS[engine])
        for side, mark in ((1, "^"), (-1, "v")):
            gone = [k for k, row in enumerate(mine) if row["direction"] == side]
            ax.plot([counts[k] for k in gone], [times[k] for k in gone], mark, **options, markersize=5)
    mine = [row for row in rows if row["engine"] == "tmt" and row[column] == 1]
    predicted = [number_or_nan(row["predicted_s"]) for row in mine]
    ax.plot([duration / row["dt_s"] for row in mine], predicted, color="black", linewidth=0.8)
    ax.set(title=f"claim 2: {robot.claims.left}", xscale="log", xlabel=f"steps in {duration:g} s")
    ax.set_xticks([32, 512, 8192], ["32", "512", "8192"])
    ax.minorticks_off()
