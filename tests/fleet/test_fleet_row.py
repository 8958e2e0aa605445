"""The row of a file: its verdict and reason, the largest share of a tolerance, its own step; and which row comes first."""

import itertools

import pytest

from compare.fleet.row import AGREE, BROKE, DIFFER, FLEET_COLUMNS, ITSELF, REFUSED, UNCONFIRMED, order, row_of_file
from compare.judge.check import AT_OWN_STEP, ENDS, About, Result
from compare.reference import Reference
from compare.report.verdict import Section

CAUSES = [{"text": "mass of upper: stated 1 kg, compiled 2 kg"}, {"text": "another"}]


def sections(*checks, limits=()):
    """One section with checks: (quantity, value, tolerance, note, rule, about); all of rounding but those of other rules."""
    result = Result("stability", tables={"step_limits": list(limits)})
    for quantity, value, tolerance, note, rule, about in checks:
        result.check(
            "home", quantity, value, tolerance, "s", note, about == About.MODELS and rule == "at most", rule, about
        )
    return [Section("stability", "", "", "", result)]


def good(share=0.5):
    return "M", share, 1.0, "", "at most", About.MODELS


def broke(quantity=ENDS):
    return quantity, None, 0.0, "ended by SIGKILL, 4 times", "equal", About.PROGRAM


def unstable(dt=0.002, limit=0.001):
    return AT_OWN_STEP, dt, limit, "with Euler", "at most", About.STEP


def limit(dt, stable, integrator="Euler", base="fixed", kind="finite"):
    return {"integrator": integrator, "file_integrator": "Euler", "base": base, "limit": kind, "predicted_dt_s": dt,
            "stable_at_file_dt": stable}  # fmt: skip


STATED = Reference("arm", "a.xml")


def verdict(*arguments, causes=(), lost=(), reference=STATED, **more):
    row = row_of_file(sections(*arguments, **more), causes, lost, reference)
    return row["verdict"], row["reason"]


def test_a_file_agrees_differs_breaks_off_or_is_refused():
    assert verdict(good(1.0)) == (AGREE, "")
    assert verdict(good(1.0 + 1e-9), causes=CAUSES) == (DIFFER, f"{CAUSES[0]['text']}, and 1 more")
    assert verdict(good(2.0)) == (DIFFER, "stability: M, home: 2 s, must be at most 1 s")
    assert verdict(good(), broke()) == (BROKE, "stability ended by SIGKILL, 4 times")
    assert verdict(good(), broke("figure a is drawn")) == (
        BROKE,
        "stability: figure a is drawn: ended by SIGKILL, 4 times",
    )
    assert verdict(good(), lost=["the table could not be made"]) == (BROKE, "the table could not be made")
    off = "limit, observed / predicted - 1", 0.01, 0.001, "", "at most", About.PREDICTION
    assert verdict(good(), off)[0] == UNCONFIRMED and "one prediction is not confirmed" in verdict(good(), off)[1]
    assert verdict(good(), off, unstable())[1].endswith("the limit is 1 ms with Euler")
    assert [verdict(good(), off, one)[0] for one in (good(2.0), broke())] == [DIFFER, BROKE]
    assert verdict() == (REFUSED, "nothing could be compared")


def test_what_differs_weighs_more_than_what_breaks_and_that_more_than_a_step():
    assert verdict(good(2.0), broke(), unstable(), causes=CAUSES)[0] == DIFFER
    assert verdict(good(), broke(), unstable())[0] == BROKE


def test_a_file_whose_own_step_is_not_stable_agrees_and_says_where_the_limit_is():
    said = "not stable at its own step of 2 ms at home: the limit is 1 ms with Euler"
    assert verdict(good(), unstable()) == (AGREE, said)
    assert verdict(good(), unstable(0.001)) == (AGREE, "")


def test_only_what_is_compared_with_stated_numbers_agrees():
    verdicts = [verdict(good(), reference=Reference(kind, "a.xml"))[0] for kind in ("arm", "solution", "model")]
    assert verdicts == [AGREE, AGREE, ITSELF]
    assert verdict(good(2.0), reference=Reference("model", "a.xml"))[0] == DIFFER
    renamed = Reference("arm", "a.xml", renamed=("wrist as hand",))
    assert verdict(good(), reference=renamed) == (AGREE, "joints matched: wrist as hand")
    assert verdict(good(2.0), causes=CAUSES[:1], reference=renamed)[1].endswith("2 kg; joints matched: wrist as hand")


def test_the_largest_share_is_of_all_checks_of_rounding_also_where_one_fails():
    row = row_of_file(sections(good(0.2), good(3.0), unstable(9.0)), CAUSES, [], STATED)
    assert row["worst_ratio"] == 3.0
    diverged = row_of_file(sections(good(0.2), ("M", None, 1.0, "", "at most", About.MODELS)), [], [], STATED)
    assert (diverged["verdict"], diverged["worst_ratio"]) == (DIFFER, 0.2)
    assert row_of_file(sections(broke()), [], [], STATED)["worst_ratio"] is None


@pytest.mark.parametrize("limits, stable, least", [
    ([], None, None),
    ([limit(0.004, True), limit(0.003, True)], True, 0.003),
    ([limit(0.004, True), limit(0.001, False)], False, 0.001),
    ([limit(0.004, True), limit(0.001, None)], True, 0.001),  # at one posture it is not known
    ([limit(0.004, None)], None, 0.004),
    ([limit(0.004, True), limit(0.001, False, integrator="RK4")], True, 0.004),  # another integrator
    ([limit(0.004, True, base="free"), limit(0.001, False, base="locked")], True, 0.004),  # that is no base of its own
    ([limit(None, True, kind="always stable"), limit(None, None, kind="saddle")], True, None),
])  # fmt: skip
def test_the_own_step_is_that_of_the_own_integrator_at_all_postures(limits, stable, least):
    row = row_of_file(sections(good(), limits=limits), [], [], STATED)
    assert (row["stable_at_file_dt"], row["limit_s"]) == (stable, least)


def test_what_needs_a_look_comes_first():
    def row(verdict, stable, ratio, file="a"):
        return {"verdict": verdict, "stable_at_file_dt": stable, "worst_ratio": ratio, "file": file}

    right = [
        row(DIFFER, None, 1e9), row(DIFFER, True, 2.0), row(BROKE, None, None), row(UNCONFIRMED, None, 0.5),
        row(REFUSED, None, None), row(ITSELF, False, 0.1), row(ITSELF, True, 0.9),
        row(AGREE, False, 0.1), row(AGREE, None, 0.9), row(AGREE, True, 0.9, "b"), row(AGREE, True, 0.0, "c"),
        row(AGREE, None, None, "d"),
    ]  # fmt: skip
    for mixed in itertools.islice(itertools.permutations(right), 0, None, 9973):
        assert sorted(mixed, key=order) == right


def test_the_columns_are_those_that_are_promised():
    assert ",".join(FLEET_COLUMNS) == (
        "file,sha256,verdict,reason,joints,worst_ratio,file_integrator,file_dt_s,stable_at_file_dt,limit_s,seconds"
    )
