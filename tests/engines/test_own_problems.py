"""Equations of a user's own that cannot be used, or that can and have something wrong: what is said of them."""

import dataclasses
import sys

import numpy as np
import pytest
from own_states import COORDINATES, single, states

import tmt
from compare.engines.own import OwnEquations, OwnError

# equations that cannot be used


class Called:
    def mass_matrix(self, q): ...

    bias = None


@pytest.mark.parametrize("value, said", [
    (lambda q: np.eye(2), r"\(2, 2\).*\(3, 3\).* at q = \["),
    (lambda q: 1.0, r"shape \(\)"), (lambda q: np.eye(3)[None], r"shape \(1, 3, 3\)"),
    (lambda q: None, "None"), (lambda q: "M", "'M'"),
    (lambda q: [[1, 2], [3]], "real numbers"), (lambda q: np.eye(3) * 1j, "complex"),
    (lambda q: np.eye(3) > 0, "real numbers"), (lambda q: q[7], "IndexError"),
    (lambda: 0, "TypeError"), (lambda q: sys.exit(3), "SystemExit: 3"),
    (lambda q: np.linalg.inv(np.zeros((3, 3))), r"LinAlgError: .*test_own_problems.py, line \d+"),
    (4.0, "4.0.*function"),
])  # fmt: skip
def test_what_cannot_be_used_is_one_line(value, said, rng):
    with pytest.raises(OwnError, match=said) as error:
        OwnEquations({"mass_matrix": value, "bias": tmt.bias}, COORDINATES).mass_matrix(states(rng)[0])
    assert "\n" not in str(error.value) and str(error.value).startswith("mass_matrix ")


@pytest.mark.parametrize("source, said", [
    (np, "numpy has no mass_matrix"),
    ({"mass_matrix": tmt.mass_matrix}, "dict has no bias"),
    (None, "NoneType has no mass_matrix"), (Called, "Called has no bias"),
    (dataclasses.replace(tmt.ARM.lock({"beta": 0.0})), "2 positions and 2 speeds (alpha, gamma)"),
])  # fmt: skip
def test_what_is_not_there_is_said(source, said):
    with pytest.raises(OwnError) as error:
        OwnEquations(source, COORDINATES)
    assert said in str(error.value)


def test_of_a_class_an_object_is_expected(rng):
    with pytest.raises(OwnError, match=r"Called\(\)"):
        OwnEquations(Called, COORDINATES, required=("mass_matrix",)).mass_matrix(states(rng)[0])


def test_bodies_are_those_of_the_first_state(rng):
    own = OwnEquations({"com_positions": lambda q: np.zeros((2, 2))}, COORDINATES, required=())
    with pytest.raises(OwnError, match=r"has shape \(2, 2\); \(bodies, 3\) is expected"):
        own.com_positions(states(rng)[0])


# equations that can be used, with something wrong


def problems(mass_matrix, q):
    own = OwnEquations({"mass_matrix": mass_matrix}, COORDINATES, required=())
    return own.mass_matrix(q), own.problems


@pytest.mark.parametrize("way", [single, lambda f: f])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite(value, way, rng):
    q = states(rng)[0]

    def mass_matrix(q):
        return np.where(q[..., 0, None, None] > 1.0, value, tmt.mass_matrix(q))

    q[:, 0] = [0.0, 0.5, 1.5, 0.0, 2.0, 0.0]
    M, (problem,) = problems(way(mass_matrix), q)
    assert not np.isfinite(M[[2, 4]]).any() and np.isfinite(M[[0, 1, 3, 5]]).all()
    assert problem.quantity == "mass_matrix" and problem.state.startswith("q = [1.5, ")
    assert problem.state in problem.text and " 1 more" in problem.text


def test_one_that_raises_later(rng):
    q = states(rng)[0]
    q[:, 0] = [0.0, 0.5, 1.5, 0.0, 2.0, 0.0]

    def mass_matrix(q):
        if q[0] > 1.0:
            raise ValueError("too\nfar")
        return tmt.mass_matrix(q)

    M, (problem,) = problems(mass_matrix, q)
    assert np.isnan(M[[2, 4]]).all() and np.isfinite(M[[0, 1, 3, 5]]).all()
    assert "ValueError: too far (test_own_problems.py, line " in problem.text and "\n" not in problem.text
    assert " 1 more" in problem.text


@pytest.mark.parametrize("way", [single, lambda f: f])
def test_one_that_changes_its_argument_is_handed_copies(way, rng):
    q = states(rng)[0]
    before = q.copy()

    def bias(q, v):
        h = tmt.bias(q, v)
        v *= 2.0
        return h

    own = OwnEquations({"bias": way(bias)}, COORDINATES, required=())
    assert np.array_equal(own.bias(q, q), tmt.bias(before, before)) and np.array_equal(q, before)
    assert [problem.quantity for problem in own.problems] == ["bias"] and "argument qd" in own.problems[0].text
    assert own.problems[0].state.startswith("q = [") and ", qd = [" in own.problems[0].state


@pytest.mark.parametrize("skew, found", [(0.9e-9, 0), (1.1e-9, 1)])
def test_a_mass_matrix_that_is_not_symmetric(skew, found, rng):
    def mass_matrix(q):
        M = tmt.mass_matrix(q)
        M[..., 0, 1] += skew * np.abs(M).max(axis=(-1, -2))
        return M

    said = problems(mass_matrix, states(rng)[0])[1]
    assert len(said) == found
    assert all("symmetric" in problem.text and " 5 more" in problem.text for problem in said)


def test_a_singular_mass_matrix_has_no_acceleration(rng):
    q, v, tau = states(rng)
    own = OwnEquations({"mass_matrix": lambda q: np.zeros((3, 3)), "bias": tmt.bias}, COORDINATES)
    assert np.isnan(own.acceleration(q, v, tau)).all()
    assert "singular" in own.problems[0].text
