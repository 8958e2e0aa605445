"""Whatever a user can get wrong gets a ValueError that says what was given and what is accepted."""

import dataclasses
import re
import warnings
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import tmt
from tmt.compiled import evaluator, runner
from tmt.methods import METHODS

REST = np.zeros(3)
CALLS = {
    "com_positions": lambda q: tmt.com_positions(q),
    "angular_velocities": lambda q: tmt.angular_velocities(REST, q),
    "jacobians": lambda q: tmt.jacobians(q),
    "convective_terms": lambda q: tmt.convective_terms(REST, q),
    "mass_matrix": lambda q: tmt.mass_matrix(q),
    "bias": lambda q: tmt.bias(REST, q),
    "gravity_balance": lambda q: tmt.gravity_balance(q),
    "acceleration": lambda q: tmt.acceleration(REST, REST, q),
    "potential_energy": lambda q: tmt.potential_energy(q),
    "energy": lambda q: tmt.energy(REST, q),
    "simulate": lambda q: tmt.simulate(q, REST, REST, 0.1, 1),
}


SAID = [  # calls that are refused, and a word of what is said
    *((lambda call=call: call(np.zeros((2, 4))), r"\(2, 4\).*alpha, beta, gamma") for call in CALLS.values()),
    *((lambda call=call: call([0.0, np.inf, 0.0]), "not finite") for call in CALLS.values()),
    *((lambda call=call: call([True, False, True]), "real numbers") for call in CALLS.values()),
    (lambda: tmt.bias(np.zeros((2, 3)), np.zeros((4, 3))), r"q \(2, 3\), qd \(4, 3\)"),
    *((lambda dt=dt: tmt.simulate(REST, REST, REST, dt, 1), "dt|step") for dt in (0.0, -1.0, np.nan, np.inf, "0.1", True)),
    *((lambda n=n: tmt.simulate(REST, REST, REST, 0.1, n), "steps") for n in (0, -1, 1.5, np.nan, "1", None, True)),
    *((lambda n=n: tmt.simulate([1.0] * 3, REST, REST, 1e-30, n, every=n), "steps|every") for n in (2**63, 10**400)),
    (lambda: tmt.simulate(REST, REST, REST, 1e308, 100), "largest double"),
    (lambda: tmt.simulate(REST, REST, REST, 0.1, 1, "rk5"), "'rk5'.*rk4, rk4_mean_speed, dopri8"),
    (lambda: tmt.simulate(REST, REST, REST, 0.1, 1, ["rk4"]), "method"),
    (lambda: tmt.simulate(REST, REST, REST, 0.1, 1, tolerance=1e-6), "tolerance"),
    *((lambda x=x: tmt.simulate(REST, REST, REST, 0.1, 1, "dopri8_adaptive", tolerance=x), "tolerance")
      for x in (0.0, -1.0, np.nan, np.inf, "1e-6", True)),
    *((lambda every=every: tmt.simulate(REST, REST, REST, 0.1, 10, every=every), "^every")
      for every in (3, 20, 0, -1, 2.5, True, None, "2")),
    (lambda: tmt.mass_matrix(REST, model="arm"), "tmt.Tree"),
    (lambda: tmt.mass_matrix(np.full((3, 1000), 1j)), "real numbers"),
]  # fmt: skip


@pytest.mark.parametrize("call, word", SAID)
def test_what_is_wrong_is_said(call, word):
    assert re.search(word, refused(call))


def test_an_empty_batch_is_a_batch():
    assert tmt.mass_matrix(np.zeros((0, 3))).shape == (0, 3, 3)


class NoArray:
    """Neither an array nor a text can be made of it."""

    def __array__(self, *arguments, **named):
        raise RuntimeError("no array")

    def __repr__(self):
        raise RuntimeError("no\ntext")


