"""Runs with many digits: the committed table, those that are made for other numbers, and how they are kept."""

import csv
from decimal import Decimal

import numpy as np
import pytest

import tmt
from compare.experiments.speed import remake
from compare.experiments.speed.settings import scenes_of
from compare.robots.arm import ARM
from compare.truth import reference
from tmt import reference_run

CASES = {case.name: case for case in scenes_of(ARM)}
BENT = CASES["bent, free"]
SHORT = BENT.changed(name="short", duration=0.02, dt=0.005)


def test_the_committed_table_is_of_the_stated_numbers():
    rows = reference.read_table(reference.TABLE)
    assert len(CASES) == 4 and {reference.key(case) for case in CASES.values()} == set(rows)
    assert all(float(of_scene[0]["halving_difference"]) < reference.SMALL_ENOUGH for of_scene in rows.values())
    for name, case in CASES.items():
        assert np.array_equal(reference.committed(case).high[0], np.concatenate(case.start)), name
        assert reference.columns(case) == [name for name in rows[reference.key(case)][0] if name not in reference.ABOUT]
    assert reference.committed(SHORT) is None


@pytest.mark.parametrize("name", CASES)
def test_a_record_is_computed_from_the_one_before(name):
    """With half as many steps as its command takes; the table has 32 digits. In seconds, where the whole takes minutes."""
    case = CASES[name]
    rows, n = reference.read_table(reference.TABLE)[reference.key(case)], len(case.joints)
    with reference_run.localcontext() as context:
        context.prec = reference_run.DIGITS
        exact = np.array([[Decimal(row[column]) for column in reference.columns(case)] for row in rows])
        traced, torque = reference_run.slope(case.tree), [Decimal(v) for v in case.tau.tolist()]
        count = int(rows[0]["steps"]) // reference.RECORDS // 2
        dt = Decimal(case.duration) / reference.RECORDS / count
        for record in (0, 40):
            state = exact[record]
            for _ in range(count):
                rate = lambda state: np.array(traced(state[:n], state[n:], torque))  # noqa: E731
                state = reference_run.extrapolated(rate, state, dt)
            assert np.abs(state - exact[record + 1]).max() < 1e-21, record
    assert exact[0].astype(float).tolist() == np.concatenate(case.start).tolist()


def test_only_a_whole_run_of_the_scene_is_a_reference(tmp_path):
    rows = reference.read_table(reference.TABLE)[reference.key(BENT)]
    assert reference.whole(rows) and reference.begins(rows, BENT)
    assert not reference.whole(rows[:-1])
    for wrong in ("nan", "Infinity", "", "x", None):
        assert not reference.whole([rows[0] | {"beta_rad": wrong}, *rows[1:]]), wrong
    assert not reference.begins([rows[0] | {"beta_rad": "0.1"}, *rows[1:]], BENT)
    assert not reference.begins([*rows[:-1], rows[-1] | {"t_s": "4.9"}], BENT)
    assert not reference.begins([{k: v for k, v in row.items() if k != "beta_rad"} for row in rows], BENT)
    for text in ("", "\0", "no,table\n1,2\n", "key\n\n"):
        path = tmp_path / "reference.csv"
        path.write_text(text, encoding="utf-8")
        assert reference.read_table(path) == {}


def test_a_reference_is_more_than_a_double():
    """Its numbers are the table's, to 30 digits; an error is taken from both halves of them."""
    for rows in reference.read_table(reference.TABLE).values():
        known, names = reference.reference(rows), reference.columns(BENT)
        for row, high, low in zip(rows, known.high.tolist(), known.low.tolist()):
            for name, h, v in zip(names, high, low):
                assert abs(Decimal(row[name]) - Decimal(h) - Decimal(v)) <= abs(Decimal(row[name])) * Decimal("1e-30")
        assert 1e-18 < np.abs(known.low).max() < 1e-14
        everyone = range(3)
        assert np.array_equal(known.error(known.high[:, :3], everyone), np.abs(known.low[:, :3]).max(axis=1))
        assert known.error(known.high[:, :3] + known.low[:, :3], everyone).max() <= 1e-15
        off = known.high[:, [0, 2]] + [[0.0, 1e-3]]
        assert known.error(off, [0, 2]) == pytest.approx(1e-3) and known.error(off, [0, 1]).max() > 1e-2


