"""The picture of stability on the first screen."""

from matplotlib.figure import Figure

from ...judge.check import Result
from ...judge.finding import Finding
from ...report.style import BLUE, GREY, ORANGE, RED
from ...robots import Robot
from ..figures_overview import MOST_ROWS, chart, named_rows
from .first_screen import known, limits_of, summary

SCHEMES = {
    "rk4": "RK4",
    "semi_implicit_euler": "semi-implicit\nEuler",
    "explicit_euler": "explicit Euler",
    "implicit_midpoint": "implicit\nmidpoint",
    "gauss_legendre_4": "Gauss-\nLegendre 4",
    "dopri8": "dopri8",
}


def draw_limits(result: Result, robot: Robot) -> tuple[str, Figure, Finding]:
    """The largest stable step of each method: predicted (line) and observed (mark), at every posture."""
    limits = limits_of(result)
    schemes = list(dict.fromkeys(limit.scheme for limit in limits))[:MOST_ROWS]
    fig, ax = chart()
    ends = [dt for limit in known(limits) for dt in (limit.predicted, limit.observed)] or [1e-3, 1.0]
    low, high = min(ends) / 2, max(ends) * 2
    for place, scheme in enumerate(schemes):
        of_scheme = [limit for limit in limits if limit.scheme == scheme]
        for limit in known(of_scheme):
            is_mujoco = limit.engine == "mujoco"
            ax.vlines(limit.predicted, place - 0.38, place + 0.38, color=GREY, linewidth=1.0)
            mark = "X" if not limit.passed else "s" if is_mujoco else "o"
            colour = RED if not limit.passed else ORANGE if is_mujoco else BLUE
            ax.plot(limit.observed, place + (0.17 if is_mujoco else -0.17), mark, color=(colour, 0.85), markersize=4.5)
        if all(limit.kind != "finite" for limit in of_scheme):
            count = sum(limit.kind == "never_fails" for limit in of_scheme)
            some = f"no limit at {count} of {len(of_scheme)}" if count else "fails at every step"
            text = "no limit" if count == len(of_scheme) else some
            ax.text(low * 1.15, place, text, va="center", fontsize=8, color=GREY)
    names = [SCHEMES.get(scheme, scheme.replace("_", " ")) for scheme in schemes]
    named_rows(ax, names, [all(limit.passed for limit in limits if limit.scheme == scheme) for scheme in schemes])
    ax.tick_params(axis="y", labelsize=8)
    ax.set(xscale="log", xlim=(low, high), xlabel="largest stable dt, s")
    ticks = [m * 10.0**k for k in range(-5, 4) for m in ((1, 2, 5) if high / low < 100 else (1,))]
    ax.set_xticks([tick for tick in ticks if low < tick < high], [f"{tick:g}" for tick in ticks if low < tick < high])
    ax.minorticks_off()
    handles = [
        *ax.plot([], [], "|", color=GREY, markersize=9, label="predicted"),
        *ax.plot([], [], "o", color=BLUE, markersize=4.5, label="observed, TMT"),
        *ax.plot([], [], "s", color=ORANGE, markersize=4.5, label="observed, MuJoCo"),
    ]
    fig.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=7.5, handletextpad=0.1, columnspacing=0.8)
    actuators_off = bool(robot.is_read and robot.drive.actuators)
    return "overview_limits", fig, result.finding("overview_caption", actuators_off=actuators_off, **summary(limits))
