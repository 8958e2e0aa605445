"""The four pictures of the first screen, small: each has one message. What fails is red, crossed and named."""

import math
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..engines import COLOURS, MARKS
from ..judge.check import Result
from ..judge.scale import FACTOR
from . import engines_apart, methods_compared, overview
from .style import BLUE, GREY, ORANGE, RED, plain

SIZE = (4.2, 2.75)  # inches: about 400 px wide on the first screen
LEAST_EPS, MOST_EPS = 1e-3, 1e6  # eps: where what is zero, and what is farther, is drawn
LEAST_SHARE, MOST_SHARE = 1e-4, 1e3  # of a band
MOST_IN_A_PICTURE = 9  # scenes or methods in one picture
NAMES_OF_SCHEMES = {
    "rk4": "RK4",
    "semi_implicit_euler": "semi-implicit\nEuler",
    "explicit_euler": "explicit Euler",
    "implicit_midpoint": "implicit\nmidpoint",
    "gauss_legendre_4": "Gauss-\nLegendre 4",
    "dopri8": "dopri8",
}


def pictures(experiment: str, results: Mapping[str, Result], robot: object) -> Iterator[partial]:
    """Calls that draw what can be drawn once this experiment is done, each returning (file name, figure, caption)."""
    draw = {
        "agreement": picture_of_agreement,
        "scenes": picture_of_scenes,
        "times": picture_of_times,
        "limits": picture_of_limits,
    }
    for name in overview.drawn_with(experiment, results):
        if has_data(name, results):
            yield partial(draw[name], results, robot)


def has_data(name: str, results: Mapping[str, Result]) -> bool:
    """Whether there is something to draw."""
    if name == "agreement":
        return bool(engines_apart.agreements(results))
    (result,) = (results[need] for need in overview.PICTURES[name])
    if name == "times":
        return bool(methods_compared.best_curves(result))
    if name == "scenes":
        return bool(result.rows)
    return any(one.predicted or one.observed or not one.passed for one in methods_compared.limits_found(result))


def empty(height: float = SIZE[1]) -> tuple[Figure, Axes]:
    fig = Figure(figsize=(SIZE[0], height), layout="constrained")
    fig.get_layout_engine().set(w_pad=0.03, h_pad=0.03)
    return fig, fig.subplots()


def named_rows(ax: Axes, names: list[str], passed: list[bool]) -> None:
    """The names of the rows from top to bottom; of what fails in red, with a cross."""
    ax.set_yticks(range(len(names)), [name if good else f"✗ {name}" for name, good in zip(names, passed)])
    for label, good in zip(ax.get_yticklabels(), passed):
        label.set(color="black" if good else RED, fontweight="normal" if good else "bold")
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.tick_params(axis="y", length=0)


def picture_of_agreement(results: Mapping[str, Result], robot: object) -> tuple[str, Figure, str]:
    """M, h and accelerations: how far the engines are apart, and each from exact, in eps, beside the tolerance."""
    found, label = engines_apart.agreements(results), next(iter(results.values())).label
    fig, ax = empty()
    looks = (
        ("apart", f"{label} to MuJoCo", "D", "black", -0.22),
        ("ours", f"{label} to exact", "o", BLUE, 0.0),
        ("theirs", "MuJoCo to exact", "s", ORANGE, 0.22),
    )
    for part, text, mark, colour, shift in looks:
        values = [(place, getattr(one, part)) for place, one in enumerate(found)]
        known = [(place, value) for place, value in values if value is not None]
        if known:
            at = [min(max(value, LEAST_EPS), MOST_EPS) for _, value in known]
            rows = [place + shift for place, _ in known]
            ax.hlines(rows, LEAST_EPS, at, color=colour, linewidth=1.2)
            ax.plot(at, rows, mark, color=colour, markersize=5, label=text)
    for place, one in enumerate(found):
        if one.apart is not None:
            text = f"{one.apart:.2g}" if math.isfinite(one.apart) else "no number"
            far = one.apart > 1e4
            ax.annotate(text, (min(max(one.apart, LEAST_EPS), MOST_EPS), place - 0.22), (-6 if far else 6, 5 if far else 0),
                        textcoords="offset points", fontsize=8, va="bottom" if far else "center",
                        ha="right" if far else "left", color="black" if one.passed else RED)  # fmt: skip
    beyond_tolerance(ax, FACTOR, f"{FACTOR:g} eps")
    ax.set(
        xscale="log",
        xlim=(LEAST_EPS, MOST_EPS if any(not one.passed for one in found) else 2e3),
        xlabel="eps of the scale",
    )
    named_rows(ax, [one.name.replace(" ", "\n", len(one.name) > 12) for one in found], [one.passed for one in found])
    fig.legend(loc="outside upper center", ncols=3, fontsize=7.5, handletextpad=0.1, columnspacing=0.8)
    return f"{overview.BEGINNING}agreement", fig, engines_apart.agreement_in_words(found, label)


