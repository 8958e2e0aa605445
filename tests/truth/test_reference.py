"""The runs that errors are measured against: their digits, the errors that they measure, and what is too stiff for a series."""

import numpy as np
import pytest

import tmt
from compare.engines.mujoco import read
from compare.experiments.speed.floors import floor
from compare.experiments.speed.settings import scenes_of
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.truth import reference
from tmt.exact import motion as reference_run

CASES = {case.name: case for case in scenes_of(ARM)}
BENT = CASES["bent, free"]
SHORT = BENT.changed(name="short", duration=0.02, dt=0.005)
SPRING = """<mujoco><worldbody><body><joint name="swing" axis="0 1 0" stiffness="4"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    "name", ["bent, free", *(pytest.param(name, marks=pytest.mark.slow) for name in CASES if name != "bent, free")]
)
def test_the_arms_scenes_are_known_to_1e_30_times_the_growth(name, engines):
    case = CASES[name]
    known = reference.reference(case)
    growth = floor(case, engines["tmt"].of(case)) / np.finfo(float).eps
    assert known.apart <= reference.LOST * growth and known.why is None
    assert np.array_equal(known.high[0], np.concatenate(case.start)) and not known.low[0].any()
    assert known.t.tolist() == (np.arange(65) * 5 / 64).tolist() and known.steps < 1000
    finer = tmt.simulate(*case.start, case.tau, 5.0 / 2**15, 2**15, "dopri8", case.tree).q[::512]
    assert known.error(finer, range(3)).max() < 64 * growth * np.finfo(float).eps


def test_errors_are_taken_from_both_halves():
    known = reference.reference(BENT)
    assert 1e-18 < np.abs(known.low).max() < 1e-14
    assert np.array_equal(known.error(known.high[:, :3], range(3)), np.abs(known.low[:, :3]).max(axis=1))
    assert known.error(known.high[:, :3] + known.low[:, :3], range(3)).max() <= 1e-15
    off = known.high[:, [0, 2]] + [[0.0, 1e-3]]
    assert known.error(off, [0, 2]) == pytest.approx(1e-3) and known.error(off, [0, 1]).max() > 1e-2


def test_a_changed_scene_has_another_motion_and_an_equal_one_is_not_computed_again():
    before = reference.in_pairs.cache_info()
    first, again = (reference.references([SHORT])["short"] for _ in range(2))
    after = reference.in_pairs.cache_info()
    assert first.high is again.high and after.hits > before.hits
    others = {"damping": 0.1, "gravity": False, "torque": (0, 0, 1)}
    changed = [SHORT.changed(**{name: value}) for name, value in others.items()]
    assert len({reference.reference(case).high[-1].tobytes() for case in (SHORT, *changed)}) == 4
    swing = reference.reference(SHORT.changed(name="swing", locked=("alpha", "beta")))
    assert swing.high.shape == swing.low.shape == (65, 2)


# what takes too long


def test_a_run_ends_where_it_would_take_too_many_steps(monkeypatch):
    case = robot_of(read(SPRING), "spring.xml").cases[-1]
    work = reference_run.BESIDE + len(reference_run.equations(case.tree, case.tau, "composite").code)
    run = lambda: reference_run.trajectory(case.tree, *case.start, case.tau, 1.0, 5)  # noqa: E731
    steps = run().steps
    assert steps > 3
    monkeypatch.setattr(reference_run, "MOST_OPERATIONS", steps * work)
    assert run().steps == steps
    monkeypatch.setattr(reference_run, "MOST_OPERATIONS", (steps - 1) * work)
    with pytest.raises(reference_run.TooManySteps, match=rf"\b{steps - 1}\b"):
        run()


@pytest.mark.parametrize("rate, known", [(1e4, True), (1e7, False)])
def test_whether_a_model_is_too_stiff_is_seen_after_a_few_steps(rate, known):
    tree = robot_of(read(SPRING.replace('"4"', repr(str(rate**2)))), "spring.xml").tree
    start = [1.0], [0.0], [0.0]
    if known:
        path = reference_run.trajectory(tree, *start, 0.125, 1)
        assert path.high[-1, 0] == pytest.approx(np.cos(0.125 * rate), abs=1e-9)
    else:
        with pytest.raises(reference_run.TooManySteps, match="series"):
            reference_run.trajectory(tree, *start, 0.125, 1)


def test_a_run_that_does_not_reach_its_end_says_so_in_one_line():
    fast = SHORT.changed(name="fast", speed=(1e200, -1e200, 1e200))
    with (
        pytest.raises(ValueError, match="'fast'") as error,
        np.errstate(all="ignore"),
    ):
        reference.reference(fast)
    assert "\n" not in str(error.value)
