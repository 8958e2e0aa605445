"""Runs of a file from a posture itself: where they come to rest, and up to which step they do where the posture rests."""

import numpy as np
import pytest

from compare.engines.mujoco.reading import read
from compare.experiments.stability import own_run
from compare.stability.answer import Asked, answers
from compare.stability.place import Posture
from compare.stability.rest import RELAXED_STEPS
from compare.stability.start import StartRuns

# an inverted pendulum that leans on one of two stops; the deeper it starts in a stop, the more that one throws it
TIPPING = """<mujoco><compiler angle="radian"/><option timestep="{dt}"><flag refsafe="disable"/></option><worldbody><body>
  <joint name="tip" axis="0 1 0" range="-0.5 0.5" solreflimit="0.02 1" damping="0.02"/>
  <geom size="0.1" pos="0 0 0.5" mass="1"/></body></worldbody><keyframe><key name="lean" qpos="{q}"/></keyframe></mujoco>"""
LEAN = Posture("lean", "lean")
GO = 0.01  # s


def starts(q, dt=GO):
    return StartRuns(read(TIPPING.format(dt=dt, q=q)), LEAN, "Euler")


@pytest.mark.parametrize("q, outcome", [(0.55, "calm"), (0.8, "alike"), (1.2, "worse")])
def test_a_run_that_comes_to_rest_elsewhere_is_stable_only_if_a_finer_step_leads_there_too(q, outcome):
    reading = read(TIPPING.format(dt=GO, q=q))
    row = own_run.own_run("lean", reading.dt, reading.integrator, reading)
    assert row.full_model_calm and row.outcome == outcome
    assert row.rests_elsewhere is (outcome != "calm") and not row.has_fallen
    expected = (1.0, "tip") if row.rests_elsewhere else (0.0, "tip")
    assert (row.moved, row.moved_joint) == (pytest.approx(expected[0], abs=0.01), expected[1])


def test_the_longest_step_from_the_posture_itself_is_where_its_runs_change():
    for first in (1e-3, GO):  # from below and from above
        runs = starts(1.2)
        longest = runs.longest(first, 0.017)
        assert 2e-3 < longest < GO and runs.rests(longest) and not runs.rests(GO)
    assert starts(0.55).longest(1e-3, 0.01) is None  # not below the limit
    assert starts(0.8).longest(1e-3, 0.017) is None  # at no step


def test_a_row_has_the_step_from_the_posture_beside_its_limit_where_it_is_lower():
    for q, lower in ((1.2, True), (0.52, False)):
        first = answers(LEAN, read(TIPPING.format(dt=1e-3, q=q)), Asked(1e-3, "Euler", ["Euler"]))[0]
        (row,) = first.rows
        assert row.stable_at_file_dt and (row.start_dt is not None) is lower
        assert not lower or row.start_dt < 0.97 * row.longest


def test_what_is_held_is_asked_at_the_fine_step_of_the_relaxed_run():
    """At a coarse step MuJoCo softens the stop (refsafe), and the rest lies deeper in it."""
    text = TIPPING.format(dt=0.03, q=0.52).replace('<flag refsafe="disable"/>', "")
    runs = StartRuns(read(text), LEAN, "Euler")
    assert runs.place.left > 0.02 and RELAXED_STEPS[0] < 0.03
    assert np.array_equal(runs.is_held, [True])
