"""The row of a file: its verdict, its share of a tolerance, its own step; which comes first, and what changed since before."""

import random

import pytest

from compare.fleet.piece import FleetError
from compare.fleet.row import AGREE, BROKE, DIFFER, FLEET_COLUMNS, ITSELF, REFUSED, UNCONFIRMED, order, row_of_file
from compare.fleet.since import changes, earlier
from compare.fleet.table import csv_of_fleet
from compare.judge.check import AT_OWN_STEP, ENDS, About, Result
from compare.reference import Reference
from compare.report.verdict import Section

CAUSES = [{"text": "mass of upper: stated 1 kg, compiled 2 kg"}, {"text": "another"}]
STATED = Reference("arm", "a.xml")
BROKEN = ENDS, None, 0.0, "ended by SIGKILL, 4 times", "equal", About.PROGRAM
OFF = "limit, observed / predicted - 1", 0.01, 0.001, "", "at most", About.PREDICTION


def good(share=0.5):
    return "M", share, 1.0, "", "at most", About.MODELS


def own(dt=0.002, limit=0.001):
    return AT_OWN_STEP, dt, limit, "with Euler", "at most", About.STEP


def row_of(*checks, limits=(), causes=(), lost=(), reference=STATED):
    """The row of one section with checks: (quantity, value, tolerance, note, rule, about)."""
    result = Result("stability", tables={"step_limits": list(limits)})
    for quantity, value, tolerance, note, rule, about in checks:
        result.check("home", quantity, value, tolerance, "s", note, about == About.MODELS, rule, about)
    return row_of_file([Section("stability", "", "", "", result)], causes, lost, reference)


@pytest.mark.parametrize("verdict, checks, more, named", [
    (AGREE, [good(1.0)], {}, ""),
    (AGREE, [good(1.0), own(0.001)], {}, ""),
    (AGREE, [good(), own()], {}, "2 ms"),  # its own step is not stable: the reason says so
    (AGREE, [good()], {"reference": Reference("solution", "a.xml")}, ""),
    (AGREE, [good()], {"reference": Reference("arm", "a.xml", renamed=("wrist as hand",))}, "wrist as hand"),
    (ITSELF, [good()], {"reference": Reference("model", "a.xml")}, ""),
    (DIFFER, [good(2.0)], {"reference": Reference("model", "a.xml")}, "2 s"),
    (DIFFER, [good(1.0 + 1e-9)], {"causes": CAUSES}, "mass of upper"),
    (DIFFER, [good(2.0), BROKEN, own(), OFF], {"causes": CAUSES}, "mass of upper"),
    (BROKE, [good(), BROKEN, own(), OFF], {}, "SIGKILL, 4 times"),
    (BROKE, [good(), ("figure a is drawn", *BROKEN[1:])], {}, "figure a is drawn"),
    (BROKE, [good()], {"lost": ["the table"]}, "the table"),
    (UNCONFIRMED, [good(), OFF, own()], {}, "0.01"),
    (REFUSED, [], {}, ""),
])  # fmt: skip
def test_a_file_agrees_differs_breaks_off_or_is_refused(verdict, checks, more, named):
    row = row_of(*checks, **more)
    assert row["verdict"] == verdict and named in row["reason"]
    assert bool(named) == bool(row["reason"]) or verdict == REFUSED


def test_the_largest_share_is_of_all_checks_of_rounding_also_where_one_fails():
    assert row_of(good(0.2), good(3.0), own(9.0))["worst_ratio"] == 3.0
    diverged = row_of(good(0.2), ("M", None, 1.0, "", "at most", About.MODELS))
    assert (diverged["verdict"], diverged["worst_ratio"]) == (DIFFER, 0.2)
    assert row_of(BROKEN)["worst_ratio"] is None


