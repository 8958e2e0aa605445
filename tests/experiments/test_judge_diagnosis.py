"""`compare diagnosis`: a file or one's own equations beside the reference, and its place beside other experiments."""

import pytest
from helpers.edited import XML, setup_of
from helpers.in_process import InProcess, Lines

from compare.core.check import Result
from compare.core.text import say
from compare.experiments import diagnosis, parameters
from compare.judge.scale import EPS, FACTOR
from compare.run import examine as experiment

HEAVY = XML.replace('mass="1.5"', 'mass="1.51"')


def failed(result):
    return [check for check in result.checks if not check.passed]


def test_the_arm_has_nothing_to_explain(monkeypatch):
    setup = setup_of()
    result = diagnosis.rows(setup)
    assert failed(result) == [] and result.rows == [] and result.causes == []
    found = diagnosis.diagnosed(setup)  # a ratio of 1 is allowed
    for k in range(2):  # of M and h, of the force left over
        for ratio, passes in ((1.0, True), (1.001, False)):
            why = found.why._replace(force_ratio=ratio) if k else found.why
            at_limit = found._replace(why=why) if k else found._replace(ratio=ratio)
            monkeypatch.setattr(diagnosis, "diagnosed", lambda setup, at_limit=at_limit: at_limit)
            noted = diagnosis.rows(setup)
            assert noted.checks[k].passed is passes
            assert [note.kind == "nothing" for note in noted.notes] == [passes]
    assert found._replace(ratio=1e3).share == 1e3 * FACTOR * EPS


def test_a_cause_is_a_row_and_a_note_of_the_check_that_fails():
    result = diagnosis.rows(setup_of(HEAVY))
    (row,), (check,) = result.rows, failed(result)
    assert row.explains == pytest.approx(1.51, rel=1e-12) and row.left_over < 1e-9
    stated = {"rank": 2, "kind": "number", "place": "mass of forearm", "stated": 1.5, "unit": "kg", "tied": 0}
    assert row.record().items() >= stated.items()
    assert "mass of forearm" in check.note and "1.51 kg" in check.note
    assert list(map(say, result.notes)) == [check.note]
    assert not list(diagnosis.figures(result, None))  # the cause says it


@pytest.mark.parametrize("names, text, made, found", [
    (["mass", "diagnosis"], XML, ["mass"], []),  # nothing failed
    (["mass", "diagnosis"], HEAVY, ["mass", "diagnosis"], ["mass of forearm"]), (["diagnosis"], XML, ["diagnosis"], []),
])  # fmt: skip
def test_beside_others_it_is_made_where_one_fails(names, text, made, found, tmp_path, monkeypatch):
    # not by parameters, but in the values
    monkeypatch.setattr(parameters, "rows", lambda setup: Result("parameters"))
    setup = setup_of(text, make=experiment.Setup, states=20, exact_states=1, size="small")
    run = experiment.Run(names, setup, tmp_path, Lines(), InProcess()).examined()
    assert [section.name for section in run.sections] == made
    assert list(run.needless) == [name for name in names if name not in made]
    assert [cause.place for cause in run.causes] == found
