"""Where the time of the workers goes, and how long a fleet takes still."""

import pytest

from compare.fleet.times import Spent, in_percent, seconds_left, time_of_workers


def test_the_time_of_the_workers_is_computing_waiting_for_timings_or_neither():
    took = {"mass": [(2, 10.0), (3, 20.0)], "speed": [(2, 6.0)], "reduction": [(2, 4.0)]}
    spent = time_of_workers(took, 2, 32.0, times_alone=True)
    assert spent == pytest.approx((40.0 / 64.0, 10.0 / 64.0, 14.0 / 64.0))
    assert spent.words(2, 32.0) == (
        "Of 2 x 32 s 62 % were computing, 16 % were waiting while times were measured, 22 % were neither."
    )
    assert time_of_workers(took, 2, 32.0, times_alone=False) == pytest.approx((40.0 / 64.0, 0.0, 24.0 / 64.0))
    assert time_of_workers(took, 4, 20.0, times_alone=True) == pytest.approx((0.5, 30.0 / 80.0, 10.0 / 80.0))


def test_one_worker_waits_for_nobody_and_nothing_is_more_than_all():
    assert time_of_workers({"speed": [(1, 9.0)]}, 1, 10.0, True).words(1, 10.0) == (
        "Of 10 s 90 % were computing, 10 % were neither."
    )
    assert time_of_workers({"speed": [(1, 11.0)]}, 2, 10.0, True) == pytest.approx((0.55, 0.45, 0.0))
    assert time_of_workers({"mass": [(1, 50.0)]}, 2, 10.0, True) == (1.0, 0.0, 0.0)
    assert time_of_workers({}, 2, 10.0, True).words(2, 10.0) == "Of 2 x 10 s 100 % were neither."


@pytest.mark.parametrize(
    "parts", [(0.333, 0.333, 0.334), (0.005, 0.005, 0.99), (1.0, 0.0, 0.0), (0.7451, 0.2151, 0.0398)]
)
def test_percents_add_up_to_100(parts):
    found = in_percent(Spent(*parts))
    assert sum(found) == 100 and all(abs(a - 100.0 * b) < 1.0 for a, b in zip(found, parts, strict=True))


def test_what_is_left_is_what_the_same_kind_took_by_the_joints_of_the_robot():
    assert seconds_left({}, [("mass", 2)], 2, True) is None
    took = {"mass": [(7, 100.0), (7, 100.0)]}
    assert seconds_left(took, [], 2, True) == 0.0
    small, large = (seconds_left(took, [("mass", joints)], 1, True) for joints in (7, 27))
    assert small == pytest.approx(200.4 / 3) and large == pytest.approx(3.0 * small)
    assert seconds_left(took, [("mass", None)], 1, True) == small
    assert seconds_left(took, [("mass", 7)] * 4, 4, True) == pytest.approx(small)


def test_timed_pieces_come_one_after_the_other_or_beside_the_others():
    took, still = {"speed": [(7, 8.0)], "mass": [(7, 4.0)]}, [("speed", 7)] * 3 + [("mass", 7)] * 10
    timed, others = 24.0, 10 * 2.2 / 2
    assert seconds_left(took, still, 2, times_alone=True) == pytest.approx(timed + others)
    assert seconds_left(took, still, 2, times_alone=False) == pytest.approx(max(timed, others))


def test_one_piece_that_took_long_does_not_move_the_whole_far():
    still = [("stability", 7)] * 100
    before = seconds_left({"read": [(7, 0.1)]}, still, 2, True)
    assert seconds_left({"read": [(7, 0.1)], "stability": [(47, 15.0)]}, still, 2, True) == pytest.approx(before)
    assert seconds_left({"read": [(7, 0.1)], "stability": [(7, 6.0)]}, still, 2, True) < 2.0 * before
