"""The regrouped sums and the sine of the kernels: the same numbers as the method and as many digits."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trees import random_state, random_tree, tree_of_kinds

import tmt
from tmt import kernels
from tmt.equations import composite, method
from tmt.exact.tree import exact_tree
from tmt.sine import LIMIT, sincos

EPS = np.finfo(float).eps


def along_axes(rng, tree):
    """The tree with hinges along coordinate axes: those have length 1 exactly, in any number of digits."""
    axes = np.eye(3)[rng.integers(0, 3, len(tree.parent))] * rng.choice([-1.0, 1.0], (len(tree.parent), 1))
    return tmt.Tree(**{name: getattr(tree, name) for name in tree.__dataclass_fields__} | {"axis": axes})


def differences(tree, q, qd, number):
    M, h = method.mass_matrix_and_bias(tree if number is float else exact_tree(tree, number), q, qd)
    expected = [v for row in M for v in row] + h
    M, h = composite.mass_matrix_and_bias(tree, q, qd, number)
    assert max(map(abs, expected)) > 0.1
    return [abs(a - b) for a, b in zip([v for row in M for v in row] + h, expected)]


@pytest.mark.parametrize("bodies", [0, 2, 4, 7])
def test_composite_form_is_the_method_in_50_digits(rng, bodies):
    for _ in range(5):
        tree = along_axes(rng, random_tree(rng, bodies=bodies)) if bodies else tmt.ARM
        with mpmath.workdps(50):
            q, qd = ([mpmath.mpf(v) for v in values] for values in rng.uniform(-4, 4, (2, len(tree.parent))).tolist())
            assert max(differences(tree, q, qd, mpmath.mpf)) < mpmath.mpf(10) ** -46


@pytest.mark.parametrize("seed", range(6))
def test_composite_form_is_the_method_for_every_kind_of_joint(seed):
    rng = np.random.default_rng(seed)
    tree = tree_of_kinds(rng, bodies=4, along_axes=True)
    assert set(tree.kind) >= {"slide", "ball"}
    with mpmath.workdps(50):
        q, qd, _ = ([mpmath.mpf(v) for v in values.tolist()] for values in random_state(rng, tree))
        assert max(differences(tree, q, qd, mpmath.mpf)) < mpmath.mpf(10) ** -46
    tree = tree_of_kinds(rng, bodies=5)
    q, qd, _ = (values.tolist() for values in random_state(rng, tree))
    assert max(differences(tree, q, qd, float)) < 1e-12


def test_composite_form_about_any_axes(rng):
    for bodies in (2, 5):
        tree = random_tree(rng, bodies=bodies)
        q, qd = rng.uniform(-3, 3, (2, len(tree.parent))).tolist()
        assert max(differences(tree, q, qd, float)) < 1e-12


def test_mass_on_a_hinge_axis_belongs_to_the_parent():
    outer = composite.carried_by_joint(tmt.ARM)[2]
    assert outer.mass == 0 and list(outer.moment)[1:] == [0, 0]
    assert [float(row.y) for row in outer.second] == [0.0, 0.0, 0.0]
    assert float(outer.moment.x) == pytest.approx(1.5 * 0.15)
    inner = composite.carried_by_joint(tmt.ARM)[0]
    assert inner.mass == 0 and list(inner.moment) == [0, 0, 0]


def test_the_arm_folds_to_fewer_operations_than_the_literal_method():
    literal = kernels.slope_source(tmt.ARM, "rk4", method.mass_matrix_and_bias).operations
    assert 100 < kernels.slope_source(tmt.ARM, "rk4").operations < 140 < 400 < literal < 600


@given(
    st.floats(LIMIT / 2, LIMIT)
    | st.floats(-LIMIT, LIMIT)
    | st.floats(-10.0, 10.0)
    | st.integers(-1000, 1000).map(lambda n: n * np.pi / 4)
)
def test_sine_and_cosine_to_the_last_digit(x):
    with mpmath.workdps(60):
        exact = mpmath.sin(mpmath.mpf(x)), mpmath.cos(mpmath.mpf(x))
        for value, truth in zip(sincos(x), exact):
            assert abs(mpmath.mpf(value) - truth) <= 1.2 * EPS


@pytest.mark.parametrize("x", [2 * LIMIT, -1e300, np.inf, -np.inf, np.nan])
def test_no_sine_beyond_the_limit(x):
    assert np.isnan(sincos(x)).all()


def states(rng, count):
    return rng.uniform(-4, 4, (3, count, 3))


def test_lanes_give_the_bits_of_one_state_at_a_time(rng):
    q, qd, tau = states(rng, 2 * kernels.LANES + 5)
    q[7, 0] = 1e17  # beyond the limit: by the library
    q[-1, 2] = -1e18
    compiled = kernels.evaluator(tmt.ARM, "forward_dynamics")
    one, many = np.empty_like(q), np.empty(q.T.shape)
    compiled.each(q, qd, tau, one)
    compiled.lanes(*(np.ascontiguousarray(a.T) for a in (q, qd, tau)), many)
    assert np.array_equal(one, many.T)
    expected = tmt.acceleration(q, qd, tau)
    assert np.allclose(one, expected, rtol=1e-11, atol=1e-11) and not np.array_equal(one, expected)


def test_every_quantity_of_every_tree_falls_back_beyond_the_limit(rng):
    """An angle that is too large for our sine may leave the first component as it is: that of another tree has no part in it."""
    whole = random_tree(rng, bodies=2)
    fields = {name: getattr(whole, name)[:2] for name in whole.__dataclass_fields__}
    two_trees = tmt.Tree(**fields | {"parent": (-1, -1), "body_hinge": (0, 1), "gravity": whole.gravity})
    for model, n in ((tmt.ARM, 3), (two_trees, 2)):
        size = {"forward_dynamics": n, "mass_matrix_and_bias": n * (n + 3) // 2}
        q, qd, tau = rng.uniform(-1, 1, (3, n, n))
        q[np.arange(n), np.arange(n)] = 1e17  # in each state another hinge
        for quantity, expected in (
            ("forward_dynamics", tmt.acceleration(q, qd, tau, model)),
            ("mass_matrix_and_bias", tmt.bias(q, qd, model)),
        ):
            compiled = kernels.evaluator(model, quantity)
            one, many = np.empty((n, size[quantity])), np.empty((size[quantity], n))
            compiled.each(q, qd, tau, one)
            compiled.lanes(q.T.copy(), qd.T.copy(), tau.T.copy(), many)
            assert np.array_equal(one, many.T)
            assert np.allclose(one[:, -n:], expected, rtol=1e-9, atol=1e-9)


def test_wrong_shapes_are_refused_by_compiled_code():
    compiled, three = kernels.evaluator(tmt.ARM, "forward_dynamics"), np.zeros((3, 40))
    with pytest.raises(ValueError, match=r"and out \("):
        compiled.lanes(three, three, three, np.zeros((3, 39)))
    with pytest.raises(ValueError, match=r"and out \("):
        compiled.each(three, three, three, three)


def test_compiled_mass_matrix_and_bias(rng):
    q, qd, tau = states(rng, kernels.LANES + 1)
    out = np.empty((9, len(q)))
    kernels.evaluator(tmt.ARM, "mass_matrix_and_bias").lanes(*(np.ascontiguousarray(a.T) for a in (q, qd, tau)), out)
    out = out.T
    rows, columns = np.triu_indices(3)
    assert np.allclose(out[:, :6], tmt.mass_matrix(q)[:, rows, columns], rtol=0, atol=1e-14)
    assert np.allclose(out[:, 6:], tmt.bias(q, qd), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["rk4", "semi_implicit_euler"])
def test_runs_in_lanes_give_the_bits_of_single_runs(rng, name):
    q, qd, tau = states(rng, kernels.LANES + 3)
    qd[5] = 1e8  # diverges on the way
    _, *single = tmt.simulate(q, qd, tau, 0.01, 40, name, form="straight_line")
    _, *lanes = tmt.simulate(q, qd, tau, 0.01, 40, name, form="straight_line_lanes")
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(single, lanes))
    assert np.isnan(single[0][5, -1]).all() and np.isfinite(single[0][6]).all()