ITSELF = []
ITSELF.append(ITSELF)
MASKED = np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False])
READ_ONLY = np.zeros((40, 3))
READ_ONLY.flags.writeable = False
# for no argument any of these will do
NONSENSE = [
    b"x", 1j, [1j, 0, 0], {"q": 1}, {1, 2}, object(), NoArray(), [NoArray()] * 3, ITSELF, [1, 2, "x"], [[1, 2, 3], [1, 2]],
    [True, False, True], np.array([True] * 3), np.array([1j, 0, 0]), np.array([None] * 3), 10**400, -(10**5000),
    [10**400, 0, 0], [10**5000] * 3, np.nan, [np.nan, 0, 0], [np.inf, 0, 0], MASKED, [MASKED], [np.ma.masked, 1, 2],
    np.zeros(0), np.zeros((3, 2)), np.datetime64("2020"), np.array(["2020"] * 3, "M8[D]"), [Decimal(1)] * 3, ..., slice(3),
    np.zeros(3, [("a", float)]), np.full(3, np.longdouble("1e4000")), "no such name", "two\nlines",
]  # fmt: skip
# these by compiled code only
NO_ARRAYS = [*NONSENSE, None, REST.tolist(), np.zeros((40, 3), np.float32), np.zeros((40, 3), ">f8"), READ_ONLY,
             np.zeros((3, 40)).T, np.zeros((80, 3))[::2], np.ma.zeros((40, 3)), np.zeros((1, 40, 3))]  # fmt: skip


def with_field(name):
    return lambda value: dataclasses.replace(tmt.ARM, **{name: value})


def with_part(method, name):
    return lambda value: dataclasses.replace(METHODS[method], **{name: value})


PLACES = {
    **CALLS,
    "acceleration, q": lambda q: tmt.acceleration(q, REST, REST),
    "acceleration, qd": lambda qd: tmt.acceleration(REST, qd, REST),
    "simulate, qd": lambda qd: tmt.simulate(REST, qd, REST, 0.1, 1),
    "simulate, tau": lambda tau: tmt.simulate(REST, REST, tau, 0.1, 1),
    "dt": lambda dt: tmt.simulate(REST, REST, REST, dt, 1),
    "steps": lambda steps: tmt.simulate(REST, REST, REST, 0.1, steps),
    "method": lambda method: tmt.simulate(REST, REST, REST, 0.1, 1, method),
    "model": lambda model: tmt.mass_matrix(REST, model=model),
    "model of simulate": lambda model: tmt.simulate(REST, REST, REST, 0.1, 1, model=model),
    "tolerance": lambda value: tmt.simulate(REST, REST, REST, 0.1, 1, "dopri8_adaptive", tolerance=value),
    "lock": tmt.ARM.lock,
    "angle": lambda angle: tmt.ARM.lock({"beta": angle}),
    **{f"Tree.{field.name}": with_field(field.name) for field in dataclasses.fields(tmt.Tree)},
    **{f"{name}.{part}": with_part(name, part)
       for name in ("rk4", "implicit_midpoint", "dopri8_adaptive") for part in ("order", "A", "b", "c")},
    "errors of an adaptive method": with_part("dopri8_adaptive", "errors"),
    "tree of an evaluator": lambda tree: evaluator(tree, "acceleration"),
    "quantity": lambda quantity: evaluator(tmt.ARM, quantity),
    "terms": lambda terms: evaluator(tmt.ARM, "acceleration", terms),
    "tree of a runner": lambda tree: runner(tree, "rk4"),
    "method of a runner": lambda name: runner(tmt.ARM, name),
    "model of prepare": tmt.prepare,
}  # fmt: skip


