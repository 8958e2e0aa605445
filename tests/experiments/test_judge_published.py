"""Printed numbers: what meets them, just inside and just outside; whose number stands where."""

import dataclasses

import numpy as np
import pytest
from edited import MOON, setup_of
from judged import verdicts

import tmt
from compare.engines.mujoco import parse
from compare.experiments import published
from compare.judge.check import Result
from compare.robots.arm import ARM, PRINTED

EPS = 2.0**-52
ITEMS = {item.item: item for item in PRINTED}


def of_item(name, ours=0.0, theirs=0.0, scale=0.0, exactly=0.0, printed=True):
    """The verdicts on an item: each answer is so far from what is printed, or from the exact value."""
    item, result = ITEMS[name], Result("published")
    value = np.array(item.values)
    truth = value + exactly if printed else np.zeros_like(value)
    answer = published.Answer(truth.astype(object), truth + ours, truth + theirs, scale)
    published.check_answer(result, item, answer, ARM.joints)
    return verdicts(result)


@pytest.mark.parametrize("name", ["c", "f1", "g", "h"])
@pytest.mark.parametrize("off, inside", [(0.499e-4, True), (-0.499e-4, True), (0.501e-4, False), (-0.501e-4, False)])
def test_four_decimals_are_met_to_half_a_unit_of_the_last(name, off, inside):
    what = ITEMS[name].quantity + " - printed"
    assert of_item(name, ours=off) == {f"TMT: {what}": inside, f"MuJoCo: {what}": True, f"exact: {what}": True}
    assert of_item(name, theirs=off) == {f"TMT: {what}": True, f"MuJoCo: {what}": inside, f"exact: {what}": True}


@pytest.mark.parametrize("name", ["f2", "f3", "f4"])
@pytest.mark.parametrize("share, inside", [(0.99, True), (1.01, False)])
def test_what_is_zero_but_for_rounding_is_met_to_64_eps_of_its_scale(name, share, inside):
    away = share * 64 * EPS * 1e5
    for off, verdict in (({"ours": away}, (inside, True)), ({"theirs": away}, (True, inside))):
        found = of_item(name, scale=1e5, printed=False, **off)
        assert (found["TMT: qdd - exact"], found["MuJoCo: qdd - exact"]) == verdict


@pytest.mark.parametrize("off, inside", [(0.49e-18, True), (0.51e-18, False)])
def test_the_printed_digits_of_f2_and_f3_are_met_to_half_a_unit_of_the_last(off, inside):
    assert of_item("f3", ours=off)["TMT: qdd - printed"] is inside
    assert of_item("f3", exactly=off)["exact: qdd - printed"] is inside
    assert of_item("f2", exactly=off)["exact: |qdd_alpha| - |printed|"] is inside


def test_each_column_is_whose_it_says_and_f4_is_asked_under_the_torque_of_c():
    of_moon = published.rows(setup_of(MOON)).rows
    moon = {(row["item"], row["component"]): row for row in of_moon}
    ours, least = tmt.gravity_balance(np.zeros(3)), np.linalg.eigvalsh(tmt.mass_matrix(ARM.posture("hanging")))
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    assert [moon["c", name]["tmt"] for name in ARM.joints] == list(ours)
    assert [moon["c", name]["mujoco"] for name in ARM.joints] == list(theirs)
    of_alpha = moon["c", "alpha"]
    assert of_alpha["exact"] == pytest.approx(-2.20725) and of_alpha["tolerance"] == pytest.approx(0.5e-4, rel=1e-6)
    for name in ("tmt", "exact"):
        assert max(abs(float(row[name])) for row in of_moon if row["item"] == "f4") < 1e-12
    assert max(abs(float(row["tmt"])) for row in of_moon if row["item"] == "f1") > 40.0
    allowed = 64 * EPS * (least[-1] / least[0] + 1.0) / least[0] * 9.4176
    assert moon["f2", "alpha"]["tolerance"] == pytest.approx(allowed, rel=1e-9)


def test_a_robot_of_which_nothing_is_printed_is_skipped():
    assert published.skipped(ARM) is None and published.skipped(dataclasses.replace(ARM, printed=()))
