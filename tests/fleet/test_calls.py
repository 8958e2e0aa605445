"""Calls of one function through a door: what comes back, in which order, and what is said where the door is gone."""

import math
import os
import platform

import pytest

from compare.fleet.calls import Calls, door_opened
from compare.fleet.piece import FleetError
from compare.process.workers import WorkerEnded


def test_outcomes_come_in_the_order_of_the_items_and_none_is_lost_with_another():
    ended = []
    with door_opened(None, 2) as door:
        found = door.outcomes(math.sqrt, [4.0, -1.0, 9.0], progress=ended.append)
        gone, here = door.outcomes(os._exit, [3]) + door.outcomes(math.sqrt, [16.0])
    assert [found[0].returned, found[2].returned, here.returned] == [2.0, 3.0, 4.0] and ended == [1, 2, 3]
    assert found[1].broke.startswith("ValueError: math domain error") and gone.broke.startswith("ended with status 3")
    assert {outcome.machine for outcome in found} == {platform.node()} and door.no_timing() is None


def test_without_a_cluster_or_processes_there_is_no_door():
    with door_opened(None, None) as door:
        assert door is None


class Gone:
    """A door behind which nothing is any more."""

    under_way = 0

    def submit(self, piece):
        self.under_way += 1

    def next(self):
        raise FleetError("the scheduler tcp://x:1 is gone; what is done is kept")


def test_where_the_door_is_gone_the_run_ends_with_a_line():
    with pytest.raises(WorkerEnded, match=r"^the scheduler tcp://x:1 is gone; a report that was there is unchanged$"):
        Calls(Gone()).outcomes(math.sqrt, [4.0])
