"""The examples in the docstrings of tmt's public functions: each has one, and it is right."""

import dataclasses
import doctest
from inspect import isfunction

import numpy as np
import pytest

import tmt


@pytest.mark.parametrize("name", [name for name in tmt.__all__ if isfunction(getattr(tmt, name))])
def test_the_example_of_a_public_function_is_right(name):
    names = {"tmt": tmt, "np": np, "dataclasses": dataclasses}
    (found,) = doctest.DocTestFinder(recurse=False).find(getattr(tmt, name), name, globs=names)
    assert found.examples and doctest.DocTestRunner().run(found).failed == 0
