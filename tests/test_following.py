"""Which form follows runs: by what it takes to get it and how much is asked for; lanes and cores change no bits."""

import dataclasses

import numpy as np
import pytest
from trees import random_state, tree_of_kinds

import tmt
from tmt import choice, eight, following, kernels, loop_runs, loop_semi_implicit, loop_stages
from tmt.following import SIDE_BY_SIDE, Runs
from tmt.methods import METHODS, method_named
from tmt.simulation import FORMS, reasons, singular_in

BENT, REST = np.radians([30.0, 20.0, 60.0]), np.zeros(3)


@pytest.fixture
def runs(monkeypatch):
    """Those of an arm by RK4, of which nothing is there, in a process with nothing compiled and nothing on disk."""
    monkeypatch.setattr(following.generic, "is_compiled", lambda name: False)
    monkeypatch.setattr(following, "is_kept", lambda pattern: False)
    monkeypatch.setattr(kernels, "is_on_disk", lambda *which: False)
    return Runs(tmt.ARM, method_named("rk4"), "rk4")


def test_the_forms_are_those_of_simulate():
    assert set(FORMS) == set(SIDE_BY_SIDE)
    assert following.WIDTH == eight.WIDTH
    known = vars(loop_runs) | vars(loop_semi_implicit) | vars(loop_stages)
    assert all(name in known for name in choice.LOOPS_COMPILED)
    assert {METHODS[name].loop for name in METHODS} <= set(choice.LOOPS_COMPILED)


def test_where_nothing_is_there_the_soonest_code_is_got(runs):
    """Of three hinges straight-line code is compiled sooner than the loops, and is faster."""
    assert runs.form(1, 1000.0) == runs.form(1000, 1000.0) == "straight_line"
    assert runs.form(1000, 1e10) == "straight_line_lanes"


def test_a_loop_that_is_there_answers_until_other_code_pays(runs):
    runs.there["loop"] = None
    assert runs.form(1, 1000.0) == "loop" and not runs.known  # nothing is traced
    saved = runs.costs("loop").each - choice.straight_line_each(kernels.lines(tmt.ARM, runs.stepping)[1])
    lines = kernels.lines(tmt.ARM, runs.stepping)[0]
    even = choice.straight_line_getting(lines, kept=False) / saved
    assert runs.form(1, 0.9 * even) == "loop" and runs.form(1, 1.1 * even) == "straight_line"
    runs.asked[1] = 0.5 * even
    assert runs.form(1, 0.4 * even) == "loop" and runs.form(1, 0.6 * even) == "straight_line"


def test_what_is_there_and_best_is_not_asked_about_again(runs):
    runs.there |= {"loop": None, "straight_line": None}
    assert runs.form(1, 1.0) == "straight_line" and runs.settled == {1: "straight_line"}


def test_eight_runs_are_enough_for_the_lanes_of_the_loop(runs):
    runs.there |= {"loop": None, "loop_lanes": None}
    assert runs.form(7, 1.0) == "loop" and runs.form(8, 1.0) == "loop_lanes"


def test_what_few_runs_asked_for_counts_for_no_lanes(runs):
    for count, asked in ((1, (12, 0, 0)), (7, (96, 0, 0)), (9, (204, 108, 0)), (33, (600, 504, 396))):
        paths = np.zeros((2, count, 4, 3))
        runs.follow(*paths, np.zeros((count, 3)), (0.01,), np.zeros((count, 2), np.int64), 1, "loop")
        assert tuple(runs.asked.values()) == asked  # RK4 has four stages, and there are three steps


def test_an_implicit_method_has_its_jacobians_in_the_estimate_of_the_loop(runs):
    implicit = Runs(tmt.ARM, method_named("implicit_midpoint"), "implicit_midpoint")
    assert implicit.costs("loop").each == (2 + 4 * 3) * runs.costs("loop").each


@pytest.mark.parametrize("form", ["straight_line_lanes", "loop_lanes"])
def test_fewer_runs_than_lanes_are_followed_one_at_a_time(form, rng):
    for count in (1, 5):
        q, qd, tau = rng.uniform(-1, 1, (3, count, 3))
        few = tmt.simulate(q, qd, tau, 0.01, 5, form=form)
        alone = tmt.simulate(q, qd, tau, 0.01, 5, form=form.removesuffix("_lanes"))
        assert np.array_equal(few.q, alone.q) and np.array_equal(few.qd, alone.qd) and not few.ended.any()


def test_large_trees_are_not_traced(monkeypatch):
    monkeypatch.setattr(kernels, "LONGEST", 0)
    runs = following.runs_of(tmt.ARM, "rk4")
    assert runs.form(1, 1e12) == "loop" and runs.form(100, 1e12) == "loop_lanes"
    assert tmt.simulate(BENT, REST, REST, 0.01, 5).form == "loop"


