"""What is concluded from errors: every rule with a row just inside and one just outside."""

from functools import partial

import numpy as np
import pytest
from judged import BOTH
from speed_rows import SCHEMES, known_rows, row

from compare.experiments.speed import accuracy
from compare.judge.check import Result
from compare.robots.arm import ARM

BENT = {"bent, free": 64}


def judged(check, rows, *arguments):
    """(quantity, passed) of each check that is made of rows."""
    result = Result("speed", rows=rows)
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


same_schemes = partial(judged, accuracy.check_same_schemes)
smallest_errors = partial(judged, accuracy.check_smallest_errors)


@pytest.mark.parametrize(
    "ours, theirs, verdict",
    [
        (1e-3, 1e-3 + 63e-10, True),
        (1e-3, 1e-3 + 65e-10, False),
        (1e-3, 1e-3 - 65e-10, False),
        (1e-3, None, False),
        (None, 1e-3, False),
        (0.0999, 0.2, False),
        (0.2, 0.0999, False),
        (0.1001, 0.2, None),
        (None, 0.2, None),
        (None, None, None),
    ],
)
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs), row("tmt", "rk4", 1.0, 128)]
    found = same_schemes(rows, {"bent, free": 1e-10}, {"bent, free": SCHEMES})
    assert found == ({} if verdict is None else {"the same error as tmt's rk4": verdict})


def test_where_tmt_took_no_step_as_coarse_nothing_is_compared():
    quantity = "smallest error of MuJoCo's RK4, beside that of tmt's rk4"
    theirs = [row("mujoco", "RK4", 1e-3, 64), row("mujoco", "RK4", 1e-5, 128)]
    assert smallest_errors(theirs, {"bent, free": 1e-16}) == {}
    assert smallest_errors([*theirs, row("tmt", "rk4", 1e-9, 1024)], {"bent, free": 1e-16}) == {}
    assert smallest_errors([*theirs, row("tmt", "rk4", None, 128)], {"bent, free": 1e-16}) == {quantity: False}


@pytest.mark.parametrize("left, passes", [(1e-14, True), (0.9e-14, True), (0.99e-14 / 64 / 2, False)])
def test_errors_that_have_stopped_are_of_the_size_of_rounding(left, passes):
    stops = [1e-6, 1e-14, 2e-14]  # 64 of the rounding, at least, where the last is not the least
    rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate(stops)]
    rows += [row("tmt", "rk4", e, 64 << k) for k, e in enumerate([1e-6, 1e-14])]
    found = smallest_errors(rows, {"bent, free": left})
    assert found.pop("smallest error of mujoco's RK4, where smaller steps gain nothing") is passes
    assert list(found) == ["smallest error of MuJoCo's RK4, beside that of tmt's rk4"]


def test_the_factor_of_rounding_is_64():
    for error, passes in ((63e-14, True), (65e-14, False)):
        rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate([error, 1.0])]
        found = smallest_errors([*rows, row("tmt", "rk4", error)], {"bent, free": 1e-14})
        assert found["smallest error of mujoco's RK4, where smaller steps gain nothing"] is passes


@pytest.mark.parametrize(
    "ours, theirs, passes",
    [(1e-9, 2e-9 + 63e-14, True), (1e-9, 2e-9 + 65e-14, False), (1e-9, None, False), (None, 63e-14, True), (None, 65e-14, False)],
)  # fmt: skip
def test_mujoco_comes_as_near_as_tmt(ours, theirs, passes):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs)]
    found = smallest_errors(rows, {"bent, free": 1e-14})
    assert found == {"smallest error of MuJoCo's RK4, beside that of tmt's rk4": passes}


@pytest.mark.parametrize(
    "nearest, found", [(256, {}), (64, {"smallest error of MuJoCo's RK4, beside that of tmt's rk4": False})]
)
def test_where_both_diverge_with_all_of_mujocos_steps_nothing_is_compared(nearest, found):
    rows = [row("mujoco", "RK4", None, steps) for steps in (64, 128)]
    rows += [row("tmt", "rk4", 1e-9 / steps if steps >= nearest else None, steps) for steps in (64, 128, 256)]
    assert smallest_errors(rows, {"bent, free": 1e-14}) == found


@BOTH
def test_where_mujocos_steps_end_before_its_errors_stop_tmts_are_no_finer(share, passes):
    errors = [1e-6, 1e-7, 1e-8]
    rows = [row("tmt", "rk4", e, 64 << k) for k, e in enumerate(errors)]
    ends = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate([1e-6, share * 2e-7])]
    quantity = "smallest error of MuJoCo's RK4, beside that of tmt's rk4"
    assert smallest_errors([*ends, *rows], {"bent, free": 1e-20})[quantity] is passes
    # where finer steps have gained nothing, more of them would not have either
    stops = [*ends, row("mujoco", "RK4", 1e-6, 256)]
    assert not smallest_errors([*stops, *rows], {"bent, free": 1e-20})[quantity]