def refused(call, *arguments) -> str:
    """The message, of one line, of the ValueError that the call raises, without a warning before it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError) as error:
            call(*arguments)
    message = str(error.value)
    assert message and "\n" not in message and len(message) < 400
    return message


@pytest.mark.parametrize("call", PLACES.values(), ids=PLACES)
def test_nonsense_is_refused_in_one_line(call):
    for value in NONSENSE:
        refused(call, value)


def compiled_calls() -> dict:
    """{what: (call, its arrays)} of compiled code."""
    compiled = evaluator(tmt.ARM, "acceleration")
    runs = [np.zeros((32, 3, 3)), np.zeros((32, 3, 3)), np.zeros((32, 3))]
    ended = [*runs, np.zeros((32, 2), int)]
    return {
        "each": (compiled.each, [np.zeros((40, 3)) for _ in range(4)]),
        "lanes": (compiled.lanes, [np.zeros((3, 40)) for _ in range(4)]),
        "chain": (lambda *arrays: compiled.chain(*arrays, 2), [np.zeros(3) for _ in range(3)]),
        "run": (lambda q, qd, tau, ended: runner(tmt.ARM, "rk4")(q, qd, tau, 0.1, ended), ended),
        "adaptive run": (lambda *arrays: runner(tmt.ARM, "dopri8_adaptive")(*arrays, 0.1, 1e-6), runs),
    }


@pytest.mark.parametrize("what", ["each", "lanes", "chain", "run", "adaptive run"])
def test_compiled_code_takes_its_own_arrays_only(what):
    call, arrays = compiled_calls()[what]
    call(*arrays)
    for place in range(len(arrays)):
        for value in NO_ARRAYS:
            if not (value is None and place == 3 and what == "run"):
                refused(call, *arrays[:place], value, *arrays[place + 1 :])


def test_compiled_code_takes_numbers_only():
    path, tau = np.zeros((1, 3, 3)), np.zeros((1, 3))
    fixed, adaptive = (runner(tmt.ARM, name) for name in ("rk4", "dopri8_adaptive"))
    for value in [*NONSENSE, None, True, Fraction(1, 2)]:
        if not isinstance(value, float):  # a NaN is a number: the run is NaN, and says so
            refused(fixed, path, path.copy(), tau, value)
            refused(adaptive, path, path.copy(), tau, 0.1, value)
        if value is not True:
            refused(evaluator(tmt.ARM, "acceleration").chain, REST, REST, REST, value)
        if type(value) is not int:  # see SAID
            refused(lambda value=value: fixed(path, path.copy(), tau, 0.1, every=value))


def test_results_are_not_written_over_arguments():
    both = np.zeros((41, 3))
    call = evaluator(tmt.ARM, "acceleration").each
    call(both[:20], REST[None].repeat(20, 0), REST[None].repeat(20, 0), both[20:40])
    assert "shares memory" in refused(call, both[:40], both[:40].copy(), both[:40].copy(), both[1:])


def test_paths_that_share_memory_are_refused():
    path = np.zeros((1, 3, 3))
    refused(runner(tmt.ARM, "rk4"), path, path, np.zeros((1, 3)), 0.1)


def test_wrong_terms_are_refused():
    returned = (None, 3, ([[1.0]], [1.0]), (["abc"] * 3, [0.0] * 3))
    for terms in (lambda: None, type, *(lambda tree, q, qd, found=found: found for found in returned)):
        refused(lambda terms=terms: evaluator(tmt.ARM, "acceleration", terms).alone)


def test_paths_that_do_not_fit_into_memory():
    for exponent, size in ((12, "4.8e+04 GB"), (15, "GB"), (18, "GB")):
        assert size in refused(tmt.simulate, REST, REST, REST, 1e-3, 10**exponent)
    assert tmt.simulate(np.zeros((3, 3)), REST, REST, 1e-3, 10**5, every=10**5).q.shape == (3, 2, 3)
    wide = np.zeros((10**5, 1, 1, 3)), np.zeros((10**5, 1, 3)), np.zeros((10**5, 3))  # 8 PB: beyond any address
    assert "memory" in refused(tmt.acceleration, *wide)


@given(arrays(float, (3, 3), elements=st.floats(allow_nan=False, allow_infinity=False)))
def test_finite_numbers_give_finite_results_or_a_reason(state):
    q, qd, tau = state
    for call, arguments in (
        (tmt.bias, (q, qd)), (tmt.convective_terms, (q, qd)), (tmt.angular_velocities, (q, qd)), (tmt.acceleration, state),
        (tmt.mass_matrix, (q,)), (tmt.gravity_balance, (q,)), (tmt.potential_energy, (q,)),
    ):  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                assert np.isfinite(call(*arguments)).all()
            except ValueError as error:
                assert "beyond the largest double" in str(error) and np.abs(state).max() > 1e100
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not np.isnan(tmt.energy(q, qd))
        motion = tmt.simulate(q, qd, tau, 0.01, 3)
    assert (motion.ended is None) == bool(np.isfinite(motion.q).all() and np.isfinite(motion.qd).all())


@given(st.sampled_from([int, np.int32, np.int64]), st.sampled_from([float, np.float64, np.float32, Fraction]))
def test_any_kind_of_number_will_do(whole, real):
    t, q, _ = tmt.simulate([0, 0, 1], REST, REST, real(0.5), whole(2))
    assert t.dtype == q.dtype == float and t[-1] == 1.0
