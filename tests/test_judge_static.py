"""The judge of single states: for each rule a row just inside and one just outside; whose number stands where."""

import dataclasses

import matplotlib.colors
import numpy as np
import pytest
from judged import verdicts

import tmt
from compare import acceleration, draw, gravity, kinematics, mass, published
from compare.agreement import Result, Sample, Setup
from compare.engine_file import ARM_XML, parse

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach
MOON = parse(ARM_XML.read_text().replace("0 0 -9.81", "0 0 -1.62"))
ITEMS = {item.item: item for item in published.ITEMS}


# published numbers


def of_item(name, ours=0.0, theirs=0.0, scale=0.0, exactly=0.0, printed=True):
    """The verdicts on an item: who is so far from what is printed, or from the exact value."""
    item, result = ITEMS[name], Result("published")
    value = np.array(item.values)
    truth = value + exactly if printed else np.zeros_like(value)
    published.judge(result, item, truth.astype(object), truth + ours, truth + theirs, scale)
    return verdicts(result)


@pytest.mark.parametrize("name", ["c", "f1", "g", "h"])
def test_four_decimals_are_met_to_half_a_unit_of_the_last(name):
    what = ITEMS[name].quantity + " - printed"
    assert of_item(name) == {f"{who}: {what}": True for who in ("TMT", "MuJoCo", "exact")}
    for off in (0.499e-4, 0.501e-4, -0.499e-4, -0.501e-4):
        inside = abs(off) < 0.5e-4
        assert of_item(name, ours=off) == {f"TMT: {what}": inside, f"MuJoCo: {what}": True, f"exact: {what}": True}
        assert of_item(name, theirs=off) == {f"TMT: {what}": True, f"MuJoCo: {what}": inside, f"exact: {what}": True}


@pytest.mark.parametrize("name", ["f2", "f3", "f4"])
def test_what_is_zero_but_for_rounding_is_met_to_64_eps_of_its_scale(name):
    for share, inside in ((0.99, True), (1.01, False)):
        off = share * 64 * EPS * 1e5
        told = of_item(name, ours=off, scale=1e5, printed=False)
        assert (told["TMT: qdd - exact"], told["MuJoCo: qdd - exact"]) == (inside, True)
        told = of_item(name, theirs=off, scale=1e5, printed=False)
        assert (told["TMT: qdd - exact"], told["MuJoCo: qdd - exact"]) == (True, inside)


def test_the_printed_digits_of_f2_and_f3_are_met_to_half_a_unit_of_the_last():
    for off, inside in ((0.49e-18, True), (0.51e-18, False)):
        assert of_item("f3", ours=off)["TMT: qdd - printed"] is inside
        assert of_item("f3", exactly=off)["exact: qdd - printed"] is inside
        assert of_item("f2", exactly=off)["exact: |qdd_alpha| - |printed|"] is inside


def test_each_column_of_the_published_numbers_is_whose_it_says(engine):
    earth, moon = (
        {(r["item"], r["component"]): r for r in published.rows(Setup.small(e)).rows} for e in (engine, MOON)
    )
    ours, theirs = tmt.gravity_balance(np.zeros(3)), MOON.gravity_balance(np.zeros(3))
    for i, name in enumerate(("alpha", "beta", "gamma")):
        assert moon["c", name]["tmt"] == earth["c", name]["tmt"] == ours[i]
        assert moon["c", name]["mujoco"] == theirs[i]
    assert moon["c", "alpha"]["exact"] == pytest.approx(-2.20725) and moon["c", "alpha"]["mujoco"] > -0.4
    assert moon["c", "alpha"]["tolerance"] == pytest.approx(0.5e-4, rel=1e-6)


