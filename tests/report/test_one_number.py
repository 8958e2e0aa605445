"""The one number of each experiment comes out either way, and is there for every one of them."""

import re

import pytest
from sections import BAD, GOOD, section

from compare.experiments import EXPERIMENTS
from compare.report.one_number import FINDERS, of_checks, one_number
from compare.report.verdict import Section

LONG = ("trajectory", "diagnosis", "stability", "speed", "reduction", "kinematics")


def test_every_experiment_has_a_finder():
    assert set(FINDERS) == set(EXPERIMENTS)


@pytest.mark.parametrize(
    "experiment", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in EXPERIMENTS]
)
def test_a_small_run_of_each_experiment_has_one(small, experiment):
    result = small(experiment)
    said = one_number(Section(experiment, "", "", "", result))
    assert said and "nan" not in said and any(sign.isdigit() for sign in said)
    if experiment not in ("diagnosis", "speed"):  # which may have nothing to say of a small run
        assert said != of_checks(result)


OFF = {"of": "forearm", "quantity": "com", "component": "x", "stated": 2.0, "compiled": 2.5, "difference": 0.5,
       "unit": "m"}  # fmt: skip
SAME = OFF | {"compiled": 2.0, "difference": 0.0}
APART = {"quantity": "Mbar", "unit": "kg m2", "worst_difference": 2e-16, "difference_over_bar": 0.1}
STEP = {"scene": "s", "engine": "tmt", "method": "rk4", "damping": 0.0, "limit": "finite", "predicted_dt_s": 0.1,
        "observed_dt_s": 0.1001}  # fmt: skip
PRINTED = {"published": 1.0, "tmt": 1.1, "mujoco": 0.9, "tolerance": 0.11}
FAULT = {"visible": True, "outcome": "right", "faults": 3}
FASTER = {"speedup": 4.21, "hinges": "gamma", "scene": "a"}


@pytest.mark.parametrize("name, rows, numbers, named", [
    ("mass", [], "1 1 50", ""),
    ("mass", [{"odd": 1}], "1 1 50", ""),
    ("parameters", [SAME, SAME | {"stated": None}], "1", ""),
    ("parameters", [SAME, OFF], "1 2 0.5", "com x of forearm"),
    ("parameters", [SAME, OFF | {"asked_by": "an option"}], "1", ""),
    ("parameters", [OFF, OFF | {"quantity": "mass", "component": "", "unit": "kg", "stated": 100.0, "compiled": 101.0,
     "difference": 1.0}], "0 2 0.5", "com x of forearm"),  # relative to their sizes
    ("parameters", [OFF, OFF | {"component": "y", "stated": 0.0, "compiled": 4e-18, "difference": 4e-18}], "0 2 0.5", "com x"),
    ("parameters", [OFF, OFF | {"quantity": "damping", "component": "", "stated": 0.0, "compiled": 0.01,
     "difference": 0.01}], "0 2 0.01", "damping of forearm"),
    ("published", [PRINTED], "1 1", ""),
    ("published", [PRINTED | {"mujoco": 0.8}], "0 1", ""),
    ("mass", [APART, APART | {"quantity": "other", "worst_difference": 1.0, "difference_over_bar": 0.05}], "2e-16 10", "Mbar"),
    ("mass", [APART | {"difference_over_bar": 1.5}], "2e-16 1.5", "Mbar"),
    ("mass", [APART, APART | {"worst_difference": None}], "", "Mbar"),
    ("trajectory", [{"scene": "a", "difference_over_band": 0.5}, {"scene": "b", "difference_over_band": 0.04}], "2 50", ""),
    ("trajectory", [{"scene": "a", "difference_over_band": 0.04}, {"scene": "a", "difference_over_band": 12.0}], "1 12", ""),
    ("diagnosis", [{"place": "mass of forearm"}, {"place": "other"}], "1", "mass of forearm"),
    ("diagnosis", [FAULT, FAULT | {"outcome": "wrong"}, FAULT | {"visible": False}], "3 6", ""),
    ("diagnosis", [FAULT, FAULT | {"outcome": "tied", "faults": 2}], "5 5", ""),
    ("stability", [STEP], "1 0.1", ""),
    ("stability", [STEP, STEP | {"observed_dt_s": 0.0995}], "2 0.5", ""),
    ("reduction", [FASTER, {"speedup": None}], "4.2", "gamma"),
    ("reduction", [FASTER | {"speedup": 1.05}], "1.1", "gamma"),
    ("reduction", [FASTER | {"speedup": 1.04}], "1 1 50", ""),  # as much as the clock may be off
])  # fmt: skip
def test_it_is_computed_and_comes_out_either_way(name, rows, numbers, named):
    said = one_number(section(name, GOOD, rows=rows))
    found = re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?", said.replace(" m2", ""))
    assert found == numbers.split() and named in said, said


def test_without_rows_it_is_how_many_checks_pass():
    assert one_number(section("mass")) == "" and "1 of 2" in one_number(section("mass", GOOD, BAD))


def test_limits_that_are_not_as_predicted_are_counted():
    of = section("stability", GOOD, rows=[STEP, STEP | {"scene": "other"}])
    of.result.check("s, TMT rk4, damping 0", "limit, observed / predicted - 1", 2.0, 1.0, "")
    assert "1 of 2" in one_number(of)
