"""Figures of departure: times against perturbation, the 27 torques, finer steps, bent beyond its limit, zero."""

import numpy as np
from matplotlib.figure import Figure

from .beyond import TORQUES, tell_above, tell_within
from .claims import DT
from .departure import NEAR, late, near, span
from .draw import BLUE, GREEN, GREY, ORANGE, RED, WIDTH
from .draw_stability import style
from .motion import LEFT
from .parties import value

MARKS = {"rk4": "o", "explicit_euler": "v", "semi_implicit_euler": "s", "implicit": "D", "implicit_midpoint": "^",
         "gauss_legendre_4": "P", "Euler": "+", "RK4": "x"}  # fmt: skip
PARTY = {"TMT": (BLUE, "o"), "MuJoCo": (ORANGE, "s")}


def times(result):
    """Time to leave ball catch against the size of the perturbation, with the predicted slope."""
    rows = [
        row
        for row in result.tables["departure"]
        if row["scene"].startswith("ball catch") and "printed" not in row["scene"]
    ]
    steps = sorted({row["dt_s"] for row in rows}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = fig.subplots(1, len(steps), sharey=True, squeeze=False)[0]
    for ax, dt in zip(axes, steps):
        here = [row for row in rows if row["dt_s"] == dt]
        for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in here):
            mine = sorted(
                (r for r in here if (r["engine"], r["method"]) == (engine, method)), key=lambda r: r["perturbation_rad"]
            )
            p, predicted, observed = (
                [value(r[key]) for r in mine] for key in ("perturbation_rad", "predicted_s", "observed_s")
            )
            if engine == "TMT":
                colour, dash, name = style(method)
                ax.plot(p, predicted, linestyle=dash, color=colour, linewidth=1)
                ax.plot(p, observed, MARKS.get(method, "*"), color=colour, mfc="none", markersize=5.5, label=name)
            else:
                ax.plot(
                    p,
                    observed,
                    "x+1"[["Euler", "implicit", "RK4"].index(method)],
                    color="black",
                    label=f"MuJoCo {method}",
                )
        ax.axvspan(1e-15, 3e-13, color=GREY, alpha=0.15)
        ax.set(xscale="log", xlim=(1e-15, 3e-2), ylim=(0, None), title=f"dt = {'5/64' if dt == DT else f'{dt:g}'} s")
        ax.set_xticks([1e-14, 1e-11, 1e-8, 1e-5])
    axes[0].set_ylabel(f"time until a hinge is {LEFT:g} rad away, s")
    fig.supxlabel("perturbation, rad (grey: as the error of torque that moves the equilibrium so far)", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=8)
    rate = max(row["real_per_s"] for row in result.tables["stability_modes"] if row["scene"] == "ball catch")
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    close = sum(abs(late(row)) <= near(row["dt_s"]) for row in both)
    caption = (
        f"How long the arm stays at ball catch. Lines: first crossing of {LEFT:g} rad by each method's own linear map, its "
        "angles rounded to doubles; the fastest mode alone gives a slope of "
        f"ln 10 / {rate:.3f} = {np.log(10) / rate:.3f} s for each power of ten. Marks: {len(rows)} runs. "
        f"{len(both)} leave as the map does, {close} of them within one step or {NEAR:g} s"
        + (f", the farthest {max(abs(late(row)) for row in both):.3f} s off." if both else ".")
    )
    return "stability_departure", fig, caption


