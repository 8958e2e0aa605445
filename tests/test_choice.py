"""Who answers: the least total of getting a form and of the evaluations."""

from tmt import choice
from tmt.choice import Form, chosen

LITERAL, LOOP, STRAIGHT = Form("literal", 0.0, 1e-3), Form("loop", 1.0, 1e-6), Form("straight_line", 3.0, 1e-7)
FORMS = [LITERAL, LOOP, STRAIGHT]


def test_a_short_question_waits_for_no_compiler_and_a_long_one_gets_the_fastest_code():
    assert chosen(FORMS, 1) is chosen(FORMS, 900) is LITERAL
    assert chosen(FORMS, 1100) is chosen(FORMS, 2e6) is LOOP
    assert chosen(FORMS, 2.3e6) is STRAIGHT


def test_code_is_got_when_what_it_would_have_saved_is_what_it_costs():
    """Just before and just after: 1 s is saved by 1 / (1e-3 - 1e-6) evaluations."""
    even = 1.0 / (LITERAL.each - LOOP.each)
    assert chosen(FORMS, 1, even - 2) is LITERAL and chosen(FORMS, 1, even) is LOOP


def test_what_is_there_already_answers_unless_other_code_pays():
    there = LOOP._replace(getting=0.0)
    assert chosen([LITERAL, there, STRAIGHT], 1) is there
    even = 3.0 / (LOOP.each - STRAIGHT.each)
    assert chosen([LITERAL, there, STRAIGHT], even - 1) is there
    assert chosen([LITERAL, there, STRAIGHT], even + 1) is STRAIGHT
    assert chosen([there, STRAIGHT._replace(getting=0.0)], 1).name == "straight_line"


def test_of_equals_the_first_answers():
    assert chosen([LITERAL, LITERAL._replace(name="loop")], 5) is LITERAL


def test_what_was_asked_is_counted_for_each_kind():
    key = ("a model of this test", "rk4")
    assert choice.asked(*key).count == 0.0
    choice.asked(*key).count += 5
    assert choice.asked(*key).count == 5 and choice.asked(key[0], "dopri8").count == 0.0


def test_more_lines_and_what_is_not_there_take_longer():
    assert choice.straight_line_getting(1000, kept=False) > choice.straight_line_getting(100, kept=False)
    assert choice.straight_line_getting(1000, kept=False, lanes=True) > choice.straight_line_getting(1000, kept=False)
    assert choice.straight_line_getting(1000, kept=True) < choice.straight_line_getting(1000, kept=True, traced=False)
    assert choice.loop_getting("run_tableau", kept=True) < choice.loop_getting("run_tableau", kept=False)
    assert choice.loop_getting("another", kept=False) == max(choice.LOOPS_COMPILED.values())
    for each in (choice.straight_line_each, choice.loop_each):
        assert 0.0 < each(7, lanes=True) < each(7) < each(700)