def test_the_notes_on_the_published_numbers_follow_the_numbers(engine):
    upward = parse(ARM_XML.read_text().replace("0 0 -9.81", "0 0 9.81"))
    right, wrong = (published.rows(Setup.small(e)).notes for e in (engine, upward))
    assert "has the sign of the torque that holds TMT's arm (-2.20725 N m) and the sign of MuJoCo's" in right[-1]
    assert "and not the sign of MuJoCo's qfrc_bias at rest (+2.20725 N m)" in wrong[-1]
    assert "has the sign of the torque that holds TMT's arm (-2.20725 N m)" in wrong[-1]
    assert right[1].startswith(
        "f3, printed (-3.456e-15, 0, 1.92e-16) rad/s2, is met to every digit by: exact arithmetic all;"
    )
    digits = np.array(ITEMS["f3"].values)
    told = published.shared(ITEMS["f3"], digits + 1.0, digits, -digits, 1.0)
    assert "exact arithmetic none; TMT all; MuJoCo none, and alpha and gamma with the other sign" in told
    assert "text's omega_1 is 1.9e+00 rad/s from TMT's" in right[2]
    for off, said in ((0.49e-18, "TMT all"), (0.51e-18, "TMT none")):
        assert said in published.shared(ITEMS["f3"], digits, digits + off, digits, 1.0)


# the mass matrix


def test_a_mass_matrix_is_definite_by_more_than_rounding():
    for least, passes in ((1.01, True), (0.99, False), (0.0, False), (-1.0, False)):
        result = Result("mass")
        mass.definite(result, "TMT", np.array([np.eye(3), np.diag([1.0, 1.0, least * 64 * EPS])]))
        assert verdicts(result) == {"TMT: least eigenvalue of Mbar over the largest": passes}


def test_a_mass_matrix_is_symmetric_but_for_rounding():
    for share, passes in ((0.99, True), (1.01, False)):
        M, result = 2.0 * np.eye(3)[None], Result("mass")
        M[0, 0, 1] = share * 2.0 * 64 * EPS
        mass.symmetric(result, M)
        assert verdicts(result) == {"TMT: Mbar - Mbar' over its largest entry": passes}


def test_the_worst_posture_and_its_condition_number_are_those_of_the_stated_arm():
    assert pytest.approx(126.8333, abs=1e-4) == mass.LARGEST and "126.83" in mass.CLAIM
    right = mass.LARGEST, np.radians([-90.0, 90.0])
    bar = 64 * EPS * 126.8333**2
    for value, worst, passes in (
        (*right, [True, True]),
        (right[0] + 0.99 * bar, right[1], [True, True]),
        (right[0] + 1.01 * bar, right[1], [False, True]),
        (right[0], np.radians([90.0099, 90.0]), [True, True]),
        (right[0], np.radians([90.0101, 90.0]), [True, False]),
        (right[0], np.radians([90.0, 90.0101]), [True, False]),
        (right[0], np.radians([90.0, -90.0]), [True, False]),
    ):
        result = Result("mass")
        mass.conditioned(result, "MuJoCo", value, worst)
        assert [check.passed for check in result.checks] == passes


def test_every_rule_of_the_mass_matrix_is_applied_to_both_engines(engine):
    found = {check.quantity for check in mass.rows(Setup.small(engine)).checks}
    assert found == {"Mbar", "Mbar, TMT to exact", "Mbar, MuJoCo to exact", "TMT: Mbar - Mbar' over its largest entry"} | {
        f"{name}: {what}" for name in ("TMT", "MuJoCo")
        for what in ("least eigenvalue of Mbar over the largest", "condition number - 126.83", "distance from (+-90, 90) deg")
    }  # fmt: skip


def test_a_gamma_axis_that_is_flipped_is_seen_in_the_worst_posture(engine):
    flipped = parse(
        ARM_XML.read_text().replace('"gamma" type="hinge" axis="0 1 0"', '"gamma" type="hinge" axis="0 -1 0"')
    )
    failed = {check.quantity for check in mass.rows(Setup.small(flipped)).checks if not check.passed}
    assert "MuJoCo: distance from (+-90, 90) deg" in failed and not any(name.startswith("TMT") for name in failed)


# tolerances of what is compared at states