def limit(dt, stable, integrator="Euler", base="fixed", kind="finite"):
    return {"integrator": integrator, "file_integrator": "Euler", "base": base, "limit": kind, "predicted_dt_s": dt,
            "stable_at_file_dt": stable}  # fmt: skip


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
    row = row_of(good(), limits=limits)
    assert (row["stable_at_file_dt"], row["limit_s"]) == (stable, least)


def test_what_needs_a_look_comes_first():
    right = [
        (DIFFER, None, 1e9, "a"), (DIFFER, True, 2.0, "a"), (BROKE, None, None, "a"), (UNCONFIRMED, None, 0.5, "a"),
        (REFUSED, None, None, "a"), (ITSELF, False, 0.1, "a"), (ITSELF, True, 0.9, "a"), (AGREE, False, 0.1, "a"),
        (AGREE, None, 0.9, "a"), (AGREE, True, 0.9, "b"), (AGREE, True, 0.0, "c"), (AGREE, None, None, "d"),
    ]  # fmt: skip
    rows = [dict(zip(("verdict", "stable_at_file_dt", "worst_ratio", "file"), row)) for row in right]
    for seed in range(20):
        assert sorted(random.Random(seed).sample(rows, len(rows)), key=order) == rows


# what has changed since an earlier fleet

ROW = {
    "file": "a b.xml", "sha256": "1", "verdict": AGREE, "reason": "", "joints": 3, "worst_ratio": 0.1,
    "file_integrator": "Euler", "file_dt_s": 0.002, "stable_at_file_dt": True, "limit_s": 0.01, "seconds": 1.0,
}  # fmt: skip


@pytest.mark.parametrize("before, now, named", [
    ({}, {"seconds": 99.0, "worst_ratio": 0.9, "sha256": "2", "reason": "other"}, None),
    ({}, {"verdict": DIFFER, "reason": "mass of x"}, ["agree", "differ", "mass of x"]),
    ({"verdict": DIFFER}, {}, ["differ", "agree"]),
    ({}, {"stable_at_file_dt": False}, [""]),
    ({"stable_at_file_dt": None}, {"stable_at_file_dt": False}, [""]),
    ({}, {"limit_s": 0.010099}, None),
    ({}, {"limit_s": 0.009901}, None),
    ({}, {"limit_s": 0.010101}, ["10 ms", "10.1 ms"]),
    ({}, {"limit_s": 0.009899}, ["10 ms", "9.899 ms"]),
    ({"limit_s": None}, {}, ["none", "10 ms"]),
    ({"limit_s": None}, {"limit_s": None}, None),
    ({"limit_s": 0.0}, {"limit_s": 0.0}, None),
    ({"limit_s": 0.0}, {}, [" 0 ms", "10 ms"]),
    ({}, {"verdict": BROKE, "limit_s": 1.0, "sha256": "2"}, ["agree", "broke", "10 ms", "1000 ms"]),
    ({}, {"file": "new.xml", "verdict": REFUSED}, ["new.xml", "refused", "a b.xml", "agree"]),  # and one is gone
])  # fmt: skip
def test_a_verdict_a_step_or_a_limit_that_is_another_is_told(before, now, named, tmp_path):
    (tmp_path / "fleet.csv").write_text(csv_of_fleet([ROW | before]), encoding="utf-8")
    found = changes(earlier(tmp_path), [ROW | now])
    places = [" ".join(found).index(name) for name in named or ()]
    assert bool(found) == bool(named) and places == sorted(places)


@pytest.mark.parametrize("content", [
    None, b"a,b\n1,2\n", b"", b"\xff\xfe\x00", (",".join(FLEET_COLUMNS) + "\na,1,agree,,1,1,Euler,1,true,soon,1\n").encode(),
])  # fmt: skip
def test_what_is_no_earlier_fleet_is_refused_in_one_line(content, tmp_path):
    if content is not None:
        (tmp_path / "fleet.csv").write_bytes(content)
    with pytest.raises(FleetError, match=r"fleet\.csv") as refused:
        earlier(tmp_path)
    assert len(str(refused.value).splitlines()) == 1
