"""Figures of what is claimed: torques in the last bit, finer steps, and a held posture beyond its limit."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...engines import LABELS
from ...judge.check import Result
from ...judge.run import LEFT, number_or_nan
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, WIDTH
from ...robots import Robot
from .beyond import NEAR_TORQUES, ONE_ULP, above_in_words, within_in_words
from .choice import fraction
from .claims import VARIANT, ulps_of
from .departure import span
from .figures_departure import ENGINE_LOOKS

NOTHING_MOVES = 1e-17  # rad, where no movement is drawn


def draw_torques(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Departure under the torques that differ in the last bit: when, and to which side."""
    claims, symbol = robot.claims, robot.symbol(robot.joints[0])
    rows = [row for row in result.tables["stability_torques"] if row["torque"].startswith(VARIANT)]
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    grid = fig.add_gridspec(2, 2, width_ratios=(1.35, 1))
    sides = {1: (BLUE, "^", f"to larger {symbol}"), -1: (RED, "v", f"to smaller {symbol}"), None: (GREY, "o", "never")}
    observed = [row["observed_s"] for row in rows if row["observed_s"] is not None]
    first, last = min(observed, default=0.0), max(observed, default=0.0)
    never = last + 4 * claims.dt
    first_axis = None
    for k, engine in enumerate(ENGINE_LOOKS):
        ax = fig.add_subplot(grid[k, 0], sharex=first_axis)
        first_axis = first_axis or ax
        stacks = {}
        order = sorted((row for row in rows if row["engine"] == engine), key=lambda row: -(row["direction"] or 0))
        for row in order:
            at = never if row["observed_s"] is None else row["observed_s"]
            stacks[at] = stacks.get(at, 0) + 1
            colour, mark, _ = sides[row["direction"]]
            ax.plot(at, stacks[at], mark, color=colour, markersize=5, fillstyle="full" if engine == "tmt" else "none")
        most = max(stacks.values(), default=0)
        ax.set(
            ylabel=f"runs, {LABELS[engine]}",
            xlim=(first - 2 * claims.dt, never + 2 * claims.dt),
            ylim=(0, max(15, most + 1)),
        )
        ticks = np.arange(0.0, 10.0, 0.2 if last - first < 1.5 else 1.0)
        ticks = [t for t in ticks if first - 2 * claims.dt < t < last + claims.dt]
        ax.set_xticks([*ticks, never], [*(f"{t:g}" for t in ticks), "never"])
        ax.yaxis.set_major_locator(MaxNLocator(4, integer=True))
        if k == 0:
            ax.tick_params(labelbottom=False)
        else:
            ax.set_xlabel(f"time until a hinge is {LEFT:g} rad away, s")
    ax = fig.add_subplot(grid[:, 1])
    largest = max((abs(row["push_rad_per_s2"]) for row in rows if row["push_rad_per_s2"]), default=1.0)
    factor = 10.0 ** np.floor(np.log10(largest))
    for engine, fill in (("tmt", "full"), ("mujoco", "none")):
        for row in (row for row in rows if row["engine"] == engine and row["observed_s"] is not None):
            colour, mark, _ = sides[row["direction"]]
            ax.plot(
                row["push_rad_per_s2"] / factor, row["observed_s"], mark, color=colour, fillstyle=fill, markersize=5
            )
    known = sorted(
        {(row["push_rad_per_s2"] / factor, row["predicted_s"]) for row in rows if row["predicted_s"] is not None}
    )
    known_x, known_y = zip(*known) if known else ((), ())
    ax.plot(known_x, known_y, drawstyle="steps-mid", color="black", linewidth=0.8, label="predicted by the linear map")
    ax.axvline(0.0, color="black", linewidth=0.5)
    ax.set(xlabel=f"push on the unstable mode, {factor:.0e} rad/s2", ylabel="time, s")
    for colour, mark, text in sides.values():
        ax.plot([], [], mark, color=colour, label=text)
    ax.plot([], [], "^", color="black", fillstyle="none", label="open: MuJoCo")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=8)
    count = sum(row["engine"] == "tmt" for row in rows)
    caption = (
        f"Held at {claims.left}, RK4, dt = {fraction(claims.duration, claims.dt)} s, under all {count} torques within one unit "
        f"in the last place of TMT's. They leave: {'; '.join(sides_in_words(rows, engine, symbol) for engine in ENGINE_LOOKS)}. "
        "Right: when and to which side, over what the torque, less the engine's own bias, pushes on the unstable mode."
    )
    return "stability_torques", fig, caption


def sides_in_words(rows: list[dict], engine: str, symbol: str) -> str:
    """When the posture is left in one engine, and to which side."""
    mine = [row for row in rows if row["engine"] == engine]
    gone = [row["observed_s"] for row in mine if row["observed_s"] is not None]
    up, down = (sum(row["direction"] == side for row in mine) for side in (1, -1))
    label, never = LABELS[engine], len(mine) - len(gone)
    return f"{label} after {span(gone)}, {up} to larger {symbol}, {down} to smaller, {never} never"


