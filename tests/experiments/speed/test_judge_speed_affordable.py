"""Which code follows tmt's runs is said, as it is and not as it was."""

import pytest

from compare.experiments.speed.affordable import forms_in_words
from compare.robots.arm import ARM
from tmt import kernels

STRAIGHT = "straight-line code, traced and compiled for the model ("
LOOP = "the loop over any tree, compiled once for all models ("


def test_both_forms_are_named_with_their_methods(monkeypatch):
    cases = ARM.cases[:1]
    assert forms_in_words(cases, ["rk4", "implicit"]) == f"tmt's runs are followed by {STRAIGHT}implicit and rk4)."
    is_traced = kernels.is_traced
    monkeypatch.setattr(kernels, "is_traced", lambda tree, method: method.order == 4 and is_traced(tree, method))
    found = forms_in_words(cases, ["rk4", "implicit"])
    assert found == f"tmt's runs are followed by {STRAIGHT}rk4) and by {LOOP}implicit)."
    assert forms_in_words(cases, ["implicit"]) == f"tmt's runs are followed by {LOOP}implicit)."


@pytest.mark.parametrize("cases, methods", [([], ["rk4"]), (ARM.cases[:1], [])])
def test_nothing_is_said_of_nothing(cases, methods):
    assert forms_in_words(cases, methods) == ""
