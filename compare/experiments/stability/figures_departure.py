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

SCHEME_MARKS = {"rk4": "o", "explicit_euler": "v", "semi_implicit_euler": "s", "implicit": "D", "implicit_midpoint": "^",
                "gauss_legendre_4": "P"}  # fmt: skip
INTEGRATOR_MARKS = "x+1234"  # of MuJoCo's, one after the other
ENGINE_LOOKS = {"tmt": (BLUE, "o"), "mujoco": (ORANGE, "s")}


def draw_departure(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Time to leave a saddle against the size of the perturbation, with the predicted slope."""
    unit = unit_of_movements(robot)
    saddle, coarse = result.curves["looked at"]["saddle"], coarsest_case(robot)
    rows = [row for row in result.tables["departure"] if row["scene"] in (saddle, f"{saddle}, torque off")]
    steps = sorted({row["dt_s"] for row in rows}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = fig.subplots(1, len(steps), sharey=True, squeeze=False)[0]
    for ax, dt in zip(axes, steps):
        here = [row for row in rows if row["dt_s"] == dt]
        marks = iter(INTEGRATOR_MARKS)
        for engine, method in dict.fromkeys((row["engine"], row["method"]) for row in here):
            mine = sorted((r for r in here if (r["engine"], r["method"]) == (engine, method)), key=size_of)
            p = [size_of(row) for row in mine]
            predicted, observed = ([number_or_nan(r[key]) for r in mine] for key in ("predicted_s", "observed_s"))
            if engine == "tmt":
                colour, dash, name = look(method)
                ax.plot(p, predicted, linestyle=dash, color=colour, linewidth=1)
                ax.plot(
                    p, observed, SCHEME_MARKS.get(method, "*"), color=colour, mfc="none", markersize=5.5, label=name
                )
            else:
                ax.plot(p, observed, next(marks), color="black", label=f"{LABELS[engine]} {method}")
        ax.axvspan(1e-15, 3e-13, color=(GREY, 0.15))
        ax.set(xscale="log", xlim=(1e-15, 3e-2), ylim=(0, None), title=f"dt = {step_text(coarse, dt)} s")
        ax.set_xticks([1e-14, 1e-11, 1e-8, 1e-5])
    axes[0].set_ylabel(f"time until a {joint_of(robot)} is {LEFT:g} {unit} away, s")
    fig.supxlabel(f"perturbation, {unit} (grey: as the error of torque that moves the equilibrium so far)", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=8)
    rate = max(row["real_per_s"] for row in result.tables["stability_modes"] if row["scene"] == saddle)
    both = [row for row in rows if None not in (row["observed_s"], row["predicted_s"])]
    close = sum(abs(late(row)) <= near_row(row) for row in both)
    caption = (
        f"How long the {robot.noun} stays at {saddle}. Lines: first crossing of {LEFT:g} {unit} by each method's own linear map, "
        "its angles rounded to doubles; the fastest mode alone gives a slope of "
        f"ln 10 / {rate:.3f} = {np.log(10) / rate:.3f} s for each power of ten. Marks: {len(rows)} runs. "
        f"{len(both)} leave as the map does, {close} of them within one step or {DEPARTURE_TOLERANCE:g} s"
        + (f", the farthest {max(abs(late(row)) for row in both):.3f} s off." if both else ".")
    )
    return "stability_departure", fig, caption


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
