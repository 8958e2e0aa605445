"""What the first screen says and draws of results: the one number of each experiment, and what is marked in the pictures."""

import re
from types import SimpleNamespace

import pytest
from matplotlib.colors import to_hex
from sections import GOOD, section

from compare.judge.check import Result
from compare.report import engines_apart, figures_overview, methods_compared
from compare.report.engines_apart import SceneRun
from compare.report.methods_compared import Cheapest, Curve, Limit
from compare.report.one_number import one_number
from compare.report.style import BLUE, ORANGE, RED
from compare.report.verdict import Section
from compare.robots.arm import ARM

OFF = {"of": "forearm", "quantity": "com", "component": "x", "stated": 2.0, "compiled": 2.5, "difference": 0.5,
       "unit": "m"}  # fmt: skip
SAME = OFF | {"compiled": 2.0, "difference": 0.0}
HEAVY = OFF | {"quantity": "mass", "component": "", "unit": "kg", "stated": 100.0, "compiled": 101.0, "difference": 1.0}
APART = {"quantity": "Mbar", "unit": "kg m2", "worst_difference": 2e-16, "difference_over_bar": 0.1}
STEP = {"scene": "s", "engine": "tmt", "method": "rk4", "damping": 0.0, "limit": "finite", "predicted_dt_s": 0.1,
        "observed_dt_s": 0.1001}  # fmt: skip
PRINTED = {"published": 1.0, "tmt": 1.1, "mujoco": 0.9, "tolerance": 0.11}
FAULT = {"visible": True, "outcome": "right", "faults": 3}
FASTER = {"speedup": 4.21, "hinges": "gamma", "scene": "a"}


@pytest.mark.parametrize("name, rows, numbers, named", [
    ("mass", [{"odd": 1}], "1 1 50", ""),  # how many checks pass
    ("parameters", [SAME, OFF], "1 2 0.5", "com x of forearm"),
    ("parameters", [SAME, OFF | {"asked_by": "an option"}], "1", ""),
    ("parameters", [OFF, HEAVY], "0 2 0.5", "com x of forearm"),  # relative to their sizes
    ("parameters", [OFF, HEAVY | {"stated": 0.0}], "0 2 1", "mass of forearm"),
    ("published", [PRINTED | {"mujoco": 0.8}], "0 1", ""),
    ("mass", [APART, APART | {"quantity": "other", "worst_difference": 1.0, "difference_over_bar": 0.05}], "2e-16 10", "Mbar"),
    ("mass", [APART, APART | {"worst_difference": None}], "", "Mbar"),
    ("trajectory", [{"scene": "a", "difference_over_band": 0.04}, {"scene": "a", "difference_over_band": 12.0}], "1 12", ""),
    ("diagnosis", [{"place": "mass of forearm"}, {"place": "other"}], "1", "mass of forearm"),
    ("diagnosis", [FAULT, FAULT | {"outcome": "wrong"}, FAULT | {"visible": False}], "3 6", ""),
    ("stability", [STEP, STEP | {"observed_dt_s": 0.0995}], "2 0.5", ""),
    ("reduction", [FASTER | {"speedup": 1.05}], "1.1", "gamma"),
    ("reduction", [FASTER | {"speedup": 1.04}], "1 1 50", ""),  # as much as the clock may be off
])  # fmt: skip
def test_the_one_number_is_computed_and_comes_out_either_way(name, rows, numbers, named):
    said = one_number(section(name, GOOD, rows=rows))
    found = re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]\d+)?", said.replace(" m2", ""))
    assert found == numbers.split() and named in said, said


# the pictures

OF_BIAS = {"quantity": "Mbar", "difference_eps": 2.0, "tmt_from_exact_eps": 1.0, "mujoco_from_exact_eps": 4.0,
           "passed": True}  # fmt: skip
RUN = {"scene": "a", "level": "open loop", "difference_over_band": 0.2, "judged_until_s": 3.0, "diverged_at_s": None}


def timed(engine, method, seconds, error, **more):
    return {"scene": "s", "engine": engine, "method": method, "seconds": seconds, "worst_error_rad": error, "why_not": None,
            "diverged": False} | more  # fmt: skip


def marks(experiment, result):
    """What is marked in the first panel of the picture of an experiment: (mark, colour, x) of every point."""
    ((_, figure, _),) = (call() for call in figures_overview.pictures(experiment, {experiment: result}, ARM))
    lines = [line for line in figure.axes[0].get_lines() if line.get_marker() not in (None, "None", "")]
    return {(line.get_marker(), to_hex(line.get_color()), float(x)) for line in lines for x in line.get_xdata()}


