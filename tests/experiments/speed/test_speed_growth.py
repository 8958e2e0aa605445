"""What a chain costs as it grows: its rows and empty cells, exponents, sentences, the figure, and where it is asked for."""

import dataclasses
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from models import PATHS
from runs import ENVIRONMENT

from compare import experiment
from compare.engines.mujoco import load, read
from compare.experiments.speed import figures_growth, growth
from compare.experiments.speed.growth import Exponent, Extent, costs_of_growth, exponents, made_chains
from compare.experiments.speed.implementations import IMPLEMENTATIONS, Implementation, Made
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of

COLUMNS = ["n", "implementation", "ns_per_state", "compile_s", "operations"]


def nothing(*_):
    pass


def row(n, name, ns, compile_s=None, operations=None):
    return dict(zip(COLUMNS, (n, name, ns, compile_s, operations)))


def of_power(name, power, numbers, first=100.0):
    return [row(n, name, first * n**power) for n in numbers]


@pytest.fixture(scope="module")
def known():
    """The costs of chains of 1 and 2 joints, of which the code of the first alone is compiled, and reasons."""
    return costs_of_growth(made_chains(Extent((1, 2), 2, most=200), nothing), nothing)


def test_there_is_a_row_for_each_number_and_each_implementation(known):
    rows, _ = known
    names = [one.name for one in IMPLEMENTATIONS if not one.unavailable()]
    assert {*names} >= {"literal", "straight_line", "loop", "loop_lanes"}
    assert [(row["n"], row["implementation"]) for row in rows] == [(n, name) for n in (1, 2) for name in names]
    assert all(list(row) == COLUMNS for row in rows)
    timed = {(row["n"], row["implementation"]): row for row in rows if row["ns_per_state"]}
    assert {(n, name) for n in (1, 2) for name in names} - timed.keys() == {(2, "straight_line")}
    assert all(row["ns_per_state"] > 0.0 for row in timed.values())
    assert timed[1, "straight_line"]["compile_s"] is None  # it may come from the cache folder
    assert (
        timed[1, "straight_line"]["operations"] < timed[1, "literal"]["operations"] < timed[2, "literal"]["operations"]
    )


def test_what_has_no_time_has_an_empty_row_and_a_reason(known):
    rows, reasons = known
    assert dict.fromkeys(COLUMNS) | {"n": 2, "implementation": "straight_line"} in rows
    assert reasons["straight-line code is not timed with 2 joints"] == (
        "it has more than 200 operations; `speed --growth` compiles it, unless it is to be quick"
    )


def test_an_implementation_that_is_not_there_has_no_row_but_a_reason():
    calls = []
    here = Implementation("here", "here", nothing, lambda of: Made(calls.append, 4))
    elsewhere = Implementation("elsewhere", "the other", lambda: "it is not installed", None)
    picky = Implementation("picky", "the third", nothing, lambda of: "too long" if of.n > 1 else Made(calls.append))
    rows, reasons = costs_of_growth(made_chains(Extent((1, 2, 3), 1), nothing, (here, elsewhere, picky)), nothing)
    assert [(r["n"], r["implementation"], r["ns_per_state"] is None) for r in rows] == [
        (1, "here", False), (1, "picky", False), (2, "here", False), (2, "picky", True), (3, "here", False), (3, "picky", True)
    ]  # fmt: skip
    assert reasons == {
        "the other takes no part": "it is not installed",
        "the third is not timed with 2, 3 joints": "too long",
    }
    assert growth.chain_in_words([], {}, reasons) == [
        "Growth: the other takes no part: it is not installed.", "Growth: the third is not timed with 2, 3 joints: too long."
    ]  # fmt: skip


def test_a_time_is_that_of_one_state(monkeypatch):
    """The fastest call of all passes, over what it did and how many states that has."""
    monkeypatch.setattr(growth, "often_enough", lambda run: 50)
    passes = iter([2e-3, 1e-3, 3e-3])
    monkeypatch.setattr(growth.timing, "fastest", lambda calls, rounds: dict.fromkeys(calls, next(passes)))
    one = Implementation("a", "a", nothing, lambda of: Made(nothing, 4, 0.5, 7))
    (found,), _ = costs_of_growth(made_chains(Extent((1,), 3), nothing, [one]), nothing)
    assert found == row(1, "a", pytest.approx(1e9 * 1e-3 / (50 * 4)), 0.5, 7)


