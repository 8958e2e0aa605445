"""Code that is sent with a piece."""

from contextlib import closing

import pytest

from compare.fleet.piece import Piece, outcomes
from compare.fleet.pool import Pool
from compare.fleet.sent import sent_call

CODE = """
calls = []


def twice(x):
    calls.append(x)
    return len(calls), 2 * x
"""


def test_a_function_of_what_is_sent_answers_and_other_code_is_another_module():
    assert [sent_call(CODE, "twice", 3), sent_call(CODE, "twice", 4)] == [(1, 6), (2, 8)]
    assert sent_call(CODE.replace("2 * x", "3 * x"), "twice", 3) == (1, 9)
    with pytest.raises(AttributeError, match="thrice"):
        sent_call(CODE, "thrice", 3)


def test_it_is_carried_out_where_it_is_not_installed():
    with closing(Pool(1, 60.0)) as door:
        (found,) = outcomes(door, [Piece("a", sent_call, (CODE, "twice", 5))])
    assert found.returned == (1, 10)
