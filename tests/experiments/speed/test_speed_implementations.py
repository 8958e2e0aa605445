"""The implementations of a chain: what is timed is right, what has no time says why, and what compilation takes."""

import json
from functools import partial

import numpy as np
import pytest

import tmt
from compare.experiments.speed import implementations
from compare.experiments.speed.implementations import Made, chain_of
from compare.judge.scale import EPS


def test_what_is_timed_is_right():
    """Each form of tmt gives the accelerations of the states that it is timed with."""
    of = chain_of(2)
    q, qd, tau = of.states
    lanes = partial(implementations.loop, lanes=True)
    expected = tmt.acceleration(q[:64], qd[:64], tau[:64], of.tree)
    assert len(q) % 32 == 0 and len(q) * of.n <= implementations.ANGLES_AT_ONCE
    for one in (
        implementations.literal,
        implementations.straight_line_of,
        implementations.loop,
        lanes,
    ):
        made = one(of)
        evaluate, arguments = made.run.args
        result = evaluate(*arguments)
        found = np.array(result)[None] if made.states == 1 else arguments[-1]
        found = found.T if one is lanes else found
        assert len(found) == made.states
        found = found[:64]
        assert np.abs(found - expected[: len(found)]).max() < 1e4 * EPS * np.abs(expected).max(), one
        made.run(2)


def test_code_for_one_state_at_a_time_has_no_other_loops():
    text = implementations.one_at_a_time(
        implementations.evaluator_source(
            chain_of(1).tree, "forward_dynamics", implementations.composite.mass_matrix_and_bias, "sincos"
        )
    )
    named = [line.split("(")[0] for line in text.splitlines() if line.startswith("def ")]
    assert named == ["def quantity", "def by_library", "def apart", "def each"]


def test_what_compilation_takes_is_measured_where_that_is_asked():
    of = chain_of(1)
    assert implementations.straight_line_of(of).compile_s is None
    assert implementations.straight_line_of(of._replace(cold=True)).compile_s > 0.0


def test_straight_line_code_of_many_joints_is_not_made():
    made = implementations.straight_line_of(chain_of(30))
    assert made == "it has so many lines that a loop takes its place"
    assert implementations.literal(chain_of(30)).operations is None


@pytest.mark.parametrize("of_tolerance, counts", [(0.9, True), (1.1, False)])
def test_pinocchio_is_timed_where_its_accelerations_are_those_of_tmt(of_tolerance, counts, monkeypatch):
    class Calls:
        def __init__(self, tree):
            pass

        def aba_loop(self, *state):
            return [array.shape for array in state]

    monkeypatch.setattr(implementations, "PinocchioCalls", Calls)
    monkeypatch.setattr(implementations.peers, "difference", lambda calls, states: of_tolerance)
    made = implementations.pinocchio_aba(chain_of(2))
    assert (
        made == Made([(2,)] * 3)
        if counts
        else made.startswith("Pinocchio's accelerations differ from tmt's by 1.1 times")
    )


def test_the_loops_are_compiled_anew_in_a_process_of_their_own(monkeypatch):
    asked = []

    def run(command, env, **more):
        asked.append((command[1:], env["TMT_CACHE"]))
        return implementations.subprocess.CompletedProcess(command, 0, '{"loop": 1.5, "loop_lanes": 2.5}', "")

    monkeypatch.setattr(implementations.subprocess, "run", run)
    implementations.cold_start.cache_clear()
    of = chain_of(1, cold=True)
    assert (implementations.loop(of).compile_s, implementations.loop(of, lanes=True).compile_s) == (1.5, 2.5)
    implementations.cold_start.cache_clear()
    ((command, folder),) = asked
    assert command == ["-c", "from compare.experiments.speed.implementations import compilation; compilation()"]
    assert not implementations.Path(folder).exists()
    assert implementations.loop(of._replace(cold=False)).compile_s is None


def test_what_that_process_prints(capsys):
    implementations.compilation()
    taken = json.loads(capsys.readouterr().out)
    assert list(taken) == ["loop", "loop_lanes"] and all(seconds >= 0.0 for seconds in taken.values())
