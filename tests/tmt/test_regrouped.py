"""The sums of the method regrouped: composite bodies and articulated bodies, the same numbers to as many digits."""

import mpmath
import numpy as np
import pytest
from trees import large_tree, random_state, random_tree, tree_of_kinds

import tmt
from tmt.equations import articulated, composite, method
from tmt.exact.tree import exact_tree

EPS = np.finfo(float).eps


def along_axes(rng, tree):
    """The tree with hinges along coordinate axes: those have length 1 exactly, in any number of digits."""
    axes = np.eye(3)[rng.integers(0, 3, len(tree.parent))] * rng.choice([-1.0, 1.0], (len(tree.parent), 1))
    return tmt.Tree(**{name: getattr(tree, name) for name in tree.__dataclass_fields__} | {"axis": axes})


@pytest.fixture(autouse=True)
def any_number(monkeypatch):
    """What joints carry in numbers of mpmath for an exact tree: the articulated form has it in doubles alone."""
    monkeypatch.setattr(
        articulated,
        "rounded_once",
        lambda tree, number: composite.rounded_once(*getattr(tree, "plain", (tree, number))),
    )


def differences(tree, q, qd, tau, number) -> list[float]:
    """The largest differences of Mbar, h and of the equation of motion, from the literal form, for both forms."""
    exact = tree if number is float else exact_tree(tree, number)
    if number is not float:
        exact.plain = tree, number
    M, h = (np.array(x) for x in method.mass_matrix_and_bias(exact, q, qd))
    force = method.reduced_force(exact, list(h), q, qd, tau)
    found = []
    for other in (
        composite.mass_matrix_and_bias(tree, q, qd, number),
        articulated.mass_matrix_and_bias(exact, q, qd),
    ):
        found += [abs(np.array(other[0]) - M).max(), abs(np.array(other[1]) - h).max()]
    found.append(abs(np.array(articulated.bias(exact, q, qd)) - h).max())
    found.append(abs(M @ np.array(articulated.forward_dynamics(exact, q, qd, tau)) - force).max())
    assert abs(M).max() > 0.1 and abs(h).max() > 0.1
    return found


@pytest.mark.parametrize("bodies", [0, 2, 5])
def test_hinges_in_50_digits(rng, bodies):
    tree = along_axes(rng, random_tree(rng, bodies=bodies)) if bodies else tmt.ARM
    with mpmath.workdps(50):
        values = rng.uniform(-4, 4, (3, len(tree.parent))).tolist()
        state = [[mpmath.mpf(v) for v in part] for part in values]
        assert max(differences(tree, *state, mpmath.mpf)) < mpmath.mpf(10) ** -43


@pytest.mark.parametrize("seed", range(4))
def test_every_kind_of_joint_in_50_digits_and_in_floats(seed):
    rng = np.random.default_rng(seed)
    tree = tree_of_kinds(rng, bodies=4, along_axes=True)
    assert set(tree.kind) >= {"slide", "ball"}
    with mpmath.workdps(50):
        state = [[mpmath.mpf(v) for v in values.tolist()] for values in random_state(rng, tree)]
        assert max(differences(tree, *state, mpmath.mpf)) < mpmath.mpf(10) ** -43
    tree = tree_of_kinds(rng, bodies=5)
    assert max(differences(tree, *(values.tolist() for values in random_state(rng, tree)), float)) < 1e-11


@pytest.mark.parametrize("tree", [random_tree(np.random.default_rng(1), bodies=5), large_tree()])
def test_larger_trees_in_floats(tree, rng):
    assert max(differences(tree, *(values.tolist() for values in random_state(rng, tree)), float)) < 1e-10


def test_mass_on_a_hinge_axis_belongs_to_the_parent():
    outer = composite.carried_by_joint(tmt.ARM)[2]
    assert outer.mass == 0 and list(outer.moment)[1:] == [0, 0]
    assert [float(row.y) for row in outer.second] == [0.0, 0.0, 0.0]
    assert float(outer.moment.x) == pytest.approx(1.5 * 0.15)
    inner = composite.carried_by_joint(tmt.ARM)[0]
    assert inner.mass == 0 and list(inner.moment) == [0, 0, 0]
