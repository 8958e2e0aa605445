"""Figures of speed against accuracy."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from .draw import BLUE, GREEN, GREY, ORANGE, WIDTH

PURPLE = "#CC79A7"
ENGINES = {"mujoco": ("MuJoCo", ORANGE), "tmt": ("tmt", BLUE), "scipy": ("SciPy", GREEN), "heyoka": ("heyoka", PURPLE)}
SAME_BITS = ("implicitfast", "discrete")  # as Euler's
MARKS = "osD^v<>PXph*"
LEFT, RIGHT = 3.0, 3e-16  # rad: the axis of errors runs from coarse to fine
WRONG = 1.0  # rad: a run that is farther off is no result
LOST = 30.0  # where what has diverged is drawn


def curves(result, scene) -> dict:
    """The rows of a scene by (engine, method), in the order of their settings."""
    by_method = {}
    for row in result.rows:
        if row["scene"] == scene:
            by_method.setdefault((row["engine"], row["method"]), []).append(row)
    return by_method


def scenes(result) -> list[str]:
    """The scenes with all their methods, not those of smaller models."""
    return list(result.curves["floors"])


def marker(method) -> str:
    """A mark that is the method's in every figure."""
    names = ("rk4", "dopri8", "dopri8_adaptive", "explicit_euler", "semi_implicit_euler", "implicit", "implicit_midpoint",
             "gauss_legendre_4")  # fmt: skip
    others = ("RK4", "DOP853", "RK45", "implicitfast", "Euler", "discrete", "Radau", "LSODA", "Taylor")
    for group in (names, others):
        if method in group:
            return MARKS[group.index(method) % len(MARKS)]
    return "o"


def pareto(rows, of) -> list[dict]:
    """The rows that nothing beats in both error and cost, from the cheapest to the most exact."""
    front, least = [], np.inf
    good = (r for r in rows if not r["diverged"] and r["worst_error_rad"] < WRONG)
    for row in sorted(good, key=lambda r: (r[of], r["worst_error_rad"])):
        if row["worst_error_rad"] < least:
            front.append(row)
            least = row["worst_error_rad"]
    return front


def times(result):
    """One figure for each scene: worst error against time, a curve for each method, the Pareto front marked."""
    for scene in scenes(result):
        fig = Figure(figsize=(WIDTH, 5.2), layout="constrained")
        ax = fig.subplots()
        by_method = curves(result, scene)
        ends = []
        for (engine, method), rows in by_method.items():
            _, colour = ENGINES[engine]
            good = [r for r in rows if not r["diverged"]]
            errors = np.clip([r["worst_error_rad"] for r in good], RIGHT, LEFT)
            ax.plot(
                errors,
                [1e3 * r["seconds"] for r in good],
                marker=marker(method),
                markersize=3.5,
                linewidth=1,
                color=colour,
            )
            if good:
                k = int(np.argmin(errors))
                if engine != "mujoco" or method not in SAME_BITS:
                    name = ", ".join([method, *SAME_BITS]) if (engine, method) == ("mujoco", "Euler") else method
                    ends.append([errors[k], 1e3 * good[k]["seconds"], name, colour])
        front = pareto([r for rows in by_method.values() for r in rows], "seconds")
        ax.plot(
            np.clip([r["worst_error_rad"] for r in front], RIGHT, LEFT), [1e3 * r["seconds"] for r in front],
            "o", markersize=9, markerfacecolor="none", markeredgecolor="black", label="nothing is both faster and more exact",
        )  # fmt: skip
        for name, colour in ENGINES.values():
            if any(e == name for e, _ in (ENGINES[engine] for engine, _ in by_method)):
                ax.plot([], [], color=colour, linewidth=3, label=name)
        floor = result.curves["floors"][scene]
        ax.axvline(floor, color=GREY, linestyle=":", label="rounding: eps × growth")
        ax.set(
            xscale="log",
            yscale="log",
            xlim=(LOST * 3, RIGHT / 30),
            xlabel="worst error on the way, rad (finer to the right)",
        )
        ax.set_ylabel("time for 5 s of motion, ms")
        labelled(ax, ends)
        lost = [
            (ENGINES[r["engine"]][1], 1e3 * r["seconds"]) for rows in by_method.values() for r in rows if r["diverged"]
        ]
        for colour, time in lost:
            ax.plot(LOST, time, "x", color=colour, markersize=6)
        if lost:
            ax.plot([], [], "x", color="black", label="diverged (no error)")
        fig.legend(loc="outside upper center", ncols=3, fontsize=8)
        caption = f"{scene[0].upper()}{scene[1:]}: {spoken(result, scene)}"
        if lost:
            caption += f" {len(lost)} settings with coarse steps diverge (crosses at the left)."
        yield "speed_" + scene.replace(", ", "_").replace(" ", "_"), fig, caption


