"""The judge of reduction: every rule with numbers just inside and just outside; times and engines keep their places."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from compare import cost, draw_reduction, engine_cost, known_motion, reduction, sub_blocks
from compare.agreement import EPS, Result, Setup
from compare.engine_file import ARM_XML, parse
from compare.scenes import HINGES, SCENES, Scene
from compare.smallest import needed

GREEN, ORANGE, BLUE = "#009e73", "#e69f00", "#0072b2"
FLOOR = engine_cost.CONTACT


def verdicts(judge, *arguments, **curves):
    """(quantity, passed) of each check that a judge makes."""
    result = Result("reduction", curves={"apart": {}} | curves, tables={"reduction_subsets": []})
    judge(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


@pytest.mark.parametrize("apart, passes", [(63.0, True), (65.0, False), (np.nan, False), (np.inf, False)])
def test_sub_blocks_agree_within_64_eps(apart, passes):
    scale = np.array([2.0, 1e-3, 5.0])
    off = np.array([0.0, apart * EPS * 1e-3, 0.0])  # in the state with the small scale
    found = verdicts(sub_blocks.judge, ("beta",), "Mbar", "reduced, TMT to MuJoCo", off, scale, {})
    assert found == {"Mbar, reduced, TMT to MuJoCo": passes}


@pytest.mark.filterwarnings("ignore:All-NaN")
@pytest.mark.parametrize("moved, passes", [(0.1001, True), (0.0999, False), (np.nan, False)])
def test_a_free_run_moves(moved, passes):
    q = np.array([[0.3, 1.0], [0.3, 1.0 - moved], [0.35, 1.0]]) if np.isfinite(moved) else np.full((3, 2), np.nan)
    with np.errstate(invalid="ignore"):
        assert verdicts(reduction.judge_movement, "zero, free", q) == {"movement": passes}


@pytest.mark.parametrize(
    "apart, width, required, within, long_enough",
    [
        (0.99e-9, 1e-9, 5.0, True, True),
        (1.01e-9, 1e-9, 5.0, False, True),
        (np.nan, 1e-9, 5.0, False, True),
        (0.0, 0.0, 5.0, True, True),
        (1e-300, 0.0, 5.0, False, True),
        (0.0, 0.99e-3, 5.0, True, True),
        (0.0, 1.01e-3, 3.0, True, True),  # too wide from 4 s on
        (1.0, 1.01e-3, 3.0, True, True),  # then nothing is judged there
        (0.0, 1.01e-3, 3.01, True, False),
        (0.0, np.inf, 5.0, True, False),
    ],
)
def test_the_smallest_model_is_judged_while_the_band_is_narrow(apart, width, required, within, long_enough):
    t = np.arange(6.0)
    off, band = np.zeros((6, 4)), np.full((6, 4), 1e-9)
    off[4, 1], band[4, 1] = apart, width
    found = verdicts(reduction.judge_run, "zero, free", ("alpha", "gamma"), t, off, band, required)
    assert found == {"smallest model to whole": within, "time judged": long_enough}


@pytest.mark.parametrize("off, passes", [(63.0, True), (65.0, False)])
def test_the_elliptic_function_is_right_to_64_eps(off, passes):
    found = verdicts(known_motion.judge_function, "elbow swing", off * EPS * 33.0, 33.0)
    assert found == {"elliptic function, scipy to 50 digits": passes}


@pytest.mark.parametrize(
    "order, clear, passes",
    [(4.149, 1e-8, True), (4.151, 1e-8, False), (3.851, 1e-8, True), (3.849, 1e-8, False), (4.1, 1.1e-11, True),
     (0.0, 1.0, False)],
)  # fmt: skip
def test_errors_fall_at_the_order_of_the_method(order, clear, passes):
    values = [2.0 ** (2 * order) * clear, 2.0**order * clear, clear, 9e-12, 8e-12]  # the last two are rounding
    assert verdicts(known_motion.judge_orders, "elbow swing", {("TMT", "RK4"): values if order else [1.0] * 5}) == {
        "order of the error against the elliptic function, from 4": passes}  # fmt: skip


def test_the_order_is_that_of_the_finest_steps_above_rounding():
    coarse_are_off = [1.0, 0.9, 2.0**4 * 1e-9, 1e-9, 9e-12]
    assert list(verdicts(known_motion.judge_orders, "elbow swing", {("TMT", "RK4"): coarse_are_off}).values()) == [True]
    fine_are_off = [1.0, 2.0**-4, 0.9e-9, 0.8e-9, 9e-12]
    assert list(verdicts(known_motion.judge_orders, "elbow swing", {("TMT", "RK4"): fine_are_off}).values()) == [False]


@pytest.mark.parametrize("power, passes", [(2.149, True), (2.151, False), (1.851, True), (1.849, False), (0.0, False)])
def test_the_distance_from_the_modes_falls_with_the_amplitude_squared(power, passes):
    found = verdicts(known_motion.judge_modes, {"MuJoCo": [1e-2, 2.0**power * 1e-3, 1e-3]})
    assert list(found.values()) == [passes]


def test_what_exerts_no_force_leaves_the_bits_and_a_floor_in_reach_does_not():
    def judged(**same):
        rows = [{"added": name, "integrator": "RK4", "same_bits": same.get(key, True)} for key, name in (
            ("nothing", engine_cost.NOTHING), ("again", engine_cost.AGAIN), ("motor", "a motor"), ("floor", FLOOR))]  # fmt: skip
        return verdicts(cost.judge, "bent, free", rows)

    motor, floor = "the same bits with a motor", f"another motion with {FLOOR}"
    assert judged(floor=False) == {motor: True, floor: True}
    assert judged() == {motor: True, floor: False}
    assert judged(motor=False, floor=False) == {motor: False, floor: True}


def costs_of_two():
    zero = np.zeros((3, 6))
    moved = zero.copy()
    moved[1, 2], moved[2, 5] = 0.25, 9.0  # an angle, a rate
    names = (engine_cost.NOTHING, engine_cost.AGAIN, "a motor", FLOOR)
    paths = {(name, i): moved if name == FLOOR else zero for name in names for i in ("RK4", "Euler")}
    seconds = {
        (name, i): 128e-9 * (k + 2) * (4 if i == "RK4" else 1) for k, name in enumerate(names) for i in ("RK4", "Euler")
    }
    return cost.table(seconds, paths, dict.fromkeys(paths, 0.0))


def test_the_cost_of_an_addition_is_the_ratio_of_its_times():
    rows = {(row["added"], row["integrator"]): row for row in costs_of_two()}
    assert next(iter(rows)) == (engine_cost.NOTHING, "Euler") and len(rows) == 8
    assert rows["a motor", "Euler"]["ns_per_step"] == pytest.approx(4.0)
    assert rows["a motor", "RK4"]["ns_per_step"] == pytest.approx(16.0)
    assert rows["a motor", "RK4"]["ratio"] == pytest.approx(2.0) and rows[FLOOR, "Euler"]["ratio"] == pytest.approx(2.5)
    assert rows["a motor", "RK4"]["same_bits"] and rows[FLOOR, "RK4"]["max_difference_rad"] == 0.25
    assert not rows[FLOOR, "RK4"]["same_bits"]


def test_the_costs_are_drawn_as_they_are():
    result = Result("reduction", tables={"cost_in_mujoco": costs_of_two()})
    _, fig, caption = draw_reduction.costs(result)
    bars = [(to_hex(bar.get_facecolor()), bar.get_width(), bar.get_hatch()) for bar in fig.axes[0].patches]
    assert sorted(width for _, width, _ in bars) == pytest.approx(sorted(2 * [0.5, 1.0, 1.5]))
    assert {colour for colour, *_ in bars} == {BLUE, GREEN} and sum(hatch is not None for *_, hatch in bars) == 2
    assert f"2.50 and 2.50 with {FLOOR}" in caption and "timed again differs by 50.0 %" in caption
    assert f"changed by: {FLOOR}; 1 additions leave the same bits" in caption


# the table and its figure


def needed_rows():
    """Rows of a scene with a smaller model and of one that needs no run, from known seconds of the runs."""
    scene, held = SCENES[0], next(scene for scene in SCENES if scene.name == "bent, held")
    planar = next(scene for scene in SCENES if scene.name == "elbow swing")  # stands for the smaller model
    seconds = {}
    for party, whole, small in (("TMT", 1024 * 300e-9, 1024 * 100e-9), ("MuJoCo", 128 * 6000e-9, 128 * 4000e-9)):
        for integrator, factor in (("RK4", 1.0), ("Euler", 0.25)):
            for name in (scene.name, held.name):
                seconds[name, HINGES, party, integrator] = whole * factor
            seconds[scene.name, planar.hinges, party, integrator] = small * factor
    models = [(scene.name, scene), (scene.name, planar), (held.name, held), (held.name, None)]
    return reduction.table(models, seconds, {(scene.name, "TMT", "RK4"): 1e-12})


def test_the_table_has_nanoseconds_of_a_step():
    rows = {(r["scene"], r["nv"], r["engine"], r["integrator"]): r for r in needed_rows()}
    assert len(rows) == 4 * 2 * 2
    for engine, whole, small in (("TMT", 300.0, 100.0), ("MuJoCo", 6000.0, 4000.0)):
        assert rows["zero, free", 3, engine, "RK4"]["ns_per_step"] == pytest.approx(whole)
        assert rows["zero, free", 1, engine, "RK4"]["ns_per_step"] == pytest.approx(small)
        assert rows["zero, free", 1, engine, "Euler"]["ns_per_step"] == pytest.approx(small / 4)
        assert rows["zero, free", 1, engine, "RK4"]["speedup"] == pytest.approx(whole / small)
        assert rows["zero, free", 3, engine, "RK4"]["speedup"] == pytest.approx(1.0)
        assert rows["bent, held", 0, engine, "RK4"]["ns_per_step"] is None
    assert rows["zero, free", 1, "TMT", "RK4"]["max_difference_rad"] == 1e-12
    assert rows["zero, free", 3, "TMT", "RK4"]["max_difference_rad"] is None


def test_the_figure_of_needs_draws_the_times_of_each_engine():
    curves = {
        "needs": {"zero, free": {"locked": (), "stays": ("beta",)}, "bent, held": {"locked": (), "stays": HINGES}}
    }
    result = Result("reduction", rows=needed_rows(), curves=curves)
    _, fig, caption = draw_reduction.needs(result)
    points = [(to_hex(line.get_color()), line.get_xdata()[0], line.get_ydata()[0]) for line in fig.axes[1].get_lines()
              if len(line.get_xdata()) == 1]  # fmt: skip
    for colour, times in ((GREEN, (300.0, 100.0)), (ORANGE, (6000.0, 4000.0))):
        drawn = [x for c, x, y in points if c == colour and round(y) == 0]
        assert sorted(drawn) == pytest.approx(sorted(times))
    labels = {text.get_text(): to_hex(handle.get_color()) for text, handle in zip(
        fig.axes[1].get_legend().get_texts(), fig.axes[1].get_legend().legend_handles)}  # fmt: skip
    assert labels["TMT, whole model"] == GREEN and labels["MuJoCo, smallest model"] == ORANGE
    assert "Nothing for bent, held" in caption and "hinges, proved, for zero, free." in caption
    assert "that of TMT in zero, free" in caption and "with 1 of 3 hinges a step takes 0.33 of the time" in caption
    assert draw_reduction.gain([]) == "No smaller model was timed."


def test_the_figures_of_known_motions_say_what_was_measured():
    errors = {(party, i): [e * 2.0 ** (-o * k) for k in range(6)] for party, e in (("TMT", 1e-3), ("MuJoCo", 3e-3))
              for i, o in (("RK4", 4), ("Euler", 1))}  # fmt: skip
    orders = {("TMT", "RK4"): 4.01, ("MuJoCo", "RK4"): 3.97, ("TMT", "Euler"): 1.02, ("MuJoCo", "Euler"): 0.97}
    small = {"amplitude": np.array([0.02, 0.01]), "off": {"TMT": [4e-4, 1e-4], "MuJoCo": [3e-4, 3e-4]}, "duration": 5.0,
             "frequencies": np.array([4.0, 5.0, 11.0]), "powers": {"TMT": 2.0, "MuJoCo": 0.0}}  # fmt: skip
    swings = {"elbow swing": {"dt": 0.02 / 2.0 ** np.arange(6), "errors": errors, "orders": orders}}
    result = Result("reduction", curves={"swings": swings, "small": small})
    _, fig, caption = draw_reduction.swing(result, "elbow swing")
    lines = {line.get_label(): line.get_ydata()[0] for line in fig.axes[0].get_lines()}
    assert lines["RK4, TMT"] == 1e-3 and lines["RK4, MuJoCo"] == 3e-3
    assert "RK4: order 4.01 and 3.97, down to 9.5e-10 and 2.9e-09 rad" in caption
    _, fig, caption = draw_reduction.small_oscillations(result)
    lines = {line.get_label(): line.get_ydata()[-1] for line in fig.axes[0].get_lines()}
    assert lines["TMT"] == 1e-4 and lines["MuJoCo"] == 3e-4
    assert "power 2.000 (TMT) and 0.000 (MuJoCo)" in caption and "1.0e-04 (TMT) and 3.0e-04 (MuJoCo) at 0.01" in caption


def test_an_empty_section_has_no_figures_and_none_raises():
    empty = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}}, tables={"cost_in_mujoco": []})
    assert len(list(reduction.figures(Result("reduction", curves={"swings": {}})))) == 0
    for draw in (draw_reduction.needs, draw_reduction.costs):
        assert len(draw(empty)) == 3


def test_a_model_whose_hinges_cannot_be_locked_is_a_failed_check():
    """A tendon runs over the hinges: it cannot go with one of them."""
    tendon = '<tendon><fixed><joint joint="alpha" coef="1"/><joint joint="gamma" coef="1"/></fixed></tendon></mujoco>'
    text = ARM_XML.read_text(encoding="utf-8").replace("</mujoco>", tendon)
    (failed,) = [check for check in reduction.rows(Setup.small(parse(text)), timed=False).checks if not check.passed]
    assert failed.quantity == "models whose hinges can be locked" and failed.value == 0 and failed.note


def test_a_small_acceleration_is_one():
    """A torque of a thousandth moves the hanging arm by 1e-2 rad/s2: every hinge is needed, and of none it is undecided."""
    need = needed(Scene("a light push", "hanging", (1e-3, 1e-3, 1e-3)))
    assert set(need.moves) == set(HINGES) and need.stays == need.undecided == ()