def test_a_changed_scene_gets_a_reference_of_its_own(tmp_path, monkeypatch):
    path = tmt.simulate(*SHORT.start, SHORT.tau, 0.005, 4, "dopri8", SHORT.tree)[1]
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    monkeypatch.setattr(reference, "RECORDS", 4)
    others = [BENT.changed(**{name: value}) for name, value in (
        ("damping", 0.1), ("gravity", False), ("torque", (0, 0, 1)), ("speed", (0, 1, 0)), ("posture", (1, 2, 3)),
        ("locked", ("beta",)))]  # fmt: skip
    assert len({reference.key(case) for case in (BENT, SHORT, *others)}) == 8
    said = []
    first = reference.references([SHORT], progress=said.append)[SHORT.name]
    assert said == [f"runs with many digits: {k} of 2, {4 * k} steps" for k in (1, 2)] and first.halving < 1e-20
    assert first.error(path, range(3)).max() < 1e-13
    (kept,) = tmp_path.glob("reference_*.csv")
    again = reference.references([SHORT], progress=said.append)[SHORT.name]
    assert len(said) == 2 and np.array_equal(first.high, again.high)
    text = kept.read_text(encoding="utf-8")
    kept.write_text(text[:1000], encoding="utf-8")
    assert reference.read_table(kept) == {}  # damaged: as if it were not there
    planted = text.replace(next(csv.DictReader(text.splitlines()))["beta_rad"], "0.1")
    assert planted != text
    kept.write_text(planted, encoding="utf-8")  # a run of another start: made anew
    once_more = reference.references([SHORT], progress=said.append)[SHORT.name]
    assert len(said) == 4 and np.array_equal(first.high, once_more.high)

    def refuse(*_):
        raise RuntimeError("the folder is not the user's own")

    monkeypatch.setattr(reference, "cache_file", refuse)
    reference.references([SHORT], progress=said.append)
    assert len(said) == 6  # nothing is read there, and nothing written


def test_what_is_committed_is_not_computed():
    said = []
    known = reference.references(list(CASES.values()), progress=said.append)
    assert list(known) == list(CASES) and said == []


def test_a_scene_with_locked_joints_has_columns_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    monkeypatch.setattr(reference, "RECORDS", 4)
    swing = SHORT.changed(name="swing", locked=("alpha", "beta"))
    first, again = (reference.references([swing], progress=lambda text: None)["swing"] for _ in range(2))
    assert first.high.shape == (5, 2) and np.array_equal(first.low, again.low)
    (kept,) = tmp_path.glob("reference_*.csv")
    assert (
        kept.read_text(encoding="utf-8").splitlines()[0]
        == "scene,key,steps,halving_difference,t_s,gamma_rad,gamma_rad_per_s"
    )


# how many steps


def counts(differences, case=BENT):
    """The numbers of steps of runs that differ by so much from the one before, as long as there is a next one."""
    runs, left = [], iter(differences)
    while asked := reference.next_counts(case, runs):
        for count in asked:
            before = runs[-1][1] if runs else np.zeros(1)
            runs.append((count, before + next(left) if runs else before))
    return [count for count, _ in runs]


def test_steps_are_doubled_until_that_changes_nothing_of_importance():
    assert counts([1.99e-22]) == [256, 512]
    assert counts([2.01e-22, 1.99e-22]) == [256, 512, 1024]
    assert counts([1.0, 1.0, 1.0]) == [256, 512, 1024, 2048]  # no more
    ten, short, shorter = (BENT.changed(duration=d, dt=d / 64) for d in (10.0, 0.25, 0.02))
    assert counts([1.0, 1.0, 1.0], ten) == [512, 1024, 2048, 4096]
    assert counts([1.0, 1.0, 1.0], short) == counts([1.0, 1.0, 1.0], shorter) == [64, 128, 256, 512]


def test_the_committed_runs_have_the_steps_of_this_rule():
    for case in CASES.values():
        known = reference.committed(case)
        assert known.steps in (512, 1024, 2048) and known.halving <= reference.SMALL_ENOUGH


def test_a_run_that_does_not_reach_its_end_is_none_and_says_so_in_one_line():
    fast = SHORT.changed(name="fast", speed=(1e8, -1e8, 1e8))
    assert reference.path_with_many_digits((fast, 64, 64)) is None
    with pytest.raises(
        ValueError, match=r"scene 'fast': runs with many digits and up to 512 steps do not reach"
    ) as error:
        reference.references([fast], progress=lambda text: None)
    assert "\n" not in str(error.value)
    assert reference.halving([(64, None), (128, np.zeros(1))]) == np.inf  # a coarse one may fail: finer ones are tried
    assert reference.next_counts(fast, [(64, None), (128, np.zeros(1))]) == [256]


def test_the_command_remakes_the_table(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(reference, "TABLE", tmp_path / "reference.csv")
    monkeypatch.setattr(reference, "RECORDS", 8)
    remake.main([SHORT])
    (rows,) = reference.read_table(reference.TABLE).values()
    assert reference.begins(rows, SHORT) and float(rows[0]["halving_difference"]) < 1e-28
    printed = capsys.readouterr()
    assert printed.out.startswith("short: 16 steps, ") and "digits: 2 of 2" in printed.err
