"""Figures of the arm: step limits, also of the first screen; departure; claims."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...core.check import Result
from ...core.finding import Finding
from ...engines import COLOURS, LABELS
from ...engines.mujoco.engine import SCHEMES as OF_MUJOCO
from ...judge.run import LEFT, number_or_nan
from ...report.style import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, WIDTH
from ...robots import Robot
from ..figures import MOST_ROWS, chart, named_rows
from .claims import NEAREST, claims_of, fraction
from .departure import departure_values
from .limits import LINEAR_DEVIATION, summary
from .tables import ClaimRow, LimitRow

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


def look(name: str) -> tuple[str, Any, str]:
    """Colour, dash and printed name of a method."""
    return SCHEME_LOOKS.get(name, ("black", "-", name.replace("_", " ")))


def limits_in(ax: Axes, rows: Sequence[LimitRow], most: int | None = None) -> list[Line2D]:
    """The limits of each scheme, predicted (line) and observed (mark); the handles of a legend."""
    of_scheme: dict[str, list[LimitRow]] = {}
    for row in rows:
        of_scheme.setdefault(OF_MUJOCO.get(row.method, row.method), []).append(row)
    of_scheme = dict(list(of_scheme.items())[:most])
    ends = [dt for row in rows for dt in (row.predicted_dt, row.observed_dt) if dt]
    low, high = min(ends) / 2, max(ends) * 2
    for place, mine in enumerate(of_scheme.values()):
        for row in mine:
            is_mujoco, failed = row.engine == "mujoco", row.passed is False
            if row.predicted_dt:
                ax.vlines(row.predicted_dt, place - 0.38, place + 0.38, color=GREY, linewidth=1.0)
            mark = "X" if failed else "s" if is_mujoco else "o"
            colour = RED if failed else ORANGE if is_mujoco else BLUE
            shift = 0.17 if is_mujoco else -0.17
            ax.plot(number_or_nan(row.observed_dt), place + shift, mark, color=(colour, 0.85), markersize=4.5)
        if all(row.limit != "finite" for row in mine):
            count = sum(row.limit == "never_fails" for row in mine)
            some = f"no limit at {count} of {len(mine)}" if count else "fails at every step"
            text = "no limit" if count == len(mine) else some
            ax.text(low * 1.15, place, text, va="center", fontsize=8, color=GREY)
    passed = [all(row.passed is not False for row in mine) for mine in of_scheme.values()]
    named_rows(ax, [look(name)[2] for name in of_scheme], passed)
    ax.tick_params(axis="y", labelsize=8)
    ax.set(xscale="log", xlim=(low, high))
    decades = np.multiply.outer(10.0 ** np.arange(-5, 4), [1, 2, 5] if high / low < 100 else [1]).ravel()
    ticks = decades[(low < decades) & (decades < high)]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    return [
        *ax.plot([], [], "|", color=GREY, markersize=9, label="predicted"),
        *ax.plot([], [], "o", color=BLUE, markersize=4.5, label="observed, TMT"),
        *ax.plot([], [], "s", color=ORANGE, markersize=4.5, label="observed, MuJoCo"),
    ]


def draw_overview(result: Result, rows: Sequence[LimitRow]) -> tuple[str, Figure, Finding]:
    """The limits of the first screen, all postures in one."""
    fig, ax = chart()
    handles = limits_in(ax, rows, MOST_ROWS)
    ax.set_xlabel("largest stable dt, s")
    looks = {"ncols": 3, "fontsize": 7.5, "handletextpad": 0.1, "columnspacing": 0.8}
    fig.legend(handles=handles, loc="outside upper center", **looks)
    return "overview_limits", fig, result.finding("overview_caption", **summary(rows))


def draw_limits(result: Result, rows: Sequence[LimitRow]) -> tuple[str, Figure, Finding]:
    """The limits scene by scene and damping by damping."""
    panels = list(dict.fromkeys((row.scene, row.damping) for row in rows))
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    fig = Figure(figsize=(WIDTH, 0.9 + 2.15 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharey=True, squeeze=False)
    for ax, (scene, damping) in zip(axes.flat, panels):
        here = [row for row in rows if (row.scene, row.damping) == (scene, damping)]
        handles = limits_in(ax, here)
        ax.set_title(f"{scene}, damping {damping:g}" if damping else scene)
    fig.supxlabel("largest stable dt, s (damping in N m s/rad)", fontsize=9)
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    first = [row for row in rows if (row.scene, row.damping, row.engine) == (*panels[0], "tmt")]
    products = {look(row.method)[2]: row.predicted_dt * row.mode for row in first if row.predicted_dt}
    about: dict[str, Any] = {"deviation": LINEAR_DEVIATION, "posture": panels[0][0], "products": products}
    return "stability_limits", fig, result.finding("figure_limits", **about, **summary(rows))


def draw_departure(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """Time to leave a saddle against the size of the perturbation."""
    rows = result.tables["departure"]
    steps = sorted({row.dt for row in rows}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    axes = fig.subplots(1, len(steps), sharey=True, squeeze=False)[0]
    methods = list(dict.fromkeys((row.engine, row.method) for row in rows))
    for ax, dt in zip(axes, steps):
        for k, (engine, method) in enumerate(methods):
            mine = [row for row in rows if (row.dt, row.engine, row.method) == (dt, engine, method)]
            mine.sort(key=lambda row: row.perturbation)
            sizes = [row.perturbation for row in mine]
            observed = [number_or_nan(row.observed) for row in mine]
            predicted = [number_or_nan(row.predicted) for row in mine]
            label = f"{LABELS[engine]}: {look(method)[2] if engine == 'tmt' else method}"
            colour, dash, _ = look(method)
            if engine == "tmt":
                ax.plot(sizes, predicted, linestyle=dash, color=colour, linewidth=1)
                of_tmt: dict[str, Any] = {"color": colour, "mfc": "none", "markersize": 11 - k}
                ax.plot(sizes, observed, MARKS[k % 6], label=label, **of_tmt)
            else:
                ax.plot(sizes, observed, MUJOCO_MARKS[k % 3], color="black", markersize=5, label=label)
        ax.set(xscale="log", ylim=(0, None), title=f"dt = {dt:.4g} s")
        ax.minorticks_off()
    axes[0].set_ylabel(f"time until a movement of {LEFT:g} rad, s")
    axes[0].plot([], [], color="black", linewidth=1, label="predicted by the linear map")
    fig.supxlabel("perturbation, rad", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)
    values = {"posture": rows[0].scene, "noun": robot.noun, "left": LEFT}
    return "stability_departure", fig, result.finding("figure_departure", **values, **departure_values(rows))


def draw_claims(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """A panel for each claim that was tried: times of departure, the same over the steps, how far a kept posture moves."""
    claims, rows = claims_of(robot), result.tables["stability_claims"]
    found = [claim for claim in (1, 2, 3) if any(row.claim == claim for row in rows)]
    fig = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = fig.subplots(1, len(found), squeeze=False)[0]
    for ax, claim in zip(axes, found):
        series: dict[tuple[str, int], list[ClaimRow]] = {}
        for row in rows:
            if row.claim == claim and row.torque != NEAREST:
                series.setdefault((row.engine, row.ulps or 0), []).append(row)
        for (engine, sign), mine in series.items():
            fill = "full" if engine == "tmt" else "none"
            looks: dict[str, Any] = {"color": COLOURS[engine], "fillstyle": fill, "markersize": 5}
            where = range(1, len(mine) + 1) if claim == 1 else [row.dt for row in mine]
            values = [number_or_nan(row.moved if claim == 3 else row.observed) for row in mine]
            if claim == 2:
                ax.plot(where, values, "-" if sign > 0 else "--", color=COLOURS[engine])
            for place, value, row in zip(where, values, mine):
                ax.plot(place, value, "v" if row.direction == -1 else "^", **looks)
        ax.set_title(f"claim {claim}: {claims.kept if claim == 3 else claims.left}")
        ax.set_xlabel("torque within one ulp" if claim == 1 else "dt, s")
        ax.set_ylabel("largest movement, rad" if claim == 3 else f"time until a movement of {LEFT:g} rad, s")
        ax.set(xscale="linear" if claim == 1 else "log", yscale="log" if claim == 3 else "linear")
        if claim == 2:
            steps = sorted({row.dt for row in rows if row.claim == claim})[::3]
            ax.set_xticks(steps, [f"{dt:.2g}" for dt in steps])
            ax.minorticks_off()
        if claim == 3:
            lost = [row.dt for row in rows if row.claim == claim and row.diverged_at is not None]
            ax.plot(lost, [1.0] * len(lost), "x", color="black", label="diverges")
            ax.set_xticks((0.3, 0.4, 0.6, 1.0), ("0.3", "0.4", "0.6", "1"))
            ax.minorticks_off()
    for engine in dict.fromkeys(row.engine for row in rows):
        fill = "full" if engine == "tmt" else "none"
        axes[0].plot([], [], "^", color=COLOURS[engine], fillstyle=fill, label=LABELS[engine])
    fig.legend(loc="outside upper center", ncols=3, fontsize=8)
    dt, joint = fraction(claims.duration, claims.dt), robot.joints[0]
    about: dict[str, Any] = {"posture": claims.left, "kept": claims.kept, "panels": len(found)}
    return "stability_claims", fig, result.finding("figure_claims", dt=dt, joint=joint, **about)
