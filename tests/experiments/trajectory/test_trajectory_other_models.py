"""Models that are not the stated arm: nothing raises, and every sentence and caption follows that model's numbers."""

import re
from functools import cache

import pytest
from edited import MODELS, XML
from trajectory_curves import CASES

import tmt
from compare import experiment
from compare.engines.mujoco import parse
from compare.experiments import trajectory
from compare.experiments.trajectory import drift, errors, horizon, sentences
from compare.judge.check import Result
from compare.robots.arm import ARM

STEPS = {1: (16, 32, 64), 4: (16, 32, 64)}
FREE = CASES["bent, free"]


@cache
def known() -> tuple:
    """TMT's side, and the runs with many digits, which are the same for all models."""
    return {}, [horizon.exact_runs(FREE, ("semi_implicit_euler", "implicit", "rk4"), 3)]


def said_of(name) -> tuple[Result, list]:
    """All that a report says of a model's runs, and the names and captions of some figures."""
    text = XML.replace(*MODELS[name]) if name != "the arm" else XML
    engines, result = experiment.engines(parse(text, tmt.ARM)), Result("trajectory", curves={"runs": {}})
    for case in ARM.cases:
        part = trajectory.runs.follow(case, engines, (1,), known()[0])
        result.rows += part.rows
        result.curves["runs"] |= part.curves
    drift.measure_drift(result, ARM, engines, STEPS)
    horizon.many_digits(result, [FREE], known()[1])
    result.curves["errors"] = errors.errors_when_held(result, ARM) | errors.errors_when_free(result, ARM)
    result.notes = sentences.notes(result, ARM, engines, (1,)) + result.notes
    drawn = [
        figure()
        for figure in trajectory.figures(result, ARM)
        if figure.args[-1] not in (result, *ARM.cases[4:])  # some of the scenes: each is drawn in the same way
    ]
    result.curves["runs"] = {
        key: {part: run[part] for part in ("left", "ended")} for key, run in result.curves["runs"].items()
    }
    return result, [(name, caption) for name, _, caption in drawn]


@pytest.fixture(params=MODELS, scope="module")
def other(request, beside):
    """A model's name and what is said of it."""
    return request.param, *beside.result(said_of, request.param)


def test_the_sentences_of_a_trajectory_follow_the_model(other):
    name, result, _ = other
    catch, bent, of_errors, agreement, order = result.notes[:5]
    right = name == "the arm"
    assert (re.search(r"MuJoCo's is 0.1 rad away at 4\.\d+ s", catch) is not None) == right
    assert ("the cause is rounding of the torque" in catch) == right
    at = re.search(r"MuJoCo's (stays within 0.1 rad|is 0.1 rad away at ([\d.]+) s)", bent)
    for note, scene in ((catch, "ball catch, held"), (bent, "bent, held")):
        left = result.curves["runs"][scene, "rk4", 64]["left"]["mujoco"]
        assert ("that is no rounding" in note) == (not right and left is not None and "damped" not in name)
    assert (at.group(2) is None) == (result.curves["runs"]["bent, held", "rk4", 64]["left"]["mujoco"] is None)
    assert ("; bent, free; " in agreement) == right or "damped" in name
    held = result.curves["errors"]["ball catch, held"]
    assert f"ball catch, held (true: rest): TMT {sentences.rad(held[0])}, MuJoCo {sentences.rad(held[1])}" in of_errors
    ended = result.curves["runs"]["ball catch, free", "semi_implicit_euler", 64]["ended"]["mujoco"]
    says = "MuJoCo never" if ended is None else f"MuJoCo at {ended:.2f} s"
    assert re.search(rf"ball catch, free, Euler: judged for [\d.]+ s, diverges: TMT at 0.39 s, {says}", order)


def test_every_caption_of_a_trajectory_can_be_said_of_the_model(other):
    _, _, captions = other
    assert captions
    for name, caption in captions:
        assert caption.endswith(".") and "nan" not in caption and name
