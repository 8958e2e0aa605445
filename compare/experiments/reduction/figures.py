"""Figures of what a scene needs: hinges and time, exact swings, small oscillations, costs in MuJoCo."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tmt.methods import METHODS

from .draw import BLUE, GREEK, GREEN, GREY, ORANGE, WIDTH
from .engine_cost import AGAIN, CONTACT, NOTHING
from .motion import TWINS
from .scenes import HINGES

STYLES = {("TMT", "RK4"): (GREEN, "-"), ("TMT", "Euler"): (BLUE, "--")}


def needs(result):
    """Which hinges each scene needs, and the time of a step of the whole and of the smallest model."""
    scenes = result.curves["needs"]
    fig = Figure(figsize=(WIDTH, 0.9 + 0.36 * len(scenes)), layout="constrained")
    left, right = fig.subplots(1, 2, sharey=True, width_ratios=(1, 2.4))
    marks = {
        "needed": {"marker": "o", "color": BLUE},
        "never moves": {"marker": "o", "color": BLUE, "mfc": "none"},
        "declared locked": {"marker": "x", "color": GREY},
    }
    for y, found in enumerate(scenes.values()):
        for x, hinge in enumerate(HINGES):
            kind = (
                "declared locked"
                if hinge in found["locked"]
                else "never moves"
                if hinge in found["stays"]
                else "needed"
            )
            left.plot(x, y, markersize=9, linestyle="none", **marks[kind])
    left.set(xlim=(-0.6, 2.6), ylim=(max(1, len(scenes)) - 0.5, -0.5))
    left.set_xticks(range(len(HINGES)), [GREEK[hinge] for hinge in HINGES])
    left.set_yticks(range(len(scenes)), scenes)
    left.tick_params(length=0)
    parties = {"TMT": (-0.15, {"marker": "o", "color": GREEN}), "MuJoCo": (0.15, {"marker": "s", "color": ORANGE})}
    for party, (offset, style) in parties.items():
        for y, name in enumerate(scenes):
            times = [row["ns_per_step"] for row in rows_of(result, name, party)]
            if not times:
                continue
            whole, smallest = times[0], times[-1]
            right.plot(whole, y + offset, mfc="none", **style)
            if smallest is None:
                right.text(whole * 1.25, y + offset, "no run needed", va="center", fontsize=8)
                continue
            right.plot([smallest, whole], [y + offset] * 2, color=style["color"], linewidth=1)
            right.plot(smallest, y + offset, markersize=3.5, **style)
            if len(times) > 1:
                right.text(smallest / 1.15, y + offset, f"×{whole / smallest:.2f}", ha="right", va="center", fontsize=8)
    right.set(xscale="log", xlabel="time of an RK4 step, ns", xlim=(15, 100000))
    right.set_xticks([100, 1000, 10000], ["100", "1000", "10000"])
    handles = [Line2D([], [], linestyle="none", label=kind, markersize=7, **style) for kind, style in marks.items()]
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "handletextpad": 0.2, "columnspacing": 1.0}
    left.legend(handles=handles, ncols=1, **above)
    handles = [
        Line2D([], [], linestyle="none", label=f"{party}, {model}", **style | more)
        for party, (_, style) in parties.items()
        for model, more in (("whole model", {"mfc": "none"}), ("smallest model", {"markersize": 3.5}))
    ]
    right.legend(handles=handles, ncols=2, **above)
    held = [name for name, found in scenes.items() if not found["locked"] and len(found["stays"]) == len(HINGES)]
    fewer = [name for name, found in scenes.items() if found["stays"] and name not in held]
    told = [f"Nothing for {'; '.join(held)}: the exact solution stays."] if held else []
    told += [f"Fewer than all {len(HINGES)} hinges, proved, for {'; '.join(fewer)}."] if fewer else []
    return "reduction_needs", fig, " ".join(["What each scene of the stated arm needs.", *told, gain(result.rows)])


def gain(rows) -> str:
    """The largest gain of a smaller model, in words."""
    smaller = [row for row in rows if row["speedup"] and row["nv"] < len(HINGES)]
    best = max(smaller, key=lambda row: row["speedup"], default=None)
    if best is None:
        return "No smaller model was timed."
    return (
        f"The largest gain is that of {best['engine']} in {best['scene']}, {best['integrator']}: with {best['nv']} of "
        f"{len(HINGES)} hinges a step takes {1 / best['speedup']:.2f} of the time of the whole model's."
    )


def rows_of(result, scene, party):
    """The rows of a scene and party with RK4, the whole model first."""
    return [row for row in result.rows if (row["scene"], row["engine"], row["integrator"]) == (scene, party, "RK4")]


def swing(result, scene):
    """Error of a swing of one hinge against the elliptic function, over the step."""
    dt, errors, orders = (result.curves["swings"][scene][key] for key in ("dt", "errors", "orders"))
    fig = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    ax = fig.subplots()
    for (party, integrator), values in errors.items():
        if party == "TMT":
            colour, dash = STYLES[party, integrator]
            ax.loglog(dt, values, dash, color=colour, label=f"{integrator}, TMT")
            ax.loglog(dt, errors["MuJoCo", integrator], "o", mfc="none", color=colour, label=f"{integrator}, MuJoCo")
            power = f"order {METHODS[TWINS[integrator]].order}"
            ax.annotate(power, (dt[3], values[3]), xytext=(0, 8), textcoords="offset points", ha="right", color=colour)
    ax.set(xlabel="dt, s", ylabel="largest error of the angle, rad")
    fig.legend(loc="outside upper center", ncols=4)
    told = "; ".join(
        f"{integrator}: order {orders['TMT', integrator]:.2f} and {orders['MuJoCo', integrator]:.2f}, down to "
        f"{errors['TMT', integrator][-1]:.1e} and {errors['MuJoCo', integrator][-1]:.1e} rad"
        for integrator in ("RK4", "Euler")
    )
    caption = (
        f"{scene[0].upper()}{scene[1:]}: distance from the exact motion, an elliptic function of time. TMT and MuJoCo with "
        f"{told}."
    )
    return f"reduction_{scene.replace(', ', '_').replace(' ', '_')}", fig, caption


def small_oscillations(result):
    """Distance of small oscillations about hanging from the linear modes, over their amplitude."""
    small = result.curves["small"]
    fig = Figure(figsize=(WIDTH, 2.8), layout="constrained")
    ax = fig.subplots()
    amplitude, off = small["amplitude"], small["off"]
    ax.loglog(amplitude, off["TMT"], color=BLUE, label="TMT")
    ax.loglog(
        amplitude, off["MuJoCo"], "o", mfc="none", markersize=8, color=ORANGE, markeredgewidth=1.5, label="MuJoCo"
    )
    ax.loglog(
        amplitude, 0.4 * off["TMT"][-1] * (amplitude / amplitude[-1]) ** 2, ":", color=GREY, label="amplitude squared"
    )
    ax.set(xlabel="amplitude, rad", ylabel="distance / amplitude")
    ax.set_xticks(amplitude, [f"{a:g}" for a in amplitude])
    ax.minorticks_off()
    fig.legend(loc="outside upper center", ncols=3)
    modes = ", ".join(f"{f:.3f}" for f in small["frequencies"])
    powers = " and ".join(f"{small['powers'][party]:.3f} ({party})" for party in off)
    least = " and ".join(f"{off[party][-1]:.1e} ({party})" for party in off)
    caption = (
        f"Small oscillations about hanging against the linear modes of the stated arm ({modes} rad/s): the relative distance in "
        f"{small['duration']:g} s goes with the amplitude to the power {powers}, where the same arm has 2. It is {least} at "
        f"{amplitude[-1]:g} rad."
    )
    return "reduction_modes", fig, caption


def costs(result):
    """Cost in MuJoCo of each thing that is added, as a ratio to the minimal model."""
    table = result.tables["cost_in_mujoco"]
    names = [name for name in dict.fromkeys(row["added"] for row in table) if name != NOTHING]
    fig = Figure(figsize=(WIDTH, 0.9 + 0.32 * len(names)), layout="constrained")
    ax = fig.subplots()
    most = max((row["ratio"] for row in table), default=1.0)
    for offset, integrator, colour in ((-0.19, "Euler", BLUE), (0.19, "RK4", GREEN)):
        rows = {row["added"]: row for row in table if row["integrator"] == integrator}
        for y, name in enumerate(names):
            row = rows[name]
            hatch = None if row["same_bits"] else "////"
            ax.barh(
                y + offset,
                row["ratio"] - 1.0,
                left=1.0,
                height=0.36,
                color=colour,
                alpha=0.8,
                hatch=hatch,
                edgecolor="white",
            )
            ax.text(max(row["ratio"], 1.0) + 0.01 * most, y + offset, f"{row['ratio']:.2f}", va="center", fontsize=7)
    ax.set_yticks(range(len(names)), names)
    ax.axvline(1.0, color="black", linewidth=0.8)
    ax.set(
        ylim=(max(1, len(names)) - 0.5, -0.5),
        xlabel="time of a step / that of the minimal model",
        xlim=(0.9, 1.08 * most),
    )
    ax.grid(axis="y", visible=False)
    handles = [Patch(color=colour, alpha=0.8, label=name) for name, colour in (("Euler", BLUE), ("RK4", GREEN))]
    handles.append(Patch(facecolor=GREY, hatch="////", edgecolor="white", label="changes the motion"))
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    ratio = {(row["added"], row["integrator"]): row["ratio"] for row in table}
    changing = {row["added"] for row in table if not row["same_bits"]}
    again = [abs(row["ratio"] - 1.0) for row in table if row["added"] == AGAIN]
    told = [
        f"{ratio[name, 'Euler']:.2f} and {ratio[name, 'RK4']:.2f} with {name}"
        for name in ("default flags", "default flags + capsules", CONTACT)
        if (name, "Euler") in ratio
    ]
    same = len({row["added"] for row in table} - changing - {NOTHING, AGAIN})
    caption = (
        "What each addition costs in MuJoCo, a step of Euler and of RK4 as ratios to the minimal model: "
        f"{'; '.join(told)}. The minimal model timed again differs by {100 * max(again, default=np.nan):.1f} %. The motion is "
        f"changed by: {'; '.join(sorted(changing)) or 'none'}; {same} additions leave the same bits."
    )
    return "reduction_cost_in_mujoco", fig, caption