def beyond_tolerance(ax: Axes, tolerance: float, text: str) -> None:
    """A line at the tolerance, and hatching where something fails."""
    ax.axvline(tolerance, color=RED, linewidth=2)
    ax.axvspan(tolerance, 1e30, facecolor="none", edgecolor=(0.84, 0.37, 0.0, 0.35), hatch="////", linewidth=0)
    ax.annotate(f"tolerance {text}", (tolerance, 0.02), (-4, 0), xycoords=("data", "axes fraction"), fontsize=7.5,
                textcoords="offset points", color=RED, rotation=90, ha="right", va="bottom",
                path_effects=[withStroke(linewidth=3, foreground="white")])  # fmt: skip


def picture_of_scenes(results: Mapping[str, Result], robot: object) -> tuple[str, Figure, str]:
    """Scene by scene: the difference over its band at the left; at the right for how long it is judged, and what ends it."""
    result = results["trajectory"]
    found = engines_apart.scene_runs(result, robot)
    wrong_first = sorted(found, key=lambda one: one.passed)[:MOST_IN_A_PICTURE]
    shown = [one for one in found if one in wrong_first]
    fig = Figure(figsize=SIZE, layout="constrained")
    fig.get_layout_engine().set(w_pad=0.03, h_pad=0.03)
    left, right = fig.subplots(1, 2, sharey=True, width_ratios=(1.15, 1))
    fails = any(not one.passed for one in found)
    most = MOST_SHARE if fails else 10.0
    for place, one in enumerate(shown):
        colour = "black" if one.passed else RED
        if one.share is not None:
            at = min(max(one.share, LEAST_SHARE), most)
            left.hlines(place, LEAST_SHARE, at, color=colour, linewidth=1.2)
            left.plot(at, place, "D" if one.passed else "X", color=colour, markersize=4.5)
        right.barh(place, one.duration, height=0.5, color=(GREY, 0.2))
        right.barh(place, one.judged[1], height=0.5, color=(BLUE, 0.4))
        right.barh(place, one.judged[0], height=0.5, color=BLUE)
        if one.diverged is not None:
            right.plot(one.diverged, place, "x", color=RED, markersize=5, markeredgewidth=1.5)
        for mark, colour, time in zip("os", ("white", ORANGE), one.left or (None, None)):
            if time is not None:
                right.plot(time, place, mark, color=colour, markersize=4.5, markeredgecolor="black")
    beyond_tolerance(left, 1.0, "1")
    left.set(xscale="log", xlim=(LEAST_SHARE, most), xlabel="difference / band")
    left.set_xticks([1e-4, 1e-2, 1.0])
    left.minorticks_off()
    right.set(xlabel="time, s", xlim=(0, 1.04 * max(one.duration for one in shown)))
    named_rows(left, [plain(one.name) for one in shown], [one.passed for one in shown])
    left.tick_params(axis="y", labelsize=8)
    right.grid(axis="y", visible=False)
    handles = [
        right.barh(-9, 1, color=BLUE, label="judged"),
        right.barh(-9, 1, color=(BLUE, 0.4), label="at some dt"),
        right.barh(-9, 1, color=(GREY, 0.2), label="not"),
    ]
    if any(one.diverged is not None for one in shown):
        handles += right.plot([], [], "x", color=RED, markeredgewidth=1.5, label="diverges")
    for k, (mark, colour, name) in enumerate((("o", "white", result.label), ("s", ORANGE, "MuJoCo"))):
        if any(one.left and one.left[k] is not None for one in shown):
            look = {"color": colour, "markersize": 4.5, "markeredgecolor": "black", "linestyle": "none"}
            handles += right.plot([], [], mark, label=f"{name} leaves", **look)
    left.set_ylim(len(shown) - 0.4, -0.6)
    fig.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=7, handletextpad=0.3, columnspacing=0.7,
               handlelength=1.0)  # fmt: skip
    return f"{overview.BEGINNING}scenes", fig, engines_apart.scenes_in_words(found, result.label)


