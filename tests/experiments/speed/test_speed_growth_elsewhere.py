"""The growing chain through a door: the same table, where it was timed, and what is said of what was not."""

import dataclasses
import pickle
import platform

import pytest

from compare import experiment
from compare.engines.mujoco import load
from compare.experiments.speed import growth
from compare.experiments.speed.growth import Extent, costs_of_growth, made_chains
from compare.experiments.speed.growth_elsewhere import add_growth_elsewhere
from compare.fleet.calls import door_opened
from compare.fleet.piece import Outcome
from compare.judge.check import ENDS, Result
from compare.robots.arm import ARM

SHORT = Extent((1, 2), 1, most=0.0)


class Door:
    """A door behind which another process, or none, has done it. machine: its name; lost: numbers of joints that are."""

    def __init__(self, machine="", lost=(), why=None):
        self.machine, self.lost, self.why, self.asked, self.said = machine or platform.node(), lost, why, [], []

    def no_timing(self):
        return self.why

    def outcomes(self, function, items, timed=False, progress=None):
        self.asked += [(item.numbers, timed) for item in items]
        progress(len(items))
        return [
            Outcome(ended="ended by SIGKILL, 4 times")
            if item.numbers[0] in self.lost
            else Outcome(pickle.dumps(function(item)._replace(processor="old vectors")), machine=self.machine)
            for item in items
        ]


@pytest.fixture(name="grown")
def grown_through(monkeypatch):
    """grown(door): the result of the growing chain through a door."""
    monkeypatch.setitem(growth.EXTENTS, "short", SHORT)
    engines = experiment.engines(load(ARM.mjcf, ARM.tree))

    def grown(door):
        result = Result("speed")
        add_growth_elsewhere(
            result,
            experiment.Setup.quick(ARM, engines, growth=True, door=door, progress=getattr(door, "said", []).append),
        )
        return result

    return grown


def keys(rows):
    return [(row["n"], row["implementation"], row["operations"], row["ns_per_state"] is None) for row in rows]


def test_the_table_is_the_same_in_a_process_of_its_own(grown):
    with door_opened(None, 2) as door:
        result = grown(door)
    rows, reasons = costs_of_growth(made_chains(SHORT, lambda _: None), lambda _: None)
    assert keys(result.tables["growth"]) == keys(rows) and not result.checks
    said = growth.chain_in_words([], {}, reasons)
    assert result.notes[-len(said) :] == said and any("not timed with 1, 2 joints" in text for text in said)


def test_each_number_of_joints_is_timed_for_itself_and_another_machine_is_named(grown):
    door = Door(machine="big iron")
    result = grown(door)
    assert door.asked == [((1,), True), ((2,), True)]
    said = "Growth: 1, 2 joints timed on big iron (old vectors), by a worker that did nothing else."
    assert result.notes[-1] == said and door.said == ["speed: 2 of 2 chains are timed"]
    assert not any("timed on" in note for note in grown(Door()).notes)


def test_what_is_not_timed_to_its_end_is_a_failed_check_and_the_rest_is_there(grown):
    result = grown(Door(lost=(1,)))
    (check,) = result.checks
    assert (check.scene, check.quantity, check.passed) == ("chain of 1", ENDS, False)
    assert check.note == "ended by SIGKILL, 4 times" and {row["n"] for row in result.tables["growth"]} == {2}
    result = grown(Door(lost=(1, 2)))
    assert len(result.checks) == 2 and not result.tables and not result.notes


def test_where_nothing_can_be_timed_the_reason_is_said(grown):
    door = Door(why="no worker of the cluster has the resource timing")
    result = grown(door)
    assert result.notes == ["Growth is left out: no worker of the cluster has the resource timing."]
    assert not door.asked and not result.tables and not result.checks


def test_no_chain_is_made_here_where_there_is_a_door():
    setup = experiment.Setup.quick(ARM, experiment.engines(load(ARM.mjcf, ARM.tree)), growth=True, door=Door())
    assert growth.chains_of(setup) is None
    assert dataclasses.replace(setup, door=None).growth and growth.extent_of(setup) is growth.EXTENTS["short"]