def labelled(ax, ends) -> None:
    """The name of each curve beside its most exact point, none over another."""
    ends.sort(key=lambda end: end[1])
    placed = []
    for error, time, name, colour in ends:
        y = np.log10(time)
        while any(abs(np.log10(error / e)) < 2.9 and abs(y - p) < 0.17 for e, p in placed):
            y += 0.04
        placed.append((error, y))
        ax.annotate(
            name, (error, time), (error / 1.8, 10**y), fontsize=7, color=colour, va="center",
            path_effects=[withStroke(linewidth=2, foreground="white")],
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4} if 10**y > 1.3 * time else None,
        )  # fmt: skip


def spoken(result, scene) -> str:
    """The message of a scene: how many times faster at the errors asked for."""
    lines = [line for line in result.tables["what_should_i_use"] if line["scene"] == scene and line["ratio"]]
    told = ", ".join(f"{line['ratio']:.0f} times as long for {line['target_rad']:.0e} rad" for line in lines)
    return (
        f"MuJoCo's cheapest setting takes {told} as tmt's."
        if told
        else "no error asked for is reached by both parties."
    )


def evaluations(result):
    """Worst error against evaluations of the right-hand side: independent of the machine and of who wrote the kernel."""
    fig, axes = panels(result)
    for ax, scene in zip(axes, scenes(result)):
        for (engine, method), rows in curves(result, scene).items():
            good = [r for r in rows if not r["diverged"] and r["evaluations"]]
            if good and not (engine == "mujoco" and method in SAME_BITS):
                errors = np.clip([r["worst_error_rad"] for r in good], RIGHT, LEFT)
                line(ax, engine, method, errors, [r["evaluations"] for r in good])
        ax.set(xlim=(LEFT * 2, 2e-16), ylim=(40, 2e6))
    fig.supylabel("evaluations of the right-hand side", fontsize=9)
    finish(fig, axes, "worst error on the way, rad")
    ratio = fewest(result, "bent, free", 1e-9)
    alike = [check.passed for check in result.checks if "twin" in check.quantity]
    same = "MuJoCo and its twins lie on one curve." if all(alike) else "MuJoCo and its twins do not lie on one curve."
    caption = (
        f"The same errors against evaluations of the equations of motion, which do not depend on the machine. {same} {ratio} Of "
        "an implicit method an evaluation with its derivatives counts once; heyoka's Taylor method has none and is not drawn."
    )
    return "speed_evaluations", fig, caption


def fewest(result, scene, target) -> str:
    """How many evaluations RK4 and the 8th-order method need for an error, in words."""
    counts = {}
    for method in ("rk4", "dopri8"):
        rows = curves(result, scene).get(("tmt", method), [])
        good = [r["evaluations"] for r in rows if not r["diverged"] and r["worst_error_rad"] <= target]
        counts[method] = min(good, default=None)
    if None in counts.values():
        return ""
    return f"For {target:.0e} rad ({scene}) rk4 needs {counts['rk4']}, dopri8 {counts['dopri8']}."