def torques(result):
    """Departure from ball catch under the 27 torques that differ in the last bit: when, and to which side."""
    rows = [row for row in result.tables["stability_torques"] if row["torque"].startswith("variant")]
    fig = Figure(figsize=(WIDTH, 4.0), layout="constrained")
    grid = fig.add_gridspec(2, 2, width_ratios=(1.35, 1))
    sides = {1: (BLUE, "^", "to larger α"), -1: (RED, "v", "to smaller α"), None: (GREY, "o", "never")}
    observed = [row["observed_s"] for row in rows if row["observed_s"] is not None]
    first, last = min(observed, default=0.0), max(observed, default=0.0)
    never = last + 4 * DT
    first_axis = None
    for k, engine in enumerate(PARTY):
        ax = fig.add_subplot(grid[k, 0], sharex=first_axis)
        first_axis = first_axis or ax
        stacks = {}
        order = sorted((row for row in rows if row["engine"] == engine), key=lambda row: -(row["direction"] or 0))
        for row in order:
            at = never if row["observed_s"] is None else row["observed_s"]
            stacks[at] = stacks.get(at, 0) + 1
            colour, mark, _ = sides[row["direction"]]
            ax.plot(at, stacks[at], mark, color=colour, markersize=5, fillstyle="full" if engine == "TMT" else "none")
        ax.set(ylabel=f"runs, {engine}", xlim=(first - 2 * DT, never + 2 * DT), ylim=(0, 15))
        ticks = [t for t in np.arange(0.0, 10.0, 0.2 if last - first < 1.5 else 1.0) if first - 2 * DT < t < last + DT]
        ax.set_xticks([*ticks, never], [*(f"{t:g}" for t in ticks), "never"])
        if k == 0:
            ax.tick_params(labelbottom=False)
        else:
            ax.set_xlabel("time until a hinge is 0.1 rad away, s")
    ax = fig.add_subplot(grid[:, 1])
    for engine, fill in (("TMT", "full"), ("MuJoCo", "none")):
        for row in (row for row in rows if row["engine"] == engine and row["observed_s"] is not None):
            colour, mark, _ = sides[row["direction"]]
            ax.plot(row["push_rad_per_s2"] * 1e15, row["observed_s"], mark, color=colour, fillstyle=fill, markersize=5)
    known = sorted(
        {(row["push_rad_per_s2"] * 1e15, row["predicted_s"]) for row in rows if row["predicted_s"] is not None}
    )
    known_x, known_y = zip(*known) if known else ((), ())
    ax.plot(known_x, known_y, drawstyle="steps-mid", color="black", linewidth=0.8, label="predicted by the linear map")
    ax.axvline(0.0, color="black", linewidth=0.5)
    ax.set(xlabel="push on the unstable mode, 1e-15 rad/s2", ylabel="time, s")
    for colour, mark, text in sides.values():
        ax.plot([], [], mark, color=colour, label=text)
    ax.plot([], [], "^", color="black", fillstyle="none", label="open: MuJoCo")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=8)
    caption = (
        "Held at ball catch, RK4, dt = 5/64 s, under all 27 torques within one unit in the last place of TMT's. They "
        f"leave: {'; '.join(tell_sides(rows, engine) for engine in PARTY)}. Right: when and to which side, over what the "
        "torque, less the engine's own bias, pushes on the unstable mode."
    )
    return "stability_torques", fig, caption


def tell_sides(rows, engine) -> str:
    """When the arm leaves in one engine, and to which side."""
    mine = [row for row in rows if row["engine"] == engine]
    gone = [row["observed_s"] for row in mine if row["observed_s"] is not None]
    up, down = (sum(row["direction"] == side for row in mine) for side in (1, -1))
    return f"{engine} after {span(gone)}, {up} to larger α, {down} to smaller, {len(mine) - len(gone)} never"


def finer(result):
    """Ball catch with the torque one ulp off: time to leave and movement after 5 s against the number of steps."""
    rows = result.tables["stability_finer_steps"]
    fig = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    left, right = fig.subplots(1, 2, sharex=True)
    for engine, (colour, _) in PARTY.items():
        for sign, dash, fill in ((1, "-", "full"), (-1, "--", "none")):
            mine = [row for row in rows if row["engine"] == engine and row["ulps_alpha"] == sign]
            counts = [5 / row["dt_s"] for row in mine]
            label = f"{engine}, {'+' if sign > 0 else '-'}1 ulp"
            options = {"color": colour, "linestyle": dash, "fillstyle": fill, "markersize": 5.5}
            left.plot(counts, [value(r["observed_s"]) for r in mine], **options, label=label)
            for side, mark in ((1, "^"), (-1, "v")):
                gone = [(5 / r["dt_s"], r["observed_s"]) for r in mine if r["direction"] == side]
                left.plot(
                    [n for n, _ in gone], [t for _, t in gone], mark, color=colour, fillstyle=fill, markersize=5.5
                )
            right.plot(counts, [max(value(r["moved_rad"]), 1e-17) for r in mine], **options)
    mine = [row for row in rows if row["engine"] == "TMT" and row["ulps_alpha"] == 1]
    left.plot(
        [5 / r["dt_s"] for r in mine], [value(r["predicted_s"]) for r in mine], ":", color="black", label="linear map"
    )
    left.plot([], [], "^", color="black", label="to larger α")
    left.plot([], [], "v", color="black", label="to smaller α")
    left.set(xscale="log", xlabel="steps in 5 s", ylabel="time until a hinge is 0.1 rad away, s", ylim=(4, 10.2))
    right.set(yscale="log", xlabel="steps in 5 s", ylabel="largest movement after 5 s, rad", ylim=(3e-18, 10))
    right.text(16384, 2.2e-17, "none", ha="right", va="bottom", fontsize=8)
    for ax in (left, right):
        ax.set_xticks([32, 128, 512, 2048, 8192], ["32", "128", "512", "2048", "8192"])
        ax.minorticks_off()
    fig.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=7, fontsize=7.5, columnspacing=1.0)
    caption = (
        "Held at ball catch by RK4, the torque one unit in the last place off in alpha. Triangles: to which side the arm "
        f"leaves. {tell_finest(rows)} The linear map, which does not round here, leaves after "
        f"{span(row['predicted_s'] for row in mine)}."
    )
    return "stability_finer_steps", fig, caption


