"""The edits that test the judge apply to the sources as they are."""

from ast import dump

from helpers.runs import ROOT
from mutations.edit import applied
from mutations.edits import EDITS


def test_every_edit_applies_and_says_what_it_breaks():
    for edit in EDITS:
        place = applied(ROOT, edit)
        assert edit.breaks and dump(place.old) != dump(place.new)
    assert len({edit.name for edit in EDITS}) == len(EDITS)
