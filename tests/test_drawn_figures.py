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


def test_what_is_wrong_with_a_figure_is_seen():
    figure = Figure(figsize=(style.WIDTH, 3.0), layout="constrained")
    ax = figure.subplots()
    for mark in "osv^":
        ax.plot([0, 1], [0, 1], mark, label=mark)
    ax.set(title="a title", xlabel="time, s")
    figure.legend(loc="outside upper center", ncols=4)
    assert flaws(figure) == []
    ax.set_title("so long a title in small print that it does not stand above the panel " * 3, fontsize=6.5)
    ax.set_ylim(-1e-9, 1e-9)
    ax.text(0.5, 0.0, "one name")
    ax.text(0.5, 0.0, "another name")
    ax.legend(loc="center left")
    found = {flaw.partition(":")[0] for flaw in flaws(figure)}
    assert found == {"cut", "too small", "on each other", "a legend on data", "a factor at the end of an axis"}
