"""The edits that test the judge apply to the sources as they are."""

from ast import dump

from architecture import ROOT
from mutations.edit import DoesNotApply, applied
from mutations.edits import EDITS


def test_every_edit_applies_and_says_what_it_breaks():
    lost = []
    for edit in EDITS:
        try:
            place = applied(ROOT, edit)
            assert dump(place.old) != dump(place.new)
        except DoesNotApply as error:
            lost.append(str(error))
    assert lost == [] and all(edit.breaks for edit in EDITS)
    assert len({edit.name for edit in EDITS}) == len(EDITS)