def draw_finer_steps(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """The torque one ulp off: time to leave and movement after a run of the claims against the number of steps."""
    rows, claims, joint = result.tables["stability_finer_steps"], robot.claims, robot.joints[0]
    column, symbol, run = ulps_of(robot)[0], robot.symbol(joint), f"{claims.duration:g} s"
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    left, right = fig.subplots(1, 2, sharex=True)
    for engine, (colour, _) in ENGINE_LOOKS.items():
        for sign, dash, fill in ((1, "-", "full"), (-1, "--", "none")):
            mine = [row for row in rows if row["engine"] == engine and row[column] == sign]
            counts = [claims.duration / row["dt_s"] for row in mine]
            label = f"{LABELS[engine]}, {'+' if sign > 0 else '-'}1 ulp"
            options = {"color": colour, "linestyle": dash, "fillstyle": fill, "markersize": 5.5}
            left.plot(counts, [number_or_nan(r["observed_s"]) for r in mine], **options, label=label)
            for side, mark in ((1, "^"), (-1, "v")):
                gone = [(claims.duration / r["dt_s"], r["observed_s"]) for r in mine if r["direction"] == side]
                left.plot(
                    [n for n, _ in gone], [t for _, t in gone], mark, color=colour, fillstyle=fill, markersize=5.5
                )
            right.plot(counts, [max(number_or_nan(r["moved_rad"]), NOTHING_MOVES) for r in mine], **options)
    mine = [row for row in rows if row["engine"] == "tmt" and row[column] == 1]
    counts = [claims.duration / row["dt_s"] for row in mine]
    left.plot(counts, [number_or_nan(r["predicted_s"]) for r in mine], ":", color="black", label="linear map")
    left.plot([], [], "^", color="black", label=f"to larger {symbol}")
    left.plot([], [], "v", color="black", label=f"to smaller {symbol}")
    left.set(
        xscale="log", xlabel=f"steps in {run}", ylabel=f"time until a hinge is {LEFT:g} rad away, s", ylim=(4, 10.2)
    )
    right.set(yscale="log", xlabel=f"steps in {run}", ylabel=f"largest movement after {run}, rad", ylim=(3e-18, 10))
    right.text(16384, 2.2e-17, "none", ha="right", va="bottom")
    for ax in (left, right):
        ax.set_xticks([32, 128, 512, 2048, 8192], ["32", "128", "512", "2048", "8192"])
        ax.minorticks_off()
    fig.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    caption = (
        f"Held at {claims.left} by RK4, the torque one unit in the last place off in {joint}. Triangles: to which side the "
        f"{robot.name} leaves. {finest_in_words(robot, rows)} The linear map, which does not round here, leaves after "
        f"{span(row['predicted_s'] for row in mine)}."
    )
    return "stability_finer_steps", fig, caption


def finest_in_words(robot: Robot, rows: list[dict]) -> str:
    """From how many steps on nothing moves in any series, and what a step adds at the finest."""
    duration = robot.claims.duration
    counts = sorted({round(duration / row["dt_s"]) for row in rows}, reverse=True)
    still = []
    for count in counts:
        if any(row["moved_rad"] != 0.0 for row in rows if round(duration / row["dt_s"]) == count):
            break
        still.append(count)
    text = (
        f"From {min(still)} steps on nothing moves in {duration:g} s (drawn at {NOTHING_MOVES:g})."
        if still
        else f"With every step the {robot.noun} moves."
    )
    finest = (row for row in rows if round(duration / row["dt_s"]) == counts[0])
    last = max(finest, key=lambda row: number_or_nan(row["step_rad"]))
    return text + (
        f" At {counts[0]} steps dt qd is {number_or_nan(last['step_rad']):.1e} rad after {duration:g} s at most; half a unit in "
        f"the last place of the angle that it would change first is {last['half_ulp_rad']:.1e} rad."
    )


def draw_kept(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """The posture that is kept, under RK4 below and beyond its limit: deviation against the number of steps."""
    data, claims = result.curves["kept"], robot.claims
    steps = [dt for engine, torque, dt in data["paths"] if (engine, torque) == ("tmt", ONE_ULP)][:5]
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = fig.subplots(1, 2, sharey=True, sharex=True)
    for ax, torque in zip(axes, NEAR_TORQUES):
        for dt, colour, mark in zip(steps, (GREEN, BLUE, ORANGE, RED, PINK), "osD^v"):
            for engine, dash in (("tmt", "-"), ("mujoco", ":")):
                path = data["paths"][(engine, torque, dt)]
                label = f"dt = {dt:.4g} s" if engine == "tmt" else None
                look = {"linewidth": 2.2}
                if engine == "tmt":
                    look = {"linewidth": 1.2, "marker": mark, "markersize": 4, "markevery": (0.08, 0.12)}
                t = dt * np.arange(len(path))
                ax.semilogy(t[1:], np.maximum(path[1:], NOTHING_MOVES), dash, color=colour, **look, label=label)
        ax.axhline(LEFT, color="black", linewidth=0.8, linestyle="--", label=f"{LEFT:g} rad")
        ax.axvline(claims.duration, color=GREY, linewidth=1.2, label=f"{claims.duration:g} s")
        ax.set(title=f"torque: {torque}", xlabel="time, s", xlim=(0, 30), ylim=(1e-17, 1e3))
    axes[0].plot([], [], ":", color="black", linewidth=2.2, label="MuJoCo")
    axes[0].set_ylabel("largest deviation of a hinge, rad")
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    limit = data["limit"]
    caption = (
        f"Held at {claims.kept} by RK4, its predicted limit {limit:.4f} s. "
        f"{above_in_words([row for row in data['rows'] if row['dt_s'] > limit])} "
        f"{within_in_words(robot, data['rows'], data['leaves'], len(data['counts']))}"
    )
    return "stability_bent", fig, caption