def picture_of_times(results: Mapping[str, Result], robot: object) -> tuple[str, Figure, str]:
    """Time against error: the best settings of each engine in one scene, the cheapest within the target ringed."""
    result = results["speed"]
    unit = result.curves.get("unit", "rad")
    fig, ax = empty()
    for curve in methods_compared.best_curves(result):
        colour = COLOURS[curve.engine]
        errors = np.maximum(curve.errors, 1e-16)
        ax.plot(errors, curve.milliseconds, marker=MARKS[curve.engine], markersize=3.5, linewidth=1.2,
                color=colour, label=methods_compared.engine_in_print(curve.engine))  # fmt: skip
        if curve.cheapest:
            method, time, _ = curve.cheapest
            at = curve.milliseconds.index(time)
            ax.plot(errors[at], time, "o", markersize=9, markerfacecolor="none", markeredgecolor="black")
            if curve.engine in ("mujoco", "tmt"):
                above, fine = curve.engine == "mujoco", errors[at] < np.sqrt(errors[0] * errors[-1])
                text = f"{method} {overview.times_in_print(time)} ms"
                ax.annotate(text, (errors[at], time), (0, 8 if above else -11), fontsize=8, color=colour,
                            textcoords="offset points", ha="right" if above else "center" if fine else "left",
                            va="bottom" if above else "top",
                            path_effects=[withStroke(linewidth=3, foreground="white")])  # fmt: skip
    ax.axvline(methods_compared.ERROR_ASKED, color=GREY, linestyle=":", linewidth=1.2)
    ax.set(xscale="log", yscale="log", xlabel=f"worst error, {unit} (finer to the right)", ylabel="time, ms")
    ax.invert_xaxis()
    ax.margins(0.06, 0.12)
    fig.legend(loc="outside upper center", ncols=4, fontsize=8, handletextpad=0.4, columnspacing=1.0)
    return f"{overview.BEGINNING}times", fig, methods_compared.times_in_words(result)


def picture_of_limits(results: Mapping[str, Result], robot: object) -> tuple[str, Figure, str]:
    """The largest stable step, method by method: as predicted (line) and as observed (mark), at every posture."""
    found = methods_compared.limits_found(results["stability"])
    schemes = list(dict.fromkeys(one.scheme for one in found))[:MOST_IN_A_PICTURE]
    fig, ax = empty()
    known = methods_compared.known_limits(found)
    ends = [dt for one in known for dt in (one.predicted, one.observed)] or [1e-3, 1.0]
    low, high = min(ends) / 2, max(ends) * 2
    for place, scheme in enumerate(schemes):
        of = [one for one in found if one.scheme == scheme]
        for one in methods_compared.known_limits(of):
            ax.vlines(one.predicted, place - 0.38, place + 0.38, color=GREY, linewidth=1.0)
            shift = 0.17 if one.engine == "mujoco" else -0.17
            mark = ("s" if one.engine == "mujoco" else "o") if one.passed else "X"
            colour = COLOURS[one.engine] if one.passed else RED
            ax.plot(one.observed, place + shift, mark, color=(colour, 0.85), markersize=4.5)
        kinds = {one.kind for one in of}
        if "finite" not in kinds:
            count = sum(one.kind == "never_fails" for one in of)
            text = (
                "no limit"
                if count == len(of)
                else f"no limit at {count} of {len(of)}"
                if count
                else "fails at every step"
            )
            ax.text(low * 1.15, place, text, va="center", fontsize=8, color=GREY)
    names = [NAMES_OF_SCHEMES.get(scheme, scheme.replace("_", " ")) for scheme in schemes]
    named_rows(ax, names, [all(one.passed for one in found if one.scheme == scheme) for scheme in schemes])
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
    caption = methods_compared.limits_at_a_glance(found)
    own = " Its actuators and equalities do not act here." if robot.is_read and robot.drive.actuators else ""
    return f"{overview.BEGINNING}limits", fig, caption + own
