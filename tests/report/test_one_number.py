"""The one number of each experiment comes out either way, and is there for every one of them."""

import pytest
from sections import BAD, GOOD, section

from compare.experiments import EXPERIMENTS
from compare.report.one_number import FINDERS, of_checks, one_number
from compare.report.verdict import Section


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_each_experiment_has_one(small, experiment):
    assert set(FINDERS) == set(EXPERIMENTS)
    result = small(experiment)
    said = one_number(Section(experiment, "", "", "", result))
    assert said and "nan" not in said and any(sign.isdigit() for sign in said)
    if experiment not in ("diagnosis", "speed"):  # which may have nothing to say of a small run
        assert said != of_checks(result)


def test_without_rows_it_is_how_many_checks_pass():
    assert one_number(section("mass", GOOD, BAD)) == "1 of 2 checks pass, at most 50 % of a tolerance"
    assert one_number(section("mass")) == ""
    assert one_number(section("mass", GOOD, rows=[{"odd": 1}])) == "1 of 1 checks pass, at most 50 % of a tolerance"


NUMBER = {
    "of": "forearm",
    "quantity": "com",
    "component": "x",
    "stated": 2.0,
    "compiled": 2.0,
    "difference": 0.0,
    "unit": "m",
}
APART = {"quantity": "Mbar", "unit": "kg m2", "worst_difference": 2e-16, "difference_over_bar": 0.1}
STEP = {"scene": "s", "engine": "tmt", "method": "rk4", "damping": 0.0, "limit": "finite", "predicted_dt_s": 0.1,
        "observed_dt_s": 0.1001}  # fmt: skip
FAULT = {"visible": True, "outcome": "right", "faults": 3}


@pytest.mark.parametrize("name, rows, said", [
    ("parameters", [NUMBER, NUMBER | {"stated": None}], "1 numbers equal to the last bit"),
    ("parameters", [NUMBER, NUMBER | {"compiled": 2.5, "difference": 0.5}],
     "1 of 2 numbers equal to the last bit; com x of forearm is 0.5 m off"),
    ("parameters", [NUMBER, NUMBER | {"compiled": 2.5, "difference": 0.5, "asked_by": "an option"}],
     "1 numbers equal to the last bit"),
    ("parameters", [NUMBER | {"compiled": 2.5, "difference": 0.5}, NUMBER | {"quantity": "mass", "component": "",
     "unit": "kg", "stated": 100.0, "compiled": 101.0, "difference": 1.0}],
     "0 of 2 numbers equal to the last bit; com x of forearm is 0.5 m off"),
    ("parameters", [NUMBER | {"compiled": 2.1, "difference": 0.1},
                    NUMBER | {"component": "y", "stated": 0.0, "compiled": 4e-18, "difference": 4e-18}],
     "0 of 2 numbers equal to the last bit; com x of forearm is 0.1 m off"),
    ("parameters", [NUMBER | {"compiled": 2.1, "difference": 0.1},
                    NUMBER | {"quantity": "damping", "component": "", "stated": 0.0, "compiled": 0.01, "difference": 0.01}],
     "0 of 2 numbers equal to the last bit; damping of forearm is 0.01 m off"),
    ("published", [{"published": 1.0, "tmt": 1.1, "mujoco": 0.9, "tolerance": 0.11}], "1 of 1 printed numbers met by both"),
    ("published", [{"published": 1.0, "tmt": 1.0, "mujoco": 0.8, "tolerance": 0.11}], "0 of 1 printed numbers met by both"),
    ("mass", [APART, APART | {"quantity": "other", "worst_difference": 1.0, "difference_over_bar": 0.05}],
     "2e-16 kg m2 apart in Mbar: 10 % of the tolerance"),
    ("mass", [APART | {"difference_over_bar": 1.5}], "2e-16 kg m2 apart in Mbar: 1.5 times the tolerance"),
    ("mass", [APART, APART | {"worst_difference": None}], "Mbar: no number"),
    ("trajectory", [{"scene": "a", "difference_over_band": 0.5}, {"scene": "b", "difference_over_band": 0.04}],
     "2 scenes, 50 % of the rounding band apart at most"),
    ("trajectory", [{"scene": "a", "difference_over_band": 0.04}, {"scene": "a", "difference_over_band": 0.5}],
     "1 scene, 50 % of the rounding band apart at most"),
    ("trajectory", [{"scene": "a", "difference_over_band": 12.0}], "1 scene, 12 times the rounding band apart at most"),
    ("diagnosis", [{"place": "mass of forearm"}, {"place": "other"}], "explained by: mass of forearm and 1 more"),
    ("diagnosis", [FAULT, FAULT | {"outcome": "wrong"}, FAULT | {"visible": False}],
     "3 of 6 made faults that can be seen are explained"),
    ("diagnosis", [FAULT, FAULT | {"outcome": "tied", "faults": 2}], "5 of 5 made faults that can be seen are explained"),
    ("stability", [STEP], "1 step limits predicted within 0.1 %"),
    ("stability", [STEP, STEP | {"observed_dt_s": 0.0995}], "2 step limits predicted within 0.5 %"),
    ("reduction", [{"speedup": 4.21, "hinges": "gamma", "scene": "a"}, {"speedup": None}],
     "a step is up to 4.2 times as fast with gamma alone (a)"),
    ("reduction", [{"speedup": 1.05, "hinges": "gamma", "scene": "a"}],
     "a step is up to 1.1 times as fast with gamma alone (a)"),
    ("reduction", [{"speedup": 1.04, "hinges": "gamma", "scene": "a"}],
     "1 of 1 checks pass, at most 50 % of a tolerance"),
])  # fmt: skip
def test_it_is_computed_and_comes_out_either_way(name, rows, said):
    assert one_number(section(name, GOOD, rows=rows)) == said


def test_limits_that_are_not_as_predicted_are_counted():
    of = section("stability", GOOD, rows=[STEP, STEP | {"scene": "other"}])
    of.result.check("s, TMT rk4, damping 0", "limit, observed / predicted - 1", 2.0, 1.0, "")
    assert one_number(of) == "1 of 2 step limits not as predicted"