def test_the_agreement_is_the_largest_of_all_rows_of_a_quantity_and_its_picture_says_whose_distance_is_whose():
    rows = [
        OF_BIAS | {"mujoco_from_exact_eps": None},
        OF_BIAS | {"difference_eps": 7.0, "tmt_from_exact_eps": None, "mujoco_from_exact_eps": None},
        OF_BIAS | {"quantity": "other", "difference_eps": 9.0},
    ]
    (found,) = engines_apart.agreements({"mass": Result("mass", rows=rows)})
    assert found[1:] == (7.0, 1.0, None, True) and "7 eps" in engines_apart.agreement_in_words([found], "TMT")
    rows.append(OF_BIAS | {"difference_eps": float("nan"), "passed": False})
    (found,) = engines_apart.agreements({"mass": Result("mass", rows=rows)})
    assert found.apart == float("inf") and not found.passed
    assert found.name in engines_apart.agreement_in_words([found], "yours")
    drawn = marks("mass", Result("mass", rows=[OF_BIAS]))
    assert drawn == {("D", to_hex("black"), 2.0), ("o", to_hex(BLUE), 1.0), ("s", to_hex(ORANGE), 4.0)}


def test_a_scene_at_a_glance():
    rows = [RUN, RUN | {"judged_until_s": 0.5, "diverged_at_s": 0.6}, RUN | {"level": "one step", "difference_over_band": 0.7},
            RUN | {"scene": "a, more", "difference_over_band": None}]  # fmt: skip
    left = {("a", "rk4", 64): {"t": [0.0, 5.0], "left": {"tmt": 4.7, "mujoco": None}}}
    result = Result("trajectory", rows=rows, curves={"runs": left})
    result.check("a, more, RK4", "one step", 2.0, 1.0, "rad")
    result.check("a, RK4", "one step", 1.0, 1.0, "rad")
    robot = SimpleNamespace(cases=[SimpleNamespace(name="a", duration=5.0, is_held=True, steps=64)])
    found = engines_apart.scene_runs(result, robot)
    assert found == [
        SceneRun("a", 0.7, (0.5, 3.0), 5.0, 0.6, (4.7, None), True),
        SceneRun("a, more", None, (3.0, 3.0), 3.0, None, None, False),
    ]
    assert "a, more" in engines_apart.scenes_in_words(found, "yours")
    said = engines_apart.scenes_in_words(found[:1], "TMT")
    assert "70 %" in said and "0.5 to 3 s" in said and "TMT alone" in said and "4.7" in said


def test_a_curve_has_what_nothing_of_the_same_engine_beats_and_its_cheapest_is_named():
    rows = [
        timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "rk4", 2e-3, 1e-2), timed("tmt", "dopri8", 4e-3, 1e-6),
        timed("tmt", "dopri8", 5e-3, 1e-9), timed("mujoco", "RK4", 1e-2, 1.1e-6), timed("tmt", "rk4", 1e-9, None, diverged=True),
        timed("tmt", "rk4", 1e-9, 2.0), timed("heyoka", "Taylor", None, None, why_not="absent"),
    ]  # fmt: skip
    result = Result("speed", rows=rows, curves={"regular": "s", "unit": "rad"})
    assert methods_compared.best_curves(result) == [
        Curve("tmt", [1e-3, 1e-6, 1e-9], [1.0, 4.0, 5.0], Cheapest("dopri8", 4.0)),
        Curve("mujoco", [1.1e-6], [10.0], None),  # which is just outside of the error asked for
    ]
    rows.append(timed("mujoco", "RK4", 3e-3, 1e-6, dt_s=0.00244140625, steps=2048.0))
    rows.append(timed("scipy", "DOP853", 4.5e-3, 1e-7))  # which is not the cheapest beside MuJoCo
    for said in (methods_compared.times_in_words(result), one_number(Section("speed", "", "", "", result))):
        assert all(
            part in said for part in ("MuJoCo RK4, 2048 steps (dt 0.0024 s), 3 ms", "tmt dopri8, 4 ms", "1e-06 rad")
        )


def test_limits_are_counted_and_drawn_where_they_are_predicted_and_observed():
    row = STEP | {"damping": 0.5}
    curves = {"looked at": {"centres": ("s",)}, "schemes": {("tmt", "rk4"): "rk4", ("mujoco", "RK4"): "rk4"}}
    mujoco = row | {"engine": "mujoco", "method": "RK4", "observed_dt_s": 0.0995}
    result = Result("stability", rows=[row, mujoco, row | {"scene": "saddle"}], curves=curves)
    found = methods_compared.limits_found(result)
    assert found[0] == Limit("rk4", "tmt", "s", 0.5, "finite", 0.1, 0.1001, True) and len(found) == 2
    said = methods_compared.limits_at_a_glance(found)
    assert said.startswith("2 ") and " 0.5 %" in said
    result.check("s, TMT rk4, damping 0.5", "growth in 8 steps", 2.0, 1.0, "")  # of something else
    assert all(one.passed for one in methods_compared.limits_found(result))
    result.check("s, MuJoCo RK4, damping 0.5", "limit, observed / predicted - 1", 2.0, 1.0, "")
    found = methods_compared.limits_found(result)
    assert "1 of 2" in methods_compared.limits_at_a_glance(found) and "1 of 2" in one_number(
        Section("stability", "", "", "", result)
    )
    drawn = marks("stability", result)
    assert {("o", to_hex(BLUE), 0.1001), ("X", to_hex(RED), 0.0995)} <= drawn
