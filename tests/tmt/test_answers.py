"""The public functions: NumPy answers few states and machine code all others, with what the literal form returns and raises."""

import dataclasses
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from inspect import signature

import numpy as np
import pytest
from helpers.many_digits import FIELDS, distance, exact
from helpers.trees import one_body, random_states, small_tree, wrist

import tmt
from tmt import answers, literal
from tmt.compiled import cores, evaluator
from tmt.derivation.quantities import PLAIN, QUANTITIES

EPS = np.finfo(float).eps
SMALL = small_tree()


def in_parts(result):
    return result if isinstance(result, tuple) else (result,)


def compiled(tree, *quantities):
    """A Tree, prepared."""
    tmt.prepare(tree, *quantities or ("acceleration",))
    return tree


@pytest.mark.parametrize("quantity", PLAIN)
def test_machine_code_answers_what_the_literal_form_returns(quantity, rng):
    """Of any batch, as 50 digits have it; and a state has the same bits alone and among others."""
    function, takes = getattr(tmt, quantity), QUANTITIES[quantity].takes
    assert (*signature(function).parameters,) == ("model", *takes)
    tree, states = compiled(SMALL, quantity), random_states(rng, SMALL, 21)
    given = states[: len(takes)]
    expected, every = (in_parts(call(tree, *given)) for call in (literal.literal(quantity), function))
    M = literal.mass_matrix(tree, states[0])
    condition = np.linalg.cond(M).max() if QUANTITIES[quantity].solves else 1.0
    truth = exact(SMALL, *(rows[0] for rows in states), **{"qdd": states[2][0]} if "qdd" in takes else {})
    for field, values, bits in zip(FIELDS[quantity], expected, every, strict=True):
        allowed = 64 * EPS * condition * max(1.0, np.abs(values).max())
        assert np.abs(bits - values).max() <= allowed >= distance(bits[0], getattr(truth, field)).max()
    assert quantity == "spring_torque" or not all(map(np.array_equal, every, expected))  # it was machine code
    for batch in ((), (21,), (3, 7), (2, 0)):
        size = int(np.prod(batch))
        some = [rows[:size].reshape(*batch, rows.shape[1]) for rows in given]
        for result, bits in zip(in_parts(function(tree, *some)), every, strict=True):
            assert type(result) is np.ndarray and result.dtype == float
            assert result.flags.c_contiguous and result.flags.writeable
            assert np.array_equal(result, bits[:size].reshape(batch + bits.shape[1:]))


def test_a_call_gives_the_same_bits_whatever_was_asked_before(rng):
    """Up to 500 states have the literal form's, more of them, and of a prepared model all, those of machine code."""
    tree, states = dataclasses.replace(tmt.ARM, mass=(1.75, 1.5)), rng.uniform(-2, 2, (3, 501, 3))
    parts = 0, slice(1), slice(90), slice(500), slice(501)

    def bits(function, *of_parts):
        return [function(tree, *states[:, part]).tobytes() for part in of_parts]

    first = bits(tmt.acceleration, *parts)
    assert bits(tmt.acceleration, *parts[::-1])[::-1] == bits(tmt.acceleration, *parts) == first
    of_numpy = bits(literal.acceleration, *parts)
    assert [x == y for x, y in zip(first, of_numpy)] == [True, True, True, True, False]
    tmt.prepare(tree, "acceleration")
    prepared = bits(tmt.acceleration, *parts)
    assert all(x != y for x, y in zip(prepared, of_numpy)) and prepared[-1] == first[-1]
    for mass in range(1, answers.MOST + 2):  # of other models the last ones are held
        tmt.mass_matrix(dataclasses.replace(tmt.ARM, mass=(mass, 1.5)), np.zeros(3))
    assert bits(tmt.acceleration, *parts) == prepared
    assert answers.evaluator_of.cache_info().currsize <= answers.MOST


def test_threads_change_no_bit(monkeypatch, rng):
    """Neither those of the states of one question, nor several questions at once; nor if none can be started any more."""
    tree, states = compiled(SMALL), random_states(rng, SMALL, 200)
    alone, used = tmt.acceleration(tree, *states), []

    def refuse(*_):
        raise RuntimeError("cannot schedule new futures")

    monkeypatch.setattr(evaluator, "cores", lambda: 3)
    monkeypatch.setattr(cores, "ThreadPoolExecutor", lambda n: used.append(n) or ThreadPoolExecutor(n))
    monkeypatch.setattr(evaluator, "SHARED", 1)
    assert np.array_equal(tmt.acceleration(tree, *states), alone) and used == [3]
    monkeypatch.setattr(ThreadPoolExecutor, "submit", refuse)
    assert np.array_equal(tmt.acceleration(tree, *states), alone) and used == [3, 3]
    monkeypatch.undo()

    def ask(k):
        state = [x[k] for x in states]
        return all(np.array_equal(tmt.acceleration(tree, *state), alone[k]) for _ in range(100))

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(ask, range(8)))


BALL, Z = one_body(np.eye(3), ["ball"], com=(0, 0, 0.1)), np.zeros(3)
WRIST = dataclasses.replace(wrist(), inertia=[np.eye(3)])
TURNS = np.array([[1.0, 0.0, 0.0, 0.0]] * 10)
WRONG = [
    (tmt.ARM, (Z, np.full(3, 1e200), Z), "beyond the largest double"),
    (BALL, (TURNS - np.eye(10)[:, :4] * [1.01e-6, 0, 0, 0], Z, Z), "quaternion"),  # one of many is short
    (WRIST, (np.array([0.3, np.pi, 0.7]), Z, Z), "'a', 'c'"),  # singular except for rounding
    (WRIST, (np.eye(3)[[1, 1, 1, 2, 1]], Z, Z), "'a', 'c'"),  # one of many
]


@pytest.mark.parametrize("model, given, says", WRONG)
def test_machine_code_refuses_what_the_literal_form_refuses(model, given, says):
    compiled(model, "acceleration", "mass_matrix")
    for acceleration in (literal.acceleration, tmt.acceleration):
        with pytest.raises(ValueError, match=says):
            acceleration(model, *given)


@pytest.mark.filterwarnings("error")
def test_numbers_beyond_the_largest_double():
    compiled(tmt.ARM, "mass_matrix", "energy")
    slide = one_body([(0, 0, 1)], ["slide"], com=(0, 0, 0.1))
    compiled(slide, "potential_energy")
    for q in (np.array([1.7e308]), np.full((2, 1), 1.7e308)):  # its energy is infinite, and nothing is NaN
        with pytest.raises(ValueError, match="largest double"):
            tmt.potential_energy(slide, q)
    for qd in (np.full(3, 1e200), np.full((2, 3), 1e200)):
        assert (
            np.array_equal(tmt.energy(tmt.ARM, Z, qd), literal.energy(tmt.ARM, Z, qd))
            and np.isinf(tmt.energy(tmt.ARM, Z, qd)).all()
        )


def test_a_short_question_never_waits_for_a_compiler():
    program = "import sys, tmt; tmt.acceleration(tmt.ARM, *[[0.1] * 3] * 3); print('llvmlite' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "False\n"