def test_a_tree_and_a_method_have_their_runs(monkeypatch):
    assert following.runs_of(tmt.ARM, "rk4") is following.runs_of(tmt.ARM, "rk4")
    assert following.runs_of(tmt.ARM, "dopri8") is not following.runs_of(tmt.ARM, "rk4")
    before = following.runs_of(tmt.ARM, "rk4")
    monkeypatch.setitem(METHODS, "rk4", METHODS["dopri8"])
    assert following.runs_of(tmt.ARM, "rk4").stepping == METHODS["dopri8"]
    monkeypatch.undo()
    kernels.stepper.cache_clear()
    assert following.runs_of(tmt.ARM, "rk4") is not before
    monkeypatch.setattr(following, "MOST", 1)
    following.runs_of(tmt.ARM, "dopri8")
    assert len(following.known) == 1


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [1, 7, 8, 33, 150])
def test_pieces_are_all_runs_once(form, count, runs, monkeypatch):
    for cores, wanted in ((1, 1e12), (2, 1.0), (2, 1e12)):
        monkeypatch.setattr(following, "cores", lambda cores=cores: cores)
        pieces = runs.pieces(form, count, wanted)
        assert [k for _, part in pieces for k in range(count)[part]] == list(range(count))
        for of_piece, part in pieces:
            assert (part.stop - part.start) % SIDE_BY_SIDE[of_piece] == 0 and form.startswith(
                of_piece.removesuffix("_lanes")
            )
        assert len(pieces) <= 2 or (cores, wanted) == (2, 1e12)
    if form == "loop":
        assert len(pieces) == min(count, 2 * following.PIECES)


@pytest.mark.parametrize("form", FORMS)
def test_several_cores_give_the_bits_of_one(form, rng, monkeypatch):
    q, qd = rng.uniform(-1, 1, (2, 75, 3))
    qd[40] = 1e200
    monkeypatch.setattr(following, "cores", lambda: 1)
    one = tmt.simulate(q, qd, qd, 0.01, 20, form=form)
    monkeypatch.setattr(following, "cores", lambda: 3)
    monkeypatch.setattr(following, "SPREAD", 0.0)
    three = tmt.simulate(q, qd, qd, 0.01, 20, form=form)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, three))
    assert one.evaluations == three.evaluations and np.array_equal(one.ended, three.ended) and one.ended[40]
    assert one.form == three.form == form


# each so-manyth state


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", METHODS)
def test_the_states_that_are_kept_are_those_of_all(name, form, rng):
    if form.endswith("lanes") and not METHODS[name].lanes:
        pytest.skip("it has no lanes")
    if form == "straight_line_lanes" and name not in ("rk4", "implicit"):
        pytest.skip(
            "one text keeps the states for all methods; the lanes of each have the bits of one run: test_kernels"
        )
    starts, tau = rng.uniform(-1, 1, (2, 35, 3))
    qd = np.zeros((35, 3))
    qd[3], qd[34] = 1e200, 2.0**51  # some diverge at once, or on the way
    each, third = (tmt.simulate(starts, qd, tau, 0.02, 6, name, every=k, form=form) for k in (1, 3))
    assert third.t.shape == (3,) and np.array_equal(each.t[::3], third.t)
    assert np.array_equal(each.q[:, ::3], third.q, equal_nan=True)
    assert np.array_equal(each.qd[:, ::3], third.qd, equal_nan=True)
    assert each.evaluations == third.evaluations and np.array_equal(each.ended, third.ended) and third.ended[3]


def test_of_trees_with_balls_too(rng):
    tree = tree_of_kinds(rng)
    q, qd, tau = random_state(rng, tree)
    each, fourth = (tmt.simulate(q, qd, tau, 1e-3, 8, "dopri8", tree, every=k) for k in (1, 4))
    assert np.array_equal(each.q[::4], fourth.q) and np.array_equal(each.qd[::4], fourth.qd)


def test_taylor_keeps_them_too():
    each, second = (tmt.simulate(BENT, REST, REST, 0.05, 6, "taylor", every=k) for k in (1, 2))
    assert np.array_equal(each.q[::2], second.q) and np.array_equal(each.t[::2], second.t) and each.form == "series"


@pytest.mark.parametrize("form", ["straight_line", "loop"])
def test_a_run_ends_at_its_own_step_between_those_that_are_kept(form):
    fast = [2.0**49 - 20.0, 0.0, 0.0], [100.0, 0.0, 0.0]
    each, some = (tmt.simulate(*fast, REST, 0.01, 60, every=k, form=form) for k in (1, 20))
    last = int(np.isfinite(each.q[:, 0]).sum()) - 1
    assert last % 20 and each.ended == some.ended and each.ended.startswith(f"at t = {last * 0.01:g} s: a hinge turns")
    assert np.isfinite(some.q[:, 0]).tolist() == [k * 20 <= last for k in range(4)]


