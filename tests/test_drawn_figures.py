"""Every figure of a small run as it lies on the paper: nothing cut, nothing over anything; and what sees that."""

import pytest
from drawn_flaws import flaws
from matplotlib.figure import Figure
from small_runs import flaws_of_arm

from compare.report import style


@pytest.mark.slow
def test_no_figure_of_a_run_is_cut_or_covered(shared):
    found = shared(flaws_of_arm)
    assert len(found) > 30 and {name: of for name, of in found.items() if of} == {}


def panel(**more):
    fig = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
    ax = fig.subplots(**more)
    return fig, ax


def cut():
    fig, ax = panel()
    ax.set_title("so long a title that it does not stand above the panel " * 3)
    return fig


def over_text():
    fig, ax = panel()
    ax.text(0.5, 0.5, "one name"), ax.text(0.5, 0.5, "another name")
    return fig


def over_its_panel():
    fig, axes = panel(ncols=3)
    axes[1].set_title("a title that is wider than its panel, but meets none")
    return fig


def legend_on_data():
    fig, ax = panel()
    ax.plot([0, 1], [0, 1], "o", label="a line")
    ax.legend(loc="upper right")
    return fig


def factor():
    fig, ax = panel()
    ax.plot([0, 1], [0, 1e-9])
    return fig


def heap():
    fig, ax = panel()
    for mark in "osv^D":
        ax.plot([1.0], [2.0], mark)
    return fig


def tiny():
    fig, ax = panel()
    ax.set_title("small print", fontsize=6.5)
    return fig


def whole():
    fig, ax = panel()
    for mark in "osv^":
        ax.plot([0, 1], [0, 1], mark, label=mark)
    ax.set(title="a title", xlabel="time, s")
    fig.legend(loc="outside upper center", ncols=4)
    return fig


@pytest.mark.parametrize(
    "drawn, said",
    [(cut, "cut: "), (over_text, "on each other: "), (over_its_panel, "wider than its panel: "),
     (legend_on_data, "a legend on data: "), (factor, "a factor at the end of an axis: "), (heap, "5 marks on a point"),
     (tiny, "too small: "), (whole, "")],
)  # fmt: skip
def test_what_is_wrong_with_a_figure_is_seen(drawn, said):
    found = flaws(drawn())
    assert all(flaw.startswith(said) for flaw in found) and bool(found) is bool(said)
