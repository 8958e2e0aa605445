"""Figures of step limits, regions, growth, the nonlinear edge, silent failure and a minute of motion."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .draw import BLUE, GREEN, GREY, ORANGE, RED, WIDTH
from .failure import COARSE, LARGE, RESONANCE
from .limits import ALLOWED, STEPS
from .motion import TWINS

PINK, SKY = "#CC79A7", "#56B4E9"
SCHEME = {  # colour, dash, name
    "rk4": (GREEN, "-", "RK4"),
    "explicit_euler": (GREY, (0, (1, 1)), "explicit Euler"),
    "semi_implicit_euler": (BLUE, "--", "semi-implicit Euler"),
    "implicit": (RED, "-.", "implicit"),
    "implicit_midpoint": (ORANGE, (0, (5, 1)), "implicit midpoint"),
    "gauss_legendre_4": (PINK, (0, (3, 1, 1, 1, 1, 1)), "Gauss-Legendre 4"),
}
OTHERS = (SKY, "black", "#F0E442")  # colours of methods that are not named above


def style(name):
    """Colour, dash and printed name of a method."""
    return SCHEME.get(name, (OTHERS[sum(map(ord, name)) % len(OTHERS)], "-", name))


def limits(result):
    """Predicted and observed limits as paired bars, scene by scene and damping by damping."""
    rows = [row for row in result.rows if row["scene"] in ("bent", "hanging")]
    panels = list(dict.fromkeys((row["scene"], row["damping"]) for row in rows))
    schemes = list(dict.fromkeys(row["method"] for row in rows if row["engine"] == "TMT"))
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    fig = Figure(figsize=(WIDTH, 0.9 + 2.15 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex="col", sharey=True, squeeze=False)
    for ax, (scene, damping) in zip(axes.flat, panels):
        here = [row for row in rows if (row["scene"], row["damping"]) == (scene, damping)]
        finite = [v for r in here for v in (r["predicted_dt_s"], r["observed_dt_s"]) if v]
        low, high = min(finite) / 3, max(finite) * 3
        for row in here:
            theirs = row["engine"] == "MuJoCo"
            place = schemes.index(TWINS[row["method"]] if theirs else row["method"])
            if row["limit"] != "finite" and not theirs:
                text = {"never_fails": "no limit", "always_fails": "fails at any step"}[row["limit"]]
                ax.text(low * 1.15, place, text, va="center", fontsize=8, color=GREY)
            elif row["limit"] == "finite" and theirs:
                label = {"color": "black", "marker": "|", "markersize": 9, "markeredgewidth": 1.6, "linestyle": "none"}
                ax.plot(row["observed_dt_s"], place + 0.2, **label)
            elif row["limit"] == "finite":
                for shift, key, colour in ((-0.2, "predicted_dt_s", ORANGE), (0.2, "observed_dt_s", BLUE)):
                    ax.barh(place + shift, row[key] - low, left=low, height=0.36, color=colour)
        ax.set(xscale="log", xlim=(low, high), ylim=(len(schemes) - 0.4, -0.6))
        ax.set_yticks(range(len(schemes)), [style(name)[2] for name in schemes])
        ax.set_title(f"{scene}, damping {damping:g} N m s/rad")
        ax.grid(axis="y", visible=False)
    for ax in axes.flat[len(panels) :]:
        ax.set_visible(False)
    fig.supxlabel("largest dt, s", fontsize=9)
    axes[0, 0].barh(-9, 1, color=ORANGE, label="predicted from one step")
    axes[0, 0].barh(-9, 1, color=BLUE, label="observed, TMT")
    axes[0, 0].plot([], [], "|", color="black", markersize=9, markeredgewidth=1.6, label="observed, MuJoCo")
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    off = [abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) for row in rows if row["limit"] == "finite"]
    caption = (
        f"The largest dt at which a perturbation of 1e-6 rad grows less than {ALLOWED:.0f}-fold in {STEPS} steps, found by "
        "bisection, beside the limit predicted from the amplification of one step. The "
        f"{len(off)} pairs differ by {100 * float(np.median(off)):.3f} % in the middle and by at most "
        f"{100 * max(off):.2f} %."
    )
    return "stability_limits", fig, caption


def regions(result):
    """Eigenvalues times dt inside each method's stability region."""
    drawn = result.curves["regions"]
    columns = 2 if len(drawn) == 4 else 3
    lines = -(-len(drawn) // columns)
    fig = Figure(figsize=(WIDTH, 0.8 + 2.55 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    marks = {("bent", 0.0): ("o", BLUE), ("bent", 0.5): ("s", GREEN), ("ball catch", 0.0): ("^", RED)}
    outside = []
    for ax, (name, (x, y, growth)) in zip(axes.flat, drawn.items()):
        ax.contourf(x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[0.0, 1.0 + 1e-9], colors=["#dddddd"])
        ax.contour(
            x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[1.0 + 1e-3], colors=[GREY], linewidths=0.8
        )
        for (posture, damping), values in result.curves["points"].items():
            mark, colour = marks[(posture, damping)]
            label = posture + (f", damping {damping:g}" if damping else ", undamped")
            z = COARSE * values
            ax.plot(z.real, z.imag, mark, color=colour, markersize=4.5, markeredgecolor="white", mew=0.4, label=label)
        for row in result.rows:
            if (row["engine"], row["method"], row["scene"], row["damping"]) == ("TMT", name, "bent", 0.0):
                at = row["predicted_dt_s"]
                if at is not None:
                    swing = at * np.abs(result.curves["points"]["bent", 0.0]).max()
                    ax.plot([0, 0], [-swing, swing], "x", color="black", markersize=6, label="bent at its limit")
                    outside.append(f"{swing:.3f} ({style(name)[2]})")
        ax.axhline(0, color="black", linewidth=0.5)
        ax.axvline(0, color="black", linewidth=0.5)
        ax.set(title=style(name)[2], xlim=(-4.4, 1.4), ylim=(-3.3, 3.3))
        ax.set_aspect("equal")
    for ax in axes.flat[len(drawn) :]:
        ax.set_visible(False)
    fig.supxlabel("Re(eigenvalue) dt", fontsize=9)
    fig.supylabel("Im(eigenvalue) dt", fontsize=9)
    handles = {}
    for ax in axes.flat:
        handles |= dict(zip(*reversed(ax.get_legend_handles_labels())))
    fig.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=4)
    caption = (
        "Stability regions (grey: one step lets neither of a pair of conjugate eigenvalues grow) with the eigenvalues "
        "of the held "
        "arm times dt = 5/64 s. Ball catch has two positive ones, outside every region. Crosses: the fastest mode of "
        "bent at the "
        f"limit, omega dt = {', '.join(outside)}. Of partitioned methods two different real eigenvalues do not have a "
        f"region; their "
        "marks are a guide."
    )
    return "stability_regions", fig, caption


def growth_map(result):
    """Growth over dt, a row for each party."""
    parties = result.curves["map"]
    from .stability import MAP_STEPS

    grown = np.array(list(parties.values()))
    fig = Figure(figsize=(WIDTH, 0.9 + 0.27 * len(parties)), layout="constrained")
    ax = fig.subplots()
    shown = np.clip(np.where(np.isfinite(grown), grown, 1e6), 1.0, 1e6)
    edges = np.sqrt(MAP_STEPS[1:] * MAP_STEPS[:-1])
    edges = np.r_[MAP_STEPS[0], edges, MAP_STEPS[-1]]
    image = ax.pcolormesh(
        edges, np.arange(len(parties) + 1) - 0.5, shown, norm=LogNorm(1, 1e6), cmap="cividis", rasterized=True
    )
    limit = {
        (r["engine"], r["method"]): r["predicted_dt_s"]
        for r in result.rows
        if (r["scene"], r["damping"]) == ("bent", 0.0)
    }
    for place, party in enumerate(parties):
        at = limit.get((party.engine, party.method))
        if at is not None:
            ax.plot([at, at], [place - 0.5, place + 0.5], color=RED, linewidth=2.5)
    ax.plot([], [], color=RED, linewidth=2.5, label="predicted limit")
    names = [f"{party.engine} {style(party.method)[2]}" for party in parties]
    ax.set_yticks(range(len(parties)), names)
    ax.set(xscale="log", xlabel="dt, s", xlim=(MAP_STEPS[0], MAP_STEPS[-1]))
    ax.set_xticks([0.03, 0.1, 0.3, 1.0], ["0.03", "0.1", "0.3", "1"])
    ax.invert_yaxis()
    ax.grid(visible=False)
    bar = fig.colorbar(image, label=f"growth in {STEPS} steps", extend="max")
    bar.ax.minorticks_off()
    fig.legend(loc="outside upper center")
    edge = [float(MAP_STEPS[np.argmax(row >= ALLOWED)]) for row in grown if (row >= ALLOWED).any() and row[0] < ALLOWED]
    caption = (
        f"How much a perturbation of 1e-6 rad grows at bent, undamped, in {STEPS} steps. The edge is sharp: within "
        f"one of the "
        f"{len(MAP_STEPS)} steps drawn, {100 * (MAP_STEPS[1] / MAP_STEPS[0] - 1):.1f} % apart, growth goes from a "
        f"few-fold to "
        f"{ALLOWED:.0f}-fold and more, at {min(edge):.3f} s (the Euler family) to {max(edge):.3f} s (RK4); explicit "
        f"Euler has no edge, "
        "it grows at every step; the implicit methods never do."
    )
    return "stability_map", fig, caption


def edge(result):
    """The nonlinear edge: tongues of growth over omega dt and the size of the perturbation; the resonance close up."""
    from .failure import EDGE, EDGE_SIZES, NEAR

    maps, near = result.curves["edge"], result.curves["near"]
    fig = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    grid = fig.add_gridspec(2, 2, height_ratios=(1.25, 1))
    image = None
    first = None
    for k, (party, grown) in enumerate(maps.items()):
        ax = fig.add_subplot(grid[0, k], sharey=first)
        first = first or ax
        shown = np.clip(np.where(np.isfinite(grown), grown, 1e6), 1.0, 1e6)
        image = ax.pcolormesh(
            EDGE, EDGE_SIZES, shown, norm=LogNorm(1, 1e6), cmap="cividis", shading="nearest", rasterized=True
        )
        for at, text in ((RESONANCE, "√3"), (2.0, "2")):
            ax.axvline(at, color="white", linewidth=0.8, linestyle=":")
            ax.text(at, EDGE_SIZES[-1] * 1.2, text, ha="center", va="bottom", fontsize=9)
        ax.set(yscale="log", xlabel="ω dt of the stiffest mode", xlim=(EDGE[0], EDGE[-1]))
        ax.set_title(style(party.method)[2], loc="left")
        ax.grid(visible=False)
    first.set_ylabel("perturbation, rad")
    fig.colorbar(image, ax=fig.axes, label=f"growth in {STEPS} steps", extend="max").ax.minorticks_off()
    ax = fig.add_subplot(grid[1, :])
    for (label, grown), (colour, dash, mark) in zip(
        near.items(), ((RED, "-", ""), (BLUE, "-", ""), (ORANGE, "", "o"), (GREEN, "", "s"))
    ):
        values = np.clip(np.where(np.isfinite(grown[1]), grown[1], 1e9), 1.0, 1e9)
        name = label.replace("semi_implicit_euler", "semi-implicit Euler")
        ax.semilogy(
            NEAR, values, linestyle=dash or "none", marker=mark, mfc="none", markersize=5, color=colour, label=name
        )
    ax.semilogy(NEAR, near[next(iter(near))][0], ":", color="black", label="all, from 1e-6 rad")
    ax.axvline(RESONANCE, color=GREY, linewidth=0.8)
    ax.text(RESONANCE, 3e9, "√3", ha="center", va="bottom")
    ax.set(
        xlabel="ω dt", ylabel=f"growth in {STEPS} steps,\nfrom {LARGE:g} rad", xlim=(NEAR[0], NEAR[-1]), ylim=(1, 2e9)
    )
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    worst = max(grown[1].max() for label, grown in near.items() if label.endswith(" implicit"))
    caption = (
        f"The nonlinear edge at bent. Above: growth over ω dt and the size of the perturbation. The linear limit is "
        f"2, but at √3 a "
        f"swing takes three steps, and the cubic part of the potential pushes it at each: a tongue of failure that "
        f"widens with the "
        f"perturbation. Below: from {LARGE:g} rad `implicit` grows up to {worst:.1e}-fold there in both engines; from "
        f"1e-6 rad "
        f"nothing grows {near[next(iter(near))][0].max():.2f}-fold or more. Divergence is drawn at 1e9."
    )
    return "stability_edge", fig, caption


def silent(result):
    """Runs that fail without a word: reset by MuJoCo, and `implicit` gaining energy."""
    reset, gain = (result.curves["silent"][key] for key in ("reset", "gain"))
    fig = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    left, right = fig.subplots(1, 2)
    energy = reset["energy"] - reset["energy"][0]
    left.plot(reset["t"], energy, ".-", color=BLUE, markersize=3, linewidth=0.8, label="energy gained")
    left.set_yscale("symlog", linthresh=10.0)
    for k, t in enumerate(reset["t"][1:][np.diff(reset["clock"]) <= 0.0]):
        left.axvline(t, color=ORANGE, linewidth=1.5, label="reset by MuJoCo" if k == 0 else None)
    left.axvline(reset["caught_in_it_s"], color=RED, linestyle="--", label="caught here")
    left.axhline(gain["range"], color="black", linewidth=0.8, linestyle=":", label="range of the potential")
    left.set(xlabel="time, s", ylabel="energy gained, J", xlim=(0, reset["t"][-1]), title="Euler, automatic reset on")
    right.plot(gain["t"], gain["energy"] - gain["energy"][0], ".-", color=BLUE, markersize=4, linewidth=0.8)
    right.axhline(gain["range"], color="black", linewidth=0.8, linestyle=":")
    right.axvline(gain["caught_in_it_s"], color=RED, linestyle="--")
    right.set(xlabel="time, s", ylabel="energy gained, J", xlim=(0, gain["t"][-1]), title="implicit")
    other = right.twinx()
    other.plot(gain["t"], gain["smallest"], color=GREEN, linewidth=1, label="smallest eigenvalue")
    other.axhline(0.0, color=GREEN, linewidth=0.6)
    other.set_ylabel("smallest eigenvalue of the matrix, kg m2", color=GREEN)
    other.grid(visible=False)
    low = gain["smallest"].min()
    other.set_ylim(1.1 * low, -2.2 * low)
    handles = [ax.get_legend_handles_labels() for ax in (left, other)]
    fig.legend(
        handles[0][0] + handles[1][0], handles[0][1] + handles[1][1], loc="outside upper center", ncols=5, fontsize=8
    )
    caption = (
        f"Finite nonsense: bent, free, by MuJoCo at dt = 5/64 s. Left: Euler diverges and MuJoCo starts it again at zero, "
        f"{reset['resets']} times in {reset['t'][-1]:.0f} s. Right: `implicit` gains {gain['gain']:.0f} J without a "
        f"warning where "
        f"its matrix is indefinite (smallest eigenvalue of the symmetric part down to {low:.2f} kg m2). The bound on "
        f"the energy "
        f"catches them at {reset['caught_in_it_s']:.2f} s and {gain['caught_in_it_s']:.2f} s."
    )
    return "stability_silent", fig, caption


def minutes(result):
    """Energy over a minute of free motion, method by method, at a coarse and a fine step."""
    runs = result.curves["minutes"]
    steps = sorted({run["row"]["dt_s"] for run in runs}, reverse=True)
    fig = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = fig.subplots(1, len(steps), sharex=True, squeeze=False)[0]
    window = 20  # points over which the largest is taken, so that the swings do not fill the figure
    marked = False
    for run in runs:
        row = run["row"]
        ax = axes[steps.index(row["dt_s"])]
        off = np.abs(run["off"][1:])
        t = run["t"][1:]
        count = len(off) // window
        top = np.array([np.max(part) for part in np.split(off[: count * window], count)])
        at = t[: count * window].reshape(count, window).mean(axis=1)
        with np.errstate(invalid="ignore"):
            kept = np.isfinite(top) & (top > 0.0)
        if row["engine"] == "TMT":
            colour, dash, name = style(row["method"])
            ax.semilogy(at[kept], top[kept], linestyle=dash, color=colour, label=name if ax is axes[-1] else None)
            ended = row["diverged_at_s"]
            if ended is not None and kept.sum() == 0:
                ax.plot(ended, 18.8, "x", color=colour, clip_on=False)
            elif ended is not None:
                ax.plot(at[kept][-1], top[kept][-1], "x", color=colour)
        elif row["method"] in ("Euler", "implicit", "RK4"):
            colour = style(TWINS[row["method"]])[0]
            label = "MuJoCo's twin" if not marked else None
            ax.semilogy(at[kept][::3], top[kept][::3], "o", mfc="none", markersize=3.5, color=colour, label=label)
            marked = True
    for ax, dt in zip(axes, steps):
        ax.set(xlabel="time, s", xlim=(0, 60), title="dt = 5/64 s" if dt == COARSE else f"dt = {dt:g} s")
    axes[0].set_ylabel("largest |energy - energy at start|, J")
    fig.legend(*axes[-1].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    verdict = {
        (row["dt_s"], kind): [style(r["method"])[2] for r in (run["row"] for run in runs)
                              if r["engine"] == "TMT" and r["dt_s"] == row["dt_s"] and r["energy"] == kind]
        for row in (run["row"] for run in runs) for kind in ("bounded", "drifts", "diverges")
    }  # fmt: skip
    told = ". ".join(
        f"At dt = {dt:.3g} s "
        f"" + "; ".join(f"{kind}: {', '.join(verdict[dt, kind])}" for kind in ("bounded", "drifts", "diverges")
                                          if verdict[dt, kind])
        for dt in steps
    )  # fmt: skip
    caption = (
        f"A minute of bent, free: how far the energy is from where it started. {told}. Crosses: the run has diverged."
    )
    return "stability_energy", fig, caption