def one_state(qd) -> Setup:
    """A setup whose random states are one: zero, at these rates."""
    setup = Setup(parse(ARM_XML.read_text()), states=1, exact_states=1)
    setup.__dict__["random"] = Sample("random states", np.zeros((1, 3)), np.array([qd]), np.zeros((1, 3)), 1)
    return setup


def tolerances(module, setup) -> dict:
    """Tolerances at the one state in units of 64 eps, by quantity."""
    checks = module.rows(setup).checks
    return {check.quantity: check.tolerance / (64 * EPS) for check in checks if check.scene == "random states"}


def test_tolerances_are_64_eps_of_the_sums_that_are_added_up():
    found = tolerances(gravity, one_state([0.0, 0.0, 0.0]))
    torques = [found[name] for name in found if "torque" in name and "qdd" not in name]
    assert len(torques) == 5 and torques == pytest.approx([WEIGHT] * 5)
    least, most = np.linalg.eigvalsh(tmt.mass_matrix(np.zeros(3)))[[0, -1]]
    assert found["qdd of MuJoCo under TMT's torque"] == pytest.approx((most / least + 1.0) / least * WEIGHT)
    found = tolerances(kinematics, one_state([1.0, -2.0, 3.0]))
    expected = {"x_b": 0.45, "omega_b": 6.0, "T_b": 0.45, "B_b": 1.0, "v_conv": 0.45 * 36.0, "w_conv": 36.0}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert tolerances(mass, one_state([0.0, 0.0, 0.0]))["Mbar"] == pytest.approx(0.24450, abs=1e-5)


def test_tolerances_in_motion_grow_with_the_terms_of_the_bias():
    """Only gamma turns: the forearm's centripetal term 1.5 kg x 0.15 m x w^2 acts on alpha by 0.3 m."""
    rate = 8.0
    found = tolerances(acceleration, one_state([0.0, 0.0, rate]))
    size = WEIGHT + 1.5 * 0.15 * rate**2 * 0.3
    M = tmt.mass_matrix(np.zeros(3))
    least, most = np.linalg.eigvalsh(M)[[0, -1]]
    expected = {
        "bias": size,
        "qdd": (most / least + 1.0) / least * size,
        "tau from MuJoCo's qdd by TMT": most / least * size,
        "tau from TMT's qdd by mj_inverse": most / least * size,
        "energy": WEIGHT + M[2, 2] * rate**2 / 2,
        "potential energy": WEIGHT,
        "dE/dt - tau.qd at TMT's qdd": most / least * size * rate,
        "dE/dt - tau.qd at MuJoCo's qdd": most / least * size * rate,
        "dp_alpha/dt at TMT's qdd, no gravity": most / least * M.max() * rate**2,
        "dp_alpha/dt at MuJoCo's qdd, no gravity": most / least * M.max() * rate**2,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected)


def test_texts_name_the_scales_of_the_stated_arm():
    assert "9.42 N m" in gravity.BAR and "9.42 J" in acceleration.BAR and "9.42 N m" in published.BAR
    assert kinematics.BAR.count("0.45 m") == 2


# figures: whose number stands where


def lines_of(ax, colour):
    return [line for line in ax.lines if matplotlib.colors.same_color(line.get_color(), colour)]


def test_the_figure_of_distances_says_who_is_how_far_from_what():
    curves = {"TMT to MuJoCo": [1.0, 5.0], "TMT to exact": [1.5, 2.0], "MuJoCo to exact": [2.5, 3.0]}
    result = Result("mass", curves={"random states": {"Mbar": {name: np.array(v) for name, v in curves.items()}}})
    name, fig, caption = draw.distances(result, "random states")
    assert name == "mass_distances" and "at most 5 eps apart (Mbar)" in caption
    assert "the first 2 of the states, TMT is at most 2 eps off and MuJoCo at most 3." in caption
    larger = {name: np.array([7.0, 9.0]) for name in curves}
    result.curves["random states"]["Abar"] = larger
    told = draw.distances(result, "random states")[2]
    assert "at most 9 eps apart (Abar)" in told and "TMT is at most 9 eps off and MuJoCo at most 9." in told
    for label, values in curves.items():
        (line,) = (line for line in fig.axes[0].lines if line.get_label() == label)
        assert line.get_xdata().tolist() == values
    assert lines_of(fig.axes[0], draw.BLUE)[0].get_label() == "TMT to exact"


