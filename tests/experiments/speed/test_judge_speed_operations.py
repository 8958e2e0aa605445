"""Operations are counted by running the source itself; the peak is that of the processor's widest registers."""

import math

import numpy as np
import pytest
from models import chain
from numba import njit

import tmt
from compare.engines.mujoco import read
from compare.experiments.speed import operations, processor
from compare.experiments.speed.operations import Counted
from compare.experiments.speed.ways import FORWARD, IN_LANES, LOOP
from compare.judge.timing import vectors


def counted(text, *values, **more):
    """How many operations an expression of x and y has, and its value."""
    counts = {"operations": 0} | more
    x, y = (Counted(value, counts) for value in values)
    return eval(text, {"x": x, "y": y, "fma": operations.fma, "sqrt": operations.sqrt}), counts["operations"]


@pytest.mark.parametrize("text, value, count", [
    ("x + y", 5.0, 1), ("2.0 * x - y / x", 2.5, 3), ("-x", -2.0, 0), ("1.0 / -x", -0.5, 1), ("1.0 - x", -1.0, 1),
    ("fma(x, y, 1.0)", 7.0, 2), ("fma(-x, y, 1.0) * (x > y)", -0.0, 3), ("sqrt(x + x)", 2.0, 2), ("x * 1.0 + 0.0", 2.0, 2),
])  # fmt: skip
def test_each_operation_counts(text, value, count):
    assert counted(text, 2.0, 3.0) == (value, count)


@pytest.mark.parametrize(
    "text, count", [("x * 1.0 + 0.0", 0), ("x * -1.0 - 0.0", 0), ("0.0 + x", 1), ("1.0 / x", 1), ("x * 2.0", 1)]
)
def test_what_a_compiled_loop_leaves_out_does_not_count_there(text, count):
    assert counted(text, 2.0, 3.0, left_out=True)[1] == count


def test_a_sine_with_its_cosine_has_the_operations_of_its_source():
    for x in (0.3, -2.0, 40.0):
        number = Counted(x, {"operations": 0})
        found = [float(value) for value in operations.sincos(number)]
        assert found == pytest.approx((math.sin(x), math.cos(x)), abs=1e-14)
        # 16 fused ones, four products, a difference
        assert number.counts["operations"] == operations.OF_SINE == 37


def test_straight_lines_are_counted_as_they_are_run():
    text = "def f(x, y):\n    t0_0, t0_1 = sincos(x)\n    t1 = fma(t0_0, y, t0_1)\n    return t1, -y / t1,\n"
    count, (one, two) = operations.of_source(text, "f", [0.5, 2.0])
    assert count == 37 + 2 + 1 and one == pytest.approx(2.0 * math.sin(0.5) + math.cos(0.5)) and two == -2.0 / one


def test_the_loop_is_counted_as_it_is_run(rng):
    counts = []
    for n in (6, 5, 4):
        tree = read(chain(n)).tree
        q, v, tau = rng.uniform(-1.0, 1.0, (3, n))
        count, found = operations.of_loop(tree, q, v, tau)
        assert np.allclose(found, tmt.acceleration(q, v, tau, tree), rtol=1e-9)
        counts.append(count)
    assert counts[0] - counts[1] == counts[1] - counts[2] > 500  # each joint the same
    known = operations.operations_of(tree)
    assert known["loop"] == counts[-1] and known["straight_line"] > 1000
    assert set(operations.operations_of(read(chain(30)).tree)) == {"loop"}


PEAK, chains_in_words = processor.PEAK, processor.chains_in_words
NS = {
    (PEAK, chains_in_words(5, 1), 5, 1): 0.4, (PEAK, chains_in_words(12, 1), 12, 1): 0.2,
    (PEAK, chains_in_words(5, 8), 40, 1): 0.02, (PEAK, chains_in_words(12, 8), 96, 1): 0.04,
    (FORWARD, IN_LANES, 1000, 1): 4.0, (FORWARD, IN_LANES, 10, 1): 9.0, (FORWARD, IN_LANES, 1000, 2): 1.0,
}  # fmt: skip


def test_the_peak_is_the_best_of_its_loops():
    assert processor.rates(NS) == {1: 10.0, 8: 100.0} and processor.rates({}) == {}


def test_how_near_in_words():
    (text,) = processor.near_in_words(
        NS | {(FORWARD, LOOP, 1, 1): 400.0}, {(FORWARD, IN_LANES): 200, (FORWARD, LOOP): 2000}, 37
    )
    assert "is 100 floating-point operations a ns, 10.0 one by one" in text and "a sine with its cosine 37" in text
    assert "of 200 operations a state: lanes 50.0 (50 % of the peak)" in text
    assert "of 2,000 operations a state: generic compiled loop 5.0 (5 % of the peak; 50 % of one by one)" in text
    assert processor.near_in_words({(FORWARD, IN_LANES, 1000, 1): 4.0}, {(FORWARD, IN_LANES): 200}, 37) == []


@pytest.mark.parametrize("chains", [processor.few_chains, processor.many_chains])
def test_multiply_adds_are_done_as_often_as_told_and_in_the_widest_registers(chains):
    x, y = 0.5, 3.0
    for shape in ((processor.MANY_CHAINS + 2,), (processor.MANY_CHAINS + 2, 8)):
        w = np.ones(shape)
        w[-2], w[-1] = x, y
        chains(w, 2)
        done = w[:-2] != 1.0
        assert np.array_equal(w[:-2][done], np.full(done.sum(), (x + y) * x + y))
        per_row = done.reshape(processor.MANY_CHAINS, -1)
        assert per_row.all(axis=1).sum() == {processor.few_chains: processor.FEW_CHAINS}.get(
            chains, processor.MANY_CHAINS
        )
        assert not (per_row.any(axis=1) ^ per_row.all(axis=1)).any()
    register = {"AVX-512": "zmm", "AVX2": "ymm"}.get(vectors().rpartition(" ")[2])
    if register:
        again = njit(error_model="numpy")(chains.py_func)  # numba keeps no text of what it reads from a cache
        again(w, 1)
        (code,) = again.inspect_asm().values()
        fused = [line for line in code.splitlines() if line.strip().startswith("vfmadd")]
        assert len(fused) >= 5 and all(register in line and "pd" in line for line in fused)


def test_the_loops_of_the_peak_have_names_and_numbers():
    found = {name: count for name, count, loop in processor.peaks() if loop(1) is None}
    assert found == {
        "5 chains, one double each": 5, "5 chains, 8 doubles side by side each": 40,
        "12 chains, one double each": 12, "12 chains, 8 doubles side by side each": 96,
    }  # fmt: skip