def energy(result):
    """Energy error against time."""
    fig, axes = panels(result)
    for ax, scene in zip(axes, scenes(result)):
        for (engine, method), rows in curves(result, scene).items():
            good = [r for r in rows if not r["diverged"]]
            if good and not (engine == "mujoco" and method in SAME_BITS):
                line(
                    ax,
                    engine,
                    method,
                    np.clip([r["energy_error_J"] for r in good], 1e-15, 10),
                    [1e3 * r["seconds"] for r in good],
                )
        ax.set(xlim=(20, 3e-16))
    fig.supylabel("time for 5 s of motion, ms", fontsize=9)
    finish(fig, axes, "largest energy error on the grid, J")
    errors = {}
    for method in ("semi_implicit_euler", "rk4"):
        rows = [r for s in scenes(result) for r in curves(result, s).get(("tmt", method), []) if not r["diverged"]]
        errors[method] = min(r["energy_error_J"] for r in rows)
    caption = (
        f"Largest error of the energy against time. The least that semi_implicit_euler reaches in any scene is "
        f"{errors['semi_implicit_euler']:.1e} J, rk4 {errors['rk4']:.1e} J."
    )
    return "speed_energy", fig, caption


def panels(result):
    """One panel for each scene."""
    names = scenes(result)
    columns = 2 if len(names) > 1 else 1
    lines = -(-len(names) // columns)
    fig = Figure(figsize=(WIDTH, 1.2 + 2.6 * lines), layout="constrained")
    axes = list(fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).flat)
    for ax, name in zip(axes, names):
        ax.set(xscale="log", yscale="log", title=name)
    return fig, axes


def line(ax, engine, method, errors, costs) -> None:
    name, colour = ENGINES[engine]
    dash = "-" if engine in ("mujoco", "tmt") else "--"
    wide = 2.5 if engine == "mujoco" else 0.9  # seen where tmt's twin lies on it
    label = f"{name}: {'Euler, implicitfast, discrete' if engine == 'mujoco' and method == 'Euler' else method}"
    ax.plot(
        errors,
        costs,
        dash,
        marker=marker(method),
        markersize=3 + (engine == "mujoco"),
        linewidth=wide,
        color=colour,
        label=label,
    )


def finish(fig, axes, label) -> None:
    fig.supxlabel(f"{label} (finer to the right)", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=7)


def cost_of_one(result):
    """What one evaluation costs, way by way."""
    rows = [row for row in result.tables["evaluations"] if row["quantity"] == "forward_dynamics"]
    fig = Figure(figsize=(WIDTH, 0.9 + 0.24 * len(rows)), layout="constrained")
    ax = fig.subplots()
    names = [f"{r['implementation']}, {r['states']:,} state{'s' * (r['states'] > 1)}"
             + (f", {r['threads']} threads" if r["threads"] > 1 else "") for r in rows]  # fmt: skip
    values = [r["ns_per_state"] for r in rows]
    colours = [ORANGE if r["implementation"].startswith("MuJoCo") else BLUE for r in rows]
    ax.barh(range(len(rows)), values, color=colours, height=0.7)
    for k, value in enumerate(values):
        ax.text(value * 1.1, k, f"{value:,.0f}" if value >= 100 else f"{value:.1f}", va="center", fontsize=8)
    ax.set_yticks(range(len(rows)), names, fontsize=8)
    ax.set(xscale="log", xlabel="ns per state", xlim=(min(values) / 2, max(values) * 5))
    ax.grid(axis="y", visible=False)
    fastest, whole = (
        min(values),
        next((r["ns_per_state"] for r in rows if r["implementation"] == "MuJoCo, mj_forward"), None),
    )
    caption = (
        f"Forward dynamics of the arm for one state: from {max(values):,.0f} ns in plain Python to {fastest:.1f} ns"
    )
    caption += f"; MuJoCo's mj_forward takes {whole:,.0f} ns." if whole else "."
    return "speed_evaluation_cost", fig, caption
