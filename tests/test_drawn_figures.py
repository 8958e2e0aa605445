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


def panels(count=1):
    fig = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
    return fig, fig.subplots(ncols=count, squeeze=False)[0]


def test_what_is_wrong_with_a_figure_is_seen():
    fig, (first, second) = panels(2)
    first.set_title("so long a title that it does not stand above the panel " * 3)
    second.set_title("small print", fontsize=6.5)
    second.text(0.1, 0.5, "one name")
    second.text(0.1, 0.5, "another name")
    second.plot([0, 1], [0, 1e-9], "o", label="a line")
    second.legend(loc="upper right")
    for mark in "osv^D":
        first.plot([1.0], [2.0], mark)
    found = {flaw.partition(":")[0].partition(" of ")[0] for flaw in flaws(fig)}
    assert found == {"cut", "too small", "on each other", "wider than its panel", "a legend on data",
                     "a factor at the end", "5 marks on a point"}  # fmt: skip


def test_a_figure_with_which_nothing_is_wrong():
    fig, (ax,) = panels()
    for mark in "osv^":
        ax.plot([0, 1], [0, 1], mark, label=mark)
    ax.set(title="a title", xlabel="time, s")
    fig.legend(loc="outside upper center", ncols=4)
    assert flaws(fig) == []
