"""Names and numbers as parts of sentences."""

from compare.core.words import listed, milliseconds, scene_of, some_of


def test_a_check_belongs_to_the_scene_of_the_longest_name():
    names = ["bent", "bent, free", "bent, freely", "free"]
    assert scene_of("bent, free, RK4, dt = 5/64 s", names) == scene_of("bent, free", names) == "bent, free"
    assert scene_of("bent, RK4", names) == "bent" and scene_of("bending, RK4", names) is None


def test_a_time_near_another_has_as_many_digits_as_tell_them_apart():
    limit, step = 2.0149e-3, 2.0e-3
    assert milliseconds(limit) == milliseconds(step) == "2 ms"
    assert (milliseconds(limit, step), milliseconds(step, limit)) == ("2.015 ms", "2 ms")
    assert milliseconds(2.2049e-3, step) == "2.2 ms"


def test_lists_of_many_words_are_cut():
    assert [listed([*"abc"[:n]]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert some_of([*"abcdefg"]) == "a, b, c, d, e, f and 1 more" and some_of([*"abc"]) == "a, b and c"
