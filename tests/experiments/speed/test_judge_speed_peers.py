"""Others beside tmt: timed where they take part, else a reason."""

import pytest
from speed_rows import NS

import tmt
from compare.experiment import Setup
from compare.experiments.speed import evaluations, peers
from compare.experiments.speed.peers import (
    ABA,
    ABA_OF_MANY,
    ABA_OF_NOTHING,
    BATCH,
    CALL,
    COMPILED,
    COMPILED_FAST,
    Peers,
)
from compare.experiments.speed.ways import FORWARD, IN_LANES, RK4_STEP
from compare.robots.arm import ARM


@pytest.fixture
def states(rng):
    return list(rng.uniform(-2.0, 2.0, (3, 40, 3)))


class Off:
    """A Pinocchio of other numbers at the last state, by so much."""

    def __init__(self, by):
        self.by, self.tree = by, ARM.tree

    def acceleration(self, q, v, tau):
        found = tmt.literal.acceleration(q, v, tau)
        found[-1] *= 1.0 + self.by
        return found


def test_accelerations_that_differ_by_more_than_rounding_are_not_timed(states):
    assert peers.difference(Off(0.0), states) == 0.0
    assert peers.differs_in_words(0.999) is None
    assert "differ from tmt's by 1.1 times the tolerance of rounding: not timed" in peers.differs_in_words(1.1)
    assert peers.differs_in_words(peers.difference(Off(1e-6), states))


def test_who_is_not_here_has_a_reason_and_no_time(engines, states, monkeypatch):
    monkeypatch.setattr("compare.engines.pinocchio.find_spec", lambda name: None)
    monkeypatch.setattr("compare.engines.heyoka.find_spec", lambda name: None)
    monkeypatch.setattr("compare.engines.mujoco.batch.find_spec", lambda name: None)
    nobody = Peers(Setup.small(ARM, engines), states)
    assert list(nobody.of_one_state([part[0] for part in states])) == [] and nobody.of_many_states(states) == {}
    assert set(nobody.absent) == {(FORWARD, COMPILED), (FORWARD, ABA), (FORWARD, BATCH)}
    words = peers.peers_in_words(NS, {1000: 10.0}, nobody)
    assert len(words) == 3 and "Pinocchio is not installed; the extra `peers` brings it." in words
    rows = evaluations.evaluation_rows({}, absent=nobody.absent)
    assert [row["why_not"] for row in rows] == list(nobody.absent.values())
    assert all(row["ns_per_state"] is row["states"] is None for row in rows)


def test_who_is_here_evaluates_these_states(engines, states):
    here = Peers(Setup.small(ARM, engines), states)
    one = {(quantity, name) for quantity, name, loop in here.of_one_state([part[0] for part in states]) if not loop(1)}
    many = here.of_many_states(states)
    for run in many.values():
        run()
    expected = set()
    if here.heyoka:
        expected |= {(FORWARD, name, 40, 1) for name in (COMPILED, COMPILED_FAST, IN_LANES)}
    if here.batch:
        expected |= {(quantity, BATCH, 40, threads) for quantity in (FORWARD, RK4_STEP) for threads in (1, 2)}
    if here.pinocchio:
        expected |= {(FORWARD, ABA_OF_MANY, 40, 1)}
        assert here.of_tolerance <= 1.0 and one == {(FORWARD, ABA), (CALL, ABA_OF_NOTHING)}
    assert set(many) == expected and len(here.absent) == 3 - bool(here.heyoka) - bool(here.batch) - bool(here.pinocchio)


def test_what_others_take_in_words():
    class Known:
        of_tolerance, absent = 0.031, {(FORWARD, BATCH): "there are no batches"}

    ns = NS | {
        (FORWARD, ABA, 1, 1): 1290.0, (CALL, ABA_OF_NOTHING, 1, 1): 410.0, (FORWARD, ABA_OF_MANY, 1000, 1): 820.0,
        (FORWARD, COMPILED, 1000, 1): 20.0, (FORWARD, COMPILED_FAST, 1000, 1): 5.0,
    }  # fmt: skip
    text = " ".join(peers.peers_in_words(ns, {1000: 10.0}, Known))
    assert (
        "aba, called from Python, takes 1290 ns, the call alone (aba without joints) 410 ns; in one call for 1,000"
        in text
    )
    assert "820 ns each. Its accelerations are tmt's within 3.1 % of the tolerance of rounding." in text
    assert "tmt 10.0 ns; heyoka's compiled function 20.0 ns (2 times), with fast math 5.0 ns (0.5 times)." in text
    assert text.endswith("there are no batches.")
    batched = NS | {(FORWARD, BATCH, 1000, 1): 1500.0, (FORWARD, BATCH, 1000, 2): 800.0}
    assert "MuJoCo's batch 1500.0 ns (150 times), on two threads 800.0 ns (80 times)" in " ".join(
        peers.peers_in_words(batched, {1000: 10.0}, Known)
    )