def wrist():
    """Three hinges through one point, z y z: Mbar is singular where the second is at zero."""
    return tmt.Tree(
        hinge_names=("a", "b", "c"), parent=(-1, 0, 1), offset=np.zeros((3, 3)), axis=((0, 0, 1), (0, 1, 0), (0, 0, 1)),
        damping=[0.0] * 3, body_names=["hand"], body_hinge=[2], mass=[1.0], com=[(0.1, 0.0, 0.2)],
        inertia=[np.diag([0.01, 0.02, 0.025])], gravity=(0, 0, -9.81),
    )  # fmt: skip


def test_a_singular_state_between_those_that_are_kept_is_found():
    q, qd = np.zeros((1, 9, 3)), np.zeros((1, 9, 3))
    q[0, :, 1] = [1.0, 0.8, 0.6, 0.4, 0.0, -0.4, -0.6, -0.8, -1.0]
    qd[0, 5:] = 1.0  # the rates jump after it
    tree, none = wrist(), np.zeros((1, 2), int)
    (each,) = reasons(tree, q.copy(), qd.copy(), none, 0.1, 1e-9)
    assert singular_in(tree, q[0], qd[0])[0] == 4 and each.startswith("at t = 0.4 s: Mbar is singular: hinges 'a', 'c'")
    kept = q[:, ::3].copy(), qd[:, ::3].copy()
    (third,) = reasons(tree, *kept, none, 0.1, 1e-9, 3, lambda run, k: [x[run, 3 * k : 3 * k + 4] for x in (q, qd)])
    # 8 is no multiple of 3: the records are those after 0, 3 and 6 steps
    assert third == each and np.isfinite(kept[0][0, :, 0]).tolist() == [True, True, False]


@pytest.mark.parametrize("name", ["implicit_midpoint", "gauss_legendre_4"])
def test_a_stage_that_divides_by_zero_ends_its_run_alone(name, rng):
    """In the loop over complex numbers, for which numba has an error."""
    singular = tmt.simulate(np.zeros(3), [0.1, 0.2, 0.3], [1.0, 0.0, 0.0], 0.01, 2, name, wrist(), form="loop")
    assert singular.ended.startswith("at t = 0 s: Mbar is singular: hinges 'a', 'c'")
    tree = tree_of_kinds(rng, bodies=2)
    q, qd, tau = random_state(rng, tree)
    fast = np.array([qd, qd])
    fast[1, tree.coordinates.balls[0].qd] = 1e50
    both = tmt.simulate(q, fast, tau, 0.01, 2, name, tree, form="loop")
    assert both.ended[0] is None and both.ended[1].startswith("at t = 0 s: Newton's method")


@pytest.mark.parametrize(
    "every, says",
    [
        (3, "every is 3, of which steps = 10 is no multiple; a divisor is expected"),
        (20, "every is 20, of which steps = 10 is no multiple"),
        (0, "every is 0; a whole number of at least 1 is expected"),
        (2.5, "every is 2.5; a whole number"),
        (True, "every is True; a whole number"),
    ],
)
def test_what_is_no_every_is_refused_in_one_line(every, says):
    with pytest.raises(ValueError) as error:
        tmt.simulate(BENT, REST, REST, 0.1, 10, every=every)
    assert str(error.value).startswith(says) and "\n" not in str(error.value)


@pytest.mark.parametrize("form", ["fast", 1, "", ["loop"]])
def test_what_is_no_form_is_refused_in_one_line(form):
    with pytest.raises(
        ValueError, match=r"form is .*; known are straight_line, straight_line_lanes, loop, loop_lanes$"
    ) as error:
        tmt.simulate(BENT, REST, REST, 0.1, 10, form=form)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("form", ["loop", "fast"])
def test_taylor_takes_no_form(form):
    with pytest.raises(ValueError, match=r"^method 'taylor' is not compiled and takes no form$"):
        tmt.simulate(BENT, REST, REST, 0.1, 10, "taylor", form=form)


def test_a_method_without_lanes_has_none():
    with pytest.raises(ValueError, match="'implicit_midpoint' has no lanes"):
        tmt.simulate([BENT] * 40, REST, REST, 0.1, 1, "implicit_midpoint", form="straight_line_lanes")


def test_every_state_that_is_asked_for_needs_its_memory():
    with pytest.raises(ValueError, match="with every=k each k-th of them is kept"):
        tmt.simulate(BENT, REST, REST, 1e-3, 10**12)
    heavy = dataclasses.replace(tmt.ARM, gravity=(0.0, 0.0, 0.0))
    assert tmt.simulate(np.zeros((3, 3)), REST, REST, 1e-3, 10**5, model=heavy, every=10**5).q.shape == (3, 2, 3)
