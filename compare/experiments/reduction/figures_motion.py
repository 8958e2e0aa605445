"""Figures of motions that are known exactly: swings of a single joint, small oscillations."""

from matplotlib.figure import Figure

from ...engines import LABELS
from ...judge.check import Result
from ...judge.words import capital
from ...report.style import BLUE, GREEN, GREY, ORANGE, WIDTH, file_name
from ...robots import Robot

SWING_LINES = {"RK4": (GREEN, "-"), "Euler": (BLUE, "--")}


def draw_swing(result: Result, scene: str, beginning: str = "") -> tuple[str, Figure, str]:
    """Error of a swing of one joint against the elliptic function, over the step."""
    dt, errors, orders, stated = (result.curves["swings"][scene][key] for key in ("dt", "errors", "orders", "stated"))
    fig = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    ax = fig.subplots()
    for integrator, (colour, dash) in SWING_LINES.items():
        values = errors["tmt", integrator]
        ax.loglog(dt, values, dash, color=colour, label=f"{integrator}, TMT")
        ax.loglog(dt, errors["mujoco", integrator], "o", mfc="none", color=colour, label=f"{integrator}, MuJoCo")
        if ("tmt", integrator) in orders:
            place = {"xy": (dt[3], values[3]), "xytext": (0, 8), "textcoords": "offset points", "ha": "right"}
            ax.annotate(f"order {stated[integrator]}", **place, color=colour)
    ax.set(xlabel="dt, s", ylabel="largest error of the angle, rad")
    fig.legend(loc="outside upper center", ncols=4)

    def found(integrator):
        measured = [orders.get((engine, integrator)) for engine in ("tmt", "mujoco")]
        ours, theirs = ("not measured" if order is None else f"{order:.2f}" for order in measured)
        last = [errors[engine, integrator][-1] for engine in ("tmt", "mujoco")]
        return f"{integrator}: order {ours} and {theirs}, down to {last[0]:.1e} and {last[1]:.1e} rad"

    caption = (
        f"{beginning or capital(scene)}: distance from the exact motion, an elliptic function of time. TMT and MuJoCo with "
        f"{'; '.join(map(found, SWING_LINES))}."
    )
    return file_name("reduction", scene), fig, caption


def draw_small_oscillations(result: Result, robot: Robot) -> tuple[str, Figure, str]:
    """Distance of small oscillations about an equilibrium from the linear modes, over their amplitude."""
    small = result.curves["small"]
    fig = Figure(figsize=(WIDTH, 2.8), layout="constrained")
    ax = fig.subplots()
    amplitude, off = small["amplitude"], small["off"]
    marks = {"marker": "o", "linestyle": "none", "mfc": "none", "markersize": 8, "markeredgewidth": 1.5}
    ax.loglog(amplitude, off["tmt"], color=BLUE, label="TMT")
    ax.loglog(amplitude, off["mujoco"], **marks, color=ORANGE, label="MuJoCo")
    ax.loglog(
        amplitude, 0.4 * off["tmt"][-1] * (amplitude / amplitude[-1]) ** 2, ":", color=GREY, label="amplitude squared"
    )
    ax.set(xlabel="amplitude, rad", ylabel="distance / amplitude")
    ax.set_xticks(amplitude, [f"{a:g}" for a in amplitude])
    ax.minorticks_off()
    fig.legend(loc="outside upper center", ncols=3)
    modes = ", ".join(f"{f:.3f}" for f in small["frequencies"])
    powers = " and ".join(f"{small['powers'][engine]:.3f} ({LABELS[engine]})" for engine in off)
    least = " and ".join(f"{off[engine][-1]:.1e} ({LABELS[engine]})" for engine in off)
    halves = "" if small["sides"] == 1 else " Of two motions, let go on either side, half the difference is taken."
    caption = (
        f"Small oscillations about {small['posture']} against the linear modes of the stated {robot.noun} ({modes} rad/s): the "
        f"relative distance in {small['duration']:.3g} s goes with the amplitude to the power {powers}, where the same "
        f"{robot.name} has 2. It is {least} at {amplitude[-1]:g} rad.{halves}"
    )
    return "reduction_modes", fig, caption
