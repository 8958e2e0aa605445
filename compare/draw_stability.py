"""Figures of step limits: predicted and observed, the regions of the methods, growth over dt."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .departure import span
from .draw import BLUE, GREEN, GREY, ORANGE, RED, WIDTH
from .failure import COARSE
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
    "dopri8": (SKY, (0, (4, 2)), "Dormand-Prince 8"),
}


def style(name):
    """Colour, dash and printed name of a method."""
    return SCHEME.get(name, ("black", "-", name))


def limits(result):
    """Predicted and observed limits as paired bars, scene by scene and damping by damping."""
    rows = [row for row in result.rows if row["scene"] in ("bent", "hanging")]
    panels = list(dict.fromkeys((row["scene"], row["damping"]) for row in rows))
    schemes = list(dict.fromkeys(row["method"] for row in rows if row["engine"] == "TMT"))
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    fig = Figure(figsize=(WIDTH, 0.9 + 2.15 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharey=True, squeeze=False)
    for ax, (scene, damping) in zip(axes.flat, panels):
        here = [row for row in rows if (row["scene"], row["damping"]) == (scene, damping)]
        alike = [row for row in rows if row["damping"] == damping]
        finite = [v for r in alike for v in (r["predicted_dt_s"], r["observed_dt_s"]) if v]
        low, high = min(finite) / 3, max(finite) * 2
        for row in here:
            theirs = row["engine"] == "MuJoCo"
            place = schemes.index(TWINS[row["method"]] if theirs else row["method"])
            if row["limit"] != "finite" and not theirs:
                text = {"never_fails": "no limit", "always_fails": "fails at every step"}[row["limit"]]
                ax.text(low * 1.1, place, text, va="center", fontsize=8, color=GREY)
            elif row["observed_dt_s"] is None or row["limit"] != "finite":
                continue
            elif theirs:
                mark = {"color": "black", "marker": "|", "markersize": 9, "markeredgewidth": 1.6, "linestyle": "none"}
                ax.plot(row["observed_dt_s"], place + 0.2, **mark)
            else:
                for shift, key, colour in ((-0.2, "predicted_dt_s", ORANGE), (0.2, "observed_dt_s", BLUE)):
                    ax.barh(place + shift, row[key] - low, left=low, height=0.36, color=colour)
        ax.set(xscale="log", xlim=(low, high), ylim=(len(schemes) - 0.4, -0.6))
        ticks = [m * 10.0**k for k in range(-4, 3) for m in ((1, 2, 5) if high / low < 100 else (1,))]
        ticks = [tick for tick in ticks if low < tick < high]
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.minorticks_off()
        ax.set_yticks(range(len(schemes)), [style(name)[2] for name in schemes])
        ax.set_title(f"{scene}, {f'damping {damping:g}' if damping else 'undamped'}")
        ax.grid(axis="y", visible=False)
    for ax in axes.flat[len(panels) :]:
        ax.set_visible(False)
    fig.supxlabel("largest dt, s (damping in N m s/rad)", fontsize=9)
    handles = [
        axes[0, 0].barh(-9, 1, color=ORANGE, label="predicted from one step"),
        axes[0, 0].barh(-9, 1, color=BLUE, label="observed, TMT"),
        *axes[0, 0].plot([], [], "|", color="black", markersize=9, markeredgewidth=1.6, label="observed, MuJoCo"),
    ]
    fig.legend(handles=handles, loc="outside upper center", ncols=3)
    pairs = [(row["observed_dt_s"], row["predicted_dt_s"]) for row in rows if row["limit"] == "finite"]
    off = [abs(observed / predicted - 1.0) for observed, predicted in pairs if observed is not None]
    caption = (
        f"The largest dt at which a perturbation of 1e-6 rad grows less than {ALLOWED:.0f}-fold in {STEPS} steps, "
        f"found by bisection, beside the limit predicted from the amplification of one step. The {len(off)} pairs "
        f"differ by {100 * float(np.median(off)):.3f} % in the middle and by at most {100 * max(off):.2f} %."
    )
    return "stability_limits", fig, caption


def regions(result):
    """Eigenvalues times dt inside each method's stability region."""
    drawn = result.curves["regions"]
    columns = 2 if len(drawn) == 4 else 3
    lines = -(-len(drawn) // columns)
    fig = Figure(figsize=(WIDTH, 0.7 + 2.1 * lines), layout="constrained")
    axes = fig.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    marks = {  # marker, colour, size, filled: marks that come to lie on each other differ in size
        ("bent", 0.0): ("o", BLUE, 7, "none"),
        ("bent", 0.5): ("s", GREEN, 4, "full"),
        ("ball catch", 0.0): ("^", RED, 3.5, "full"),
    }
    titles = {names: " and ".join(style(name)[2] for name in names) for names in drawn}
    outside = []
    for ax, (names, (x, y, growth)) in zip(axes.flat, drawn.items()):
        ax.contourf(x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[0.0, 1.0 + 1e-9], colors=["#dddddd"])
        ax.contour(
            x, y, np.where(np.isfinite(growth), growth, 99.0), levels=[1.0 + 1e-3], colors=[GREY], linewidths=0.8
        )
        for (posture, damping), values in result.curves["points"].items():
            mark, colour, size, fill = marks[(posture, damping)]
            label = posture + (f", damping {damping:g}" if damping else ", undamped")
            z = COARSE * values
            ax.plot(z.real, z.imag, mark, color=colour, markersize=size, fillstyle=fill, label=label)
        for row in result.rows:
            if (row["engine"], row["method"], row["scene"], row["damping"]) == ("TMT", names[0], "bent", 0.0):
                at = row["predicted_dt_s"]
                if at is not None:
                    swing = at * np.abs(result.curves["points"]["bent", 0.0]).max()
                    ax.plot(0, swing, "x", color="black", markersize=6, label="bent at its limit")
                    outside.append(f"{swing:.3f} ({titles[names]})")
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
    caption = (
        "The upper half of the stability regions (grey: one step lets neither of a pair of conjugate eigenvalues "
        "grow) with the eigenvalues of the held arm times dt = 5/64 s. Ball catch has two positive ones, outside "
        f"every region. Crosses: the fastest mode of bent at the limit, omega dt = {', '.join(outside)}. Of "
        "partitioned methods two different real eigenvalues do not have a region; their marks are a guide."
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
    at = {
        f"{party.engine} {style(party.method)[2]}": float(MAP_STEPS[np.argmax(row >= ALLOWED)])
        if (row >= ALLOWED).any()
        else None
        for party, row in zip(parties, grown)
    }
    kinds = {
        "Growth at every step": [name for name, dt in at.items() if dt == MAP_STEPS[0]],
        "Less at every step": [name for name, dt in at.items() if dt is None],
    }
    edges = [dt for dt in at.values() if dt not in (None, MAP_STEPS[0])]
    told = ". ".join(f"{text}: {', '.join(names)}" for text, names in kinds.items() if names)
    caption = (
        f"How much a perturbation of 1e-6 rad grows at bent, undamped, in {STEPS} steps. The edge is sharp: of "
        f"{len(MAP_STEPS)} steps drawn, {100 * (MAP_STEPS[1] / MAP_STEPS[0] - 1):.1f} % apart, the first at which "
        f"growth is {ALLOWED:.0f}-fold or more is at {span(edges)}, and the predicted limit lies just before it. "
        f"{told}."
    )
    return "stability_map", fig, caption
