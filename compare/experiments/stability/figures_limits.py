"""Figures of step limits: predicted and observed, the regions of the methods, growth over dt."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...engines import LABELS, Method
from ...judge.check import Result
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from ...robots import Robot
from .choice import coarsest_case, damped, fraction, unit_of_movements
from .departure import span
from .growth import LINEAR_DEVIATION
from .limits_judged import apart

SCHEME_LOOKS = {  # colour, dash, name
    "rk4": (GREEN, "-", "RK4"),
    "explicit_euler": (GREY, (0, (1, 1)), "explicit Euler"),
    "semi_implicit_euler": (BLUE, "--", "semi-implicit Euler"),
    "implicit": (RED, "-.", "implicit"),
    "implicit_midpoint": (ORANGE, (0, (5, 1)), "implicit midpoint"),
    "gauss_legendre_4": (PINK, (0, (3, 1, 1, 1, 1, 1)), "Gauss-Legendre 4"),
    "dopri8": (SKY, (0, (4, 2)), "Dormand-Prince 8"),
}


def look(name: str) -> tuple:
    """Colour, dash and printed name of a method."""
    return SCHEME_LOOKS.get(name, ("black", "-", name))


def in_print(method: Method) -> str:
    """The engine and the printed name of a method."""
    return f"{LABELS[method.engine]} {look(method.name)[2]}"


def draw_limits(result: Result, robot: Robot) -> tuple[str, Figure, str]:
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
            theirs = row["engine"] == "mujoco"
            place = schemes.index(result.curves["schemes"][row["engine"], row["method"]])
            if row["limit"] != "finite" and not theirs:
                text = {"never_fails": "no limit", "always_fails": "fails at every step"}[row["limit"]]
                ax.text(low * 1.1, place, text, va="center", fontsize=8, color=GREY)
            elif row["limit"] != "finite" or (theirs and row["observed_dt_s"] is None):
                continue
            elif theirs:
                mark = {"color": "black", "marker": "|", "markersize": 9, "markeredgewidth": 1.6, "linestyle": "none"}
                ax.plot(row["observed_dt_s"], place + 0.2, **mark)
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
    fig.supxlabel("largest dt, s" + " (damping in N m s/rad)" * (not robot.is_read), fontsize=9)
    handles = [
        axes[0, 0].barh(-9, 1, color=ORANGE, label="predicted from one step"),
        axes[0, 0].barh(-9, 1, color=BLUE, label="observed, TMT"),
        *axes[0, 0].plot([], [], "|", color="black", markersize=9, markeredgewidth=1.6, label="observed, MuJoCo"),
    ]
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    expected = [row for row in rows if row["limit"] == "finite"]
    off = [apart(row) for row in expected if apart(row) is not None]
    caption = (
        f"The largest dt at which no mode of the equations of motion grows in a run from {LINEAR_DEVIATION:g} "
        f"{unit_of_movements(robot)}, found by "
        "bisection, beside the limit predicted from the amplification of one step"
        + ", without the robot's actuators" * bool(robot.drive.actuators)
        + f". {len(off)} of {len(expected)} predicted limits are observed"
        + (
            f"; they differ by {100 * float(np.median(off)):.3f} % in the middle and by at most {100 * max(off):.3f} %."
            if off
            else "."
        )
    )
    return "stability_limits", fig, caption


def draw_regions(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Eigenvalues times dt inside each method's stability region."""
    drawn, points, case = result.curves["regions"], result.curves["points"], coarsest_case(robot)
    centre, dt = result.curves["looked at"]["centre"], case.scene.dt
    columns = 2 if len(drawn) == 4 else 3
    lines = -(-len(drawn) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    # marker, colour, size, filled: marks that come to lie on each other differ in size
    at_centre, with_damping, at_saddle = ("o", BLUE, 7, "none"), ("s", GREEN, 4, "full"), ("^", RED, 3.5, "full")
    titles = {names: " and ".join(look(name)[2] for name in names) for names in drawn}
    outside = []
    for ax, (names, (x, y, growth)) in zip(axes.flat, drawn.items()):
        ax.contourf(x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[0.0, 1.0 + 1e-9], colors=["#dddddd"])
        ax.contour(
            x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[1.0 + 1e-3], colors=[GREY], linewidths=0.8
        )
        mine = (row for row in result.rows if (row["engine"], row["method"]) == ("tmt", names[0]))
        limits = (row for row in mine if (row["scene"], row["damping"]) == (centre, 0.0))
        row = next((row for row in limits if row["predicted_dt_s"] is not None), None)
        # of a robot that is read from a file, whose own step is small, all modes at the limit; else one, and all at its step
        spread = row["predicted_dt_s"] if row and robot.is_read else dt
        titles[names] += f", dt = {spread:.3g} s" if robot.is_read else ""
        for (posture, damping), values in points.items():
            mark, colour, size, fill = at_saddle if posture != centre else with_damping if damping else at_centre
            z, label = spread * values, f"{posture}, {damped(robot, damping)}"
            ax.plot(z.real, z.imag, mark, color=colour, markersize=size, fillstyle=fill, label=label)
        if row:
            values = points[centre, 0.0]
            z = row["predicted_dt_s"] * values[np.argmin(np.abs(np.abs(values) - row["mode_per_s"]))]
            ax.plot(z.real, abs(z.imag), "x", color="black", markersize=6, label=f"{centre} at its limit")
            outside.append(f"{abs(z):.3f} ({titles[names]})")
        ax.axhline(0, color="black", linewidth=0.5)
        ax.axvline(0, color="black", linewidth=0.5)
        ax.set(title=titles[names], xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        ax.set_aspect("equal")
    for ax in axes.flat[len(drawn) :]:
        ax.set_visible(False)
    fig.supxlabel("Re(eigenvalue) dt", fontsize=9)
    fig.supylabel("Im(eigenvalue) dt", fontsize=9)
    handles = {}
    for ax in axes.flat:
        handles |= dict(zip(*reversed(ax.get_legend_handles_labels())))
    fig.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=4)
    growing = {
        name: [dt * v.real for v in values if v.real > 1e-9]
        for (name, damping), values in points.items()
        if not damping
    }
    real = "; ".join(f"{name}: {', '.join(f'{z:.3f}' for z in found)}" for name, found in growing.items() if found)
    limiting, swing, step = "the fastest mode", "omega dt", f"dt = {fraction(case.duration, dt)} s"
    if robot.is_read:
        limiting, swing = "the mode that a step first lets grow", "|eigenvalue| dt"
        step = f"the limit of dt at the posture {centre}, where there is one, else {step}" if centre else step
    caption = (
        "The upper half of the stability regions (grey: one step lets neither of a pair of conjugate eigenvalues "
        f"grow) with the eigenvalues of the held {robot.noun} times {step}. "
        + (f"Positive real parts, which grow in the exact motion too ({real}). " if real else "")
        + (f"Crosses: {limiting} of {centre} at the limit, {swing} = {', '.join(outside)}. " if outside else "")
        + "Of partitioned methods two different real eigenvalues do not have a region; their marks are a guide."
    )
    return "stability_regions", fig, caption


def draw_growth_map(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Growth over dt, a row for each engine and method."""
    drawn, centre = result.curves["map"], result.curves["looked at"]["centre"]
    by_method, dts, steps, allowed = (drawn[key] for key in ("grown", "x", "steps", "allowed"))
    grown = np.array(list(by_method.values()))
    fig = Figure(figsize=(WIDTH, 0.9 + 0.27 * len(by_method)), layout="constrained")
    ax = fig.subplots()
    shown = np.clip(np.where(np.isfinite(grown), grown, 1e6), 1.0, 1e6)
    edges = np.sqrt(dts[1:] * dts[:-1])
    edges = np.r_[dts[0], edges, dts[-1]]
    image = ax.pcolormesh(
        edges, np.arange(len(by_method) + 1) - 0.5, shown, norm=LogNorm(1, 1e6), cmap="cividis", rasterized=True
    )
    limit = {
        (r["engine"], r["method"]): r["predicted_dt_s"]
        for r in result.rows
        if (r["scene"], r["damping"]) == (centre, 0.0)
    }
    for place, method in enumerate(by_method):
        at = limit.get((method.engine, method.name))
        if at is not None:
            ax.plot([at, at], [place - 0.5, place + 0.5], color=RED, linewidth=2.5)
    ax.plot([], [], color=RED, linewidth=2.5, label="predicted limit")
    ax.set_yticks(range(len(by_method)), [in_print(method) for method in by_method])
    ax.set(xscale="log", xlabel="dt, s", xlim=(dts[0], dts[-1]))
    ax.set_xticks([0.03, 0.1, 0.3, 1.0], ["0.03", "0.1", "0.3", "1"])
    ax.invert_yaxis()
    ax.grid(visible=False)
    bar = fig.colorbar(image, label=f"growth in {steps} steps", extend="max")
    bar.ax.minorticks_off()
    fig.legend(loc="outside upper center")
    caption = (
        f"How much a perturbation of {LINEAR_DEVIATION:g} rad grows at {centre}, {damped(robot, 0.0)}, in {steps} steps, at "
        f"{len(dts)} values of dt, {100 * (dts[1] / dts[0] - 1):.1f} % apart. {map_in_words(by_method, dts, allowed, limit)}"
    )
    return "stability_map", fig, caption


def map_in_words(by_method: dict, dts: np.ndarray, allowed: float, limit: dict) -> str:
    """At which dt growth begins, beside the predicted limit; which method grows at every step, and which at none."""
    first = {
        method: float(dts[np.argmax(~(row < allowed))]) if not (row < allowed).all() else None
        for method, row in by_method.items()
    }
    always = [in_print(method) for method, dt in first.items() if dt == dts[0]]
    never = [in_print(method) for method, dt in first.items() if dt is None]
    edges = {method: dt for method, dt in first.items() if dt is not None and dt != dts[0]}
    after = 0
    for method, dt in edges.items():
        at = limit.get((method.engine, method.name))
        before = dts[np.searchsorted(dts, dt) - 1]
        after += at is not None and before <= at <= dt
    texts = [
        f"Growth is {allowed:.0f}-fold or more first at {span(edges.values())}, for {after} of {len(edges)} at the first "
        "value above the predicted limit"
    ] * bool(edges)
    texts += [f"At every dt: {', '.join(always)}"] * bool(always) + [f"At none: {', '.join(never)}"] * bool(never)
    return ". ".join(texts) + "."