def test_in_each_pass_chains_are_timed_one_after_the_other_and_what_takes_long_in_the_first_alone(monkeypatch):
    asked = []

    def fastest(calls, rounds):
        asked.append([(n, one.name) for n, one in calls])
        return {(n, one): {"short": 1e-3, "long": growth.timing.ONCE}[one.name] for n, one in calls}

    monkeypatch.setattr(growth.timing, "fastest", fastest)
    ones = [Implementation(name, name, nothing, lambda of: Made(nothing)) for name in ("short", "long")]
    monkeypatch.setattr(growth, "often_enough", lambda run: 1)
    costs_of_growth(made_chains(Extent((1, 2), 3), nothing, ones), nothing)
    assert asked == [[(n, "short"), (n, "long")] for n in (1, 2)] + [[(n, "short")] for n in (1, 2, 1, 2)]


@pytest.mark.parametrize(
    "lasts, least, most", [(1e-6, 1000, 2500), (1e-4, 10, 25), (0.9e-3, 2, 2), (1.1e-3, 1, 1), (1.0, 1, 1)]
)
def test_a_timed_call_takes_a_millisecond_or_is_one_evaluation(lasts, least, most, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(growth.time, "perf_counter", lambda: now[0])

    def run(times):
        now[0] += lasts * times

    assert least <= growth.often_enough(run) <= most


def test_exponents_of_known_series():
    long = (1, 2, 4, 8, 16, 32, 64)
    rows = of_power("a", 1.25, long) + of_power("b", 2.0, (1, 2, 8, 12)) + of_power("c", 1.0, (4, 8))
    rows += [row(n, "d", 1000.0 if n < 8 else 100.0 * n) for n in long] + [row(2, "e", None)]
    found = exponents(rows)
    assert found == {
        "a": Exponent(pytest.approx(1.25), 8, 64), "b": Exponent(pytest.approx(2.0), 1, 12),
        "d": Exponent(pytest.approx(1.0), 8, 64),
    }  # fmt: skip


def test_exponents_in_words():
    said = growth.powers_in_words(
        {"loop": Exponent(1.04, 8, 64), "literal": Exponent(2.5, 8, 64), "straight_line": Exponent(1.5, 1, 8)}
    )
    assert said == [
        "Forward dynamics of a chain of n hinges, none of them along a coordinate axis, grow from 8 to 64 joints the loop as "
        "n^1.04, the literal form in Python as n^2.50; from 1 to 8 joints straight-line code as n^1.50."
    ]
    assert growth.powers_in_words({}) == []


def test_where_straight_line_code_wins_in_words():
    def said(**ratios):
        return growth.straight_in_words([
            row(int(n[1:]), name, value) for n, ratio in ratios.items()
            for name, value in (("loop", 100.0 * ratio), ("straight_line", 100.0))
        ])  # fmt: skip

    start = "One state at a time, straight-line code takes"
    assert said(n1=8.0, n2=2.5, n4=1.5) == [f"{start} 8 to 1.5 times less than the loop with 1, 2, 4 joints."]
    assert said(n1=8.0, n2=2.5, n4=0.9) == [
        f"{start} 8 to 2.5 times less than the loop with 1, 2 joints, and no less with 4 joints."
    ]
    assert said(n1=3.0, n2=1.0) == [f"{start} 3 times less than the loop with 1 joint, and no less with 2 joints."]
    assert said(n1=0.5, n2=1.0) == [f"{start} no less time than the loop with 1, 2 joints."]
    assert said() == [] and growth.straight_in_words([row(1, "straight_line", 3.0), row(2, "loop", 3.0)]) == []


def test_what_the_longest_chain_costs_in_words():
    rows = [
        row(1, "mujoco_equal_work", 1.0),
        row(8, "mujoco_equal_work", 2000.0),
        row(8, "loop", 500.0),
        row(8, "literal", 8000.0),
    ]
    assert growth.most_joints_in_words([*rows, row(8, "straight_line", None)]) == [
        "With 8 joints MuJoCo's equal work takes 2,000 ns a state, and the literal form in Python 4.0 times more, the loop 4.0 "
        "times less."
    ]
    assert growth.most_joints_in_words(rows[2:]) == growth.most_joints_in_words(rows[1:2]) == []
    assert growth.most_joints_in_words([]) == []


def test_what_compilation_takes_in_words():
    rows = [row(1, "straight_line", 10.0, 0.5, 80), row(1, "loop", 110.0, 3.0), row(1, "loop_lanes", 9.0, 4.0)]
    rows += [row(2, "straight_line", 50.0, 2.0, 500), row(2, "loop", 150.0, 3.0)]
    start, loops = (
        "To compile takes, of the processor's time: ",
        "the loop 3 s, once for all trees; the loop in lanes 4 s, after it.",
    )
    assert growth.compilation_in_words(rows) == [
        f"{start}straight-line code of 2 joints, 500 operations, 2 s (won back in 2.0e+07 states); {loops}"
    ]
    rows[-1]["ns_per_state"] = 50.0
    assert growth.compilation_in_words(rows) == [f"{start}straight-line code of 2 joints, 500 operations, 2 s; {loops}"]
    assert growth.compilation_in_words(rows[1:3]) == [f"{start}{loops}"]
    assert growth.compilation_in_words([row(1, "loop", 3.0)]) == []


def test_the_figure_draws_the_rows():
    result = Result("speed")
    result.tables["growth"] = of_power("loop", 1.0, (1, 2, 8, 16)) + of_power("literal", 2.0, (1, 2, 8), 1e5)
    result.tables["growth"] += [row(1, "straight_line", 20.0), *(row(n, "straight_line", None) for n in (2, 8, 16))]
    result.curves["exponents"] = exponents(result.tables["growth"])
    name, fig, caption = figures_growth.draw_chain(result)
    lines = {line.get_label(): line for ax in fig.axes for line in ax.get_lines()}
    assert name == "speed_growth" and list(lines["the loop ($n^{1.00}$)"].get_ydata()) == [100.0, 200.0, 800.0, 1600.0]
    assert list(lines["straight-line code"].get_xdata()) == [1]
    assert to_hex(lines["the literal form in Python ($n^{2.00}$)"].get_color()) == "#666666"
    assert caption == (
        "What a state takes, forward dynamics of a chain of 1 to 16 hinges, none of them along a coordinate axis; above the "
        "literal form in Python, below what is compiled, one state after the other but in lanes and in MuJoCo's batch. Powers "
        "of n are fitted by least squares to the logarithms, over 1 to 16 and 1 to 8 joints."
    )
    assert {one.name for one in IMPLEMENTATIONS} <= figures_growth.LOOKS.keys()
    assert len(set(figures_growth.LOOKS.values())) == len(figures_growth.LOOKS)


def test_the_chain_grows_where_it_is_asked_for_and_a_little_in_a_whole_run_of_the_arm():
    engines = experiment.engines(load(ARM.mjcf, ARM.tree))
    of_file = robot_of(read(PATHS["arm6"]), "arm6.xml")
    own = dataclasses.replace(ARM, own=("mass_matrix", "bias"))
    make, quick, small = experiment.Setup, experiment.Setup.quick, experiment.Setup.small
    extents = growth.EXTENTS
    assert growth.extent_of(make(ARM, engines)) is extents["short"]
    assert growth.extent_of(small(ARM, engines)) is extents["small"]
    for setup in (quick(ARM, engines), make(of_file, engines), make(own, engines), quick(of_file, engines)):
        assert growth.extent_of(setup) is None
    for robot in (ARM, of_file, own):
        assert growth.extent_of(make(robot, engines, growth=True)) is extents["whole"]
        assert growth.extent_of(quick(robot, engines, growth=True)) is extents["short"]
    assert extents["short"].numbers[-1] == 8 and extents["whole"].numbers[-1] == 64
    assert not extents["short"].cold and extents["whole"].cold and extents["whole"].most == np.inf


PROGRAM = """
import sys
from compare.__main__ import main
from compare.experiments.speed.growth import EXTENTS, Extent
EXTENTS["short"] = Extent((1, 2), 1, most=0.0)
sys.exit(main(["speed", "--quick", "--growth", "--out", sys.argv[1]]))
"""


def by_command(folder) -> tuple:
    """Of `speed --quick --growth` with short chains: the run, the table, the figure's bytes, report.md."""
    run = subprocess.run([sys.executable, "-c", PROGRAM, folder], env=ENVIRONMENT, capture_output=True, text=True)
    table, size = (
        pd.read_csv(folder / "tables" / "growth.csv"),
        (folder / "figures" / "speed_growth.png").stat().st_size,
    )
    return run, table, size, (folder / "report.md").read_text(encoding="utf-8")


def test_it_can_be_asked_for_on_the_command_line(beside):
    run, table, size, text = beside.result(by_command, beside.folder / "grown")
    assert run.returncode == 0, run
    assert list(table.columns) == COLUMNS and set(table["n"]) == {1, 2}
    assert table[table["implementation"] == "straight_line"]["ns_per_state"].isna().all()
    assert size > 5000 and "straight-line code is not timed with 1, 2 joints" in text


def test_nothing_is_added_where_nothing_is_asked():
    result = Result("speed")
    setup = experiment.Setup.quick(ARM, experiment.engines(load(ARM.mjcf, ARM.tree)))
    growth.add_growth(result, growth.chains_of(setup), nothing)
    assert not result.tables and not result.notes and not result.curves


def test_a_small_run_has_the_table_and_its_sentences(small):
    result = small("speed")
    assert [*dict.fromkeys(row["n"] for row in result.tables["growth"])] == [1, 2, 3]
    assert any(note.startswith("Forward dynamics of a chain of n hinges") for note in result.notes)
    assert result.curves["exponents"]["loop"].first == 1