def test_the_figure_of_holding_torques_says_whose_they_are_and_where_none_is_needed():
    ours, theirs = np.array([1.0, 2.0, 3.0]), np.array([-1.0, -2.0, -3.0])
    result = Result("gravity", curves={"postures": {"zero": (ours, theirs), "hanging": (0 * ours, 0 * ours)}})
    _, fig, caption = draw.holding_torques(result)
    assert [bar.get_height() for bar in fig.axes[0].patches][::2] == ours.tolist()
    assert [line.get_ydata()[0] for line in fig.axes[0].lines][:3] == theirs.tolist()
    assert "at most 6.0e+00 N m apart. Both need none, but for rounding, at: hanging." in caption
    one = {"zero": (0 * ours, ours), "bent": (ours, ours + 0.99 * 64 * EPS * WEIGHT)}
    assert draw.needless(one) == (
        "TMT needs none, but for rounding, at: zero. MuJoCo needs none, but for rounding, at: no posture."
    )
    for share, said in ((0.99, "bent"), (1.01, "no posture")):
        rest = np.full(3, share * 64 * EPS * WEIGHT)
        assert draw.needless({"bent": (rest, rest)}) == f"Both need none, but for rounding, at: {said}."


def test_the_map_of_the_condition_number_says_whose_maximum_is_where():
    result = Result("mass")
    result.curves["condition"] = mass.condition_grid(tmt.mass_matrix, 30.0)
    ours, theirs = np.radians([-90.0, 90.0]), np.radians([45.0, -60.0])
    result.curves["worst"] = {"TMT": (126.8, ours, 126.8), "MuJoCo": (99.0, theirs, 50.0)}
    _, fig, caption = draw.condition_map(result)
    assert "TMT's is 126.80 at β = -90.0°, γ = 90.0°, and the same at -β" in caption
    assert "MuJoCo's is 99.00 at β = 45.0°, γ = -60.0°, and 50.00 at -β" in caption
    (dot,) = lines_of(fig.axes[0], draw.RED)
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == (pytest.approx(-90.0), pytest.approx(90.0))


def test_the_sketch_says_where_each_hinge_is(monkeypatch):
    assert draw.hinges() == ["α about y at the shoulder", "β about x at the shoulder", "γ about y at the elbow"]
    other = dataclasses.replace(tmt.ARM, axis=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.6, 0.8)))
    monkeypatch.setattr(tmt, "ARM", other)
    assert draw.hinges()[2] == "γ about (0, 0.6, 0.8) at the elbow"


@pytest.mark.parametrize("module", [mass, gravity, kinematics, acceleration])
def test_every_figure_of_the_single_states_is_drawn(module):
    result = module.rows(Setup.small(MOON))
    for figure in module.figures(result):
        name, drawn, caption = figure()
        assert name.startswith(result.experiment) and drawn.axes and caption.endswith(".")


def test_what_is_kept_for_the_figures_is_whose_it_says():
    kept = gravity.rows(Setup.small(MOON)).curves["postures"]["zero"]
    assert np.array_equal(kept, [tmt.gravity_balance(np.zeros(3)), MOON.gravity_balance(np.zeros(3))])
    heavy = parse(ARM_XML.read_text().replace('mass="1.5"', 'mass="2.5"'))
    worst = mass.rows(Setup.small(heavy)).curves["worst"]
    assert worst["TMT"][0] == pytest.approx(126.83, abs=0.01) and worst["MuJoCo"][0] > 190.0


def test_f4_is_asked_under_the_torque_of_c(small):
    rows = [row for row in small("published").rows if row["item"] == "f4"]
    for engine in ("tmt", "mujoco", "exact"):
        assert max(abs(float(row[engine])) for row in rows) < 1e-12
    assert max(abs(float(row["tmt"])) for row in small("published").rows if row["item"] == "f1") > 40.0