def tell_finest(rows) -> str:
    """From how many steps on nothing moves in any series, and what a step adds at the finest."""
    counts = sorted({round(5 / row["dt_s"]) for row in rows}, reverse=True)
    still = []
    for count in counts:
        if any(row["moved_rad"] != 0.0 for row in rows if round(5 / row["dt_s"]) == count):
            break
        still.append(count)
    told = (
        f"From {min(still)} steps on nothing moves in 5 s (drawn at 1e-17)."
        if still
        else "With every step the arm moves."
    )
    last = max((row for row in rows if round(5 / row["dt_s"]) == counts[0]), key=lambda row: value(row["step_rad"]))
    return told + (
        f" At {counts[0]} steps dt qd is {value(last['step_rad']):.1e} rad after 5 s at most; half a unit in the last place "
        f"of the angle that it would change first is {last['half_ulp_rad']:.1e} rad."
    )


def bent(result):
    """Bent under RK4 below and beyond its limit: deviation against the number of steps."""
    data = result.curves["bent"]
    steps = [dt for engine, torque, dt in data["paths"] if (engine, torque) == ("TMT", TORQUES[0])][:5]
    fig = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    axes = fig.subplots(1, 2, sharey=True, sharex=True)
    colours = (GREEN, BLUE, ORANGE, RED, "#CC79A7")
    for ax, torque in zip(axes, TORQUES):
        for dt, colour in zip(steps, colours):
            for engine, dash in (("TMT", "-"), ("MuJoCo", ":")):
                path = data["paths"][(engine, torque, dt)]
                label = f"dt = {dt:.4g} s" if engine == "TMT" else None
                width = 1.2 if engine == "TMT" else 2.2
                t = dt * np.arange(len(path))
                ax.semilogy(t[1:], np.maximum(path[1:], 1e-17), dash, color=colour, linewidth=width, label=label)
        ax.axhline(LEFT, color="black", linewidth=0.6)
        ax.axvline(5.0, color=GREY, linewidth=0.8)
        ax.set(title=f"torque: {torque}", xlabel="time, s", xlim=(0, 30), ylim=(1e-17, 1e3))
    axes[0].plot([], [], ":", color="black", linewidth=2.2, label="MuJoCo")
    axes[0].set_ylabel("largest deviation of a hinge, rad")
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6, fontsize=8)
    limit = data["limit"]
    caption = (
        f"Held at bent by RK4, its predicted limit {limit:.4f} s. "
        f"{tell_above([row for row in data['rows'] if row['dt_s'] > limit])} "
        f"{tell_within(data['rows'], data['leaves_within_5_s'], len(data['counts']))} "
        f"Grey line: 5 s; black line: {LEFT:g} rad."
    )
    return "stability_bent", fig, caption


def zero(result):
    """Time to leave zero, a marginal posture, against the perturbation: the law of a cubic potential."""
    rows = [row for row in result.tables["departure"] if row["scene"] == "zero"]
    fig = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    ax = fig.subplots()
    for sign, dash, text in ((1, "-", "with the fall"), (-1, "--", "against it")):
        for engine, (colour, mark) in PARTY.items():
            mine = [row for row in rows if row["engine"] == engine and row["perturbation_rad"] * sign > 0]
            if not mine:
                continue
            p = np.abs([row["perturbation_rad"] for row in mine])
            if engine == "TMT":
                ax.loglog(p, [row["predicted_s"] for row in mine], dash, color="black", label=f"predicted, {text}")
            size, fill = (9, "none") if engine == "MuJoCo" else (4.5, "full")
            observed = [value(row["observed_s"]) for row in mine]
            label = engine if sign == 1 else None
            ax.loglog(p, observed, mark, color=colour, fillstyle=fill, markersize=size, label=label)
    anchor = min((row for row in rows if row["perturbation_rad"] > 0.0), key=lambda row: row["perturbation_rad"])
    sizes = np.array([anchor["perturbation_rad"], 1e-2])
    ax.loglog(sizes, 0.55 * anchor["predicted_s"] * np.sqrt(sizes[0] / sizes), ":", color=GREY, label="slope -1/2")
    ax.set(xlabel="perturbation along the mode without stiffness, rad", ylabel="time to move 0.1 rad, s")
    ax.set_yticks([5, 10, 20, 50, 100, 200], ["5", "10", "20", "50", "100", "200"])
    ax.minorticks_off()
    fig.legend(loc="outside upper center", ncols=5)
    off = [abs(late(row)) for row in rows if row["observed_s"] is not None]
    caption = (
        "Zero, held: along the mode without stiffness the potential is cubic, and the time to leave is predicted from the "
        f"cubic coefficient alone. {len(off)} of {len(rows)} runs of RK4 at {rows[0]['dt_s']:g} s leave"
        + (f", at most {max(off):.3f} s off the prediction." if off else ".")
    )
    return "stability_zero", fig, caption
