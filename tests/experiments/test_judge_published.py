"""Printed numbers: what meets them, just inside and just outside; whose number stands where; what is said of them."""

import dataclasses

import numpy as np
import pytest
from edited import MOON, XML, setup_of
from judged import verdicts

import tmt
from compare.engines.mujoco import parse
from compare.experiments import published
from compare.judge.check import Result
from compare.robots.arm import ARM, PRINTED

EPS = 2.0**-52
ITEMS = {item.item: item for item in PRINTED}


def of_item(name, ours=0.0, theirs=0.0, scale=0.0, exactly=0.0, printed=True):
    """The verdicts on an item: who is so far from what is printed, or from the exact value."""
    item, result = ITEMS[name], Result("published")
    value = np.array(item.values)
    truth = value + exactly if printed else np.zeros_like(value)
    answer = published.Answer(truth.astype(object), truth + ours, truth + theirs, scale)
    published.check_answer(result, item, answer, ARM.joints)
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
        found = of_item(name, ours=off, scale=1e5, printed=False)
        assert (found["TMT: qdd - exact"], found["MuJoCo: qdd - exact"]) == (inside, True)
        found = of_item(name, theirs=off, scale=1e5, printed=False)
        assert (found["TMT: qdd - exact"], found["MuJoCo: qdd - exact"]) == (True, inside)


def test_the_printed_digits_of_f2_and_f3_are_met_to_half_a_unit_of_the_last():
    for off, inside in ((0.49e-18, True), (0.51e-18, False)):
        assert of_item("f3", ours=off)["TMT: qdd - printed"] is inside
        assert of_item("f3", exactly=off)["exact: qdd - printed"] is inside
        assert of_item("f2", exactly=off)["exact: |qdd_alpha| - |printed|"] is inside


def test_each_column_of_the_published_numbers_is_whose_it_says():
    earth, moon = (
        {(r["item"], r["component"]): r for r in published.rows(setup_of(text)).rows} for text in (XML, MOON)
    )
    ours = tmt.gravity_balance(np.zeros(3))
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    for i, name in enumerate(("alpha", "beta", "gamma")):
        assert moon["c", name]["tmt"] == earth["c", name]["tmt"] == ours[i]
        assert moon["c", name]["mujoco"] == theirs[i]
    assert moon["c", "alpha"]["exact"] == pytest.approx(-2.20725) and moon["c", "alpha"]["mujoco"] > -0.4
    assert moon["c", "alpha"]["tolerance"] == pytest.approx(0.5e-4, rel=1e-6)


def test_the_tolerance_of_what_is_rounding_alone_has_no_printed_digit(small):
    rows = {row["item"]: row for row in small("published").rows}
    least = np.linalg.eigvalsh(tmt.mass_matrix(ARM.posture("hanging")))
    allowed = 64 * EPS * (least[-1] / least[0] + 1.0) / least[0] * 9.4176
    assert rows["f2"]["tolerance"] == pytest.approx(allowed, rel=1e-9)


def test_the_notes_on_the_published_numbers_follow_the_numbers():
    right, wrong = (published.rows(setup_of(text)).notes for text in (XML, XML.replace("0 0 -9.81", "0 0 9.81")))
    assert "has the sign of the torque that holds TMT's arm (-2.20725 N m) and the sign of MuJoCo's" in right[-1]
    assert "and not the sign of MuJoCo's qfrc_bias at rest (+2.20725 N m)" in wrong[-1]
    assert "has the sign of the torque that holds TMT's arm (-2.20725 N m)" in wrong[-1]
    assert right[1].startswith(
        "f3, printed (-3.456e-15, 0, 1.92e-16) rad/s2, is met to every digit by: exact arithmetic all;"
    )
    digits = np.array(ITEMS["f3"].values)

    def words(exactly, ours, theirs):
        return published.digits_in_words(ITEMS["f3"], published.Answer(exactly, ours, theirs, 1.0), ARM)

    said = words(digits + 1.0, digits, -digits)
    assert "exact arithmetic none; TMT all; MuJoCo none, and alpha and gamma with the other sign" in said
    assert "text's omega_1 is 1.9e+00 rad/s from TMT's" in right[2]
    for off, by in ((0.49e-18, "TMT all"), (0.51e-18, "TMT none")):
        assert by in words(digits, digits + off, digits)


def test_f4_is_asked_under_the_torque_of_c(small):
    rows = [row for row in small("published").rows if row["item"] == "f4"]
    for engine in ("tmt", "mujoco", "exact"):
        assert max(abs(float(row[engine])) for row in rows) < 1e-12
    assert max(abs(float(row["tmt"])) for row in small("published").rows if row["item"] == "f1") > 40.0


def test_texts_say_what_is_printed_of_the_robot():
    assert "9.42 N m" in published.tolerance(ARM)
    without = dataclasses.replace(ARM, printed=PRINTED[:2])
    assert published.claim(without).endswith("prints is met by TMT, by MuJoCo and by exact arithmetic.")
    assert published.tolerance(without).endswith("|Mbar^-1| x 9.42 N m).")
    one = dataclasses.replace(ARM, printed=(PRINTED[2]._replace(sizes=("alpha", "gamma")),))
    assert published.claim(one).endswith(
        "prints, f2 apart, is met by TMT, by MuJoCo and by exact arithmetic. f2 is zero but for rounding, and both engines are "
        "within rounding of what is exact at the doubles nearest to pi/2. Of f2 it shares the size of the first entry and the "
        "third entry."
    )
    assert published.skipped(ARM) is None
    assert "arm" in published.skipped(dataclasses.replace(ARM, printed=()))


@pytest.mark.parametrize("degrees, words", [(90, "pi/2"), (-180, "pi"), (135, "3 pi/4"), (360, "2 pi")])
def test_an_angle_is_a_part_of_pi(degrees, words):
    turned = dataclasses.replace(ARM, postures={"hanging": (0, 0, degrees)}, printed=PRINTED[2:3])
    assert published.angles(turned) == [words]