@pytest.mark.parametrize(
    "found, work, best, last, ends",
    [
        (0.71e-14, 121, 1e-14, 100, True),
        (0.69e-14, 121, 1e-14, 100, False),
        (0.71e-14, 119, 1e-14, 100, False),
        (29e-15, 200, 29e-15, 100, True),
        (31e-15, 200, 31e-15, 100, False),
        (np.inf, 200, 1e-15, 100, True),
        (np.nan, 200, 1e-15, 100, True),
    ],
)
def test_a_series_ends_where_a_run_gains_nothing(found, work, best, last, ends):
    assert accuracy.gained_nothing(found, work, best, last, 1e-15) is ends


def test_the_true_error_is_that_of_rk4_with_the_coarsest_steps():
    rows = [row("tmt", "rk4", 1.5), row("mujoco", "RK4", 1.6), row("tmt", "rk4", 1e-3, 128), row("tmt", "dopri8", 1e-6)]
    rows += [row("tmt", "rk4", 0.02, scene="bent, damped"), row("mujoco", "RK4", None, scene="bent, damped")]
    steps = BENT | {"bent, damped": 64}
    assert accuracy.true_error(rows, steps) == {"bent, free": (1.5, 1.6), "bent, damped": (0.02, None)}
    assert accuracy.true_error(rows, {"bent, free": 128}) == {"bent, free": (1e-3, None)}
    assert accuracy.true_error([], BENT) == {} and accuracy.true_errors_in_words([], BENT, ARM) == []


@pytest.mark.parametrize(
    "ours, theirs, says",
    [
        (1.5, 1.501, "bent, free: TMT 1.5 rad, MuJoCo 1.5 rad. bent, free: both engines make this error"),
        (1.5, 1.6, "bent, free: TMT 1.5 rad, MuJoCo 1.6 rad. bent, free: the errors are not the same"),
        (0.099, 0.099, "MuJoCo 0.099 rad."),
        (0.099, None, "MuJoCo no number. bent, free: the errors are not the same"),
    ],
)
def test_the_true_error_in_words(ours, theirs, says):
    (words,) = accuracy.true_errors_in_words([row("tmt", "rk4", ours), row("mujoco", "RK4", theirs)], BENT, ARM)
    assert says in words and ("rad. bent" in words or "number. bent" in words) == ("not" in says or "both" in says)
    assert words.startswith("At the assignment's step, 64 steps of RK4, ")


def test_only_the_arms_own_step_is_the_assignments():
    rows = [row("tmt", "rk4", 1e-3), row("mujoco", "RK4", 1e-3)]
    rows += [row("tmt", "rk4", 1e-6, 128, scene="mine"), row("mujoco", "RK4", 1e-6, 128, scene="mine")]
    rows += [row("heyoka", "Taylor", 1e-6, 64, dt_s=None)]  # it chose as many steps by itself
    rows += [row(*of, 1e-6, dt_s=1 / 64, scene="short") for of in (("tmt", "rk4"), ("mujoco", "RK4"))]
    own, mine, short = accuracy.true_errors_in_words(rows, BENT | {"mine": 128, "short": 64}, ARM)
    assert own.startswith("At the assignment's step, 64 steps of RK4, ") and "mine" not in own
    assert mine.startswith("At the coarsest step, 128 steps of RK4, ") and "bent" not in mine
    assert short.startswith("At the coarsest step, 64 steps of RK4, ") and "bent" not in short


def test_sentences_of_first_order_and_smaller_models():
    rows = known_rows()
    assert (
        "bent, free: 3.1e-02 rad in 64 ms (Euler, 1024 steps)" in accuracy.first_order_in_words(rows, ["bent, free"])[0]
    )
    assert accuracy.first_order_in_words([], ["bent, free"]) == []
    smaller = row("tmt", "rk4", 1e-3, 64, 0.5e-3, scene="bent, free, beta locked", whole="bent, free")
    (words,) = accuracy.smaller_models_in_words([*rows, smaller])
    assert (
        "(tmt rk4, 64 steps): the whole model takes 2.00 times as long; 1.00e-03 rad off where that is 2.00e-02"
        in words
    )
    another = row("tmt", "rk4", 1e-3, 64, 0.5e-3, scene="bent, free, my own")  # a scene that is only called so
    assert accuracy.smaller_models_in_words([*rows, another]) == []
    floors = {"bent, free": 1e-14}
    assert "Of the curves of all methods 1 comes to within 30 times of it; in 0 of these" in accuracy.floors_in_words(
        rows, floors)[0]  # fmt: skip


def test_a_reference_of_few_digits_is_named(known_reference):
    for apart, named in ((0.99e-14, False), (1e-14, True), (1e-9, True)):
        known = {"bent, free": known_reference._replace(apart=apart)}
        _, *words = accuracy.references_in_words(known, {"bent, free": max(1e-14, apart)})
        assert bool(words) is named and all("known to no more than" in text for text in words)


def test_digits_of_the_reference_are_growth_times_1e_30(known_reference):
    floors = {"bent, free": 2.0**-52 * 1e4}
    for apart, said in ((0.99e-26, "They differ by no more."), (1.01e-26, "by more than that in bent, free.")):
        known = {"bent, free": known_reference._replace(apart=apart, steps=77)}
        (words,) = accuracy.references_in_words(known, floors)
        assert f"bent, free: 1e-26 ({apart:.0e}, 77 steps)" in words and words.endswith(said)
