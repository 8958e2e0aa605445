"""Figures of departure: the time to leave a saddle, and a marginal posture, against the perturbation."""

import numpy as np
from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...judge.run import LEFT, number_or_nan
from ...judge.words import posture_begins
from ...report.style import BLUE, GREY, ORANGE, WIDTH
from ...robots import Robot
from .choice import coarsest_case, joint_of, step_text, unit_of_movements
from .departure import DEPARTURE_TOLERANCE, late, near_row, size_of
from .figures_limits import look

MARKS_OF_GROUPS = {"tmt": ("o", "v", "^", "D", "s", "P", "*", "<"), "mujoco": ("x", "+", "1", "2", "3", "4")}
ON_ONE_POINT = 0.02  # of the height of a panel: marks that are nearer are one
ENGINE_LOOKS = {"tmt": (BLUE, "o"), "mujoco": (ORANGE, "s")}


def draw_departure(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Time to leave a saddle against the size of the perturbation, with the predicted slope."""
    unit = unit_of_movements(robot)
    saddle, coarse = result.curves["looked at"]["saddle"], coarsest_case(robot)
    rows = [row for row in result.tables["departure"] if row["scene"] in (saddle, f"{saddle}, torque off")]
    steps = sorted({row["dt_s"] for row in rows}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    axes = fig.subplots(1, len(steps), sharey=True, squeeze=False)[0]
    groups = on_one_point(rows)
    for ax, dt in zip(axes, steps):
        for engine, number, names in groups:
            of_group = [row for row in rows if (row["dt_s"], row["engine"], row["method"]) == (dt, engine, names[0])]
            mine = sorted(of_group, key=size_of)
            p = [size_of(row) for row in mine]
            observed = [number_or_nan(row["observed_s"]) for row in mine]
            mark, label = MARKS_OF_GROUPS[engine][number % 6], group_label(engine, names)
            if engine == "tmt":
                colour, dash, _ = look(names[0])
                predicted = [number_or_nan(row["predicted_s"]) for row in mine]
                ax.plot(p, predicted, linestyle=dash, color=colour, linewidth=1)
                ax.plot(p, observed, mark, color=colour, mfc="white", markersize=7, label=label)
            else:
                ax.plot(p, observed, mark, color="black", markersize=5, label=label)
        ax.axvspan(1e-15, 3e-13, color=(GREY, 0.15), linewidth=0)
        ax.set(xscale="log", xlim=(1e-15, 3e-2), ylim=(0, None), title=f"dt = {step_text(coarse, dt)} s")
        ax.set_xticks([1e-14, 1e-10, 1e-6, 1e-2])
        ax.minorticks_off()
    axes[0].set_ylabel(f"time until a {joint_of(robot)} is {LEFT:g} {unit} away, s")
    axes[0].plot([], [], color="black", linewidth=1, label="predicted by the linear map")
    axes[0].fill_between([], [], color=(GREY, 0.15), linewidth=0, label="as by an error of the torque")
    fig.supxlabel(f"perturbation, {unit}", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=8)
    rate = max(row["real_per_s"] for row in result.tables["stability_modes"] if row["scene"] == saddle)
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    close = sum(abs(late(row)) <= near_row(row) for row in both)
    caption = (
        f"How long the {robot.noun} stays at {saddle}. Lines: first crossing of {LEFT:g} {unit} by each method's own linear map, "
        "its angles rounded to doubles; the fastest mode alone gives a slope of "
        f"ln 10 / {rate:.3f} = {np.log(10) / rate:.3f} s for each power of ten. Marks: {len(rows)} runs, "
        f"with one mark for methods of an engine that are nowhere more than {100 * ON_ONE_POINT:g} % of the longest time apart. "
        "Grey: so small a perturbation is made by an error of the torque, which moves the equilibrium. "
        f"{len(both)} leave as the map does, {close} of them within one step or {DEPARTURE_TOLERANCE:g} s"
        + (f", the farthest {max(abs(late(row)) for row in both):.3f} s off." if both else ".")
    )
    return "stability_departure", fig, caption


def on_one_point(rows: list[dict]) -> list[tuple[str, int, list[str]]]:
    """The methods of each engine whose marks would lie on each other in every panel: (engine, its how manieth, names)."""
    near = ON_ONE_POINT * max((row["observed_s"] for row in rows if row["observed_s"] is not None), default=0.0)
    groups = []
    for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in rows):
        runs, times = times_to_leave(rows, engine, method)
        for of_engine, _, names in groups:
            theirs, their_times = times_to_leave(rows, engine, names[0])
            if of_engine == engine and runs == theirs and np.allclose(times, their_times, 0.0, near, equal_nan=True):
                names.append(method)
                break
        else:
            groups.append((engine, sum(other == engine for other, *_ in groups), [method]))
    return groups


def times_to_leave(rows: list[dict], engine: str, method: str) -> tuple[list, list[float]]:
    """The runs of a method, by scene, step and size of the perturbation, and when each leaves, s; NaN: never."""
    mine = [row for row in rows if (row["engine"], row["method"]) == (engine, method)]
    mine.sort(key=lambda row: (row["scene"], row["dt_s"], size_of(row)))
    return [(row["scene"], row["dt_s"], size_of(row)) for row in mine], [
        number_or_nan(row["observed_s"]) for row in mine
    ]


def group_label(engine: str, names: list[str]) -> str:
    """How methods that share a mark are written."""
    return f"{LABELS[engine]}: {', '.join(look(name)[2] if engine == 'tmt' else name for name in names)}"


def draw_falls(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Time to leave a marginal posture against the perturbation: the law of a cubic potential."""
    posture = result.curves["looked at"]["marginal"]
    rows = [row for row in result.tables["departure"] if row["scene"] == posture]
    fig = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    ax = fig.subplots()
    for sign, dash, text in ((1, "-", "with the fall"), (-1, "--", "against it")):
        for engine, (colour, mark) in ENGINE_LOOKS.items():
            mine = [row for row in rows if row["engine"] == engine and row["perturbation_rad"] * sign > 0]
            if not mine:
                continue
            p = np.abs([row["perturbation_rad"] for row in mine])
            if engine == "tmt":
                ax.loglog(p, [row["predicted_s"] for row in mine], dash, color="black", label=f"predicted, {text}")
            size, fill = (9, "none") if engine == "mujoco" else (4.5, "full")
            observed = [number_or_nan(row["observed_s"]) for row in mine]
            label = LABELS[engine] if sign == 1 else None
            ax.loglog(p, observed, mark, color=colour, fillstyle=fill, markersize=size, label=label)
    anchor = min((row for row in rows if row["perturbation_rad"] > 0.0), key=lambda row: row["perturbation_rad"])
    sizes = np.array([anchor["perturbation_rad"], 1e-2])
    ax.loglog(sizes, 0.55 * anchor["predicted_s"] * np.sqrt(sizes[0] / sizes), ":", color=GREY, label="slope -1/2")
    ax.set(xlabel="perturbation along the mode without stiffness, rad", ylabel=f"time to move {LEFT:g} rad, s")
    ax.set_yticks([5, 10, 20, 50, 100, 200], ["5", "10", "20", "50", "100", "200"])
    ax.minorticks_off()
    fig.legend(loc="outside upper center", ncols=5)
    off = [abs(late(row)) for row in rows if row["observed_s"] is not None]
    caption = (
        f"{posture_begins(posture, robot)}, held: along the mode without stiffness the potential is cubic, and the time to "
        f"leave is predicted from the cubic coefficient alone. {len(off)} of {len(rows)} runs of RK4 at {rows[0]['dt_s']:g} s "
        "leave" + (f", at most {max(off):.3f} s off the prediction." if off else ".")
    )
    return "stability_zero", fig, caption
