"""Docstrings of the public functions and classes: their examples are right, and they describe every argument."""

import dataclasses
import doctest
import inspect
import re

import numpy as np
import pytest

import compare
import tmt
from compare.agreement import Difference

SECTION = re.compile(r"(?ms)^ *(?:Parameters|Attributes)\n +-+\n(.*?)(?=\n *\n +\w+\n +-+\n|\Z)")
FUNCTIONS = [getattr(tmt, name) for name in tmt.__all__ if inspect.isroutine(getattr(tmt, name))]
OTHERS = [tmt.Tree, tmt.Tree.lock, tmt.Motion, Difference]
OTHERS += [getattr(compare, name) for name in compare.__all__]


@pytest.mark.parametrize("public", [*FUNCTIONS, *OTHERS], ids=lambda public: public.__qualname__)
def test_examples_are_right_and_every_argument_is_described(public):
    names = {"compare": compare, "tmt": tmt, "np": np, "dataclasses": dataclasses}
    (found,) = doctest.DocTestFinder(recurse=False).find(public, public.__qualname__, globs=names)
    assert doctest.DocTestRunner().run(found).failed == 0 and (found.examples or public is Difference)
    arguments = {*inspect.signature(public).parameters} - {"self"}
    if section := SECTION.search(public.__doc__):
        lines = inspect.cleandoc("\n" + section[1]).splitlines()
        described = [line.split(" : ")[0] for line in lines if not line.startswith(" ")]
        assert {name.strip("* ") for names in described for name in names.split(",")} == arguments
    else:  # of a state: shapes and units in a line; the help of tmt says what a model is
        described = re.findall(r"(\w+)(?: \(\.\.\.|: )", public.__doc__)
        assert arguments - {"model"} <= {*described} and "rad" in public.__doc__ and "`model`" in tmt.__doc__
